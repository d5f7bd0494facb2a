"""Charts as Mermaid text, which many web pages draw by themselves.

A flowchart, not a state diagram: state diagrams cannot have edges that end at a box inside
something parallel.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping

from engine.chart import Chart
from engine.draw.picture import BoxShape, Edge, LeafShape, Picture, Pin, picture

_CLASSES = """\
  classDef do fill:#eaf5ea,stroke:#2e7d32,color:#1f2933
  classDef watch fill:#fff6e0,stroke:#c77700,color:#1f2933,stroke-dasharray:5 3
  classDef use fill:#e8f1fb,stroke:#1f5fa8,color:#1f2933
  classDef pin fill:#ffffff,stroke:#52606d,color:#52606d
  classDef outcome fill:#ffffff,stroke:#1f2933,color:#1f2933,stroke-width:3px
  classDef alarm stroke:#c62828,color:#c62828
  classDef start fill:#1f2933,stroke:#1f2933
  classDef sequence fill:#f6f8fa,stroke:#9aa5b1
  classDef parallel fill:#f6f8fa,stroke:#9aa5b1,stroke-dasharray:5 3"""


def mermaid(chart: Chart, library: Mapping[str, Chart], depth: int | None = 0) -> str:
    """`chart` as a Mermaid flowchart; arguments as for `engine.draw.dot.dot`."""
    return "\n".join(_Writer(picture(chart, library, depth)).lines()) + "\n"


class _Writer:
    def __init__(self, shown: Picture) -> None:
        self.shown = shown
        self.names: dict[str, str] = {}  # Mermaid stumbles over words of its own, such as `end`

    def lines(self) -> Iterator[str]:
        yield "flowchart TB"
        yield _CLASSES
        for line in self.box(self.shown.root):
            yield f"  {line}"
        arrows = list(itertools.chain(self.beginnings(), map(self.edge, self.shown.edges)))
        yield from arrows
        first = len(arrows) - len(self.shown.edges)
        red = [str(n) for n, edge in enumerate(self.shown.edges, first) if edge.alarm]
        if red:
            yield f"  linkStyle {','.join(red)} stroke:#c62828"

    def name(self, shape: str) -> str:
        return self.names.setdefault(shape, f"n{len(self.names)}")

    def box(self, box: BoxShape) -> Iterator[str]:
        name = self.name(f"{box.path}/")
        title = "<br/>".join((f"<b>{_text(box.name)}</b> {box.mode}", *map(_text, box.notes)))
        yield f'subgraph {name}["{title}"]'
        if box.start:
            yield f'  {self.name(box.start)}((" ")):::start'
        for member in box.members:
            inside = self.box(member) if isinstance(member, BoxShape) else iter([self.leaf(member)])
            for line in inside:
                yield f"  {line}"
        for pin in box.pins:
            for line in self.pin(pin):
                yield f"  {line}"
        yield "end"
        yield f"class {name} {'sequence' if box.mode == 'states' else 'parallel'}"

    def leaf(self, leaf: LeafShape) -> str:
        lines = (f"<b>{_text(leaf.name)}</b>", *(f"<small>{_text(n)}</small>" for n in leaf.notes))
        return f'{self.name(leaf.id)}("{"<br/>".join(lines)}"):::{leaf.kind}'

    def pin(self, pin: Pin) -> Iterator[str]:
        lines = (_text(pin.outcome), *(f"<small>{_text(n)}</small>" for n in pin.notes))
        name, shown = self.name(pin.id), "<br/>".join(lines)
        yield f'{name}["{shown}"]:::pin' if pin.path else f'{name}(["{shown}"]):::outcome'
        if pin.alarm:
            yield f"class {name} alarm"

    def beginnings(self) -> Iterator[str]:
        for box in self.shown.root.boxes():
            if box.start:
                yield f"  {self.name(box.start)} --> {self.end(box.members[0].path)}"

    def edge(self, edge: Edge) -> str:
        line = "-->" if edge.arrow else "---"
        label = " #124; ".join(_text(label.text) for label in edge.labels)
        shown = f'|"{label}"|' if label else ""
        return f"  {self.name(edge.tail)} {line}{shown} {self.end(edge.head)}"

    def end(self, shape: str) -> str:
        return self.names.get(f"{shape}/") or self.name(shape)


def _text(text: str) -> str:
    """`text` with everything that Mermaid or HTML would read as a sign of its own encoded."""
    return "".join(c if c.isalnum() or c in " _.,:/" else f"#{ord(c)};" for c in text) or " "
