"""A reference page: entries of paragraphs, tables and code, the same for Markdown and terminals."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class PageTable:
    """Rows below a head; the first column names what a row is about, in code letters."""

    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


@dataclass(frozen=True, slots=True)
class YamlCode:
    """Lines of YAML."""

    text: str


PageBlock = str | PageTable | YamlCode
"""A paragraph, in Markdown without headings; a table; or code."""


@dataclass(frozen=True, slots=True)
class PageEntry:
    """What is said of one thing, by its name; `is_own`: it is the project's."""

    name: str
    blocks: tuple[PageBlock, ...]
    is_own: bool = False

    @property
    def first_line(self) -> str:
        """The first line of its first paragraph, for tables of contents."""
        first = next((block for block in self.blocks if isinstance(block, str)), "")
        return first.partition("\n")[0]


@dataclass(frozen=True, slots=True)
class ManualPage:
    """A page: what holds for all its entries, and the entries."""

    name: str
    title: str
    about: tuple[PageBlock, ...]
    entries: tuple[PageEntry, ...]


def table_of(head: tuple[str, ...], rows: Sequence[Sequence[str]]) -> tuple[PageTable, ...]:
    """A table without the columns in which nothing is said; none if there are no rows."""
    kept = [n for n in range(len(head)) if any(row[n] for row in rows)]
    if not rows:
        return ()
    told = tuple(tuple(row[n] for n in kept) for row in rows)
    return (PageTable(tuple(head[n] for n in kept), told),)


def sentence(text: str) -> str:
    """A meaning as a sentence: with a capital letter and a full stop."""
    if not text:
        return ""
    ends = text.endswith(("…", "…."))
    return f"{text[0].upper()}{text[1:].removesuffix('.')}{'' if ends else '.'}"
