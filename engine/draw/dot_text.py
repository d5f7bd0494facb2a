"""Charts as DOT text, which Graphviz lays out."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass

from engine.chart import Chart
from engine.draw.chart_shapes import BoxShape, Edge, LeafShape, Picture, Pin, TableShape
from engine.draw.markup import (
    SMALL,
    head_label,
    legend,
    outcomes_label,
    printable,
    shape_label,
    small,
    table_label,
    text,
)
from engine.draw.picture import picture
from engine.draw.style import CAUSES, FILLS, FRAME, GREY, INK, KINDS, LINE, LIT_FRAME, RED

_HEADER = f"""\
  graph [compound=true, splines=polyline, nodesep=0.2, ranksep=0.18, pad=0.15, labeljust=l,
    fontname="Helvetica,Arial,sans-serif", fontsize=10.5, fontcolor="{INK}", tooltip=" "]
  node [shape=box, margin="0.08,0.04", height=0.25, width=0.25, penwidth=1.3,
    fontname="Helvetica,Arial,sans-serif", fontsize=10.5, fontcolor="{INK}"]
  edge [arrowsize=0.7, penwidth=1.1, weight=8, color="{LINE}",
    fontname="Helvetica,Arial,sans-serif", fontsize=9, fontcolor="{LINE}"]"""


@dataclass(frozen=True, slots=True)
class Active:
    """What to highlight of a run: the active paths, and the last node and outcome taken."""

    paths: Collection[str] = ()
    last: tuple[str, str] | None = None

    def holds(self, path: str) -> bool:
        """True if `path`, or something below it, is active."""
        return any(active == path or active.startswith(f"{path}/") for active in self.paths)


def dot(
    chart: Chart,
    library: Mapping[str, Chart],
    depth: int | None = 0,
    active: Active | None = None,
) -> str:
    """`chart` as DOT text; the same chart gives the same text.

    In the SVG, shapes have the ids `s:PATH` (rows of tables `a_s:PATH`), pins
    `o:PATH:OUTCOME|OUTCOME`, edges `t:PATH:OUTCOME|OUTCOME`.

    Args:
        chart: the chart.
        library: the charts it uses, by name.
        depth: how many levels of `use` are expanded; `None`: all.
        active: what to highlight.
    """
    return "\n".join(_Writer(picture(chart, library, depth), active or Active()).lines()) + "\n"


class _Writer:
    """Writes the shapes of a box, then the boxes inside it, then the edges between them.

    Graphviz puts a shape into the box that mentions it first, so an edge must not be written before
    both of its ends; and it keeps an edge's label inside the box in which the edge is written.
    """

    def __init__(self, shown: Picture, active: Active) -> None:
        self.root = shown.root
        self.edges: dict[str, list[Edge]] = {}
        for edge in shown.edges:
            self.edges.setdefault(edge.within, []).append(edge)
        self.active = active
        self.taken = frozenset(shown.route(*active.last)) if active.last else frozenset()
        self.boxes = {box.path: box for box in shown.root.boxes()}

    def lines(self) -> Iterator[str]:
        yield f"digraph {_quoted(self.root.name)} {{"
        yield _HEADER
        for line in self.box(self.root, 0):
            yield f"  {line}"
        yield f"  label=<{legend()}>; labelloc=b"
        yield "}"

    def box(self, box: BoxShape, level: int) -> Iterator[str]:
        lit = bool(box.path) and self.active.holds(box.path)
        attributes = {
            "id": f"s:{box.path}",
            "tooltip": box.about or box.name or " ",
            "style": "rounded,filled" if box.mode == "states" else "rounded,filled,dashed",
            "color": LIT_FRAME if lit else FRAME,
            "fillcolor": FILLS[level % len(FILLS)],
            "penwidth": "2.2" if lit else "1.1",
            "margin": "7",
            "labelloc": "t",
        }
        yield f"subgraph {_quoted('cluster_' + box.path)} {{"
        yield f"  graph [label=<{head_label(box, self.active.holds)}>, {_listed(attributes)}]"
        for line in self.inside(box, level):
            yield f"  {line}"
        for line in self.order(box):
            yield f"  {line}"
        for edge in self.edges.get(box.path, ()):
            for line in self.edge(edge):
                yield f"  {line}"
        yield "}"

    def inside(self, box: BoxShape, level: int) -> Iterator[str]:
        if box.start:
            mark = {"shape": "point", "width": "0.13", "fillcolor": INK, "tooltip": "start"}
            yield f"{_quoted(box.start)} [{_listed(mark)}]"
        for member in box.members:
            if isinstance(member, BoxShape):
                yield from self.box(member, level + 1)
            elif isinstance(member, TableShape):
                yield self.table(member)
            else:
                yield self.leaf(member)
        for pin in box.pins:
            yield _pin(pin) if box.path else _outcome(pin)
        if box.pins:
            yield f"{{rank=sink; {'; '.join(_quoted(pin.id) for pin in box.pins)}}}"

    def table(self, table: TableShape) -> str:
        attributes = {
            "id": f"s:{table.path}",
            "shape": "plain",
            "tooltip": table.about or table.name or " ",
        }
        label = table_label(table, self.active.holds)
        return f"{_quoted(table.path)} [label=<{label}>, {_listed(attributes)}]"

    def leaf(self, leaf: LeafShape) -> str:
        lit = self.active.holds(leaf.path)
        border, fill, lit_fill, style = KINDS[leaf.kind]
        attributes = {
            "id": f"s:{leaf.path}",
            "tooltip": leaf.about or leaf.name,
            "style": f"filled,{style}",
            "color": border,
            "fillcolor": lit_fill if lit else fill,
        }
        if lit:
            attributes["penwidth"] = "2.4"
        label = shape_label(leaf.name, leaf.notes)
        return f"{_quoted(leaf.path)} [label=<{label}>, {_listed(attributes)}]"

    def order(self, box: BoxShape) -> Iterator[str]:
        """The arrow from the start dot, and invisible edges that keep the pins at the bottom."""
        if box.start:
            first = box.members[0].path
            beside = {} if first in self.boxes else {"minlen": "0"}
            yield self.arrow(box.start, first, {"weight": "30", **beside})
        for member in box.members if box.pins else ():
            if isinstance(member, BoxShape):
                hidden = {"style": "invis", "weight": "1"}
                low = member.exit or member.entry
                yield f"{_quoted(low)} -> {_quoted(box.pins[0].id)} [{_listed(hidden)}]"

    def edge(self, edge: Edge) -> Iterator[str]:
        """An edge; in two halves if it has a label, which is then a shape between them.

        Graphviz places its own edge labels after routing, sometimes outside of the frame.
        """
        name = f"{edge.path}:{'|'.join(edge.outcomes)}"
        look = self.look(edge)
        head = {"id": f"t:{name}", **look, **self.freedom(edge)}
        if not edge.arrow:
            head["arrowhead"] = "none"
        up = edge.step < 0
        if not edge.labels:
            yield self.arrow(edge.tail, edge.head, head, up=up)
            return
        label, tail = f"l:{name}", {"id": f"h:{name}", **look, "arrowhead": "none"}
        shape = {"id": label, "shape": "plain", "fontcolor": LINE, "fontsize": str(SMALL)}
        words = f"label=<{outcomes_label(edge.labels)}>, tooltip={_quoted(name)}"
        yield f"{_quoted(label)} [{words}, {_listed(shape)}]"
        if edge.step == 0:
            yield f"{{rank=same; {'; '.join(map(_quoted, (edge.tail, label, edge.head)))}}}"
        yield self.arrow(edge.tail, label, tail, up=up)
        yield self.arrow(label, edge.head, head, up=up)

    def look(self, edge: Edge) -> dict[str, str]:
        look = {"color": CAUSES[edge.cause]} if edge.cause else {}
        if edge.cause == "timeout":
            look["style"] = "dotted"
        if edge in self.taken:
            look["penwidth"] = "3"
        return look

    def freedom(self, edge: Edge) -> dict[str, str]:
        """Attributes for how far below the tail the head of an edge has to be.

        Boxes are placed side by side; any other shape that follows a box, just below its pins.
        """
        if edge.path in self.boxes and edge.head in self.boxes:
            return {"constraint": "false"}
        return {"minlen": "0"} if edge.path in self.boxes or edge.head in self.boxes else {}

    def arrow(self, tail: str, head: str, attributes: dict[str, str], *, up: bool = False) -> str:
        """An arrow, which ends at the border of a box; `up`: its head is above its tail."""
        end, box = head, self.boxes.get(head)
        if box is not None:
            end = (up and box.exit) or box.entry
            attributes = {**attributes, ("ltail" if up else "lhead"): f"cluster_{head}"}
        if not up:
            return f"{_quoted(tail)} -> {_quoted(end)} [{_listed(attributes)}]"
        arrow = {"dir": "back", "arrowtail": attributes.get("arrowhead", "normal")}
        kept = {name: value for name, value in attributes.items() if name != "arrowhead"}
        return f"{_quoted(end)} -> {_quoted(tail)} [{_listed(kept | arrow)}]"


def _pin(pin: Pin) -> str:
    attributes = {
        "id": f"o:{pin.id}",
        "tooltip": " | ".join(pin.outcomes),
        "style": "filled",
        "fillcolor": "white",
        "color": RED if pin.cause == "error" else GREY,
        "fontcolor": LINE,
        "fontsize": str(SMALL),
        "height": "0.2",
        "margin": "0.06,0.02",
        "penwidth": "0.9",
    }
    return _outcomes_shape(pin, outcomes_label(pin.labels), attributes)


def _outcome(pin: Pin) -> str:
    color = RED if pin.cause == "error" else GREY
    attributes = {
        "id": f"o:{pin.id}",
        "tooltip": f"outcome {pin.outcomes[0]}",
        "style": "rounded,filled",
        "peripheries": "2",
        "fillcolor": "white",
        "color": color,
        "fontcolor": color,
    }
    return _outcomes_shape(pin, f"<B>{text(pin.outcomes[0])}</B>", attributes)


def _outcomes_shape(pin: Pin, title: str, attributes: Mapping[str, str]) -> str:
    label = "<BR/>".join((title, *map(small, pin.notes)))
    return f"{_quoted(pin.id)} [label=<{label}>, {_listed(attributes)}]"


def _listed(attributes: Mapping[str, str]) -> str:
    return ", ".join(f"{name}={_quoted(value)}" for name, value in attributes.items())


def _quoted(value: str) -> str:
    escaped = printable(value).replace("\\", "\\\\").replace('"', '\\"')
    return f'"{escaped}"'
