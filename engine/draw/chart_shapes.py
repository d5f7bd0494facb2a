"""What a picture of a chart consists of, before anything is laid out.

A sequence (`states`) is a box: its children are inside, and edges lead from one to the next. Each
way out of a shape is a pin on its border. A container whose children run in parallel is a table,
one row per child; a row says in words which outcome of the container it brings about. A parallel
container that holds a sequence is a box with its other children as rows at its head.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import NamedTuple

from engine.draw.style import Cause

Declared = tuple[tuple[str, tuple[str, ...]], ...]
"""What a chart declares: headings, and the items under each."""


class OutcomeLabel(NamedTuple):
    """An outcome as written at an edge or in a row; `taken`: how often, None if not counted."""

    text: str
    cause: Cause = ""
    taken: int | None = None

    @property
    def shown(self) -> str:
        """The text, and how often it was taken."""
        return self.text if self.taken is None else f"{self.text} ×{self.taken}"


class Ending(NamedTuple):
    """Outcomes of a row that end its container with `outcome`."""

    labels: tuple[OutcomeLabel, ...]
    outcome: str


@dataclass(frozen=True, slots=True)
class Pin:
    """Outcomes of the shape at `path` that lead to the same place; `notes` say when they occur.

    `back`: that place is the shape itself, or a sibling before it.
    """

    path: str
    outcomes: tuple[str, ...]
    labels: tuple[OutcomeLabel, ...]
    notes: tuple[str, ...] = ()
    back: bool = False

    @property
    def id(self) -> str:
        """The id that edges from and to this pin refer to."""
        return f"{self.path}:{'|'.join(self.outcomes)}"

    @property
    def cause(self) -> Cause:
        """The cause that all of its outcomes share, else ""."""
        return common(label.cause for label in self.labels)

    @property
    def taken(self) -> int | None:
        """How often its outcomes were taken; None if they are not counted."""
        counts = [label.taken for label in self.labels if label.taken is not None]
        return sum(counts) if counts else None


@dataclass(frozen=True, slots=True)
class LeafShape:
    """A node drawn as one shape: `kind` is `do`, `watch` or `use`, `target` what it names.

    Of the ways out, `endings` are those of a row, `pins` those of any other shape.
    """

    path: str
    name: str
    kind: str
    target: str
    notes: tuple[str, ...]
    about: str
    endings: tuple[Ending, ...] = ()
    pins: tuple[Pin, ...] = ()


@dataclass(frozen=True, slots=True)
class TableShape:
    """A parallel container without a sequence in it.

    `rules` say when the children's outcomes together end it.
    """

    path: str
    name: str
    mode: str
    notes: tuple[str, ...]
    about: str
    rows: tuple[LeafShape | TableShape, ...]
    rules: tuple[str, ...] = ()
    endings: tuple[Ending, ...] = ()
    pins: tuple[Pin, ...] = ()


@dataclass(frozen=True, slots=True)
class BoxShape:
    """A container drawn as a frame. The root's pins are the outcomes of the chart."""

    path: str
    name: str
    mode: str
    notes: tuple[str, ...]
    about: str
    rows: tuple[LeafShape | TableShape, ...]
    members: tuple[LeafShape | TableShape | BoxShape, ...]
    pins: tuple[Pin, ...]

    @property
    def start(self) -> str:
        """The id of the start dot of a sequence; "" if all members start at once."""
        return f"{self.path}:" if self.mode == "states" and self.members else ""

    @property
    def entry(self) -> str:
        """The id of the shape inside at which edges to the box end."""
        return self.start or next((entry_of(member) for member in self.members), self.exit)

    @property
    def exit(self) -> str:
        """The id of a pin on the lower border, "" without pins."""
        return self.pins[len(self.pins) // 2].id if self.pins else ""

    def boxes(self) -> Iterator[BoxShape]:
        """This box and all inside it, outer first."""
        yield self
        for member in self.members:
            if isinstance(member, BoxShape):
                yield from member.boxes()


Shape = LeafShape | TableShape | BoxShape


@dataclass(frozen=True, slots=True)
class Edge:
    """The edge from a pin to `head`, the path of a node or the id of a pin of the enclosing box.

    `within` is the path of the box that holds both ends. An edge to a pin inside the picture is
    only half of the route and has no arrow.
    """

    pin: Pin
    head: str
    within: str
    arrow: bool


@dataclass(frozen=True, slots=True)
class Picture:
    """A chart as shapes and edges.

    `declared`: parameters, inputs and data of the chart, by heading. `passed_on` maps a row's path
    and outcome to those of the container that it ends. `counted`: outcomes say how often each
    was taken.
    """

    root: BoxShape
    declared: Declared
    edges: tuple[Edge, ...]
    passed_on: Mapping[tuple[str, str], tuple[str, str]]
    counted: bool = False

    def route(self, path: str, outcome: str) -> Iterator[Edge]:
        """The edges that an outcome of the node at `path` follows, through pins to the end."""
        while (path, outcome) in self.passed_on:
            path, outcome = self.passed_on[path, outcome]
        leads = {edge.pin.id: edge for edge in self.edges}
        starts = (e for e in self.edges if e.pin.path == path and outcome in e.pin.outcomes)
        edge = next(starts, None)
        while edge is not None:
            yield edge
            edge = leads.get(edge.head) if ":" in edge.head else None


def common(causes: Iterable[Cause]) -> Cause:
    """The cause that all share, else ""."""
    found = set(causes)
    return found.pop() if len(found) == 1 else ""


def entry_of(shape: Shape) -> str:
    """The id of the shape at which edges to `shape` end: itself, or one inside of a box."""
    return shape.entry if isinstance(shape, BoxShape) else shape.path
