"""Charts as DOT text, which Graphviz lays out."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass

from engine.chart import Chart
from engine.draw.chart_shapes import BoxShape, Edge, LeafShape, Picture, Pin, TableShape, entry_of
from engine.draw.markup import (
    ABOVE,
    BELOW,
    SIDES,
    SMALL,
    Side,
    head_label,
    leaf_label,
    legend,
    outcomes_label,
    printable,
    small,
    table_label,
    text,
    tooltip,
)
from engine.draw.picture import EdgeCounts, picture
from engine.draw.style import (
    BOX_MARGIN,
    CAUSES,
    FILLS,
    FRAME,
    GREY,
    INK,
    KINDS,
    LIT_FRAME,
    PAGE,
    RED,
    ROOT_MARGIN,
)
from engine.draw.wording import NONE
from engine.literals import Constant

_HEADER = f"""\
  graph [compound=true, splines=true, nodesep=0.2, ranksep=0.35, pad=0.15, labeljust=l,
    bgcolor="{PAGE}",
    fontname="Helvetica,Arial,sans-serif", fontsize=10.5, fontcolor="{INK}", tooltip=" "]
  node [shape=box, margin="0.08,0.04", height=0.25, width=0.25, penwidth=1.3,
    fontname="Helvetica,Arial,sans-serif", fontsize=10.5, fontcolor="{INK}"]
  edge [arrowsize=0.7, penwidth=1.1, weight=8, color="{GREY}",
    fontname="Helvetica,Arial,sans-serif", fontsize=9, fontcolor="{GREY}"]"""


TAKEN, NEVER_TAKEN = "1.8", "0.5"
"""Widths of edges where it was counted how often they were taken, points."""
_FREE = "|"  # no outcome, so no pin is called so


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
    constants: Mapping[str, Constant] = NONE,
    unfolded: Collection[str] = (),
    counts: EdgeCounts | None = None,
) -> str:
    """`chart` as DOT text; the same chart gives the same text.

    In the SVG, shapes have the ids `s:PATH` (rows of tables `a_s:PATH`), pins of boxes
    `o:PATH:OUTCOME|OUTCOME` (of other shapes `a_o:…`), edges `t:PATH:OUTCOME|OUTCOME`: each node
    of what is expanded has its shape.

    Args:
        chart: the chart.
        library: the charts it uses, by name.
        depth: how many levels of `use` are expanded; `None`: all.
        active: what to highlight.
        constants: what `$name.name` stands for; the others are shown by their names.
        unfolded: paths of further `use` nodes that are expanded.
        counts: how often outcomes were taken, by path and outcome; what never was is marked.
    """
    shown = picture(chart, library, depth, constants, unfolded, counts)
    return "\n".join(_Writer(shown, active or Active()).lines()) + "\n"


class _Writer:
    """Writes the shapes of a box, then the boxes inside it, then the edges between them.

    Graphviz puts a shape into the box that mentions it first, so an edge must not be written before
    both of its ends.
    """

    def __init__(self, shown: Picture, active: Active) -> None:
        self.root = shown.root
        self.declared, self.counted = shown.declared, shown.counted
        self.edges: dict[str, list[Edge]] = {}
        for edge in shown.edges:
            self.edges.setdefault(edge.within, []).append(edge)
        self.met = {(edge.head, BELOW if edge.pin.back else ABOVE) for edge in shown.edges}
        self.ports: dict[str | tuple[str, Side], str] = {}
        self.active = active
        self.taken = frozenset(shown.route(*active.last)) if active.last else frozenset()
        self.boxes = {box.path: box for box in shown.root.boxes()}

    def lines(self) -> Iterator[str]:
        yield f"digraph {_quoted(self.root.name)} {{"
        yield _HEADER
        for line in self.box(self.root, 0):
            yield f"  {line}"
        yield f"  label=<{legend(self.counted)}>; labelloc=b"
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
            "margin": BOX_MARGIN if box.path else ROOT_MARGIN,
            "labelloc": "t",
        }
        yield f"subgraph {_quoted('cluster_' + box.path)} {{"
        head = head_label(box, () if box.path else self.declared, self.active.holds)
        yield f"  graph [label=<{head}>, {_listed(attributes)}]"
        for line in self.inside(box, level):
            yield f"  {line}"
        for line in self.order(box):
            yield f"  {line}"
        for edge in self.edges.get(box.path, ()):
            yield f"  {self.edge(edge)}"
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
        lowest = [pin.id for pin in box.pins]
        if box.pins and (box.path, BELOW) in self.met:
            lowest.append(f"{box.path}:{_FREE}")
            yield f'{_quoted(lowest[-1])} [label="", style=invis]'
        if box.pins:
            yield f"{{rank=sink; {'; '.join(map(_quoted, lowest))}}}"

    def table(self, table: TableShape) -> str:
        attributes = {
            "id": f"s:{table.path}",
            "shape": "plain",
            "tooltip": table.about or table.name or " ",
        }
        label = table_label(table, self.free(table), self.active.holds)
        return f"{_quoted(table.path)} [label=<{label}>, {_listed(attributes)}]"

    def leaf(self, leaf: LeafShape) -> str:
        lit = self.active.holds(leaf.path)
        border, fill, lit_fill, style = KINDS[leaf.kind]
        attributes = {
            "id": f"s:{leaf.path}",
            "tooltip": tooltip(leaf),
            "style": f"filled,{style}",
            "color": border,
            "fillcolor": lit_fill if lit else fill,
        }
        if lit:
            attributes["penwidth"] = "2.4"
        label = leaf_label(leaf, self.free(leaf))
        return f"{_quoted(leaf.path)} [label=<{label}>, {_listed(attributes)}]"

    def free(self, shape: LeafShape | TableShape) -> Collection[Side]:
        """The sides on which edges end beside pins; notes those ports, and those of the pins."""
        name = _quoted(shape.path)
        taken = set()
        for number, pin in enumerate(shape.pins):
            self.ports[pin.id] = f"{name}:{number}:{'n' if pin.back else 's'}"
            taken.add(ABOVE if pin.back else BELOW)
        free = [side for side in SIDES if side in taken and (shape.path, side) in self.met]
        for side in free:
            self.ports[shape.path, side] = f"{name}:{side}:{'n' if side == ABOVE else 's'}"
        return free

    def order(self, box: BoxShape) -> Iterator[str]:
        """The arrow from the start dot; invisible: boxes from left to right, pins at the bottom."""
        inner = [member for member in box.members if isinstance(member, BoxShape)]
        if box.start:
            first = box.members[0]
            boxed = isinstance(first, BoxShape)
            place = {"lhead": f"cluster_{first.path}"} if boxed else {"minlen": "0"}
            yield _edge(box.start, entry_of(first), {"weight": "30", **place})
            for member in inner if len(inner) > 1 else ():
                if member is not first:
                    yield _edge(box.start, member.entry, {"style": "invis", "weight": "9"})
        for member in inner if box.pins else ():
            hidden = {"style": "invis", "weight": "1"}
            yield _edge(member.exit or member.entry, box.pins[0].id, hidden)

    def edge(self, edge: Edge) -> str:
        """An edge; one back is turned, so that Graphviz puts its head above its tail."""
        pin, box = edge.pin, self.boxes.get(edge.head)
        tail = self.ports.get(pin.id, _quoted(pin.id))
        attributes = {"id": f"t:{pin.id}", **self.look(edge), **self.freedom(edge)}
        arrow = "normal" if edge.arrow else "none"
        if box is None:
            side = BELOW if pin.back else ABOVE
            head = self.ports.get((edge.head, side), _quoted(edge.head))
        elif box.path == pin.path:
            head = _quoted(box.entry)
        elif pin.back and box.pins:
            head = _quoted(f"{box.path}:{_FREE}")
            attributes["ltail"] = f"cluster_{box.path}"
        else:
            head = _quoted(box.entry)
            attributes["ltail" if pin.back else "lhead"] = f"cluster_{box.path}"
        if pin.back:
            return f"{head} -> {tail} [{_listed(attributes)}, dir=back, arrowtail={arrow}]"
        return f"{tail} -> {head} [{_listed(attributes)}, arrowhead={arrow}]"

    def look(self, edge: Edge) -> dict[str, str]:
        cause = edge.pin.cause
        look = {"color": CAUSES[cause]} if cause else {}
        if cause == "timeout":
            look["style"] = "dotted"
        if edge.pin.taken is not None:
            look["penwidth"] = TAKEN if edge.pin.taken else NEVER_TAKEN
        if edge in self.taken:
            look["penwidth"] = "3"
        return look

    def freedom(self, edge: Edge) -> dict[str, str]:
        """Attributes for how far below the tail the head of an edge has to be.

        Boxes are placed side by side; any other shape that follows a box, just below its pins.
        """
        ends = [path for path in (edge.pin.path, edge.head) if path in self.boxes]
        if len(ends) == 2:
            return {"constraint": "false"}
        return {"minlen": "0"} if ends and ":" not in edge.head else {}


def _edge(tail: str, head: str, attributes: Mapping[str, str]) -> str:
    return f"{_quoted(tail)} -> {_quoted(head)} [{_listed(attributes)}]"


def _pin(pin: Pin) -> str:
    attributes = {
        "id": f"o:{pin.id}",
        "tooltip": " | ".join(pin.outcomes),
        "style": "filled",
        "fillcolor": PAGE,
        "color": RED if pin.cause == "error" else GREY,
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
        "fillcolor": PAGE,
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
