"""The tree that a chart becomes: leaves with their states, boxes around them, cells of data."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import chain
from typing import Any

from engine.chart import Node
from engine.interfaces import Interface


class Cell:
    """One data key of one chart in the machine, of the type called `kind`; runs hold values."""

    __slots__ = ("initial", "key", "kind")

    def __init__(self, key: str, initial: Any = None, kind: str = "any") -> None:
        self.key = key
        self.initial = initial
        self.kind = kind


class Vertex:
    """What leaves and boxes have in common.

    `order` is the index in document order, `last` that of the last vertex below. `turn` is the
    index in stepping order: all monitors (rule 3), then actions and boxes in document order, each
    box after its content. `depth` counts the enclosing boxes.

    An outcome either leads to a sibling (`go`) or ends the parent (`leave`); in a box that keeps
    outcomes it may do neither.
    """

    __slots__ = (
        "autonomy", "breaks", "depth", "go", "guard", "last", "leave", "monitor", "name", "order",
        "outputs", "parent", "path", "priority", "retry", "signature", "timeout_ns", "turn",
    )  # fmt: skip

    def __init__(self, name: str, path: str, parent: Box | None) -> None:
        self.name = name
        self.path = path
        self.parent = parent
        self.depth: int = 0 if parent is None else parent.depth + 1
        self.order = self.last = self.turn = 0
        self.go: dict[str, Vertex] = {}
        self.leave: dict[str, str] = {}
        self.guard = False
        self.monitor = False
        self.priority = 0
        self.breaks = False
        self.timeout_ns: int | None = None
        self.retry: tuple[int, frozenset[str], int] | None = None  # times, outcomes, wait in ns
        self.autonomy: dict[str, int] = {}
        self.outputs: dict[str, tuple[tuple[Any, Cell], ...]] = {}
        self.signature: tuple[Any, ...] = ()  # what a replacement of the chart may not change

    def __repr__(self) -> str:
        return f"<{self.path or '(top)'}>"


class Leaf(Vertex):
    """A state class with its arguments.

    `parameters` and `given` inputs have their values; `bound` parameters and `inputs` get theirs
    at each entry. All by their Python names. `has_in`: whether its node has `in`.
    """

    __slots__ = ("bound", "given", "has_in", "inputs", "interface", "parameters")

    def __init__(self, name: str, path: str, parent: Box, interface: Interface) -> None:
        super().__init__(name, path, parent)
        self.interface = interface
        self.monitor = interface.monitor
        self.parameters: dict[str, Any] = {}
        self.given: dict[str, Any] = {}
        self.bound: tuple[tuple[str, Cell], ...] = ()
        self.inputs: tuple[tuple[str, Cell], ...] = ()
        self.has_in = False


class Box(Vertex):
    """A container. `cells` are the data keys of the chart that begins here, if one does."""

    __slots__ = ("cells", "chart", "children", "form", "inputs", "keeps", "rules")

    def __init__(self, name: str, path: str, parent: Box | None, node: Node) -> None:
        super().__init__(name, path, parent)
        self.form = node.form
        self.keeps = node.keeps
        self.children: tuple[Vertex, ...] = ()
        self.rules = tuple((rule.outcome, dict(rule.conditions)) for rule in node.rules)
        self.chart = ""
        self.cells: dict[str, Cell] = {}
        self.inputs: tuple[tuple[Cell, Cell], ...] = ()  # inner, outer

    @property
    def first(self) -> tuple[Vertex, ...]:
        """The children that start with it: the first one of a sequence, otherwise all."""
        return self.children[:1] if self.form == "states" else self.children

    def match(self, ended: Mapping[str, str]) -> str | None:
        """The outcome of the first rule that holds, else None; a child's `error` has precedence.

        `ended` maps the names of the children that have ended to their outcomes.
        """
        if "error" in ended.values():
            return "error"
        for outcome, conditions in self.rules:
            if conditions:
                if all(ended.get(child) == wanted for child, wanted in conditions.items()):
                    return outcome
            elif len(ended) == len(self.children):
                return outcome
        return None


def _walk(vertex: Vertex) -> Iterator[Vertex]:
    """A vertex and all below it, in document order."""
    yield vertex
    if isinstance(vertex, Box):
        for child in vertex.children:
            yield from _walk(child)


def _monitor_order(box: Box) -> Iterator[Leaf]:
    """Monitors in stepping order: those directly in a box, then those of the boxes inside it."""
    for child in box.children:
        if isinstance(child, Leaf) and child.monitor:
            yield child
    for child in box.children:
        if isinstance(child, Box):
            yield from _monitor_order(child)


def set_order(root: Box) -> None:
    """Set `order`, `last` and `turn` of all vertices."""
    vertices = list(_walk(root))
    for order, vertex in enumerate(vertices):
        vertex.order = vertex.last = order
    for vertex in reversed(vertices):
        if isinstance(vertex, Box) and vertex.children:
            vertex.last = vertex.children[-1].last
    others = (vertex for vertex in vertices if not vertex.monitor)
    actions = sorted(others, key=lambda vertex: (vertex.last, -vertex.order))
    for turn, vertex in enumerate(chain(_monitor_order(root), actions)):
        vertex.turn = turn
