"""A checked chart, bound for running: every name resolved, every value converted.

A machine is a tree of vertices. `use` is expanded: the nodes of the used chart are placed below the
node that uses it, with data of their own. A machine is never changed, so any number of runs can
share it; the run-time state of a vertex is in its `engine.machine.node.RunNode`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import chain
from typing import Any

from engine.chart import AUTONOMY, Chart, Node, Reference
from engine.state import Interface
from engine.types import Type, convert, known_types


class Cell:
    """One data key of one chart in the machine; each run holds a value for it."""

    __slots__ = ("initial", "key")

    def __init__(self, key: str, initial: Any = None) -> None:
        self.key = key
        self.initial = initial


class Vertex:
    """What leaves and boxes have in common.

    `order` is the index in document order, `last` that of the last vertex below. `turn` is the
    index in stepping order: all monitors (rule 3), then actions and boxes in document order, each
    box after its content. `depth` counts the enclosing boxes.

    An outcome either leads to a sibling (`go`) or ends the parent (`leave`); in a box that keeps
    outcomes it may do neither.
    """

    __slots__ = (
        "autonomy", "depth", "go", "guard", "last", "leave", "monitor", "name", "order", "outputs",
        "parent", "path", "priority", "retry", "signature", "timeout_ns", "turn",
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
        self.timeout_ns: int | None = None
        self.retry: tuple[int, frozenset[str], int] | None = None  # times, outcomes, wait in ns
        self.autonomy: dict[str, int] = {}
        self.outputs: dict[str, tuple[tuple[Any, Cell], ...]] = {}
        self.signature: tuple[Any, ...] = ()  # what a replacement of the chart may not change

    def __repr__(self) -> str:
        return f"<{self.path or '(top)'}>"


class Leaf(Vertex):
    """A state class with its arguments."""

    __slots__ = ("inputs", "interface", "parameters")

    def __init__(self, name: str, path: str, parent: Box, interface: Interface) -> None:
        super().__init__(name, path, parent)
        self.interface = interface
        self.monitor = interface.monitor
        self.parameters: dict[str, Any] = {}
        self.inputs: tuple[tuple[str, Cell], ...] = ()


class Box(Vertex):
    """A container. `cells` are the data keys of the chart that begins here, if one does."""

    __slots__ = ("cells", "chart", "children", "form", "inputs", "keeps", "kinds", "rules")

    def __init__(self, name: str, path: str, parent: Box | None, node: Node) -> None:
        super().__init__(name, path, parent)
        self.form = node.form
        self.keeps = node.keeps
        self.children: tuple[Vertex, ...] = ()
        self.rules = tuple((rule.outcome, dict(rule.conditions)) for rule in node.rules)
        self.chart = ""
        self.cells: dict[str, Cell] = {}
        self.kinds: dict[str, str] = {}  # type names of `cells`, as in the chart
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


class Machine:
    """A chart ready to run.

    Args:
        chart: checked, without errors.
        library: the charts it uses, by name.
        interfaces: the state classes it names.
        parameters: values for the chart's own parameters, as in a chart.
        types: types beyond the built-in ones, by name.
    """

    def __init__(
        self,
        chart: Chart,
        library: Mapping[str, Chart],
        interfaces: Mapping[str, Interface],
        parameters: Mapping[str, Any] | None = None,
        types: Mapping[str, Type] | None = None,
    ) -> None:
        self.chart = chart
        self.library = library
        self.interfaces = interfaces
        self.types = known_types(types or {})
        self.vertices: dict[str, Vertex] = {}
        self.given = dict(parameters or {})
        given = chart_parameters(chart, self.given, self.types)
        self.root = self._box(chart.root, None, "", {}, given, chart)
        _number(self.root)

    @property
    def leaves(self) -> list[Leaf]:
        """All leaves, in document order."""
        return [vertex for vertex in self.vertices.values() if isinstance(vertex, Leaf)]

    def _box(
        self,
        node: Node,
        parent: Box | None,
        path: str,
        names: Mapping[str, Cell],
        given: Mapping[str, Any],
        used: Chart | None,
    ) -> Box:
        """Build a container; `used`: the chart that begins here; `given`: parameter values."""
        inner = used.root if used is not None else node
        box = Box(node.name, path, parent, inner)
        self.vertices[path] = box
        if used is not None:
            self._open_scope(box, node, names, used)
            names = box.cells
        elif node.inputs or node.outputs:
            names = {**names, **{inner: names[outer] for inner, outer in node.inputs.items()}}
            names |= {inner: names[outer] for inner, outer in node.outputs.items()}
        children = []
        for child in inner.children:
            below = f"{path}/{child.name}" if path else child.name
            children.append(self._vertex(child, box, below, names, given))
        box.children = tuple(children)
        self._connect(box, inner)
        bindings = (tuple(sorted(node.inputs.items())), tuple(sorted(node.outputs.items())))
        parameters = tuple(sorted(given.items(), key=str))
        box.signature = (box.form, box.keeps, box.chart, parameters, *bindings)
        return box

    def _vertex(
        self,
        node: Node,
        parent: Box,
        path: str,
        names: Mapping[str, Cell],
        given: Mapping[str, Any],
    ) -> Vertex:
        vertex: Vertex
        if node.form in ("do", "watch"):
            vertex = self._leaf(node, parent, path, names, given)
        elif node.form == "use":
            used = self.library[node.target]
            passed = {name: _resolve(value, given) for name, value in node.parameters.items()}
            inner = chart_parameters(used, passed, self.types)
            vertex = self._box(node, parent, path, names, inner, used)
        else:
            vertex = self._box(node, parent, path, names, given, None)
        self._limits(vertex, node, given)
        return vertex

    def _leaf(
        self,
        node: Node,
        parent: Box,
        path: str,
        names: Mapping[str, Cell],
        given: Mapping[str, Any],
    ) -> Leaf:
        interface = self.interfaces[node.target]
        leaf = Leaf(node.name, path, parent, interface)
        self.vertices[path] = leaf
        leaf.guard = leaf.monitor and parent.form in ("any", "all")
        for name, value in node.parameters.items():
            leaf.parameters[name] = convert(_resolve(value, given), interface.parameters[name].type)
        leaf.inputs = tuple((name, names[key]) for name, key in node.inputs.items())
        for outcome, produced in interface.outputs.items():
            leaf.outputs[outcome] = tuple(
                (name, names[node.outputs[name]]) for name in produced if name in node.outputs
            )
        bindings = (tuple(sorted(node.inputs.items())), tuple(sorted(node.outputs.items())))
        parameters = tuple(sorted(leaf.parameters.items(), key=str))
        leaf.signature = (node.form, node.target, parameters, *bindings)
        return leaf

    def _open_scope(self, box: Box, node: Node, outer: Mapping[str, Cell], used: Chart) -> None:
        box.chart = used.name
        for key in used.keys.values():
            kind = self.types.get(key.type)
            initial = convert(key.initial, kind) if key.has_initial and kind else None
            box.cells[key.name] = Cell(key.name, initial)
            box.kinds[key.name] = key.type
        if box.parent is None:
            return
        box.inputs = tuple((box.cells[name], outer[key]) for name, key in node.inputs.items())
        for outcome, produced in used.outputs.items():
            box.outputs[outcome] = tuple(
                (box.cells[name], outer[node.outputs[name]])
                for name in produced
                if name in node.outputs
            )

    def _limits(self, vertex: Vertex, node: Node, given: Mapping[str, Any]) -> None:
        duration = self.types["duration"]
        vertex.priority = node.priority
        vertex.autonomy = {outcome: AUTONOMY[level] for outcome, level in node.autonomy.items()}
        if node.timeout is not None:
            vertex.timeout_ns = to_ns(convert(_resolve(node.timeout, given), duration))
        if node.retry is not None:
            wait = to_ns(convert(_resolve(node.retry.wait, given), duration))
            vertex.retry = (node.retry.times, frozenset(node.retry.on), wait)

    def _connect(self, box: Box, node: Node) -> None:
        named = {child.name: child for child in box.children}
        for child in node.children:
            vertex = named[child.name]
            for outcome, target in child.next.items():
                if target.startswith("."):
                    vertex.leave[outcome] = target[1:]
                else:
                    vertex.go[outcome] = named[target]


def _number(root: Box) -> None:
    """Set `order`, `last` and `turn` of all vertices."""
    vertices = list(walk(root))
    for order, vertex in enumerate(vertices):
        vertex.order = vertex.last = order
    for vertex in reversed(vertices):
        if isinstance(vertex, Box) and vertex.children:
            vertex.last = vertex.children[-1].last
    others = (vertex for vertex in vertices if not vertex.monitor)
    actions = sorted(others, key=lambda vertex: (vertex.last, -vertex.order))
    for turn, vertex in enumerate(chain(monitor_order(root), actions)):
        vertex.turn = turn


def walk(vertex: Vertex) -> Iterator[Vertex]:
    """A vertex and all below it, in document order."""
    yield vertex
    if isinstance(vertex, Box):
        for child in vertex.children:
            yield from walk(child)


def monitor_order(box: Box) -> Iterator[Leaf]:
    """Monitors in stepping order: those directly in a box, then those of the boxes inside it."""
    for child in box.children:
        if isinstance(child, Leaf) and child.monitor:
            yield child
    for child in box.children:
        if isinstance(child, Box):
            yield from monitor_order(child)


def chart_parameters(
    chart: Chart, given: Mapping[str, Any], types: Mapping[str, Type]
) -> dict[str, Any]:
    """The parameters of a chart, converted, with defaults where none is given."""
    found = {}
    for name, parameter in chart.parameters.items():
        value = given.get(name, parameter.default)
        found[name] = None if value is None else convert(value, types[parameter.type])
    return found


def to_ns(seconds: float) -> int:
    """Seconds as whole nanoseconds."""
    return round(seconds * 1e9)


def _resolve(value: Any, given: Mapping[str, Any]) -> Any:
    if isinstance(value, Reference):
        return given[value.name]
    if isinstance(value, list):
        return [_resolve(item, given) for item in value]
    return value
