"""What a loop moves on: parts by name, and the truth about them where it is known."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Protocol

from engine.state import NEVER_NS
from hw.log import Log
from hw.safety.guarded import GuardedBase
from hw.safety.record import SafetyRecord
from hw.samples import Sample
from hw.truth import Truth


class Plant(Protocol):
    """A robot with its surroundings: simulated, mocked, real, scripted or recorded.

    `parts` are those of `hw.interfaces` and of projects, by name. `latency_ns`: how much later
    than a tick the plant hears what it decided; 0 where computing takes the time it takes. `guard`
    stands in front of the wheels, where there are some. `paced`: time passes there by itself, while
    a simulated plant stands between two calls of `advance`.
    """

    latency_ns: int
    paced: bool

    @property
    def failures(self) -> list[tuple[str, Exception]]:
        """What parts have raised in threads of their own since the last look, by their names."""
        ...

    @property
    def parts(self) -> Mapping[str, Any]:
        """By name."""
        ...

    @property
    def guard(self) -> GuardedBase | None:
        """In front of the wheels."""
        ...

    @property
    def cycles(self) -> Log[SafetyRecord] | None:
        """The records of the safety chain, where there is one."""
        ...

    @property
    def finished(self) -> bool:
        """Is everything over that was going to happen?"""
        ...

    @property
    def truth(self) -> Truth | None:
        """Where everything truly is now; None where nobody knows."""
        ...

    def advance(self, to_ns: int) -> None:
        """Let everything happen up to this instant; samples are taken after it."""
        ...

    def quiet_until(self) -> int:
        """Nothing happens and nothing is measured before this instant, ns."""
        ...

    def close(self) -> None:
        """The run is over: let go of devices."""
        ...


class Inert:
    """A part that is there in name only, as in a run that is replayed: it moves nothing."""

    def __init__(self, signals: tuple[str, ...] = ()) -> None:
        self.signals = signals

    def samples(self, now_ns: int) -> tuple[Sample, ...]:  # noqa: ARG002
        """None of its own."""
        return ()

    def pull(self, reason: str) -> None:
        """Nothing has to be stopped."""


class Nothing:
    """No robot and no world: charts alone, with signals from a script or a test."""

    def __init__(self, parts: Mapping[str, Any] | None = None) -> None:
        self.parts: Mapping[str, Any] = parts if parts is not None else {}
        self.latency_ns = 0
        self.paced = False
        self.failures: list[tuple[str, Exception]] = []
        self.guard = None
        self.cycles = None
        self.finished = False
        self.truth = None

    def advance(self, to_ns: int) -> None:
        """Nothing moves."""

    def quiet_until(self) -> int:
        """For ever."""
        return NEVER_NS

    def close(self) -> None:
        """Nothing is open."""
