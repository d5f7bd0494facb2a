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
again elsewhere. A parameter can name what a state reads, commands or ends with: `$name` in these
attributes stands for its value, text or a list, at the node that gives it.

    class Above(Monitor):
        \"\"\"`above` once a signal is greater than `limit`.\"\"\"
        outcomes = ("above",)
        reads = {"$signal": "$older"}

        def __init__(self, signal: Key[T], limit: T, older: Duration | None = None) -> None:
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterable, Mapping
from typing import Any, ClassVar, Generic, Literal, NamedTuple, Protocol, overload

from engine.types import Key as Key, V

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


RunNews = Literal["paused", "resumed", "over"]
"""What a state can hear of its run; `over` comes once, after the last tick."""
Yielded = Until | On | str | None  # text is a note shown to observers
Outcome = str | tuple[str, Mapping[str, Any]]  # alone, or with its outputs by name
Run = Generator[Yielded, None, Outcome]


class Stamped(NamedTuple, Generic[V]):
    """A signal value and when it was true, ns of run time; `ALWAYS_NS`: it does not age."""

    value: V
    stamp: int


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

    def is_event(self, signal: str) -> bool:
        """Whether a signal is one of events, each of which is read once, and no level."""
        ...

    def part(self, name: str) -> Any:
        """A part of the robot that the class lists in `commands`."""
        ...

    def note(self, text: str) -> None:
        """Put a note for people in the trace; nothing depends on it."""
        ...

    def hear_run(self, tell: Callable[[RunNews], None]) -> None:
        """Have `tell` called from now on, also after this state, when the run takes such a turn."""
        ...


class State:
    """What `Action` and `Monitor` share; charts name only subclasses of those two."""

    outcomes: ClassVar[tuple[str, ...]] = ()
    inputs: ClassVar[Mapping[str, Any]] = {}  # only where `run` takes them as **inputs
    outputs: ClassVar[Mapping[str, Mapping[str, Any]]] = {}  # outcome -> name -> type
    reads: ClassVar[Mapping[str, float | str | None]] = {}  # signal -> greatest age, s; None: any
    optional: ClassVar[tuple[str, ...]] = ()  # of `reads`, signals that a run may be without
    commands: ClassVar[tuple[str, ...]] = ()  # parts

    @classmethod
    def faults(cls, *_given: Any, **_parameters: Any) -> Iterable[tuple[str, str]]:
        """What is wrong with values that are right one by one: a parameter, and a message, each.

        Override it with `faults(cls, inputs, …)`: `inputs`, the names of the inputs that a node
        gives, then the parameters by name, those not given left out. The checks of a chart call it
        where all are known.
        """
        return ()

    @classmethod
    def stands_for(cls, name: str, _what: Literal["signal", "part"]) -> tuple[str, ...]:
        """The signals or parts that a parameter means by this value, if it names some.

        Override it where such values are names of something else, as of a topic.
        """
        return (name,)

    def run(self, ctx: Context) -> Run:
        """Do the work; the outcome is the return value."""
        raise NotImplementedError(f"{type(self).__name__}.run")


class Action(State):
    """A state that may command parts."""


class Monitor(State):
    """A state that only watches; it is stepped before every action."""
