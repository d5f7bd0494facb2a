"""Charts as DOT text, and DOT text as a picture file."""

from __future__ import annotations

import html
import itertools
import textwrap
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, get_args

from engine.chart import Chart
from engine.draw.picture import BoxShape, Edge, LeafShape, Picture, Pin, picture

INK, GREY, LINE, RED = "#1f2933", "#6b7785", "#52606d", "#c62828"
FRAME, LIT_FRAME = "#9aa5b1", "#2e7d32"
FILLS = ("#ffffff", "#f6f8fa", "#eef1f5")  # of boxes, by how deep they stand
KINDS = {  # border, fill, fill when active, style
    "do": ("#2e7d32", "#eaf5ea", "#8fd694", "rounded,filled"),
    "watch": ("#c77700", "#fff6e0", "#ffd166", "rounded,filled,dashed"),
    "use": ("#1f5fa8", "#e8f1fb", "#9cc7f5", "rounded,filled"),
}

_HEADER = f"""\
  graph [compound=true, splines=spline, nodesep=0.35, ranksep=0.42, pad=0.2, labeljust=l,
    fontname="Helvetica,Arial,sans-serif", fontsize=12, fontcolor="{INK}", tooltip=" "]
  node [shape=box, margin="0.12,0.06", height=0.3, width=0.3, penwidth=1.3,
    fontname="Helvetica,Arial,sans-serif", fontsize=12, fontcolor="{INK}"]
  edge [arrowsize=0.7, penwidth=1.1, weight=8, color="{LINE}",
    fontname="Helvetica,Arial,sans-serif", fontsize=10, fontcolor="{LINE}"]"""


@dataclass(frozen=True, slots=True)
class Active:
    """What is going on: the paths that are active, and the node and outcome taken last."""

    paths: Collection[str] = ()
    last: tuple[str, str] | None = None

    def holds(self, path: str) -> bool:
        """Whether `path` is active, or something below it."""
        return any(active == path or active.startswith(f"{path}/") for active in self.paths)


def dot(
    chart: Chart,
    library: Mapping[str, Chart],
    depth: int | None = 0,
    active: Active | None = None,
) -> str:
    """`chart` as DOT text; the same chart gives the same text.

    Shapes have the ids `s:PATH`, pins `o:PATH:OUTCOME`, edges `t:PATH:OUTCOME|OUTCOME`, so that
    a page can light them without a new layout.

    Args:
        chart: the chart.
        library: the charts it uses, by name.
        depth: how many levels of `use` are expanded; all with `None`.
        active: what to light.
    """
    return "\n".join(_Writer(picture(chart, library, depth), active or Active()).lines()) + "\n"


class _Writer:
    """Writes every shape inside its own box first, and every edge at the end, at the root.

    Graphviz moves a shape into the box in which it is named first; an edge written early would
    take the shape at its head along.
    """

    def __init__(self, shown: Picture, active: Active) -> None:
        self.root = shown.root
        self.edges = shown.edges
        self.active = active
        self.taken = frozenset(shown.way(*active.last)) if active.last else frozenset()
        self.boxes = {box.path: box for box in shown.root.boxes()}

    def lines(self) -> Iterator[str]:
        yield f"digraph {_quoted(self.root.name)} {{"
        yield _HEADER
        for line in self.box(self.root, 0):
            yield f"  {line}"
        for box in self.boxes.values():
            yield from self.order(box)
        for edge in self.edges:
            yield self.edge(edge)
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
            "margin": "12",
        }
        yield f"subgraph {_quoted('cluster_' + box.path)} {{"
        yield f"  graph [label={_title(box)}, {_listed(attributes)}]"
        for line in self.inside(box, level):
            yield f"  {line}"
        yield "}"

    def inside(self, box: BoxShape, level: int) -> Iterator[str]:
        if box.start:
            mark = {"shape": "point", "width": "0.13", "fillcolor": INK, "tooltip": "start"}
            yield f"{_quoted(box.start)} [{_listed(mark)}]"
        for member in box.members:
            if isinstance(member, BoxShape):
                yield from self.box(member, level + 1)
            else:
                yield self.leaf(member)
        for pin in box.pins:
            yield _pin(pin) if box.path else _outcome(pin)
        if box.pins:
            yield f"{{rank=sink; {'; '.join(_quoted(pin.id) for pin in box.pins)}}}"

    def leaf(self, leaf: LeafShape) -> str:
        lit = self.active.holds(leaf.path)
        border, fill, lit_fill, style = KINDS[leaf.kind]
        attributes = {
            "id": f"s:{leaf.path}",
            "tooltip": leaf.about or leaf.name,
            "style": style,
            "color": border,
            "fillcolor": lit_fill if lit else fill,
        }
        if lit:
            attributes["penwidth"] = "2.4"
        return _shape(leaf.id, f"<B>{_text(leaf.name)}</B>", leaf.notes, attributes)

    def order(self, box: BoxShape) -> Iterator[str]:
        """The mark where a sequence begins; and edges unseen, which put the box in order.

        What begins together stands side by side, and pins stand below the boxes.
        """
        if box.start:
            yield self.arrow(box.start, box.members[0].path, {"weight": "30"})
        else:
            hidden = {"style": "invis", "minlen": "0", "weight": "12"}
            for left, right in itertools.pairwise(box.members):
                yield f"  {_quoted(left.entry)} -> {_quoted(right.entry)} [{_listed(hidden)}]"
        for member in box.members if box.pins else ():
            if isinstance(member, BoxShape):
                hidden = {"style": "invis", "weight": "1"}
                yield f"  {_quoted(member.exit)} -> {_quoted(box.pins[0].id)} [{_listed(hidden)}]"

    def edge(self, edge: Edge) -> str:
        attributes = {"id": f"t:{edge.path}:{'|'.join(edge.outcomes)}"}
        if edge.alarm:
            attributes["color"] = RED
        if not edge.arrow:
            attributes["arrowhead"] = "none"
        if edge.back and (edge.tail != edge.path or edge.head in self.boxes):
            attributes["weight"] = "1"  # between boxes Graphviz weighs, it does not break loops
        if edge in self.taken:
            attributes["penwidth"] = "3"
        return self.arrow(edge.tail, edge.head, attributes, _label(edge), back=edge.back)

    def arrow(
        self,
        tail: str,
        head: str,
        attributes: dict[str, str],
        label: str = "",
        *,
        back: bool = False,
    ) -> str:
        """An edge; one that leads to a box from outside ends at its border."""
        end, box = head, self.boxes.get(head)
        if box is not None and tail.startswith(f"{head}:"):
            end = box.entry
        elif box is not None:
            attributes = {**attributes, "lhead": f"cluster_{head}"}
            end = box.exit if back else box.entry
        return f"  {_quoted(tail)} -> {_quoted(end)} [{label}{_listed(attributes)}]"


def _title(box: BoxShape) -> str:
    size = 12 if box.path else 16
    notes = box.notes if box.path else textwrap.wrap(box.about, 80)
    name = f'<B><FONT POINT-SIZE="{size}">{_text(box.name)}</FONT></B>'
    lines = (f'{name}<FONT COLOR="{GREY}">  {box.mode}</FONT>', *map(_small, notes))
    return "<" + "".join(f'{line}<BR ALIGN="LEFT"/>' for line in lines) + ">"


def _label(edge: Edge) -> str:
    texts = []
    for text, alarm in edge.labels:
        shown = _text(text)
        texts.append(f'<FONT COLOR="{RED}">{shown}</FONT>' if alarm else shown)
    return f"label=< {' | '.join(texts)} >, " if texts else ""


def _pin(pin: Pin) -> str:
    color = RED if pin.alarm else LINE
    attributes = {
        "id": f"o:{pin.id}",
        "tooltip": pin.outcome,
        "style": "filled",
        "fillcolor": "white",
        "color": color,
        "fontcolor": color,
        "fontsize": "10",
        "height": "0.2",
        "margin": "0.06,0.02",
        "penwidth": "0.9",
    }
    return _shape(pin.id, _text(pin.outcome), pin.notes, attributes)


def _outcome(pin: Pin) -> str:
    color = RED if pin.alarm else INK
    attributes = {
        "id": f"o:{pin.id}",
        "tooltip": f"outcome {pin.outcome}",
        "style": "rounded,filled",
        "peripheries": "2",
        "fillcolor": "white",
        "color": color,
        "fontcolor": color,
    }
    return _shape(pin.id, f"<B>{_text(pin.outcome)}</B>", pin.notes, attributes)


def _shape(name: str, title: str, notes: Sequence[str], attributes: Mapping[str, str]) -> str:
    label = "<BR/>".join((title, *map(_small, notes)))
    return f"{_quoted(name)} [label=<{label}>, {_listed(attributes)}]"


def _small(note: str) -> str:
    return f'<FONT POINT-SIZE="10" COLOR="{GREY}">{_text(note)}</FONT>'


def _listed(attributes: Mapping[str, str]) -> str:
    return ", ".join(f"{name}={_quoted(value)}" for name, value in attributes.items())


def _quoted(text: str) -> str:
    escaped = _printable(text).replace("\\", "\\\\").replace('"', '\\"')
    return f'"{escaped}"'


def _text(text: str) -> str:
    """`text` inside an HTML-like label, where no element may be empty."""
    return html.escape(_printable(text)).replace("\\", "\\\\") or " "


def _printable(text: str) -> str:
    return "".join(c if c.isprintable() else " " for c in text)


FileForm = Literal["svg", "png", "pdf"]
FILE_FORMS: tuple[FileForm, ...] = get_args(FileForm)


class CannotRender(RuntimeError):
    """No Graphviz is here, or it refused; the message says what to do."""


def render(text: str, form: FileForm = "svg") -> bytes:
    """DOT text laid out by Graphviz.

    Raises:
        CannotRender: with neither `pygraphviz` (which brings Graphviz along) nor a `dot` program.
    """
    try:
        import pygraphviz
    except ImportError:
        return _by_program(text, form)
    return bytes(pygraphviz.AGraph(string=text).draw(format=form, prog="dot"))


def _by_program(text: str, form: FileForm) -> bytes:
    import graphviz

    try:
        return bytes(graphviz.Source(text).pipe(form))
    except graphviz.ExecutableNotFound:
        how = "`pip install pygraphviz` (Linux), or install Graphviz so that `dot` is on the PATH"
        hint = f"no Graphviz here: {how}; DOT and Mermaid text need none"
        raise CannotRender(hint) from None
    except graphviz.CalledProcessError as error:
        raise CannotRender(f"dot: {error.stderr.decode(errors='replace').strip()}") from None
