"""A checked chart, bound for running: every name resolved, every value converted.

A machine is a tree of vertices. `use` is expanded: the nodes of the used chart are placed below the
node that uses it, with data of their own. A machine is never changed, so any number of runs can
share it; the run-time state of a vertex is in its `engine.machine.node.RunNode`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

from engine.chart import AUTONOMY, Chart, DataKey, Node, Parameter, mark_of, start_value
from engine.files import did_you_mean
from engine.files.declared import Mismatch
from engine.interfaces import Interface, bindings, python_name, resolved
from engine.literals import ConstantMismatch, Resolver, WithinLiteral, convert
from engine.machine.named_values import NamedValues, ParameterValues
from engine.machine.vertices import Box, Cell, Leaf, Vertex, set_order
from engine.types import ANY, TIMEOUT, TIMES, WAIT, Type, known_types


class Machine:
    """A chart ready to run.

    Args:
        chart: checked, without errors.
        library: the charts it uses, by name.
        interfaces: the state classes it names.
        parameters: values for the chart's own parameters, as in a chart.
        types: types beyond the built-in ones, by name.
        inputs: values for the chart's own inputs, as in a chart or as Python has them.
        around: what names in values stand for.

    Attributes:
        missing: the inputs of the chart without a value; it cannot run before they have one.

    Raises:
        Mismatch: a value of `parameters` or `inputs` is of another type, or of no such name.
    """

    def __init__(
        self,
        chart: Chart,
        library: Mapping[str, Chart],
        interfaces: Mapping[str, Interface],
        parameters: Mapping[str, Any] | None = None,
        types: Mapping[str, Type] | None = None,
        *,
        inputs: Mapping[str, Any] | None = None,
        around: NamedValues | None = None,
    ) -> None:
        self.chart = chart
        self.library = library
        self.interfaces = interfaces
        self._own_types = types or {}
        self.types = known_types(self._own_types)
        self.around = around or NamedValues()
        self.vertices: dict[str, Vertex] = {}
        self.given = dict(parameters or {})
        self.inputs = dict(inputs or {})
        _require_known("parameter", self.given, chart.parameters)
        _require_known("input", self.inputs, chart.inputs)
        self.missing = [
            name
            for name, key in chart.inputs.items()
            if not (name in self.inputs or key.has_initial or self._may_be_empty(key))
        ]
        given = self._parameters(chart, self.given, ParameterValues({}, self.around))
        self.root = self._box(chart.root, None, "", {}, given, chart)
        set_order(self.root)

    def changed(self, chart: Chart, library: Mapping[str, Chart]) -> Machine:
        """Another version of the chart, given all that this one was given and it still declares.

        Raises:
            Mismatch: what this one was given is of another type there.
        """
        given = {name: value for name, value in self.given.items() if name in chart.parameters}
        inputs = {name: value for name, value in self.inputs.items() if name in chart.inputs}
        types = self._own_types
        return Machine(
            chart, library, self.interfaces, given, types, inputs=inputs, around=self.around
        )

    def _may_be_empty(self, key: DataKey) -> bool:
        return key.optional or self.types.get(key.type, ANY).optional

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
        given: ParameterValues,
        used: Chart | None,
        outer: ParameterValues | None = None,
    ) -> Box:
        """Build a container.

        `used`: the chart that begins here; `given`: the values of the parameters inside it, `outer`
        those around it.
        """
        inner = used.root if used is not None else node
        box = Box(node.name, path, parent, inner)
        self.vertices[path] = box
        if used is not None:
            self._open_scope(box, node, names, used, outer)
            names = box.cells
        elif node.inputs or node.outputs:
            names = {**names, **{inner: names[outer] for inner, outer in node.reads.items()}}
            names |= {inner: names[outer] for inner, outer in node.outputs.items()}
        children = []
        for child in inner.children:
            below = f"{path}/{child.name}" if path else child.name
            children.append(self._vertex(child, box, below, names, given))
        box.children = tuple(children)
        self._connect(box, inner)
        parameters = tuple(sorted(given.known.items(), key=str))
        values = {name: box.cells[name].initial for name in node.given}
        box.signature = (box.form, box.keeps, box.chart, parameters, *_bindings(node, values))
        return box

    def _vertex(
        self,
        node: Node,
        parent: Box,
        path: str,
        names: Mapping[str, Cell],
        given: ParameterValues,
    ) -> Vertex:
        vertex: Vertex
        if node.form in ("do", "watch"):
            vertex = self._leaf(node, parent, path, names, given)
        elif node.form == "use":
            used = self.library[node.target]
            inner = self._parameters(used, node.parameters, given)
            vertex = self._box(node, parent, path, names, inner, used, given)
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
        given: ParameterValues,
    ) -> Leaf:
        interface = self._interface(node, names, given)
        leaf = Leaf(node.name, path, parent, interface)
        self.vertices[path] = leaf
        leaf.guard = leaf.monitor and parent.form in ("any", "all")
        for name, value in node.parameters.items():
            wanted = interface.parameters[name].type
            leaf.parameters[python_name(name)] = _converted(f"{path}: {name}", value, wanted, given)
        if node.inputs:
            _read(leaf, node, names, given)
        for outcome, produced in interface.outputs.items():
            leaf.outputs[outcome] = tuple(
                (name, names[node.outputs[name]]) for name in produced if name in node.outputs
            )
        parameters = tuple(sorted(leaf.parameters.items(), key=str))
        leaf.signature = (node.form, node.target, parameters, *_bindings(node, leaf.given))
        return leaf

    def _interface(
        self, node: Node, names: Mapping[str, Cell], given: ParameterValues
    ) -> Interface:
        """The interface of the class that a node names, with what its parameters name."""
        of = self.interfaces[node.target]
        if not of.is_open:
            return of
        named = {
            name: convert(node.parameters[name], of.parameters[name].type, given)
            for name in of.named_by & node.parameters.keys()
        }
        signals = {
            name: self.around.signals.get(signal, ANY)
            for name, signal in named.items()
            if of.parameters[name].type.name == "signal"
        }
        read = {name: self.types.get(names[key].kind, ANY) for name, key in node.reads.items()}
        return resolved(of, named, bindings(of, signals, read))

    def _open_scope(
        self,
        box: Box,
        node: Node,
        outer: Mapping[str, Cell],
        used: Chart,
        by: ParameterValues | None,
    ) -> None:
        """Make the cells of a chart; inputs that are given a value start with it."""
        given = node.given
        if by is None:
            given = {name: start_value(value) for name, value in self.inputs.items()}
        own = ParameterValues({}, self.around)
        box.chart = used.name
        for key in used.keys.values():
            kind = self.types.get(key.type, ANY)
            initial = None
            if key.name in given:
                wanted = replace(kind, optional=kind.optional or key.optional)
                initial = _converted(key.name, given[key.name], wanted, by or own)
            elif key.initial is not None:
                initial = _converted(key.name, key.initial, kind, own)
            box.cells[key.name] = Cell(key.name, initial, key.type)
        if box.parent is None:
            return
        box.inputs = tuple((box.cells[name], outer[key]) for name, key in node.reads.items())
        for outcome, produced in used.outputs.items():
            box.outputs[outcome] = tuple(
                (box.cells[name], outer[node.outputs[name]])
                for name in produced
                if name in node.outputs
            )

    def _parameters(
        self, chart: Chart, passed: Mapping[str, Any], outer: ParameterValues
    ) -> ParameterValues:
        """The parameters of a chart; those not `passed`, whose values `outer` knows, by default."""
        found = {}
        for name, parameter in chart.parameters.items():
            value = passed.get(name, parameter.default)
            by = outer if name in passed else ParameterValues({}, self.around)
            found[name] = None if value is None else self._parameter(parameter, value, by)
        return ParameterValues(found, self.around)

    def _parameter(self, parameter: Parameter, value: Any, by: ParameterValues) -> Any:
        wanted = replace(self.types[parameter.type], optional=True)
        return _converted(parameter.name, value, wanted, by)

    def _limits(self, vertex: Vertex, node: Node, given: ParameterValues) -> None:
        path = vertex.path
        vertex.priority, vertex.breaks = node.priority, node.breaks
        vertex.autonomy = {outcome: AUTONOMY[level] for outcome, level in node.autonomy.items()}
        if node.timeout is not None:
            with self._at(vertex, node, "timeout"):
                vertex.timeout_ns = to_ns(
                    _converted(f"{path}: timeout", node.timeout, TIMEOUT, given)
                )
        if node.retry is not None:
            with self._at(vertex, node, "retry"):
                wait = to_ns(_converted(f"{path}: wait", node.retry.wait, WAIT, given))
                times = _converted(f"{path}: times", node.retry.times, TIMES, given)
            vertex.retry = (times, frozenset(node.retry.on), wait)

    @contextmanager
    def _at(self, vertex: Vertex, node: Node, key: str) -> Iterator[None]:
        """Say of a wrong value where it is written: no finding of the chart has told it."""
        try:
            yield
        except ConstantMismatch:
            raise
        except Mismatch as mismatch:
            box = vertex.parent
            while box is not None and not box.chart:
                box = box.parent
            chart = self.chart if box is None else self.library.get(box.chart, self.chart)
            at = mark_of(node.raw, key) if key in node.raw else node.at
            raise Mismatch(f"{chart.place(at)}: {mismatch}") from None

    def _connect(self, box: Box, node: Node) -> None:
        named = {child.name: child for child in box.children}
        for child in node.children:
            vertex = named[child.name]
            for outcome, target in child.next.items():
                if target.startswith("."):
                    vertex.leave[outcome] = target[1:]
                else:
                    vertex.go[outcome] = named[target]


def _read(leaf: Leaf, node: Node, names: Mapping[str, Cell], given: ParameterValues) -> None:
    """Set what a leaf is given by `in`: values now, data keys to be read at each entry."""
    interface = leaf.interface
    leaf.has_in = True
    for name, value in node.given.items():
        wanted = (interface.inputs.get(name) or interface.parameters[name]).type
        held = leaf.given if name in interface.inputs else leaf.parameters
        held[python_name(name)] = _converted(f"{leaf.path}: {name}", value, wanted, given)
    read = [(name, python_name(name), names[key]) for name, key in node.reads.items()]
    leaf.inputs = tuple((called, c) for name, called, c in read if name in interface.inputs)
    leaf.bound = tuple((called, c) for name, called, c in read if name not in interface.inputs)


def shared_part(machine: Machine) -> str:
    """Which nodes that run side by side command one part, as a sentence; empty if none do.

    Charts are checked for it with what they say; parameters may name other parts in a run.
    """
    told: list[str] = []
    _commanded(machine.root, told)
    return told[0] if told else ""


def _commanded(vertex: Vertex, told: list[str]) -> frozenset[str]:
    """The parts that a vertex commands."""
    if isinstance(vertex, Leaf):
        return frozenset(vertex.interface.commands)
    owners: dict[str, Vertex] = {}
    assert isinstance(vertex, Box)
    for child in vertex.children:
        for part in sorted(_commanded(child, told)):
            other = owners.setdefault(part, child)
            if other is not child and vertex.form != "states":
                both = f"{other.path!r} and {child.path!r} both command {part!r}"
                told.append(f"{both} at the same time; put them one after the other")
    return frozenset(owners)


def to_ns(seconds: float) -> int:
    """Seconds as whole nanoseconds."""
    return round(seconds * 1e9)


def _bindings(node: Node, given: Mapping[str, Any]) -> tuple[Any, ...]:
    """What a node reads, is given and writes, as far as a replacement may not change it."""
    if not (node.inputs or node.outputs):
        return (), (), ()
    values = tuple(sorted(given.items(), key=str))
    return tuple(sorted(node.reads.items())), values, tuple(sorted(node.outputs.items()))


def _converted(name: str, value: Any, wanted: Type, by: Resolver) -> Any:
    try:
        return convert(value, wanted, by)
    except ConstantMismatch:
        raise
    except Mismatch as mismatch:
        path = mismatch.path if isinstance(mismatch, WithinLiteral) else ""
        raise Mismatch(f"{name}{path}: {mismatch}") from None


def _require_known(what: str, given: Mapping[str, Any], known: Mapping[str, Any]) -> None:
    for name in given.keys() - known.keys():
        hint = did_you_mean(name, known) if known else f"it has no {what}s"
        raise Mismatch(f"it has no {what} {name!r}; {hint}")
