"""Selects one of several velocity sources by priority (R41, R71).

Names and comparisons as in ROS's twist_mux, with three differences. A source can withdraw
(`release`), so that the next one need not wait for its time-out (R42). With nothing to send the
output is zero instead of silence, because a receiver may repeat the last velocity. And every source
must time out: one that does not would block all others after its first message.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

from hw.geometry import STILL, Twist2


@dataclass(frozen=True, slots=True)
class VelocitySource:
    """A velocity source; an offer holds for `timeout` s, and the higher priority wins."""

    name: str
    priority: int
    timeout: float = 0.5


@dataclass(frozen=True, slots=True)
class Lock:
    """Blocks all sources of lower priority while it is on.

    With a `timeout` above 0, s, it is on until first heard, and again after a silence of that
    length; with 0 it is off until switched on.
    """

    name: str
    priority: int
    timeout: float = 0.0


class Selected(NamedTuple):
    """The output: a velocity (base frame), its source, and the lock that blocks others.

    `source` is None and the velocity `STILL` if no source may send. While an offer holds, its
    velocity stays the same object.
    """

    twist: Twist2
    source: str | None
    lock: str | None


SOURCES = (
    VelocitySource("escape", 90),
    VelocitySource("docking", 86),
    VelocitySource("haptic", 80),
    VelocitySource("chase", 70),
    VelocitySource("own", 60),
)
"""The three subsystems, the last stretch of a Haptic drive, and states that name no source."""
LOCKS = (Lock("stop", 255), Lock("arm", 85))
"""The stop line blocks all sources, an unfolded arm all but Escape and docking (R46)."""


class Multiplexer:
    """Takes offers and locks as they come, and selects the velocity that counts at an instant.

    Times are integer nanoseconds. An offer counts from the first `select` after it; an offer or
    a switch stamped later than now is ignored, as if timed out. Of equal priorities the source
    declared first wins.

    Raises:
        ValueError: a name is given twice, a source never times out, or a priority is not 1 to 255.
        KeyError: a name is used that was not declared.
    """

    def __init__(
        self, sources: Sequence[VelocitySource] = SOURCES, locks: Sequence[Lock] = LOCKS
    ) -> None:
        _check(sources, locks)
        self._sources = {source.name: source for source in sources}
        self._locks = {lock.name: lock for lock in locks}
        self._ranked = [(s, _nanoseconds(s.timeout)) for s in sorted(sources, key=_rank)]
        self._ranked_locks = [(k, _nanoseconds(k.timeout)) for k in sorted(locks, key=_rank)]
        self._offers: dict[str, tuple[Twist2, int | None]] = {}
        self._switches: dict[str, tuple[bool, int]] = {}
        self._timed = any(lock.timeout > 0.0 for lock in locks)
        self._idle: Selected | None = None

    def offer(self, name: str, twist: Twist2) -> None:
        """Offer a velocity of a source, from now until its time-out.

        Raises:
            ValueError: the velocity is not finite; the source's offer before it still holds.
        """
        source = self._sources[name]
        self._offers[source.name] = (Twist2.checked(twist.vx, twist.vy, twist.wz), None)

    def release(self, name: str) -> None:
        """Withdraw a source's offer: the others take over at once."""
        self._offers.pop(self._sources[name].name, None)

    def release_all(self) -> None:
        """Withdraw all offers."""
        self._offers.clear()

    def switch(self, name: str, on: bool, now_ns: int) -> None:
        """Switch a lock on or off, or confirm its state."""
        self._switches[self._locks[name].name] = (on, now_ns)
        self._idle = None

    def select(self, now_ns: int) -> Selected:
        """The velocity that counts now."""
        if not self._offers and self._idle is not None:
            return self._idle
        for name, (twist, since) in self._offers.items():
            if since is None:
                self._offers[name] = (twist, now_ns)
        lock = self._strongest_lock(now_ns)
        floor, blocked_by = (0, None) if lock is None else (lock.priority, lock.name)
        for source, timeout_ns in self._ranked if self._offers else ():
            if source.priority < floor:
                break
            twist, since = self._offers.get(source.name, (STILL, None))
            if since is not None and 0 <= now_ns - since <= timeout_ns:
                return Selected(twist, source.name, blocked_by)
        idle = Selected(STILL, None, blocked_by)
        if not self._timed:
            self._idle = idle  # until a lock is switched
        return idle

    def _strongest_lock(self, now_ns: int) -> Lock | None:
        for lock, timeout_ns in self._ranked_locks:
            switch = self._switches.get(lock.name)
            if switch is None:
                on = timeout_ns > 0
            else:
                on = switch[0] or (timeout_ns > 0 and not 0 <= now_ns - switch[1] <= timeout_ns)
            if on:
                return lock
        return None


def _rank(entry: VelocitySource | Lock) -> int:
    return -entry.priority


def _nanoseconds(seconds: float) -> int:
    return round(seconds * 1e9)


def _check(sources: Sequence[VelocitySource], locks: Sequence[Lock]) -> None:
    for kind, entries in (("source", sources), ("lock", locks)):
        names = [entry.name for entry in entries]
        for entry in entries:
            if names.count(entry.name) > 1:
                raise ValueError(f"{kind} '{entry.name}' stands twice; each name once")
            if not 1 <= entry.priority <= 255:
                raise ValueError(f"{kind} '{entry.name}': priority {entry.priority}; 1 to 255")
            if not (math.isfinite(entry.timeout) and entry.timeout >= 0.0):
                raise ValueError(f"{kind} '{entry.name}': time-out {entry.timeout} s; 0 or more")
    for source in sources:
        if source.timeout == 0.0:
            raise ValueError(f"source '{source.name}' never times out; give more than 0 s")
