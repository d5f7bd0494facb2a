"""The signals that a test feeds to a run: single samples, and values that it holds.

What is held is delivered anew at every tick, and so is never too old.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Mapping
from numbers import Real
from typing import Any, NamedTuple

from cobodeck.loop import Loop
from cobodeck.testing.chart_only import fitting
from engine import NEVER_NS
from engine.files import did_you_mean
from engine.signals import Measured

__tracebackhide__ = True  # a failing test shows its own line


def require_seconds(what: str, given: object) -> None:
    """Make sure that a time is a number.

    Raises:
        AssertionError: it is not, but `2 s`, for example.
    """
    if isinstance(given, bool) or not isinstance(given, Real):
        raise AssertionError(f"{what}={given!r}; wanted: seconds as a number, as in {what}=2.5")


class _Course(NamedTuple):
    """What a signal is from which tick of the grid on, ascending, and the tick that ends it."""

    ticks: list[int]
    values: list[Any]
    end: int


class SignalFeed:
    """Feeds one loop, which has ticked before only if the feed was told to `deliver`."""

    def __init__(self, loop: Loop) -> None:
        self._loop = loop
        self._held: dict[str, _Course] = {}

    def sample(self, name: str, value: Any) -> None:
        """Deliver one sample at the next tick, and hold this signal no longer.

        Raises:
            AssertionError: the test cannot feed this signal, or not with this value.
        """
        self._require(name, value)
        self._held.pop(name, None)
        self._loop.wired.inlet.put(name, value, self._loop.next_ns)

    def hold(self, name: str, values: Mapping[float, Any], seconds: float = math.inf) -> None:
        """Hold each value from its instant on until the next one's.

        Args:
            name: of the signal.
            values: by instant, s after the next tick.
            seconds: the time after which none is held any more.

        Raises:
            AssertionError: as for `sample`, or a time is negative or not finite.
        """
        for instant, value in values.items():
            if not isinstance(instant, Real) or not 0 <= instant < math.inf:
                raise AssertionError(
                    f"signal {name!r} at {instant!r}; wanted: seconds as a number, 0 or more"
                )
            self._require(name, value, held=True)
        require_seconds("hold", seconds)
        if not seconds > 0:
            raise AssertionError(f"signal {name!r} held for {seconds!r}; wanted: s, more than 0")
        first, instants = self._loop.ticks, sorted(values)
        ticks = [first + self._ticks(instant) for instant in instants]
        end = first + max(1, self._ticks(seconds)) if seconds < math.inf else NEVER_NS
        self._held[name] = _Course(ticks, [values[instant] for instant in instants], end)

    def deliver(self) -> None:
        """Deliver what is held at the next tick."""
        loop = self._loop
        for name, course in self._held.items():
            index = bisect_right(course.ticks, loop.ticks) - 1
            if index >= 0 and loop.ticks < course.end:
                loop.wired.inlet.put(name, course.values[index], loop.next_ns)

    def _ticks(self, seconds: float) -> int:
        return round(seconds * self._loop.grid.hz)

    def _require(self, name: str, value: Any, *, held: bool = False) -> None:
        declared, inlet = self._loop.wired.board.declared, self._loop.wired.inlet
        signal = declared.get(name)
        if signal is None:
            hint = did_you_mean(name, declared)
            raise AssertionError(f"no signal {name!r} is read by this chart; {hint}")
        if not isinstance(signal, Measured):
            raise AssertionError(
                f"{name!r} is {type(signal).__name__.lower()}; "
                f"take it over with start(signals={{{name!r}: …}})"
            )
        if signal.constant and held:
            raise AssertionError(f"{name!r} is a constant, and never too old; do not hold it")
        if name in inlet.flowing and not signal.event:
            raise AssertionError(f"{name!r} is measured by a part here; feed it without a robot")
        fitting(inlet, name, value)
