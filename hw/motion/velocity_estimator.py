"""Velocity of a person from tracked poses that are noisy, late and sometimes missing.

States and the safety chain use the same functions, with different averaging windows. Poses are kept
in a record `TRAIL`, which compiled functions change in place.
"""

from __future__ import annotations

import math

import numpy as np

from hw.geometry import STILL, Twist2
from hw.jit import Struct, Structs, compiled, example, record_type, wrapped
from hw.samples import OLD_S

LEAST_NS = 50_000_000
"""Least time span of poses for a velocity, ns."""
JUMP = 0.3
FASTEST = 4.0
"""A step beyond JUMP (m) + FASTEST (m/s) times its duration is a jump of the tracking."""
KEPT = 1024
"""Longest trail, poses; of a longer one the older half is forgotten."""
EVER_NS = 1 << 62
"""Stamps beyond this before or after 0, ns, are no times."""
UNKNOWN, STANDS, MOVES = 0, 1, 2
"""What is known of a velocity; who stands has not moved at all."""

TRAIL = record_type(
    ("window_ns", "i8"), ("gone_ns", "i8"), ("same_since_ns", "i8"),
    ("first", "i8"), ("end", "i8"), ("stamps", "i8", (KEPT,)), ("poses", "f8", (KEPT, 3)),
)  # fmt: skip
"""The last `window_ns` of poses, by rising stamps: rows `first` to `end` of `stamps`, ns, and of
`poses`: x, y in the map, m, and the yaw, rad, not wrapped. It restarts after a gap of more than
`gone_ns` or a jump. All poses since `same_since_ns` are equal."""


class Motion:
    """Velocity of a body in the map over the last `window` seconds, m/s, with its yaw rate as wz.

    The slope of a least-squares line through the poses: of all averages with the same delay, half a
    window, it passes the least noise. After a gap of more than `gone` seconds or a jump it
    restarts, and `velocity` is None until the poses span 50 ms; it is exactly `STILL` while all
    poses are equal.
    """

    def __init__(self, window: float, gone: float = OLD_S) -> None:
        self.velocity: Twist2 | None = None
        self._trail: Structs = np.zeros(1, TRAIL)
        lay_out(self._trail[0], window, gone)

    def add_pose(self, stamp_ns: int, x: float, y: float, yaw: float = 0.0) -> None:
        """Take a pose in the map, m and rad; one not newer than the last is ignored."""
        if not -EVER_NS < stamp_ns < EVER_NS:
            return
        known, vx, vy, wz = _after(self._trail, stamp_ns, x, y, yaw)
        if known == MOVES:
            self.velocity = Twist2(vx, vy, wz)
        else:
            self.velocity = STILL if known == STANDS else None

    def leap(self, span_ns: int) -> None:
        """Pass over poses equal to those of the window, at the same rhythm, for so long, ns."""
        self._trail["stamps"] += span_ns


def lay_out(trail: Struct, window: float, gone: float) -> None:
    """Prepare an empty trail; both in s, see `Motion`."""
    trail.window_ns, trail.gone_ns = round(window * 1e9), round(gone * 1e9)
    trail.first = trail.end = 0


@compiled
def add_pose(trail: Struct, stamp_ns: int, x: float, y: float, yaw: float) -> bool:
    """Take a pose, m and rad; False if it is not newer than the last."""
    stamps, poses, first, end = trail.stamps, trail.poses, trail.first, trail.end
    if end > first:
        last_ns, last = stamps[end - 1], poses[end - 1]
        if stamp_ns <= last_ns:
            return False
        step, elapsed = math.hypot(x - last[0], y - last[1]), (stamp_ns - last_ns) * 1e-9
        if stamp_ns - last_ns > trail.gone_ns or step > JUMP + FASTEST * elapsed:
            first = end
        else:
            yaw = last[2] + wrapped(yaw - last[2])
    if end == first or x != poses[end - 1, 0] or y != poses[end - 1, 1] or yaw != poses[end - 1, 2]:
        trail.same_since_ns = stamp_ns
    if end == KEPT:
        first = max(first, KEPT // 2)
        for k in range(end - first):
            stamps[k], poses[k, :] = stamps[first + k], poses[first + k]
        first, end = 0, end - first
    stamps[end] = stamp_ns
    poses[end, 0], poses[end, 1], poses[end, 2] = x, y, yaw
    while stamp_ns - stamps[first] > trail.window_ns:
        first += 1
    trail.first, trail.end = first, end + 1
    return True


@compiled
def velocity(trail: Struct, window_ns: int) -> tuple[int, float, float, float]:
    """What is known of the velocity over the last `window_ns`, and vx, vy, wz.

    These are least-squares slopes: sum of (t - mean t) x / sum of (t - mean t)^2; y and yaw
    likewise. There must be a pose.
    """
    stamps, poses, first, end = trail.stamps, trail.poses, trail.first, trail.end
    newest = stamps[end - 1]
    while newest - stamps[first] > window_ns:
        first += 1
    if newest - stamps[first] < LEAST_NS:
        return UNKNOWN, 0.0, 0.0, 0.0
    if stamps[first] >= trail.same_since_ns:
        return STANDS, 0.0, 0.0, 0.0
    middle = 0.0
    for k in range(first, end):
        middle += (stamps[k] - stamps[first]) * 1e-9
    middle /= end - first
    spread = vx = vy = wz = 0.0
    for k in range(first, end):
        away = (stamps[k] - stamps[first]) * 1e-9 - middle
        spread += away * away
        vx += away * poses[k, 0]
        vy += away * poses[k, 1]
        wz += away * poses[k, 2]
    return MOVES, vx / spread, vy / spread, wz / spread


@compiled
def _after(
    trails: Structs, stamp_ns: int, x: float, y: float, yaw: float
) -> tuple[int, float, float, float]:
    trail = trails[0]
    add_pose(trail, stamp_ns, x, y, yaw)
    return velocity(trail, trail.window_ns)


@example
def _example() -> None:
    Motion(0.3).add_pose(0, 0.0, 0.0)
