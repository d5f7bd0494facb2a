"""Reference pages as Markdown that GitHub renders."""

from __future__ import annotations

from cobodeck.manual.page import ManualPage, PageBlock, PageEntry, PageTable, YamlCode
from cobodeck.markdown import markdown_table

MADE = "Made by `cobodeck docs`; edits are lost."


def markdown_text(page: ManualPage) -> str:
    """The text of a page's file."""
    parts = [f"# {page.title}", *map(_block, page.about)]
    own = [entry for entry in page.entries if entry.is_own]
    others = [entry for entry in page.entries if not entry.is_own]
    parts += [_contents([*own, *others])] if page.entries else []
    for title, entries in (("Of this project", own), ("Shipped", others)):
        level = "##"
        if own and entries:
            parts.append(f"## {title}")
            level = "###"
        for entry in entries:
            parts += [f"{level} {entry.name}", *map(_block, entry.blocks)]
    return "\n\n".join([*parts, f"*{MADE}*"]) + "\n"


def _contents(entries: list[PageEntry]) -> str:
    links = [f"[{entry.name}](#{_anchor(entry.name)})" for entry in entries]
    rows = [(link, _cell(entry.first_line)) for link, entry in zip(links, entries, strict=True)]
    return markdown_table(("", ""), rows)


def _anchor(heading: str) -> str:
    """The anchor that GitHub gives a heading."""
    kept = "".join(c for c in heading.lower() if c.isalnum() or c in " -_")
    return kept.replace(" ", "-")


def _block(block: PageBlock) -> str:
    if isinstance(block, YamlCode):
        return f"```yaml\n{block.text.rstrip()}\n```"
    if isinstance(block, PageTable):
        rows = [(f"`{_cell(row[0])}`", *map(_cell, row[1:])) for row in block.rows]
        return markdown_table(block.head, rows)
    return block


def _cell(text: str) -> str:
    """Text for a cell of a table: in one line, and with its bars escaped, in code letters too."""
    return " ".join(text.split()).replace("|", "\\|")
