"""HTML-like labels of Graphviz: titles, rows of tables, words at edges."""

from __future__ import annotations

import html
import textwrap
from collections.abc import Callable, Iterable, Mapping, Sequence

from engine.draw.chart_shapes import BoxShape, Ending, LeafShape, OutcomeLabel, TableShape
from engine.draw.style import AMBER, CAUSES, FILLS, FRAME, GREY, KINDS, LINE, LIT_FRAME, RED

Holds = Callable[[str], bool]
ABOUT_WIDTH = 80
BIG, MIDDLE, SMALL = 15, 10.5, 9
"""Font sizes, points."""
BARE = {"BORDER": "0", "CELLSPACING": "0", "CELLPADDING": "0"}


def shape_label(title: str, notes: Sequence[str]) -> str:
    """A bold name above small notes, centred."""
    return "<BR/>".join((f"<B>{text(title)}</B>", *map(small, notes)))


def outcomes_label(labels: Iterable[OutcomeLabel]) -> str:
    """Outcomes as written at an edge or in a row."""
    return " | ".join(map(_outcome, labels))


def _outcome(label: OutcomeLabel) -> str:
    shown = text(label.text)
    if label.cause == "timeout":
        return f"<I>{shown}</I>"
    return f'<FONT COLOR="{CAUSES[label.cause]}">{shown}</FONT>' if label.cause else shown


def head_label(box: BoxShape, holds: Holds) -> str:
    """The head of a box: its name, what it is about, and its parallel children in columns."""
    size = BIG if not box.path else MIDDLE
    notes = box.notes if box.path else textwrap.wrap(box.about, ABOUT_WIDTH)
    title = f'<FONT POINT-SIZE="{size}"><B>{text(box.name)}</B></FONT>  {small(box.mode)}'
    title = "".join(f'{line}<BR ALIGN="LEFT"/>' for line in (title, *map(small, notes)))
    if not box.rows:
        return title
    return _table([_cell(title), f"<TD>{_columns(box.rows, holds)}</TD>"], BARE)


def table_label(table: TableShape, holds: Holds) -> str:
    """A parallel container: its name, its children in columns, and its rules."""
    lit = bool(table.path) and holds(table.path)
    title = f"<B>{text(table.name)}</B>  {small(table.mode)}"
    lines = [_cell("<BR/>".join((title, *map(small, table.notes))))]
    if table.rows:
        lines.append(f"<TD>{_columns(table.rows, holds)}</TD>")
    lines += [_cell(small(rule)) for rule in table.rules]
    look = {
        "BORDER": "2" if lit else "1",
        "STYLE": "rounded,dashed",
        "COLOR": LIT_FRAME if lit else FRAME,
        "BGCOLOR": FILLS[0],
        "CELLBORDER": "0",
        "CELLSPACING": "1",
        "CELLPADDING": "1",
    }
    return _table(lines, look)


def _columns(rows: Sequence[LeafShape | TableShape], holds: Holds) -> str:
    """Rows one below the other; the guards in a column of their own, on the right."""
    guards = [row for row in rows if isinstance(row, LeafShape) and row.kind == "watch"]
    others = [row for row in rows if row not in guards]
    columns = [[_row(row, holds) for row in column] for column in (others, guards) if column]
    tables = [_table(column, {**BARE, "CELLSPACING": "2"}) for column in columns]
    cells = "".join(f'<TD VALIGN="TOP" ALIGN="LEFT">{table}</TD>' for table in tables)
    return _table([f"{cells}<TD></TD>"], BARE)  # the empty cell takes what is left of the width


def _row(row: LeafShape | TableShape, holds: Holds) -> str:
    if isinstance(row, LeafShape):
        return _leaf_cell(row, lit=holds(row.path))
    lines = [f"<TD>{table_label(row, holds)}</TD>", *(_cell(_ending(e)) for e in row.endings)]
    return f"<TD>{_table(lines, BARE)}</TD>"


def _leaf_cell(leaf: LeafShape, *, lit: bool) -> str:
    border, fill, lit_fill, style = KINDS[leaf.kind]
    target, *notes = leaf.notes
    title, endings = f"<B>{text(leaf.name)}</B> {small(target)}", [*map(_ending, leaf.endings)]
    if len(endings) == 1:
        title, endings = f"{title} {endings[0]}", []
    lines = [title, *([small(", ".join(notes))] if notes else []), *endings]
    attributes = {
        "ID": f"s:{leaf.path}",
        "TOOLTIP": leaf.about or leaf.name,
        "BORDER": "2" if lit else "1",
        "STYLE": style,
        "COLOR": border,
        "BGCOLOR": lit_fill if lit else fill,
        "ALIGN": "LEFT",
        "BALIGN": "LEFT",
        "CELLPADDING": "3",
    }
    return f"<TD {_listed(attributes)}>{'<BR/>'.join(lines)}</TD>"


def _ending(ending: Ending) -> str:
    """`→ outcome`, or `own outcomes → outcome` if the row's are named differently."""
    own = outcomes_label(ending.labels)
    same = all(label.text == ending.outcome for label in ending.labels)
    shown = f"→ {own}" if same else f"{own} → {text(ending.outcome)}"
    return f'<FONT POINT-SIZE="{SMALL}">{shown}</FONT>'


def legend() -> str:
    """The meaning of the colours, in one line."""
    words = [
        f'<FONT COLOR="{KINDS["do"][0]}">action</FONT>',
        f'<FONT COLOR="{AMBER}">monitor → outcome it causes</FONT>',
        f'<FONT COLOR="{KINDS["use"][0]}">chart</FONT>',
        f'<FONT COLOR="{GREY}">outcome</FONT>',
        f'<FONT COLOR="{LINE}"><I>time limit</I></FONT>',
        f'<FONT COLOR="{RED}">error</FONT>',
    ]
    return f'<FONT POINT-SIZE="{SMALL}">{"  ·  ".join(words)}</FONT>'


def _cell(content: str) -> str:
    return f'<TD ALIGN="LEFT" BALIGN="LEFT">{content}</TD>'


def _table(cells: Iterable[str], attributes: Mapping[str, str]) -> str:
    return f"<TABLE {_listed(attributes)}>{''.join(f'<TR>{cell}</TR>' for cell in cells)}</TABLE>"


def _listed(attributes: Mapping[str, str]) -> str:
    return " ".join(f'{name}="{text(value)}"' for name, value in attributes.items())


def small(note: str) -> str:
    """A note in small grey letters."""
    return f'<FONT POINT-SIZE="{SMALL}" COLOR="{GREY}">{text(note)}</FONT>'


def text(value: str) -> str:
    """`value` escaped for an HTML-like label; a space if empty, as no element may be empty."""
    return html.escape(printable(value)).replace("\\", "\\\\") or " "


def printable(value: str) -> str:
    """`value` with a space instead of each character that is not printable."""
    return "".join(c if c.isprintable() else " " for c in value)
