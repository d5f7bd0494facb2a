"""Where the base is right now, for its own loop: the newest fix, moved on by the wheels.

Localization speaks once per tick and of the past; the wheels speak in every cycle and drift. The
tracking system sees the rover in the very frame in which it sees the person, so that while a
tracker on the rover is seen its pose goes before the estimate: what counts is how far the two are
from each other.
"""

from __future__ import annotations

from bisect import bisect_left
from collections import deque
from typing import NamedTuple

from hw.geometry import STILL, Pose2, Twist2, wrap
from hw.samples import Odometry, PoseSigma, TrackerPose
from hw.tracking import Tracking

FRESH_NS = 150_000_000
"""Wheels or a tracker that have been silent for longer tell nothing any more."""
KEPT_NS = 1_000_000_000
"""A tracker's pose that comes later than this after its stamp is left out."""
TRACKER_SIGMA = 0.01
"""Of a pose by a tracker, with calibration and a re-acquisition, m."""
SLIP = 0.05
"""Of the way since a fix, so much may be the wheels' alone."""


class Located(NamedTuple):
    """map_from_base and its standard deviation along the worst axis, m."""

    pose: Pose2
    sigma: float


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
        self._wheels: deque[tuple[int, Pose2, float]] = deque()
        self._twist = STILL
        self._seen: tuple[int, TrackerPose] | None = None
        self._tracked: _Fix | None = None
        self._estimated: _Fix | None = None

    def move(self, stamp_ns: int, wheels_say: Odometry) -> None:
        """The wheels have got here, in the frame in which they count; late stamps are left out."""
        wheels, way, odom_from_base = self._wheels, 0.0, wheels_say.pose
        if wheels:
            if stamp_ns <= wheels[-1][0]:
                return
            way = wheels[-1][2] + wheels[-1][1].distance_to(odom_from_base)
        wheels.append((stamp_ns, odom_from_base, way))
        self._twist = wheels_say.twist
        while stamp_ns - wheels[0][0] > KEPT_NS:
            wheels.popleft()

    def track(self, stamp_ns: int, seen: TrackerPose) -> None:
        """A tracker on the rover was seen; the newest that is known counts, whichever it is."""
        newest = self._seen
        if seen.tracker in self._tracking.mounts and (newest is None or stamp_ns >= newest[0]):
            self._seen = stamp_ns, seen

    def estimate(self, stamp_ns: int, pose: Pose2 | None, sigma: PoseSigma | None) -> None:
        """Where localization takes the base to have been; None: it does not know."""
        if pose is None or sigma is None:
            self._estimated = None
        elif self._estimated is None or stamp_ns != self._estimated.stamp_ns:
            self._estimated = self._fix(stamp_ns, pose, sigma.position)

    def at(self, now_ns: int) -> Located | None:
        """Where the base is; None: neither a tracker nor localization says so, or no wheel speaks.

        Since their last word the wheels are taken to turn on. Where trackers and localization both
        speak, by how much they contradict each other is part of sigma.
        """
        if not self._wheels or now_ns - self._wheels[-1][0] > FRESH_NS:
            return None
        stamp, last, way = self._wheels[-1]
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
        """The fix by the newest tracker; None: none has been seen lately."""
        if self._seen is None or now_ns - self._seen[0] > FRESH_NS:
            return None
        stamp, seen = self._seen
        if self._tracked is None or self._tracked.stamp_ns != stamp:
            pose = self._tracking.base_by(seen)
            assert pose is not None  # its mount is known
            self._tracked = self._fix(stamp, pose, TRACKER_SIGMA)
        return self._tracked

    def _fix(self, stamp_ns: int, pose: Pose2, sigma: float) -> _Fix | None:
        """A fix by where the wheels were then; None: nobody knows any more."""
        wheels = self._wheels
        later = bisect_left(wheels, stamp_ns, key=lambda entry: entry[0])
        if later == len(wheels):  # the wheels have not spoken since: they are where they were
            if not wheels or stamp_ns - wheels[-1][0] > FRESH_NS:
                return None
            _, odom, way = wheels[-1]
        else:
            then, odom, way = wheels[later]
            if then != stamp_ns:
                if later == 0:
                    return None
                before, a, start = wheels[later - 1]
                share = (stamp_ns - before) / (then - before)
                middle = a.between(odom, share)
                odom = Pose2(middle.x, middle.y, wrap(middle.yaw))
                way = start + share * (way - start)
        return _Fix(stamp_ns, pose @ odom.inverse(), sigma, way)


def _way(twist: Twist2, time: float) -> Pose2:
    """Where a velocity in the base frame leads within a moment, s: along the mean heading."""
    gone = twist.rotated(0.5 * twist.wz * time)
    return Pose2(gone.vx * time, gone.vy * time, wrap(twist.wz * time))
