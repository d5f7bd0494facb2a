"""What a loop advances: the parts by name, and their ground truth where it is known."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Protocol

from engine import NEVER_NS
from hw import Sample, Truth
from hw.safety import CycleLog, GuardedBase


class Plant(Protocol):
    """A robot with its surroundings: simulated, mocked, real, scripted or recorded.

    `parts` are those of `hw.interfaces` and of projects, by name. `latency_ns`: simulated delay
    from a tick to the instant at which the plant receives its decisions; 0 where computing takes
    real time. `guard` is the safety chain in front of the wheels, if there are any. `paced`: time
    passes by itself; otherwise the plant stands still between two calls of `advance`.
    """

    latency_ns: int
    paced: bool

    @property
    def failures(self) -> list[tuple[str, Exception]]:
        """Exceptions raised in the parts' own threads since the last call, with the part's name."""
        ...

    @property
    def parts(self) -> Mapping[str, Any]:
        """The parts by name."""
        ...

    @property
    def guard(self) -> GuardedBase | None:
        """The safety chain in front of the wheels."""
        ...

    @property
    def cycles(self) -> CycleLog | None:
        """The records of the safety chain, if there is one."""
        ...

    @property
    def finished(self) -> bool:
        """True once nothing more is going to happen."""
        ...

    @property
    def truth(self) -> Truth | None:
        """The ground truth now; None where it is not known."""
        ...

    def advance(self, to_ns: int) -> None:
        """Let everything happen up to this instant, ns; samples are taken afterwards."""
        ...

    def quiet_until(self) -> int:
        """The instant, ns, before which nothing happens, and nothing new is measured."""
        ...

    @property
    def leap(self) -> Callable[[int], None] | None:
        """Passes over whole seconds, ns, before `quiet_until`, during which it repeats its samples.

        None for a plant that gives no samples while it is quiet.
        """
        ...

    def close(self) -> None:
        """Release all devices; the run is over."""
        ...


class Inert:
    """A part that exists by name only, as in a replayed run; it moves nothing."""

    def __init__(self, signals: tuple[str, ...] = ()) -> None:
        self.signals = signals

    def samples(self, now_ns: int) -> tuple[Sample, ...]:  # noqa: ARG002
        """No samples."""
        return ()

    def pull(self, reason: str) -> None:
        """Do nothing; nothing moves."""


class Nothing:
    """Neither robot nor world: charts alone, with signals from a script or a test."""

    leap: Callable[[int], None] | None = None

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
        """Do nothing; nothing moves."""

    def quiet_until(self) -> int:
        """Forever: nothing ever happens by itself."""
        return NEVER_NS

    def close(self) -> None:
        """Nothing is open."""
