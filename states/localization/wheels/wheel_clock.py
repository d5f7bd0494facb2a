"""How late the wheels' stamps are against those of the scans, by turns that both have measured.

Between matches at t0 and t1 the scans show a turn u; the yaw y of the wheels, read d later, shows
v(d) = y(t1 + d) - y(t0 + d). If the stamps of the wheels are late by d,

    u = (1 + k) v(d) + e,    e ~ N(0, s^2)

with the share k by which the wheels turn too little. For each d of a grid, k is eliminated by least
squares, which leaves R(d) = sum u^2 - (sum u v)^2 / sum v^2. R / 2 s^2 is the negative
log-likelihood, so the minimum of R, refined by a parabola, is the estimate, and 2 s^2 / R'' its
variance, with s^2 = R / n for n turns. A base that stands or turns steadily leaves R flat, and the
offset open. Old turns fade, so that an offset that changes is followed.
"""

from __future__ import annotations

import math
from collections import deque

import numpy as np

from hw import compiled, wrap, wrapped
from states.localization.wheels.trail import Trail, TrailPast, at
from states.maps import Array

STEP_NS, MOST = 100_000_000, 5
"""Step of the grid, ns, and the number of steps to either side."""
LEAST_S, LONGEST_S = 0.08, 2.0
"""Turns are compared over at least and at most this time, s: noise of matches, slip."""
WRONG = 0.3
"""A turn that differs this much from the wheels', whatever the offset, is of a wrong match, rad."""
MEMORY = 400.0
"""Number of turns after which an old one counts 1/e."""
ENOUGH = 30
"""Number of turns that are needed."""
SURE_S = 0.03
"""Largest standard deviation of a reported estimate, s."""
ALIKE = 2.0
"""Turns whose errors count as one: a floor makes wheels slip alike for a while."""


class WheelClock:
    """The offset, s, from matches and the wheels' trail, once turns have shown it."""

    def __init__(self) -> None:
        self._waiting: deque[tuple[int, int, float]] = deque()
        self._last: tuple[int, float] | None = None
        self._vv, self._uv = np.zeros(2 * MOST + 1), np.zeros(2 * MOST + 1)
        self._uu = self._count = 0.0
        _take_turns(Trail().past, 0, 0, np.empty(1))  # compile now, not in a tick

    def add_yaw(self, stamp_ns: int, yaw: float, trail: Trail) -> None:
        """Take the yaw of a match in the map, rad, and the trail of the wheels so far."""
        last = self._last
        if last is not None:
            elapsed = (stamp_ns - last[0]) * 1e-9
            if elapsed < LEAST_S:
                return
            if elapsed <= LONGEST_S:
                self._waiting.append((last[0], stamp_ns, wrap(yaw - last[1])))
        self._last = stamp_ns, yaw
        newest = trail.stamp_ns or 0
        while self._waiting and self._waiting[0][1] + MOST * STEP_NS <= newest:
            self._add_turn(*self._waiting.popleft(), trail)

    def forget(self) -> None:
        """Take no turn from the last match on: the base was found elsewhere."""
        self._last = None

    def _add_turn(self, first_ns: int, last_ns: int, turn: float, trail: Trail) -> None:
        turns = np.empty(2 * MOST + 1)
        if not _take_turns(trail.past, first_ns, last_ns, turns):
            return
        if np.abs(turns - turn).min() > WRONG:
            return
        keep = math.exp(-1.0 / MEMORY)
        self._vv = keep * self._vv + turns * turns
        self._uv = keep * self._uv + turn * turns
        self._uu = keep * self._uu + turn * turn
        self._count = keep * self._count + 1.0

    @property
    def estimate(self) -> tuple[float, float] | None:
        """The offset and its standard deviation, s; None while turns have not shown it."""
        if self._count < ENOUGH:
            return None
        rest = self._uu - self._uv**2 / np.maximum(self._vv, 1e-12)
        return _minimum(rest, self._count)

    @property
    def sure(self) -> float | None:
        """The offset, s, once it is known well; else None."""
        found = self.estimate
        return found[0] if found is not None and found[1] <= SURE_S else None


@compiled
def _take_turns(past: TrailPast, first_ns: int, last_ns: int, turns: Array) -> bool:
    """Write the turns of the wheels, (2 MOST + 1,), rad, by offset; False if one is unknown."""
    for k in range(len(turns)):
        late = (k - MOST) * STEP_NS
        since, first = at(past, first_ns + late)
        until, last = at(past, last_ns + late)
        if not (since and until):
            return False
        turns[k] = wrapped(last[2] - first[2])
    return True


def _minimum(rest: Array, turns: float) -> tuple[float, float] | None:
    """Minimum of R and its standard deviation, s; None at an edge of the grid."""
    k = int(np.argmin(rest))
    if k in (0, len(rest) - 1):
        return None
    before, least, after = rest[k - 1 : k + 2].tolist()
    step = STEP_NS * 1e-9
    bend = (before - 2.0 * least + after) / (step * step)
    if bend <= 0.0:
        return None
    at = (k - MOST) * step + 0.5 * step * (before - after) / (before - 2.0 * least + after)
    return at, math.sqrt(2.0 * ALIKE * max(least, 1e-12) / (turns * bend))
