"""HTML-like labels of Graphviz: titles, rows of tables, words at edges."""

from __future__ import annotations

import html
import textwrap
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from typing import Literal, get_args

from engine.draw.chart_shapes import (
    BoxShape,
    Declared,
    Ending,
    LeafShape,
    OutcomeLabel,
    Pin,
    TableShape,
)
from engine.draw.style import AMBER, CAUSES, FILLS, FRAME, GREY, KINDS, LIT_FRAME, RED
from engine.draw.wording import noted, packed

Holds = Callable[[str], bool]
HEAD_WIDTH, ROW_WIDTH, LEAF_WIDTH, PIN_WIDTH = 80, 56, 40, 28
"""Characters in a line of small letters."""
MOST_LINES = 8
"""Lines of notes under a name."""
Side = Literal["above", "below"]
SIDES: tuple[Side, Side] = get_args(Side)
ABOVE, BELOW = SIDES
BIG, MIDDLE, SMALL = 15, 10.5, 9
"""Font sizes, points."""
BARE = {"BORDER": "0", "CELLSPACING": "0", "CELLPADDING": "0"}


def leaf_label(leaf: LeafShape, free: Collection[Side]) -> str:
    """A bold name above small notes, centred, between the pins; `free`: see `_between_pins`."""
    lines = [leaf.target, *_shown(leaf, LEAF_WIDTH)]
    body = "<BR/>".join((f"<B>{text(leaf.name)}</B>", *map(small, lines)))
    if not leaf.pins:
        return body
    return _table(_between_pins([f"<TD>{body}</TD>"], leaf.pins, free), BARE)


def _shown(leaf: LeafShape, width: int) -> list[str]:
    """The notes of a leaf in at most `MOST_LINES` lines."""
    lines = noted(leaf.notes, width)
    if len(lines) <= MOST_LINES:
        return lines
    return [*lines[: MOST_LINES - 1], f"{lines[MOST_LINES - 1]} · …"]


def tooltip(leaf: LeafShape) -> str:
    """What a leaf is about, and its notes if they are not all shown."""
    about = leaf.about or leaf.name
    hidden = len(noted(leaf.notes, LEAF_WIDTH)) > MOST_LINES
    return " · ".join((about, *leaf.notes)) if hidden else about


def _between_pins(cells: list[str], pins: Sequence[Pin], free: Collection[Side]) -> Iterator[str]:
    """Pins that lead back stand above the cells, the others below, so that edges leave there.

    On the sides `free` there is a free place beside them, a port with that name for edges to end.
    """
    above = [_pin(n, pin) for n, pin in enumerate(pins) if pin.back]
    below = [_pin(n, pin) for n, pin in enumerate(pins) if not pin.back]
    if above:
        yield _pins([_free(ABOVE)] * (ABOVE in free) + above)
    yield from cells
    if below:
        yield _pins(below + [_free(BELOW)] * (BELOW in free))


def _pins(cells: list[str]) -> str:
    return f"<TD>{_table([''.join(cells)], {**BARE, 'CELLSPACING': '3'})}</TD>"


def _free(port: Side) -> str:
    return f'<TD PORT="{port}" WIDTH="16"></TD>'


def _pin(number: int, pin: Pin) -> str:
    attributes = {
        "ID": f"o:{pin.id}",
        "PORT": str(number),
        "TOOLTIP": pin.id,
        "BORDER": "1",
        "STYLE": "rounded",
        "COLOR": RED if pin.cause == "error" else GREY,
        "BGCOLOR": FILLS[0],
        "CELLPADDING": "2",
    }
    return f"<TD {_listed(attributes)}>{_small(outcomes_label(pin.labels))}</TD>"


def outcomes_label(labels: Iterable[OutcomeLabel], width: int = PIN_WIDTH) -> str:
    """Outcomes as written in a pin or in a row."""
    lines = packed(labels, width, lambda label: label.shown)
    return "<BR/>".join(" | ".join(map(_outcome, line)) for line in lines)


def _outcome(label: OutcomeLabel) -> str:
    shown = text(label.shown)
    if label.taken == 0:
        shown = f"<S>{shown}</S>"
    if label.cause == "timeout":
        return f"<I>{shown}</I>"
    return f'<FONT COLOR="{CAUSES[label.cause]}">{shown}</FONT>' if label.cause else shown


def head_label(box: BoxShape, declared: Declared, holds: Holds) -> str:
    """The head of a box: its name, what it is about, and its parallel children in columns."""
    size = BIG if not box.path else MIDDLE
    notes = noted(box.notes, HEAD_WIDTH) if box.path else textwrap.wrap(box.about, HEAD_WIDTH)
    title = f'<FONT POINT-SIZE="{size}"><B>{text(box.name)}</B></FONT>  {small(box.mode)}'
    lines = [title, *map(small, notes)]
    for heading, items in declared:
        if items:
            first, *others = noted(items, HEAD_WIDTH)
            lines += [f"{_small(heading)}  {small(first)}", *map(small, others)]
    head = "".join(f'{line}<BR ALIGN="LEFT"/>' for line in lines)
    if not box.rows:
        return head
    return _table([_cell(head), f"<TD>{_columns(box.rows, holds)}</TD>"], BARE)


def table_label(table: TableShape, free: Collection[Side], holds: Holds) -> str:
    """A parallel container: its name, its children in columns and its rules, between the pins."""
    lit = bool(table.path) and holds(table.path)
    title = f"<B>{text(table.name)}</B>  {small(table.mode)}"
    lines = [_cell("<BR/>".join((title, *map(small, noted(table.notes, ROW_WIDTH)))))]
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
    return _table(_between_pins(lines, table.pins, free), look)


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
    lines = [f"<TD>{table_label(row, (), holds)}</TD>", *(_cell(_ending(e)) for e in row.endings)]
    known_as = {"ID": f"s:{row.path}", "TOOLTIP": row.about or row.name or " "}
    return f"<TD {_listed(known_as)}>{_table(lines, BARE)}</TD>"


def _leaf_cell(leaf: LeafShape, *, lit: bool) -> str:
    border, fill, lit_fill, style = KINDS[leaf.kind]
    title = f"<B>{text(leaf.name)}</B> {small(leaf.target)}"
    endings = [*map(_ending, leaf.endings)]
    if len(endings) == 1:
        title, endings = f"{title} {endings[0]}", []
    lines = [title, *map(small, _shown(leaf, ROW_WIDTH)), *endings]
    attributes = {
        "ID": f"s:{leaf.path}",
        "TOOLTIP": tooltip(leaf),
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
    own = outcomes_label(ending.labels, ROW_WIDTH)
    same = all(label.text == ending.outcome for label in ending.labels)
    shown = f"→ {own}" if same else f"{own} → {text(ending.outcome)}"
    return _small(shown)


def legend(counted: bool = False) -> str:
    """The meaning of the colours and arrows, in two lines; a third one says what is `counted`."""
    causes = [
        f'<FONT COLOR="{KINDS["do"][0]}">action</FONT>',
        f'<FONT COLOR="{AMBER}">monitor → outcome it causes</FONT>',
        f'<FONT COLOR="{KINDS["use"][0]}">chart</FONT>',
        f'<FONT COLOR="{GREY}">outcome</FONT>',
        f'<FONT COLOR="{GREY}"><I>time limit</I></FONT>',
        f'<FONT COLOR="{RED}">error</FONT>',
    ]
    data = f'<FONT COLOR="{GREY}">parameter: value  ·  input ← data  ·  output → data</FONT>'
    lines = ["  ·  ".join(causes), data]
    if counted:
        lines.append(
            f'<FONT COLOR="{GREY}">×3: taken 3 times  ·  <S>×0</S>, thin: never taken</FONT>'
        )
    return _small("".join(f'{line}<BR ALIGN="LEFT"/>' for line in lines))


def _cell(content: str) -> str:
    return f'<TD ALIGN="LEFT" BALIGN="LEFT">{content}</TD>'


def _table(cells: Iterable[str], attributes: Mapping[str, str]) -> str:
    return f"<TABLE {_listed(attributes)}>{''.join(f'<TR>{cell}</TR>' for cell in cells)}</TABLE>"


def _listed(attributes: Mapping[str, str]) -> str:
    return " ".join(f'{name}="{text(value)}"' for name, value in attributes.items())


def small(note: str) -> str:
    """A note in small grey letters."""
    return f'<FONT POINT-SIZE="{SMALL}" COLOR="{GREY}">{text(note)}</FONT>'


def _small(markup: str) -> str:
    return f'<FONT POINT-SIZE="{SMALL}">{markup}</FONT>'


def text(value: str) -> str:
    """`value` escaped for an HTML-like label; a space if empty, as no element may be empty."""
    return html.escape(printable(value)).replace("\\", "\\\\") or " "


def printable(value: str) -> str:
    """`value` with a space instead of each character that is not printable."""
    return "".join(c if c.isprintable() else " " for c in value)
