"""The track of the user: where they were last seen, and how fast they were; m, s, m/s."""

from __future__ import annotations

import math

from hw.jit import Struct, compiled, record_type
from hw.motion import STANDS, TRAIL, UNKNOWN, add_pose, lay_out, velocity
from hw.samples import OLD_S

QUICK, STEADY = 0.1, 0.3
"""Windows over which the user's speed is estimated, s."""
_QUICK_NS, _STEADY_NS = round(QUICK * 1e9), round(STEADY * 1e9)
_FAR = 1e4
"""Poses farther than this from the origin of the map are refused, m."""

USER = record_type(
    ("seen", "?"), ("stamp_ns", "i8"), ("x", "f8"), ("y", "f8"),
    ("ahead_ns", "i8"), ("trail", TRAIL),
    ("speed_known", "?"), ("speed", "f8"), ("steady_known", "?"), ("steady", "f8"),
)  # fmt: skip
"""The user; the newest pose replaces the others.

`x`, `y` in the map and `stamp_ns` are those of the newest pose, if `seen`. `speed` is the greater
of the speeds over the last 0.1 s, which reacts at once to a user who sets off, and 0.3 s; `steady`
is that over 0.3 s alone, which noise does not raise above standing. A stamp may be `ahead_ns` ahead
of our clock.
"""


def await_user(user: Struct, ahead: float) -> None:
    """Prepare a track without a pose; `ahead` in s."""
    user.ahead_ns = round(ahead * 1e9)
    lay_out(user.trail, STEADY, OLD_S)
    forget(user)


@compiled
def forget(user: Struct) -> None:
    """Forget all poses."""
    user.seen = user.speed_known = user.steady_known = False
    user.trail.first = user.trail.end = 0


@compiled
def age_of(user: Struct, now_ns: int) -> float:
    """Age of the newest pose, s; infinite before the first, negative if it is ahead of now."""
    return (now_ns - user.stamp_ns) / 1e9 if user.seen else math.inf


@compiled
def add_position(user: Struct, now_ns: int, stamp_ns: int, x: float, y: float) -> bool:
    """Take a pose that arrived now; False if out of range, not newer, or from the future."""
    if not (abs(x) < _FAR and abs(y) < _FAR) or stamp_ns > now_ns + user.ahead_ns:
        return False
    stamp_ns = min(stamp_ns, now_ns)
    if user.seen and stamp_ns <= user.stamp_ns:
        return False
    user.seen, user.stamp_ns, user.x, user.y = True, stamp_ns, x, y
    add_pose(user.trail, stamp_ns, x, y, 0.0)
    user.steady_known, user.steady = _speed(user.trail, _STEADY_NS)
    quick_known, quick = _speed(user.trail, _QUICK_NS)
    user.speed_known = user.steady_known and quick_known
    user.speed = max(quick, user.steady)
    return True


@compiled
def _speed(trail: Struct, window_ns: int) -> tuple[bool, float]:
    known, vx, vy, _ = velocity(trail, window_ns)
    return known != UNKNOWN, 0.0 if known == STANDS else math.hypot(vx, vy)
