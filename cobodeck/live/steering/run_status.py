"""What pages are told of a run that is not on record: faults, breakpoints, speed, health."""

from __future__ import annotations

import time
from collections import deque
from typing import Any

from cobodeck.live.feed import Feed
from cobodeck.loop import Loop, Paced
from engine.operator import Operator
from engine.run import raised

HEALTH_S = 1.0
"""Between two messages of health, s."""
KEPT_TIMES = 600
"""Ticks of whose times the 99th percentile is told."""
WHERE = "live page"
"""Where errors occur that are those of this room, as the terminal says it."""


class RunStatus:
    """A tap of the loop; see the module."""

    def __init__(self, loop: Loop, feed: Feed) -> None:
        self._loop, self._feed = loop, feed
        self._told: dict[str, Any] = {}
        self._times: deque[int] = deque(maxlen=KEPT_TIMES)
        self._told_at = 0.0
        self._breaks: list[str] = []
        self._commands = -1  # carried out when the breakpoints were looked up
        self._acknowledged_ns, self._past_faults = -1, 0
        self._wrong = ""

    def failed(self, part: str, error: BaseException) -> None:
        """Do nothing; it is on record."""

    def tick(self, ticked: object) -> None:  # noqa: ARG002
        """Tell what has changed, and health once a second."""
        try:
            self._look()
        except Exception as error:  # noqa: BLE001  the run goes on
            if (wrong := str(raised(0, WHERE, error))) != self._wrong:
                self._wrong = wrong  # not in each tick
                self._feed.tell("say", unforeseen(self._loop, error))

    def _look(self) -> None:
        loop = self._loop
        operator = loop.plant.parts.get("operator")
        told = {
            "breaks": self._breakpoints(),
            "faults": self._open_faults(list(getattr(operator, "faults", ()))),
            "speed": loop.clock.speed if isinstance(loop.clock, Paced) else 1.0,
        }
        if told != self._told:
            self._told = told
            self._feed.tell("status", told)
        if loop.stopwatch is not None:
            self._times.append(loop.stopwatch.last_ns)
        now = time.monotonic()
        if now - self._told_at >= HEALTH_S:
            self._told_at = now
            self._feed.tell("health", self._health())

    def _breakpoints(self) -> list[str]:
        run = self._loop.wired.run
        if run.carried_out.total != self._commands:
            self._commands, self._breaks = run.carried_out.total, Operator(run).breaks()
        return self._breaks

    def _open_faults(self, faults: list[str]) -> list[str]:
        """Those that nobody has acknowledged yet."""
        slot = self._loop.wired.board.slots.get("operator.acknowledge")
        newest = None if slot is None else slot.newest
        stamp_ns = -1 if newest is None else newest.stamp
        if stamp_ns != self._acknowledged_ns:
            self._acknowledged_ns, self._past_faults = stamp_ns, len(faults)
        return faults[self._past_faults :]

    def _health(self) -> dict[str, Any]:
        loop, times = self._loop, sorted(self._times)
        p99 = times[min(len(times) - 1, len(times) * 99 // 100)] / 1e6 if times else None
        children = [
            {"name": child.name, "state": "runs" if child.alive else "has ended"}
            for part in loop.plant.parts.values()
            if (child := getattr(part, "child", None)) is not None and hasattr(child, "alive")
        ]
        return {
            "tick_p99_ms": p99,
            "dropped": self._feed.dropped,
            "missed": loop.missed,
            "children": children,
            "gates": dict(loop.wired.inlet.refused),
        }


def unforeseen(loop: Loop, error: Exception) -> str:
    """Tell an error of ours on the terminal; returns it as pages are told it."""
    found = raised(max(0, loop.now_ns), WHERE, error)
    if loop.tell is not None:
        loop.tell(found)
    return f"an error of the program, told on the terminal, too: {found}"
