"""The part `base` as states see it: they offer velocities, and one of them drives (R41, R42, R71).

A run has one `Wheels`. Its owner calls `begin` before a tick and `pass_on` after all states were
stepped; in between states `drive` as one of the multiplexer's sources and `release`. So a source
of higher priority takes over in the tick in which it speaks, whatever the others go on saying.
"""

from __future__ import annotations

import math
from typing import Any

from hw.geometry import STILL, Pose2, Twist2
from hw.interfaces import Base
from states.navigation.multiplexer import Multiplexer, Selected

STOP_LOCK, ARM_LOCK = "stop", "arm"
"""The locks that are on while the stop line is pulled, and while the arm is not folded."""
REFUSALS = {STOP_LOCK: "the stop line is pulled", ARM_LOCK: "the arm is not folded"}


class Wheels:
    """A base behind a multiplexer; what is not said here is asked of the base itself.

    `selected` is what counted in the last tick. An offer is handed to the base once, so that the
    base's own time-out and safety chain see how old it gets; nobody is a stop in every tick.

    While the arm is not folded only Escape drives, whatever chart runs, and Haptic with no more
    than `overlap` m to go (R46); 0: not even that.
    """

    def __init__(
        self, base: Base, multiplexer: Multiplexer | None = None, overlap: float = 0.0
    ) -> None:
        self.selected = Selected(STILL, None, None)
        self._overlap = overlap
        self._base = base
        self._multiplexer = multiplexer or Multiplexer()
        self._now_ns = 0

    def __getattr__(self, name: str) -> Any:
        return getattr(self._base, name)

    def begin(self, now_ns: int) -> None:
        """A tick begins; what is offered from now on is offered at this instant."""
        self._now_ns = now_ns

    def drive(self, command: Twist2, source: str = "own", left: float = math.inf) -> None:
        """Go at this velocity (base frame) unless a source of higher priority drives.

        `left` is the way that remains to the goal, m.

        Raises:
            ValueError: a value is NaN or infinite.
            KeyError: there is no such source.
        """
        docks = source == "haptic" and self._overlap > 0.0 and left <= self._overlap
        if source == "haptic" and not docks:
            self._multiplexer.release("docking")  # it had less to go a moment ago
        self._multiplexer.offer("docking" if docks else source, command, self._now_ns)

    def release(self, source: str = "own") -> None:
        """A source is done; the others need not wait."""
        self._multiplexer.release(source)
        if source == "haptic":
            self._multiplexer.release("docking")

    def stop(self) -> None:
        """All sources are done: called by the engine between two users of the base, and to hold."""
        self._multiplexer.release_all()

    def lock(self, pulled: bool, now_ns: int) -> None:
        """Nobody may drive while the stop line is pulled."""
        self._multiplexer.switch(STOP_LOCK, pulled, now_ns)

    def fold(self, folded: bool, now_ns: int) -> None:
        """Only Escape may drive while the arm is not folded."""
        self._multiplexer.switch(ARM_LOCK, not folded, now_ns)

    @property
    def refusal(self) -> str | None:
        """Why nobody drove in the last tick, whoever wanted to; None: nothing was in the way."""
        source, lock = self.selected[1:]
        return None if lock is None or source is not None else REFUSALS.get(lock, lock)

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
