"""A checked chart, bound for running: every name looked up, every value converted.

A machine is a tree of vertices. `use` is expanded: the used chart's nodes stand below the node
that uses it, with data of their own. The vertices also hold what a run writes down about them, so
a machine belongs to one run.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator, Mapping
from operator import attrgetter
from typing import Any, NamedTuple

from engine.chart import AUTONOMY, Chart, Node, Reference
from engine.state import NEVER_NS, Interface, On, State
from engine.types import Type, convert, known_types

IDLE, CHOSEN, RUNNING, ENDED, WAITING, RETRYING, PUT_OFF = range(7)


class Cell:
    """The place of one data key."""

    __slots__ = ("initial", "key", "value")

    def __init__(self, key: str, initial: Any = None) -> None:
        self.key = key
        self.initial = initial
        self.value = initial


class Vertex:
    """What leaves and boxes share.

    `order` is the place in the document and `last` that of the last vertex below; `place` is the
    same with each box behind all that is in it, as actions are stepped; `rank` is the place in the
    order in which monitors are stepped. An outcome either goes to a sibling (`go`) or
    ends the parent (`leave`); in a box that keeps outcomes it may do neither.
    """

    __slots__ = (
        "asked", "autonomy", "deadline", "depth", "entered", "generator", "go", "guard", "last",
        "leave", "mask", "monitor", "name", "opening", "order", "outputs", "parent", "path",
        "pending", "place", "plain", "priority", "put_off", "rank", "retry", "routes", "signature",
        "silence", "status", "step", "timeout_ns", "tries", "waiting", "wake",
    )  # fmt: skip

    def __init__(self, name: str, path: str, parent: Box | None) -> None:
        self.name = name
        self.path = path
        self.parent = parent
        self.depth: int = 0 if parent is None else parent.depth + 1
        self.order = self.last = self.place = self.rank = 0
        self.go: dict[str, Vertex] = {}
        self.leave: dict[str, str] = {}
        self.plain: dict[str, Leaf] = {}
        self.opening: Opening | None = None
        self.routes: dict[str, Any] = {}  # where outcomes lead, once found out
        self.guard = False
        self.monitor = False
        self.priority = 0
        self.timeout_ns: int | None = None
        self.retry: tuple[int, frozenset[str], int] | None = None
        self.autonomy: dict[str, int] = {}
        self.outputs: dict[str, tuple[tuple[Any, Cell], ...]] = {}
        self.signature: tuple[Any, ...] = ()
        # of the run:
        self.status = IDLE
        self.step: Callable[[], Any] = _nothing
        self.wake = 0
        self.mask = 0
        self.asked = -1  # the tick in which it began to wait for what `mask` says
        self.silence: tuple[On, int] | None = None  # waited for, since this instant of the run
        self.entered = -1
        self.deadline = NEVER_NS
        self.tries = 0
        self.put_off = (-1, 0)
        self.pending: tuple[tuple[Cell, Any], ...] = ()
        self.waiting: Any = None
        self.generator: Generator[Any, None, Any] | None = None

    def holds(self, other: Vertex) -> bool:
        """Whether `other` is this vertex or stands below it."""
        return self.order <= other.order <= self.last

    def __repr__(self) -> str:
        return f"<{self.path or '(top)'}>"


def _nothing() -> None:
    return None


class Leaf(Vertex):
    """A state class with its arguments; `make` and `produces` may be a stand-in's."""

    __slots__ = (
        "commands", "context", "inputs", "instant", "interface", "make", "parameters", "produces",
        "reads", "starter",
    )  # fmt: skip

    def __init__(self, name: str, path: str, parent: Box, interface: Interface) -> None:
        super().__init__(name, path, parent)
        self.interface = interface
        self.monitor = interface.monitor
        self.instant = interface.instant
        self.reads = bool(interface.reads)
        self.commands = interface.commands
        self.make: Callable[..., State] = interface.make
        self.produces = interface.outputs
        self.parameters: dict[str, Any] = {}
        self.inputs: tuple[tuple[str, Cell], ...] = ()
        self.context: Any = None
        self.starter: Callable[[], Any] = _nothing


class Box(Vertex):
    """A container. `cells` are the data of the chart that begins here, if one does."""

    __slots__ = (
        "cells", "chart", "children", "form", "inputs", "keeps", "kept", "kinds", "news", "rules",
    )  # fmt: skip

    def __init__(self, name: str, path: str, parent: Box | None, node: Node) -> None:
        super().__init__(name, path, parent)
        self.form = node.form
        self.keeps = node.keeps
        self.children: tuple[Vertex, ...] = ()
        self.rules: tuple[tuple[str, tuple[tuple[Vertex, str], ...]], ...] = ()
        self.chart = ""
        self.cells: dict[str, Cell] = {}
        self.kinds: dict[str, str] = {}  # types of `cells`, as the chart says
        self.inputs: tuple[tuple[Cell, Cell], ...] = ()
        self.kept: dict[Vertex, str] = {}
        self.news = False

    def reset_data(self) -> None:
        """Give the data of the chart that begins here their initial values, and its inputs."""
        for cell in self.cells.values():
            cell.value = cell.initial
        for inner, outer in self.inputs:
            inner.value = outer.value

    def match(self, ended: Mapping[Vertex, str]) -> str | None:
        """The outcome that the first fulfilled rule gives; an error comes first."""
        if "error" in ended.values():
            return "error"
        for outcome, conditions in self.rules:
            if conditions:
                if all(ended.get(child) == wanted for child, wanted in conditions):
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
        types: names of types beyond the built-in ones.
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
        self.bound = False  # to a run
        self.given = dict(parameters or {})
        given = chart_parameters(chart, self.given, self.types)
        self.root = self._box(chart.root, None, "", {}, given, chart)
        self._number(self.root)
        for vertex in self.vertices.values():
            vertex.plain = plain_edges(vertex)
        for rank, leaf in enumerate(monitor_order(self.root)):
            leaf.rank = rank

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
        """A container; `used` is the chart that begins here, `given` its parameters."""
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
        box.rules = tuple(
            (rule.outcome, tuple((named[name], wanted) for name, wanted in rule.conditions.items()))
            for rule in node.rules
        )

    def _number(self, vertex: Vertex) -> None:
        vertices = list(walk(vertex))
        for order, found in enumerate(vertices):
            found.order = found.last = order
        for found in reversed(vertices):
            if isinstance(found, Box) and found.children:
                found.last = found.children[-1].last
        for place, found in enumerate(sorted(vertices, key=lambda v: (v.last, -v.order))):
            found.place = place


def plain_edges(leaf: Vertex) -> dict[str, Leaf]:
    """Edges from an action to the action next to it which nothing can hold up, by outcome."""
    if (
        not isinstance(leaf, Leaf)
        or leaf.monitor
        or leaf.timeout_ns is not None
        or leaf.retry
        or leaf.autonomy
    ):
        return {}
    return {
        outcome: target
        for outcome, target in leaf.go.items()
        if isinstance(target, Leaf)
        and not target.monitor
        and target.timeout_ns is None
        and not target.retry
        and not leaf.interface.outputs.get(outcome)
    }


class Opening(NamedTuple):
    """What starts together when a vertex is chosen; `vertices` are all that take part."""

    leaves: tuple[Leaf, ...]
    monitors: tuple[Vertex, ...]  # by rank
    actions: tuple[Vertex, ...]  # by place
    keeping: tuple[Box, ...]
    trying: tuple[Vertex, ...]  # boxes with `retry`
    vertices: tuple[Vertex, ...]


def open_up(vertex: Vertex) -> Opening:
    """The opening of a vertex, found once."""
    vertices = tuple(_starting(vertex))
    leaves = tuple(v for v in vertices if isinstance(v, Leaf))
    keeping = tuple(v for v in vertices if isinstance(v, Box) and v.keeps)
    monitors = sorted((leaf for leaf in leaves if leaf.monitor), key=attrgetter("rank"))
    actions = [leaf for leaf in leaves if not leaf.monitor]
    turns = sorted((*actions, *keeping), key=attrgetter("place"))
    trying = tuple(v for v in vertices if isinstance(v, Box) and v.retry)
    vertex.opening = Opening(leaves, tuple(monitors), tuple(turns), keeping, trying, vertices)
    return vertex.opening


def _starting(vertex: Vertex) -> Iterator[Vertex]:
    yield vertex
    if isinstance(vertex, Box):
        below = vertex.children[:1] if vertex.form == "states" else vertex.children
        for child in below:
            yield from _starting(child)


def walk(vertex: Vertex) -> Iterator[Vertex]:
    """A vertex and all below it, in document order."""
    yield vertex
    if isinstance(vertex, Box):
        for child in vertex.children:
            yield from walk(child)


def monitor_order(box: Box) -> Iterator[Leaf]:
    """Monitors in the order they are stepped: a box's own ones, then those of its boxes."""
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
