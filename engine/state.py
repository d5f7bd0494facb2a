"""What a chart names: actions that command the robot, monitors that only watch.

A state is one generator method. `yield` means "still busy, step me next tick"; `return` gives the
outcome; `finally` stops what was started. A new instance is made for each entry.

    class PersonNear(Monitor):
        \"\"\"`seen` once somebody is within `distance`.\"\"\"
        outcomes = ("seen",)
        reads = {"user.distance": 0.2}

        def __init__(self, distance: Length) -> None:
            self.distance = distance

        def run(self, ctx: Context) -> Run:
            while not within(ctx.value("user.distance"), self.distance):
                yield On("user.distance")
            return "seen"

Parameters are the annotated arguments of `__init__`, inputs those of `run`; neither is declared
again elsewhere.
"""

from __future__ import annotations

import inspect
import typing
from collections.abc import Callable, Generator, Mapping
from dataclasses import dataclass, field
from functools import cache
from typing import TYPE_CHECKING, Any, ClassVar, Generic, NamedTuple, Protocol, cast, overload

from engine.state_class import StateError, require_declarations
from engine.types import Type, from_annotation

if TYPE_CHECKING:
    from typing_extensions import TypeVar

    V = TypeVar("V", default=Any, covariant=True)
else:
    V = typing.TypeVar("V", covariant=True)

NEVER_NS = 1 << 62  # later than any run lasts
ALWAYS_NS = NEVER_NS  # stamp of a value that does not age: later than any other, never too old


LONGEST_S = NEVER_NS // 10**9  # no run lasts longer, s


def _never(ns: float) -> int:
    """The instant of a wait without end.

    Raises:
        ValueError: `ns` is no number.
    """
    if ns != ns:
        raise ValueError("nan is no instant; give chart time in ns, as from ctx.after(seconds)")
    return NEVER_NS


class Until:
    """Yielded by a state: step me at this chart time, ns, not before; rounded to whole ns."""

    __slots__ = ("ns",)

    def __init__(self, ns: float) -> None:
        self.ns = round(ns) if ns < NEVER_NS else _never(ns)


class On:
    """Yielded by a state: step me on news or silence of a signal or at `until`, not before.

    News is a new value of a measured signal, or of one that a derived or estimated signal depends
    on; the same value object again is not news. Silence means that one of these has delivered
    nothing for longer than `older` s; one that is already silent when the wait begins does not
    count. `until` is chart time, ns. Name every signal that the decision to continue depends on.

    Raises:
        ValueError: no signal is named, or `older` is no time.
    """

    __slots__ = ("older", "signals", "until")

    def __init__(self, *signals: str, until: float = NEVER_NS, older: float | None = None) -> None:
        if not signals:
            raise ValueError("On() waits for no signal; name some, or yield Until(t) or None")
        self.signals = signals
        self.until = NEVER_NS
        if until != NEVER_NS:
            self.until = round(until) if until < NEVER_NS else _never(until)
        if older is None:
            self.older = NEVER_NS
        elif 0.0 <= older < LONGEST_S:
            self.older = round(older * 1e9)
        else:
            raise ValueError(f"On(…, older={older}): a silence, in s, is 0 or more, or left out")


Yielded = Until | On | str | None  # text is a note shown to observers
Outcome = str | tuple[str, Mapping[str, Any]]  # alone, or with its outputs by name
Run = Generator[Yielded, None, Outcome]


class Stamped(NamedTuple, Generic[V]):
    """A signal value and when it was true, ns of run time; `ALWAYS_NS`: it does not age."""

    value: V
    stamp: int


class Key(str, Generic[V]):
    """The name of a signal, with the type of its values for the type checker.

        USER_POSE: Key[UserPose] = Key("user.pose")

    `ctx.value(USER_POSE)` is then a `UserPose | None`; with plain text it is `Any`. At run time a
    key is a plain `str`, so a lookup costs the same as with any text.
    """

    __slots__ = ()

    def __new__(cls, name: str) -> Key[V]:
        """Return the name itself."""
        return cast("Key[V]", str(name))


class Context(Protocol):
    """What a running state sees: the time, the signals and the parts it has declared."""

    @property
    def now(self) -> int:
        """Chart time in ns, the same for all states of a tick; stops while the run is paused."""
        ...

    def after(self, seconds: float) -> int:
        """The chart time `seconds` from now, in ns, rounded."""
        ...

    @overload
    def value(self, signal: Key[V]) -> V | None: ...
    @overload
    def value(self, signal: str) -> Any: ...
    def value(self, signal: str) -> Any:
        """The newest value; `None` if there is none or it is older than `reads` accepts."""
        ...

    @overload
    def sample(self, signal: Key[V]) -> Stamped[V] | None: ...
    @overload
    def sample(self, signal: str) -> Stamped | None: ...
    def sample(self, signal: str) -> Stamped | None:
        """The newest value with its stamp, whatever its age."""
        ...

    def age(self, signal: str) -> float:
        """Age of the newest value, s, even if `reads` does not accept it; infinite without one."""
        ...

    @overload
    def events(self, signal: Key[V]) -> tuple[Stamped[V], ...]: ...
    @overload
    def events(self, signal: str) -> tuple[Stamped, ...]: ...
    def events(self, signal: str) -> tuple[Stamped, ...]:
        """Samples of an event signal since this state last asked; at first, since its entry."""
        ...

    def part(self, name: str) -> Any:
        """A part of the robot that the class lists in `commands`."""
        ...


class State:
    """What `Action` and `Monitor` share; charts name only subclasses of those two."""

    outcomes: ClassVar[tuple[str, ...]] = ()
    inputs: ClassVar[Mapping[str, Any]] = {}  # only where `run` takes them as **inputs
    outputs: ClassVar[Mapping[str, Mapping[str, Any]]] = {}  # outcome -> name -> type
    reads: ClassVar[Mapping[str, float | None]] = {}  # signal -> maximum accepted age, s; None: any
    commands: ClassVar[tuple[str, ...]] = ()  # parts

    def run(self, ctx: Context) -> Run:
        """Do the work; the outcome is the return value."""
        raise NotImplementedError(f"{type(self).__name__}.run")


class Action(State):
    """A state that may command parts."""


class Monitor(State):
    """A state that only watches; it is stepped before every action."""


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


@dataclass(frozen=True, slots=True)
class Interface:
    """What the engine needs to know about a state class."""

    name: str
    monitor: bool
    outcomes: tuple[str, ...]
    parameters: Mapping[str, Argument]
    inputs: Mapping[str, Argument]
    outputs: Mapping[str, Mapping[str, Type]]
    reads: Mapping[str, float | None]
    commands: tuple[str, ...]
    instant: bool
    about: str
    make: Callable[..., State] = field(compare=False)


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
    _check_ages(cls)
    monitor = issubclass(cls, Monitor)
    if monitor and cls.commands:
        raise StateError(f"{name}: a Monitor commands no part, but lists {cls.commands!r}")
    outputs = {
        outcome: {key: _type(f"{name}.outputs: {key!r}", kind) for key, kind in named.items()}
        for outcome, named in cls.outputs.items()
    }
    has_init = cls.__init__ is not object.__init__
    return Interface(
        name=name,
        monitor=monitor,
        outcomes=tuple(map(str.__str__, cls.outcomes)),
        parameters=_arguments(cls, cls.__init__, skip=1) if has_init else {},
        inputs=_inputs(cls),
        outputs=outputs,
        reads=dict(cls.reads),
        commands=tuple(cls.commands),
        instant=not inspect.isgeneratorfunction(cls.run),
        about=inspect.cleandoc(cls.__doc__ or ""),
        make=cls,
    )


def _check_ages(cls: type[State]) -> None:
    for signal, age in cls.reads.items():
        number = isinstance(age, int | float) and not isinstance(age, bool)
        if age is not None and not (number and 0.0 <= age < LONGEST_S):
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
        found[parameter.name] = Argument(kind, parameter.default)
    return found


def _type(what: str, annotation: Any) -> Type:
    try:
        return from_annotation(annotation)
    except TypeError as error:
        raise StateError(f"{what}: {error}") from None
