"""Velocity of a person from tracked poses that are noisy, late and sometimes missing.

States and the safety chain use the same class, with different averaging windows.
"""

from __future__ import annotations

import math
from collections import deque

from hw.geometry import STILL, Twist2, unwrap
from hw.samples import OLD_S

LEAST_NS = 50_000_000
"""Least time span of poses for a velocity, ns."""
JUMP = 0.3
FASTEST = 4.0
"""A step beyond JUMP (m) + FASTEST (m/s) times its duration is a jump of the tracking."""

Seen = tuple[int, float, float, float]
"""A stamp, ns, x, y, m, and the yaw, rad, not wrapped."""


class Motion:
    """Velocity of a body in the map over the last `window` seconds, m/s, with its yaw rate as wz.

    The slope of a least-squares line through the poses: of all averages with the same delay, half a
    window, it passes the least noise. After a gap of more than `gone` seconds or a jump it
    restarts, and `velocity` is None until the poses span 50 ms; it is exactly `STILL` while all
    poses are equal.
    """

    def __init__(self, window: float, gone: float = OLD_S) -> None:
        self.velocity: Twist2 | None = None
        self._window_ns, self._gone_ns = round(window * 1e9), round(gone * 1e9)
        self._seen: deque[Seen] = deque()
        self._same_since = 0

    def add_pose(self, stamp_ns: int, x: float, y: float, yaw: float = 0.0) -> None:
        """Take a pose in the map, m and rad; one not newer than the last is ignored."""
        seen = self._seen
        if seen:
            last = seen[-1]
            if stamp_ns <= last[0]:
                return
            if stamp_ns - last[0] > self._gone_ns or _is_jump(last, stamp_ns, x, y):
                seen.clear()
            else:
                yaw = unwrap(yaw, last[3])
        if not seen or last[1] != x or last[2] != y or last[3] != yaw:
            self._same_since = stamp_ns
        seen.append((stamp_ns, x, y, yaw))
        while stamp_ns - seen[0][0] > self._window_ns:
            seen.popleft()
        self.velocity = None
        if stamp_ns - seen[0][0] >= LEAST_NS:
            self.velocity = STILL if seen[0][0] >= self._same_since else _slope(seen)

    def leap(self, span_ns: int) -> None:
        """Pass over poses equal to those of the window, at the same rhythm, for so long, ns."""
        self._seen = deque((stamp + span_ns, x, y, yaw) for stamp, x, y, yaw in self._seen)


def _is_jump(last: Seen, stamp_ns: int, x: float, y: float) -> bool:
    elapsed = (stamp_ns - last[0]) * 1e-9
    return math.hypot(x - last[1], y - last[2]) > JUMP + FASTEST * elapsed


def _slope(seen: deque[Seen]) -> Twist2:
    """Least-squares slopes: sum of (t - mean t) x / sum of (t - mean t)^2; y and yaw likewise."""
    origin = seen[0][0]
    times = [(pose[0] - origin) * 1e-9 for pose in seen]
    middle = sum(times) / len(times)
    spread = vx = vy = wz = 0.0
    for t, (_, x, y, yaw) in zip(times, seen, strict=True):
        away = t - middle
        spread += away * away
        vx += away * x
        vy += away * y
        wz += away * yaw
    return Twist2(vx / spread, vy / spread, wz / spread)
