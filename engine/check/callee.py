"""The interface of what a leaf or a `use` node names: a state class or a chart."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace
from pathlib import PurePath
from typing import Any

from engine.chart import Chart, DataKey, Library, Parameter, Reference
from engine.interfaces import Argument, Interface
from engine.machine import NamedValues
from engine.types import ANY, Type


@dataclass(frozen=True, slots=True)
class Facts:
    """Summary of everything that can happen inside a state class or a chart.

    Attributes:
        commands: the parts that are commanded in it.
        unmapped: True if an error of a node that commands a part can leave it.
        instant: the outcomes it can end with in the tick of its entry.
        vertices: the number of vertices that a machine has for it.
        depth: the number of levels of these.
        limits: the parameters whose values have to be in a range in it, with their types there.
        beside: pairs of parts that may be commanded at the same time, where a parameter names one.
    """

    commands: frozenset[str] = frozenset()
    unmapped: bool = False
    instant: frozenset[str] = frozenset()
    vertices: int = 1
    depth: int = 1
    limits: Mapping[str, Type] = field(default_factory=dict)
    beside: frozenset[tuple[str, str]] = frozenset()


@dataclass(slots=True, eq=False)
class Callee:
    """A state class or chart with its parameters, inputs and outputs.

    `outputs` has the types of the outputs by outcome and name. The `facts` of a chart are filled
    in once that chart has been checked. `ending`: the parameters of a class that name outcomes.
    """

    name: str
    outcomes: tuple[str, ...]
    parameters: Mapping[str, Argument]
    inputs: Mapping[str, Argument]
    outputs: Mapping[str, Mapping[str, Type]]
    facts: Facts = field(default_factory=Facts)
    monitor: bool = False
    ending: tuple[str, ...] = ()
    ends: dict[str, tuple[()]] = field(init=False)
    required_parameters: frozenset[str] = field(init=False)
    required_inputs: frozenset[str] = field(init=False)

    def __post_init__(self) -> None:
        self.ends = dict.fromkeys(self.outcomes, ())
        self.required_parameters = _required(self.parameters)
        self.required_inputs = _required(self.inputs)


def _required(arguments: Mapping[str, Argument]) -> frozenset[str]:
    return frozenset(name for name, argument in arguments.items() if argument.required)


@dataclass(slots=True, eq=False)
class KnownNames:
    """Everything that names in charts can refer to; `None`: not known, hence not checked.

    `signals` have their types, `around` says what names in values may stand for.

    `classes` and `charts` are caches; `unread` has the names of files in which no chart was found.
    `strangers` says, by name, what else there is that is no state class, and why.
    """

    library: Library
    interfaces: Mapping[str, Interface]
    types: Mapping[str, Type]
    signals: Mapping[str, Type] | None = None
    parts: Collection[str] | None = None
    around: NamedValues = field(default_factory=NamedValues)
    strangers: Mapping[str, str] = field(default_factory=dict)
    classes: dict[str, Callee] = field(default_factory=dict)
    charts: dict[str, Callee] = field(default_factory=dict)
    unread: frozenset[str] = field(init=False)

    def __post_init__(self) -> None:
        read = {chart.file for chart in self.library.values()}
        self.unread = frozenset(PurePath(f).stem for f in self.library.sources if f not in read)

    def meant(self, value: Any) -> Any:
        """What a value written as `$profile.x` stands for; None if nothing, others themselves."""
        if isinstance(value, Reference) and value.is_constant:
            constant = self.around.constants.get(value.name)
            return None if constant is None else constant.value
        return value

    def state_class(self, name: str) -> Callee | None:
        """The state class of this name."""
        if name not in self.classes and name in self.interfaces:
            self.classes[name] = of_interface(self.interfaces[name])
        return self.classes.get(name)

    def chart(self, name: str) -> Callee | None:
        """The chart of this name."""
        if name not in self.charts and name in self.library:
            self.charts[name] = _of_chart(self.library[name], self.types)
        return self.charts.get(name)


def of_interface(interface: Interface) -> Callee:
    """What a state class, or one with the names that a node gives it, looks like from outside."""
    commands = frozenset(interface.commands)
    instant = frozenset(interface.outcomes if interface.instant else ())
    return Callee(
        interface.name,
        interface.outcomes,
        interface.parameters,
        interface.inputs,
        interface.outputs,
        Facts(commands, bool(commands), instant),
        interface.monitor,
    )


def _of_chart(chart: Chart, types: Mapping[str, Type]) -> Callee:
    parameters = {}
    for name, parameter in chart.parameters.items():
        kind = parameter_type(parameter, types)
        parameters[name] = Argument(kind) if parameter.required else Argument(kind, None)
    inputs = {name: input_of(key, types) for name, key in chart.inputs.items()}
    outputs = {
        outcome: {name: types.get(kind, ANY) for name, kind in named.items()}
        for outcome, named in chart.outputs.items()
    }
    return Callee(chart.name, chart.outcomes, parameters, inputs, outputs)


def input_of(key: DataKey, types: Mapping[str, Type]) -> Argument:
    """An input of a chart as others see it; with `default: none` it may be empty."""
    kind = types.get(key.type, ANY)
    if key.optional:
        return Argument(replace(kind, optional=True), None)
    return Argument(kind, key.initial) if key.has_initial else Argument(kind)


def parameter_type(parameter: Parameter, types: Mapping[str, Type]) -> Type:
    """The type of a chart's parameter; an empty default makes it optional."""
    kind = types.get(parameter.type, ANY)
    if parameter.required or parameter.default is not None:
        return kind
    return replace(kind, optional=True)
