"""The grid of ticks (rules 1 and 13)."""

from __future__ import annotations

from dataclasses import dataclass

SECOND_NS = 10**9


@dataclass(frozen=True, slots=True)
class TickGrid:
    """Tick n is at `n * 10**9 // hz` ns since the start of the run.

    Instants are computed from n, never by summing periods, so rounding errors do not accumulate.
    """

    hz: int = 30

    def instant(self, number: int) -> int:
        """The instant of a tick, ns."""
        return number * SECOND_NS // self.hz

    def seconds(self, ticks: int) -> int:
        """The whole seconds that so many ticks take."""
        return ticks // self.hz

    @property
    def period_ns(self) -> int:
        """The time between two ticks, ns, rounded down."""
        return SECOND_NS // self.hz

    def last(self, at: int) -> int:
        """The number of the last tick that is not after `at`, ns.

        n * S // hz <= at  iff  n * S < (at + 1) * hz, with S = `SECOND_NS` and all integers.
        """
        return ((at + 1) * self.hz - 1) // SECOND_NS

    def first(self, at: int) -> int:
        """The number of the first tick that is not before `at`, ns."""
        return max(0, -(-at * self.hz // SECOND_NS))
