"""The part `base` as states see it: they offer velocities, and one of them drives (R41, R42, R71).

A run has one `Wheels`. Its owner calls `begin` before a tick and `pass_on` after all states were
stepped; in between states `drive` as one of the multiplexer's sources and `release`. So a source
of higher priority takes over in the tick in which it speaks, whatever the others go on saying.
"""

from __future__ import annotations

from typing import Any

from hw.geometry import STILL, Pose2, Twist2
from hw.interfaces import Base
from states.navigation.multiplexer import Multiplexer, Selected

STOP_LOCK = "stop"
"""The lock that is on while the stop line is pulled."""


class Wheels:
    """A base behind a multiplexer; what is not said here is asked of the base itself.

    `selected` is what counted in the last tick. An offer is handed to the base once, so that the
    base's own time-out and safety chain see how old it gets; nobody is a stop in every tick.
    """

    def __init__(self, base: Base, multiplexer: Multiplexer | None = None) -> None:
        self.selected = Selected(STILL, None, None)
        self._base = base
        self._multiplexer = multiplexer or Multiplexer()
        self._now_ns = 0

    def __getattr__(self, name: str) -> Any:
        return getattr(self._base, name)

    def begin(self, now_ns: int) -> None:
        """A tick begins; what is offered from now on is offered at this instant."""
        self._now_ns = now_ns

    def drive(self, command: Twist2, source: str = "own") -> None:
        """Go at this velocity (base frame) unless a source of higher priority drives.

        Raises:
            ValueError: a value is NaN or infinite.
            KeyError: there is no such source.
        """
        self._multiplexer.offer(source, command, self._now_ns)

    def release(self, source: str = "own") -> None:
        """A source is done; the others need not wait."""
        self._multiplexer.release(source)

    def stop(self) -> None:
        """All sources are done: called by the engine between two users of the base, and to hold."""
        self._multiplexer.release_all()

    def lock(self, pulled: bool, now_ns: int) -> None:
        """Nobody may drive while the stop line is pulled."""
        self._multiplexer.switch(STOP_LOCK, pulled, now_ns)

    def grant(self, pose: Pose2 | None) -> None:
        """The request of the user is served from this pose; see `Base`."""
        self._base.grant(pose)

    def pass_on(self) -> None:
        """All states were stepped: hand the choice to the base."""
        before = self.selected
        self.selected = selected = self._multiplexer.select(self._now_ns)
        if selected.source is None:
            self._base.stop()
        elif selected.twist is not before.twist:
            self._base.drive(selected.twist)
