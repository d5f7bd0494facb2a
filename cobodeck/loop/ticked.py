"""A tick, and who is called in it and after it."""

from __future__ import annotations

from typing import Literal, NamedTuple, Protocol

Kind = Literal["grid", "left_out", "added", "taken", "end"]
"""What a tick was; see `Ticked`."""


class Observer(Protocol):
    """Runs at each instant, after the samples and before the chart."""

    def watch(self, now_ns: int) -> None:
        """Observe the plant at this instant, ns."""
        ...


class Ticked(NamedTuple):
    """A finished tick.

    `kind`: a tick of the `grid`; an instant of the grid `left_out`, at which samples were taken
    but the chart did not run; a tick `added` off the grid; samples `taken` off the grid without a
    tick; or the `end` of the run, when the nodes still running were closed. `number` is that of
    the grid, `missed` the ticks of the grid skipped just before, `late_ns` how long after the
    instant at which a tick was due by the grid it began.
    """

    at_ns: int
    number: int
    kind: Kind
    missed: int = 0
    late_ns: int = 0


class Tap(Protocol):
    """Is notified of everything that the loop has done."""

    def failed(self, part: str, error: BaseException) -> None:
        """A part has raised outside of any state."""
        ...

    def tick(self, ticked: Ticked) -> None:
        """A tick is over."""
        ...
