"""States whose names and types charts fill in, and values of many classes, as charts write them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from typing import Any, ClassVar, NamedTuple, TypeVar

from engine.files.units import Angle, Duration, Length, Speed
from engine.interfaces import Interface, interface
from engine.literals import Constant
from engine.machine.named_values import NamedValues
from engine.signals.signal_kinds import Measured, Signal, declare, types_of
from engine.state import NEVER_NS, Action, Context, Key, Monitor, On, Run, State
from engine.types import Type, from_annotation
from tests.engine.conftest import Do, See

T = TypeVar("T")
N = TypeVar("N", bound=float)


@dataclass(frozen=True)
class Spot:
    """A place on the floor, in m: by its fields, or by a name."""

    named_by: ClassVar[str] = "place"

    x: Length
    y: Length = 0.0


class Level(Enum):
    """A value of a fixed set."""

    LOW = 1
    HIGH = 2


class Leg(NamedTuple):
    """A way to a place."""

    spot: Spot
    pace: Speed = 1.0
    level: Level = Level.LOW


@dataclass(frozen=True)
class Heading:
    """A unit vector, which charts write as an angle."""

    cos: float
    sin: float

    @classmethod
    def written(cls, yaw: Angle) -> Heading:
        """The heading at this angle."""
        return cls(math.cos(yaw), math.sin(yaw))


class _Busy:
    def run(self, ctx: Context) -> Run:
        yield
        return ""


class Go(Action):
    """Goes to `goal`."""

    outcomes = ("done", "failed", "other")
    outputs: ClassVar = {"done": {"where": Spot}}

    def __init__(self, pace: Speed = 1.0, via: tuple[Spot, ...] = (), times: int = 1) -> None:
        self.pace, self.via, self.times = pace, via, times

    def run(self, ctx: Context, goal: Spot, leg: Leg | None = None) -> Run:
        yield
        return "done"


class Pick(Action):
    """Ends as one of `cases`."""

    outcomes = ("$cases", "other")
    outputs: ClassVar = {"$cases": {"chosen": str}}

    def __init__(self, cases: tuple[str, ...]) -> None:
        self.cases = cases

    def run(self, ctx: Context, value: str) -> Run:
        yield
        return "other"


class Keep(Action):
    """Hands on what it is given, of any type."""

    outcomes = ("done", "failed", "other")
    outputs: ClassVar = {"done": {"item": T}}

    def __init__(self, items: tuple[T, ...] = ()) -> None:
        self.items = items

    def run(self, ctx: Context, value: T) -> Run:
        yield
        return "done"


class Push(_Busy, Action):
    """Commands the part that is named."""

    outcomes = ("done", "failed", "other")
    commands = ("$part",)

    def __init__(self, part: str, heading: Heading | None = None) -> None:
        self.part, self.heading = part, heading


class Over(Monitor):
    """`seen` once a signal has been above `limit` for some time, `lost` when it is negative."""

    outcomes = ("seen", "lost")
    outputs: ClassVar = {"seen": {"value": N}}
    reads: ClassVar = {"$signal": "$older"}

    def __init__(
        self, signal: Key[N], limit: N, for_: Duration = 0.0, older: Duration | None = None
    ) -> None:
        self.signal, self.limit, self.older = signal, limit, older
        self.hold = round(for_ * 1e9)

    def run(self, ctx: Context) -> Run:
        since: int | None = None
        while True:
            value: Any = ctx.value(self.signal)
            if value is not None and value < 0:
                return "lost"
            if value is None or value <= self.limit:
                since = None
            else:
                since = ctx.now if since is None else since
                if ctx.now - since >= self.hold:
                    return "seen", {"value": value}
            until = NEVER_NS if since is None else since + self.hold
            yield On(self.signal, until=until, older=self.older)


STATES: tuple[type[State], ...] = (Do, See, Go, Pick, Keep, Push, Over)
INTERFACES: Mapping[str, Interface] = {cls.__name__: interface(cls) for cls in STATES}
TYPES: Mapping[str, Type] = {cls.__name__: from_annotation(cls) for cls in (Spot, Leg, Heading)}
SIGNALS: Mapping[str, Signal] = declare(
    [Measured("s.far", Length), Measured("s.pace", Speed), Measured("s.count", int)]
)
CONSTANTS: Mapping[str, Any] = {
    "k.pace": "80 cm/s", "k.wide": "1.2 m", "k.home": {"x": "3 m", "y": "50 cm"},
    "k.tries": 1, "k.eye": "s.far",
}  # fmt: skip
PLACES: Mapping[str, Spot] = {"dock": Spot(1.0, 2.0), "kitchen": Spot(-4.0, 0.25)}
AROUND = NamedValues(
    {k: Constant(v) for k, v in CONSTANTS.items()}, types_of(SIGNALS), {"place": PLACES}
)
