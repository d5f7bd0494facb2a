"""The present pose of the base for its control loop: the newest fix, advanced by odometry.

Localization gives one estimate per tick, already somewhat old; the wheels give odometry in every
cycle, which drifts. The tracking system sees the rover in the same frame as the person, and the
distance between them is what matters. So while a tracker on the rover is visible, its pose takes
precedence over the estimate.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from hw.geometry import Pose2
from hw.jit import Struct, Structs, compiled, example, record_type, wrapped as wrap_angle
from hw.model import Tracking
from hw.motion.pose_history import PoseHistory, wrapped
from hw.samples import OLD_NS, Odometry, PoseSigma, TrackerPose

KEPT_NS = 1_000_000_000
"""Odometry kept, ns: a fix that arrives later than this after its stamp is ignored."""
TRACKER_SIGMA = 0.01
"""Standard deviation of a tracker's pose, with calibration and re-acquisition, m."""
SLIP = 0.05
"""Uncertainty from slip: share of the distance driven since a fix."""


class Located(NamedTuple):
    """map_from_base, and its standard deviation along the worst axis, m."""

    pose: Pose2
    sigma: float


_Driven = tuple[Pose2, float]
"""odom_from_base, and the distance driven so far, m."""


_Place = tuple[float, float, float]

ODOMETRY = record_type(
    ("stamp_ns", "i8"), ("odom_from_base", "f8", (3,)), ("twist", "f8", (3,)), ("way", "f8"),
    ("known", "?"),
)  # fmt: skip
FIX = record_type(
    ("stamp_ns", "i8"), ("map_from_odom", "f8", (3,)), ("sigma", "f8"), ("way", "f8"),
    ("known", "?"),
)  # fmt: skip
RECKONING = record_type(("odometry", ODOMETRY), ("tracked", FIX), ("estimated", FIX))
"""The newest odometry, and where `odom` is in the map by the newest tracker and by the
localization; `way` is the distance driven until then, m."""


class Reckoner:
    """See the module. `state` is the record behind it, (1,) of `RECKONING`."""

    def __init__(self, tracking: Tracking) -> None:
        self.state: Structs = np.zeros(1, RECKONING)
        self._tracking = tracking
        self._wheels = PoseHistory(_along, KEPT_NS)
        self._seen: tuple[int, TrackerPose] | None = None
        self._tracked_ns: int | None = None
        self._estimated_ns: int | None = None

    def move(self, stamp_ns: int, wheels_say: Odometry) -> None:
        """Take odometry (odom_from_base and twist); late stamps are ignored."""
        wheels, way, odom_from_base = self._wheels, 0.0, wheels_say.pose
        if wheels.newest is not None:
            last_ns, (last, gone) = wheels.newest
            if stamp_ns <= last_ns:
                return
            way = gone + last.distance_to(odom_from_base)
        wheels.insert(stamp_ns, (odom_from_base, way))
        pose, twist = odom_from_base, wheels_say.twist
        self.state["odometry"] = (
            stamp_ns, (pose.x, pose.y, pose.yaw), (twist.vx, twist.vy, twist.wz), way, True,
        )  # fmt: skip

    def track(self, stamp_ns: int, seen: TrackerPose) -> None:
        """Take a tracker's pose; only the newest one from a tracker with a known mount is kept."""
        newest = self._seen
        if seen.tracker in self._tracking.mounts and (newest is None or stamp_ns >= newest[0]):
            self._seen = stamp_ns, seen

    def estimate(self, stamp_ns: int, pose: Pose2 | None, sigma: PoseSigma | None) -> None:
        """Take the localization's estimate at an instant; None: it has none."""
        if pose is None or sigma is None:
            self._estimated_ns = self._fix("estimated", stamp_ns, None, 0.0)
        elif stamp_ns != self._estimated_ns:
            self._estimated_ns = self._fix("estimated", stamp_ns, pose, sigma.position)

    def at(self, now_ns: int) -> Located | None:
        """The pose now; see `reckoned`."""
        self.prepare(now_ns)
        known, (x, y, yaw), sigma = _reckoned(self.state, now_ns)
        return Located(Pose2(x, y, yaw), sigma) if known else None

    def prepare(self, now_ns: int) -> None:
        """Make the fix by the newest tracker, for `reckoned` from now until new samples arrive."""
        newest = self._wheels.newest
        if self._seen is None or newest is None or now_ns - newest[0] > OLD_NS:
            return
        stamp, seen = self._seen
        if stamp != self._tracked_ns and now_ns - stamp <= OLD_NS:
            pose = self._tracking.base_by(seen)
            assert pose is not None  # its mount is known
            self._tracked_ns = self._fix("tracked", stamp, pose, TRACKER_SIGMA)

    def _fix(self, by: str, stamp_ns: int, pose: Pose2 | None, sigma: float) -> int | None:
        """Set a fix by the odometry interpolated at its stamp; the stamp, None if not known."""
        newest, then = self._wheels.newest, None
        if newest is not None and -KEPT_NS <= stamp_ns - newest[0] <= OLD_NS:
            # without odometry since, the newest still holds
            then = newest[1] if stamp_ns > newest[0] else self._wheels.at(stamp_ns)
        if pose is None or then is None:
            self.state[by]["known"] = False
            return None
        odom, way = then
        there = pose @ odom.inverse()
        self.state[by] = (stamp_ns, (there.x, there.y, there.yaw), sigma, way, True)
        return stamp_ns


def _along(a: _Driven, b: _Driven, share: float) -> _Driven:
    (pose, way), (then, further) = a, b
    return wrapped(pose, then, share), way + share * (further - way)


@compiled
def reckoned(now: Struct, now_ns: int) -> tuple[bool, _Place, float]:
    """Whether the pose now is known, map_from_base, and its sigma, m.

    It is unknown without odometry, and with neither a tracker nor an estimate. Since the last
    odometry the velocity is assumed constant. If both a tracker and an estimate are known, sigma is
    at least their distance from each other.
    """
    nowhere = (False, (0.0, 0.0, 0.0), 0.0)
    newest, tracked, estimated = now.odometry, now.tracked, now.estimated
    if not newest.known or now_ns - newest.stamp_ns > OLD_NS:
        return nowhere
    last, time = newest.odom_from_base, max(0, now_ns - newest.stamp_ns) * 1e-9
    place = _composed(last, _way(newest.twist, time))
    way = newest.way + math.hypot(place[0] - last[0], place[1] - last[1])
    visible = tracked.known and now_ns - tracked.stamp_ns <= OLD_NS
    if not visible and not estimated.known:
        return nowhere
    fix = tracked if visible else estimated
    pose, sigma = _composed(fix.map_from_odom, place), fix.sigma + SLIP * (way - fix.way)
    if visible and estimated.known:
        other = _composed(estimated.map_from_odom, place)
        sigma = max(sigma, math.hypot(other[0] - pose[0], other[1] - pose[1]))
    return True, pose, sigma


@compiled
def _composed(pose: _Place, other: _Place) -> _Place:
    """As `Pose2.__matmul__`."""
    c, s = math.cos(pose[2]), math.sin(pose[2])
    x, y = pose[0] + c * other[0] - s * other[1], pose[1] + s * other[0] + c * other[1]
    return x, y, wrap_angle(pose[2] + other[2])


@compiled
def _way(twist: _Place, time: float) -> _Place:
    """The displacement in a short time, s, at this velocity: straight along the mean heading."""
    half = 0.5 * twist[2] * time
    c, s = math.cos(half), math.sin(half)
    ahead, left = c * twist[0] - s * twist[1], s * twist[0] + c * twist[1]
    return ahead * time, left * time, wrap_angle(twist[2] * time)


@compiled
def _reckoned(states: Structs, now_ns: int) -> tuple[bool, _Place, float]:
    return reckoned(states[0], now_ns)


@example
def _example() -> None:
    _reckoned(np.zeros(1, RECKONING), 0)
