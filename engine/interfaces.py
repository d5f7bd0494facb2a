"""What the engine knows about a state class: its interface, and that of a node that names it.

Names of signals, parts, outcomes and outputs that begin with `$` stand for the value of the
parameter of that name. `interface` reads a class once; `resolved` puts a node's values in.
"""

from __future__ import annotations

import inspect
import keyword
import typing
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import cache
from typing import Any, Literal

from engine.files.declared import is_name
from engine.state import LONGEST_S, Action, Monitor, State
from engine.state_class import RESERVED_OUTCOMES, StateError, require_declarations
from engine.types import Type, bind, from_annotation, substituted

What = Literal["signal", "part"]
_REQUIRED: Any = inspect.Parameter.empty


@dataclass(frozen=True, slots=True)
class Argument:
    """A parameter or input: its type, and its default if it need not be given."""

    type: Type
    default: Any = _REQUIRED

    @property
    def required(self) -> bool:
        """Whether a chart must give it."""
        return self.default is _REQUIRED


class NoOutcome(ValueError):
    """A value that cannot name an outcome."""

    def __init__(self, message: str, outcome: str) -> None:
        super().__init__(message)
        self.outcome = outcome


@dataclass(frozen=True, slots=True)
class Interface:
    """What the engine needs to know about a state class.

    Attributes:
        optional: those of `reads` that nothing has to give.
        named_by: the parameters that name outcomes, signals or parts, known before a run.
        faults: see `State.faults`.
        stands_for: see `State.stands_for`.
        is_open: whether names or types in it depend on the node that names the class.
    """

    name: str
    monitor: bool
    outcomes: tuple[str, ...]
    parameters: Mapping[str, Argument]
    inputs: Mapping[str, Argument]
    outputs: Mapping[str, Mapping[str, Type]]
    reads: Mapping[str, Any]
    commands: tuple[str, ...]
    instant: bool
    about: str
    make: Callable[..., State] = field(compare=False)
    named_by: frozenset[str] = field(init=False, compare=False)
    is_open: bool = field(init=False, compare=False)
    optional: tuple[str, ...] = ()
    faults: Callable[..., Iterable[tuple[str, str]]] = field(default=State.faults, compare=False)
    stands_for: Callable[[str, What], tuple[str, ...]] = field(
        default=State.stands_for, compare=False
    )

    @property
    def needed(self) -> tuple[str, ...]:
        """The signals without which it cannot run."""
        return tuple(name for name in self.reads if name not in self.optional)

    def __post_init__(self) -> None:
        ages = [age for age in self.reads.values() if isinstance(age, str)]
        names = (*self.outcomes, *self.outputs, *self.reads, *self.commands, *ages)
        arguments = (*self.parameters.values(), *self.inputs.values())
        named_by = frozenset(name[1:] for name in names if name[:1] == "$")
        is_open = bool(named_by) or any(_has_variable(a.type) for a in arguments)
        object.__setattr__(self, "named_by", named_by)
        object.__setattr__(self, "is_open", is_open)


@cache
def interface(cls: type[State]) -> Interface:
    """The interface of a state class, from its attributes, docstring and annotations.

    Raises:
        StateError: for a class without docstring, outcomes or usable annotations.
    """
    name = cls.__name__
    if not issubclass(cls, Action | Monitor):
        raise StateError(f"{name}: derive from Action or Monitor")
    require_declarations(cls)
    monitor = issubclass(cls, Monitor)
    if monitor and cls.commands:
        raise StateError(f"{name}: a Monitor commands no part, but lists {cls.commands!r}")
    outputs = {
        outcome: {key: _type(f"{name}.outputs: {key!r}", kind) for key, kind in named.items()}
        for outcome, named in cls.outputs.items()
    }
    has_init = cls.__init__ is not object.__init__
    found = Interface(
        name=name,
        monitor=monitor,
        outcomes=tuple(map(str.__str__, cls.outcomes)),
        parameters=_arguments(cls, cls.__init__, skip=1) if has_init else {},
        inputs=_inputs(cls),
        outputs=outputs,
        reads=dict(cls.reads),
        optional=tuple(cls.optional),
        commands=tuple(cls.commands),
        instant=not inspect.isgeneratorfunction(cls.run),
        about=inspect.cleandoc(cls.__doc__ or ""),
        make=cls,
        faults=cls.faults,
        stands_for=cls.stands_for,
    )
    _require_ages(cls)
    if unknown := sorted(found.named_by - found.parameters.keys()):
        raise StateError(f"{name}: '${unknown[0]}' stands for no parameter of __init__")
    for signal in (key[1:] for key in found.reads if key[0] == "$"):
        kind = found.parameters[signal].type
        if cls.stands_for.__func__ is not State.stands_for.__func__:  # type: ignore[attr-defined]
            continue
        if "signal" not in (kind.name, "" if kind.item is None else kind.item.name):
            raise StateError(f"{name}.reads: annotate {signal!r} as a signal, like `Key[float]`")
    return found


def resolved(
    of: Interface, given: Mapping[str, Any], types: Mapping[str, Type] | None = None
) -> Interface:
    """The interface of a node.

    Args:
        of: the interface of the class it names.
        given: values of the parameters that name something, converted; one that is missing has its
            default. A name that is not known yet may begin with `$`.
        types: what the type variables stand for, see `bindings`.

    Raises:
        NoOutcome: a value is no name of an outcome.
    """
    values = {name: given.get(name, of.parameters[name].default) for name in of.named_by}
    bound = types or {}

    def meant(template: str, what: What) -> tuple[str, ...]:
        """Signals or parts: what a parameter gives may stand for other names."""
        given = _names(template, values)
        if template[0] != "$" or given == (template,):
            return given
        return tuple(name for value in given for name in of.stands_for(value, what))

    outcomes = tuple(name for template in of.outcomes for name in _names(template, values))
    _require_outcomes(outcomes)
    ages = {key: values[age[1:]] if isinstance(age, str) else age for key, age in of.reads.items()}
    return replace(
        of,
        outcomes=outcomes,
        parameters=_substituted(of.parameters, bound),
        inputs=_substituted(of.inputs, bound),
        outputs={
            outcome: {key: substituted(kind, bound) for key, kind in produced.items()}
            for template, produced in of.outputs.items()
            for outcome in _names(template, values)
        },
        reads={name: age for key, age in ages.items() for name in meant(key, "signal")},
        optional=tuple(name for key in of.optional for name in meant(key, "signal")),
        commands=tuple(dict.fromkeys(name for key in of.commands for name in meant(key, "part"))),
    )


def bindings(
    of: Interface, signals: Mapping[str, Type], inputs: Mapping[str, Type]
) -> dict[str, Type]:
    """What the type variables of an interface stand for.

    `signals`: types of the signals that its parameters name, by parameter; `inputs`: types of what
    its inputs, or parameters, are read from. The widest counts, or the first of unlike ones.
    """
    bound: dict[str, Type] = {}
    for name, kind in signals.items():
        held = replace(kind, optional=False)  # a signal without a value is not heard of
        bind(of.parameters[name].type, Type("signal", item=held), bound)
    arguments = {**of.parameters, **of.inputs}
    for name, kind in inputs.items():
        bind(arguments[name].type, kind, bound)
    return bound


def python_name(name: str) -> str:
    """The Python name of an argument: charts write `for`, Python `for_`."""
    return f"{name}_" if keyword.iskeyword(name) else name


def _names(template: str, values: Mapping[str, Any]) -> tuple[str, ...]:
    """The names that a template stands for; a template of a name that is not known is itself."""
    if template[0] != "$":
        return (template,)
    value = values.get(template[1:], template)
    if value is None:
        return ()
    return (value,) if isinstance(value, str) else tuple(value)


def _require_outcomes(outcomes: tuple[str, ...]) -> None:
    for name in outcomes:
        if name[:1] != "$" and not is_name(str(name)):
            message = f"{name!r} cannot be an outcome; letters, digits and _ are allowed"
            raise NoOutcome(message, name)
        if name in RESERVED_OUTCOMES:
            raise NoOutcome(f"{name!r} is a reserved outcome; take another name", name)
        if outcomes.count(name) > 1:
            raise NoOutcome(f"the outcome {name!r} is there already; keep one of them", name)


def _substituted(
    arguments: Mapping[str, Argument], bound: Mapping[str, Type]
) -> dict[str, Argument]:
    return {n: Argument(substituted(a.type, bound), a.default) for n, a in arguments.items()}


def _has_variable(kind: Type) -> bool:
    return bool(kind.variable) or (kind.item is not None and _has_variable(kind.item))


def _require_ages(cls: type[State]) -> None:
    for signal, age in cls.reads.items():
        number = isinstance(age, int | float) and not isinstance(age, bool)
        named = isinstance(age, str) and age[:1] == "$"
        if not (age is None or named or (number and 0.0 <= float(age) < LONGEST_S)):
            wanted = "the greatest age accepted, s, or None for any"
            raise StateError(f"{cls.__name__}.reads[{signal!r}]: {wanted}; not {age!r}")


def _inputs(cls: type[State]) -> dict[str, Argument]:
    arguments = inspect.signature(cls.run).parameters.values()
    if not cls.inputs and all(a.kind is not a.VAR_KEYWORD for a in arguments):
        return _arguments(cls, cls.run, skip=2)
    of = cls.__name__
    return {n: Argument(_type(f"{of}.inputs: {n!r}", kind)) for n, kind in cls.inputs.items()}


def _arguments(cls: type[State], function: Callable[..., Any], skip: int) -> dict[str, Argument]:
    hints = typing.get_type_hints(function, include_extras=True)
    found = {}
    for parameter in list(inspect.signature(function).parameters.values())[skip:]:
        if parameter.kind not in (parameter.POSITIONAL_OR_KEYWORD, parameter.KEYWORD_ONLY):
            raise StateError(f"{cls.__name__}: argument {parameter} cannot be given by name")
        if parameter.name not in hints:
            wanted = f"annotate {parameter.name!r} with its type, like `{parameter.name}: float`"
            raise StateError(f"{cls.__name__}: {wanted}")
        kind = _type(f"{cls.__name__}: {parameter.name!r}", hints[parameter.name])
        bare = parameter.name.removesuffix("_")
        name = bare if keyword.iskeyword(bare) else parameter.name
        found[name] = Argument(kind, parameter.default)
    return found


def _type(what: str, annotation: Any) -> Type:
    try:
        return from_annotation(annotation)
    except TypeError as error:
        raise StateError(f"{what}: {error}") from None
