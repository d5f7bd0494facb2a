"""Charts as Mermaid text, which many web pages render by themselves.

A flowchart, not a state diagram: state diagrams cannot have edges that end at a box inside
something parallel.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator, Mapping

from engine.chart import Chart
from engine.draw.chart_shapes import (
    BoxShape,
    Edge,
    Ending,
    LeafShape,
    OutcomeLabel,
    Picture,
    Pin,
    TableShape,
)
from engine.draw.picture import EdgeCounts, picture
from engine.draw.style import CAUSES, FILLS, FRAME, GREY, INK, KINDS, RED, Cause
from engine.draw.wording import NONE, noted
from engine.literals import Constant

_DASHED, _DOTTED = ",stroke-dasharray:5 3", ",stroke-dasharray:2 3"
_CLASSES = "\n".join(
    f"  classDef {name} fill:{fill},stroke:{border},color:{letters}{more}"
    for name, fill, border, letters, more in (
        ("do", KINDS["do"][1], KINDS["do"][0], INK, ""),
        ("watch", KINDS["watch"][1], KINDS["watch"][0], INK, _DASHED),
        ("use", KINDS["use"][1], KINDS["use"][0], INK, ""),
        ("table", FILLS[0], FRAME, INK, f"{_DASHED},text-align:left"),
        ("pin", FILLS[0], GREY, GREY, ""),
        ("outcome", FILLS[0], GREY, GREY, ",stroke-width:3px"),
        ("error", FILLS[0], RED, RED, ""),
        ("declared", FILLS[0], FILLS[0], INK, ",text-align:left"),
        ("start", INK, INK, INK, ""),
        ("sequence", FILLS[1], FRAME, INK, ""),
        ("parallel", FILLS[1], FRAME, INK, _DASHED),
    )
)
WIDTH = 56  # of small letters, characters


def mermaid(
    chart: Chart,
    library: Mapping[str, Chart],
    depth: int | None = 0,
    constants: Mapping[str, Constant] = NONE,
    counts: EdgeCounts | None = None,
) -> str:
    """`chart` as a Mermaid flowchart; arguments as for `engine.draw.dot_text.dot`."""
    shown = picture(chart, library, depth, constants, counts=counts)
    return "\n".join(_Writer(shown).lines()) + "\n"


class _Writer:
    def __init__(self, shown: Picture) -> None:
        self.shown = shown
        self.boxes = {box.path for box in shown.root.boxes()}
        self.names: dict[str, str] = {}  # paths could be keywords of Mermaid, such as `end`

    def lines(self) -> Iterator[str]:
        yield "flowchart TB"
        yield _CLASSES
        for line in self.box(self.shown.root):
            yield f"  {line}"
        arrows = list(itertools.chain(self.beginnings(), map(self.edge, self.shown.edges)))
        yield from arrows
        yield from self.colours(len(arrows) - len(self.shown.edges))

    def colours(self, first: int) -> Iterator[str]:
        """The styles of the edges, which Mermaid numbers, from `first` on."""
        numbers: dict[Cause, list[str]] = {}
        for number, edge in enumerate(self.shown.edges, first):
            numbers.setdefault(edge.pin.cause, []).append(str(number))
        for cause, found in numbers.items():
            if cause:
                dots = _DOTTED if cause == "timeout" else ""
                yield f"  linkStyle {','.join(found)} stroke:{CAUSES[cause]}{dots}"

    def name(self, shape: str) -> str:
        return self.names.setdefault(shape, f"n{len(self.names)}")

    def box(self, box: BoxShape) -> Iterator[str]:
        name = self.name(f"{box.path}/")
        lines = [f"<b>{_text(box.name)}</b> {box.mode}", *map(_small, noted(box.notes, WIDTH))]
        yield f'subgraph {name}["{"<br/>".join(lines)}"]'
        yield from () if box.path else self.head()
        if box.start:
            yield f'  {self.name(box.start)}((" ")):::start'
        for member in (*box.rows, *box.members):
            inside = self.box(member) if isinstance(member, BoxShape) else [self.leaf(member)]
            for line in inside:
                yield f"  {line}"
        for pin in box.pins:
            for line in self.pin(pin):
                yield f"  {line}"
        yield "end"
        yield f"class {name} {'sequence' if box.mode == 'states' else 'parallel'}"

    def head(self) -> Iterator[str]:
        """What the chart declares; a node, as titles of several lines cover what is below."""
        shown = []
        for heading, items in self.shown.declared:
            if items:
                shown += [_text(heading), *map(_small, noted(items, WIDTH))]
        if shown:
            yield f'  head["{"<br/>".join(shown)}"]:::declared'

    def leaf(self, shape: LeafShape | TableShape) -> str:
        kind = shape.kind if isinstance(shape, LeafShape) else "table"
        return f'{self.name(shape.path)}("{"<br/>".join(_lines(shape))}"):::{kind}'

    def pin(self, pin: Pin) -> Iterator[str]:
        lines = (_outcomes(pin.labels), *(_small(note) for note in pin.notes))
        name, shown = self.name(pin.id), "<br/>".join(lines)
        yield f'{name}["{shown}"]:::pin' if pin.path else f'{name}(["{shown}"]):::outcome'
        if pin.cause == "error":
            yield f"class {name} error"

    def beginnings(self) -> Iterator[str]:
        for box in self.shown.root.boxes():
            if box.start:
                yield f"  {self.name(box.start)} --> {self.end(box.members[0].path)}"

    def edge(self, edge: Edge) -> str:
        line = "-->" if edge.arrow else "---"
        if edge.pin.path in self.boxes:
            return f"  {self.name(edge.pin.id)} {line} {self.end(edge.head)}"
        shown = f'|"{_outcomes(edge.pin.labels)}"|'
        return f"  {self.name(edge.pin.path)} {line}{shown} {self.end(edge.head)}"

    def end(self, shape: str) -> str:
        return self.names.get(f"{shape}/") or self.name(shape)


def _lines(shape: LeafShape | TableShape) -> Iterator[str]:
    """A leaf's name and notes, or a table's with its rows; then how it ends its container."""
    if isinstance(shape, LeafShape):
        yield f"<b>{_text(shape.name)}</b>"
        yield _small(shape.target)
        yield from map(_small, noted(shape.notes, WIDTH))
    else:
        yield f"<b>{_text(shape.name)}</b> {shape.mode}"
        yield from map(_small, noted(shape.notes, WIDTH))
        for row in shape.rows:
            yield from _row_lines(row)
        yield from map(_small, shape.rules)
    yield from map(_ending, shape.endings)


def _row_lines(row: LeafShape | TableShape) -> Iterator[str]:
    if isinstance(row, TableShape):
        yield from _lines(row)
        return
    yield f"<b>{_text(row.name)}</b> {_small(row.target)}"
    yield from map(_small, noted(row.notes, WIDTH))
    yield from map(_ending, row.endings)


def _ending(ending: Ending) -> str:
    if all(label.text == ending.outcome for label in ending.labels):
        return f"→ {_outcomes(ending.labels)}"
    return f"{_outcomes(ending.labels)} → {_text(ending.outcome)}"


def _outcomes(labels: Iterable[OutcomeLabel]) -> str:
    return " #124; ".join(_text(label.shown) for label in labels)


def _small(note: str) -> str:
    return f"<small>{_text(note)}</small>"


def _text(text: str) -> str:
    """`text` with all characters encoded that have a meaning in Mermaid or HTML."""
    return "".join(c if c.isalnum() or c in " _.,:/" else f"#{ord(c)};" for c in text) or " "
