"""The present pose of the base for its control loop: the newest fix, advanced by odometry.

Localization gives one estimate per tick, already somewhat old; the wheels give odometry in every
cycle, which drifts. The tracking system sees the rover in the same frame as the person, and the
distance between them is what matters. So while a tracker on the rover is visible, its pose takes
precedence over the estimate.
"""

from __future__ import annotations

from typing import NamedTuple

from hw.geometry import STILL, Pose2, Twist2, wrap
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


class _Fix(NamedTuple):
    stamp_ns: int
    map_from_odom: Pose2
    sigma: float
    way: float

    def at(self, odom_from_base: Pose2, way: float) -> Located:
        pose = self.map_from_odom @ odom_from_base
        return Located(pose, self.sigma + SLIP * (way - self.way))


class Reckoner:
    """See the module."""

    def __init__(self, tracking: Tracking) -> None:
        self._tracking = tracking
        self._wheels = PoseHistory(_along, KEPT_NS)
        self._twist = STILL
        self._seen: tuple[int, TrackerPose] | None = None
        self._tracked: _Fix | None = None
        self._estimated: _Fix | None = None

    def move(self, stamp_ns: int, wheels_say: Odometry) -> None:
        """Take odometry (odom_from_base and twist); late stamps are ignored."""
        wheels, way, odom_from_base = self._wheels, 0.0, wheels_say.pose
        if wheels.newest is not None:
            last_ns, (last, gone) = wheels.newest
            if stamp_ns <= last_ns:
                return
            way = gone + last.distance_to(odom_from_base)
        wheels.insert(stamp_ns, (odom_from_base, way))
        self._twist = wheels_say.twist

    def track(self, stamp_ns: int, seen: TrackerPose) -> None:
        """Take a tracker's pose; only the newest one from a tracker with a known mount is kept."""
        newest = self._seen
        if seen.tracker in self._tracking.mounts and (newest is None or stamp_ns >= newest[0]):
            self._seen = stamp_ns, seen

    def estimate(self, stamp_ns: int, pose: Pose2 | None, sigma: PoseSigma | None) -> None:
        """Take the localization's estimate at an instant; None: it has none."""
        if pose is None or sigma is None:
            self._estimated = None
        elif self._estimated is None or stamp_ns != self._estimated.stamp_ns:
            self._estimated = self._fix(stamp_ns, pose, sigma.position)

    def at(self, now_ns: int) -> Located | None:
        """The pose now; None without odometry, or with neither a tracker nor an estimate.

        Since the last odometry the velocity is assumed constant. If both a tracker and an estimate
        are known, sigma is at least their distance from each other.
        """
        newest = self._wheels.newest
        if newest is None or now_ns - newest[0] > OLD_NS:
            return None
        stamp, (last, way) = newest
        place = last @ _way(self._twist, max(0, now_ns - stamp) * 1e-9)
        way += last.distance_to(place)
        tracked, estimated = self._newest_tracked(now_ns), self._estimated
        found = None if estimated is None else estimated.at(place, way)
        if tracked is None:
            return found
        seen = tracked.at(place, way)
        if found is None:
            return seen
        return Located(seen.pose, max(seen.sigma, seen.pose.distance_to(found.pose)))

    def _newest_tracked(self, now_ns: int) -> _Fix | None:
        """The fix by the newest tracker; None if none was seen lately."""
        if self._seen is None or now_ns - self._seen[0] > OLD_NS:
            return None
        stamp, seen = self._seen
        if self._tracked is None or self._tracked.stamp_ns != stamp:
            pose = self._tracking.base_by(seen)
            assert pose is not None  # its mount is known
            self._tracked = self._fix(stamp, pose, TRACKER_SIGMA)
        return self._tracked

    def _fix(self, stamp_ns: int, pose: Pose2, sigma: float) -> _Fix | None:
        """A fix, from the odometry interpolated at its stamp; None if that is not known."""
        newest = self._wheels.newest
        if newest is None or not -KEPT_NS <= stamp_ns - newest[0] <= OLD_NS:
            return None
        # without odometry since, the newest still holds
        then = newest[1] if stamp_ns > newest[0] else self._wheels.at(stamp_ns)
        if then is None:
            return None
        odom, way = then
        return _Fix(stamp_ns, pose @ odom.inverse(), sigma, way)


def _along(a: _Driven, b: _Driven, share: float) -> _Driven:
    (pose, way), (then, further) = a, b
    return wrapped(pose, then, share), way + share * (further - way)


def _way(twist: Twist2, time: float) -> Pose2:
    """The displacement in a short time, s, at this velocity: straight along the mean heading."""
    gone = twist.rotated(0.5 * twist.wz * time)
    return Pose2(gone.vx * time, gone.vy * time, wrap(twist.wz * time))
