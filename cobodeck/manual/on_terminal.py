"""Entries of reference pages for a terminal, wrapped."""

from __future__ import annotations

import textwrap
from collections.abc import Iterator

from cobodeck.manual.page import PageBlock, PageEntry, PageTable, YamlCode
from cobodeck.manual.wording import REQUIRED

INDENT = "    "
NARROWEST = 40


def terminal_text(entry: PageEntry, width: int) -> str:
    """The name, then each block, wrapped to `width` columns."""
    width = max(width, NARROWEST)
    lines = [entry.name]
    for block in entry.blocks:
        lines += _lines(block, width)
        lines.append("")
    return "\n".join(lines).rstrip()


def _lines(block: PageBlock, width: int) -> Iterator[str]:
    if isinstance(block, YamlCode):
        yield from (INDENT + line for line in block.text.rstrip().splitlines())
    elif isinstance(block, PageTable):
        yield from _table(block, width)
    else:
        yield from _wrapped(" ".join(block.split()), INDENT, width)


def _table(table: PageTable, width: int) -> Iterator[str]:
    """The head, then each row: its name, what is told of it in short, and its meaning below."""
    yield f"{INDENT}{table.head[0]}"
    column = min(max(len(row[0]) for row in table.rows), width // 3) + 2
    inner = INDENT + "  "
    for row in table.rows:
        short = "; ".join(_told(table.head[n], row[n]) for n in range(1, len(row) - 1) if row[n])
        name = f"{inner}{row[0]:{column}}"
        if len(row[0]) + 2 > column:
            yield name.rstrip()
            name = " " * len(f"{inner}{'':{column}}")
        following = " " * len(f"{inner}{'':{column}}")
        told = ": ".join(filter(None, (short, row[-1]))) if len(row) > 1 else ""
        yield from _wrapped(told, name, width, following) if told else (name.rstrip(),)


def _told(head: str, text: str) -> str:
    """A cell between name and meaning, with what it is where its text does not tell."""
    if head in ("default", "initial") and text != REQUIRED:
        return f"{head} {text}"
    return f"{head} {text}" if head in ("from", "with") else text


def _wrapped(text: str, first: str, width: int, following: str | None = None) -> list[str]:
    return textwrap.wrap(
        text,
        width,
        initial_indent=first,
        subsequent_indent=first if following is None else following,
        break_on_hyphens=False,
    )
