"""Poses of the base from its trackers, at a requested period (R30)."""

from __future__ import annotations

import math

from hw import Pose2, TrackerPose, total
from hw.model import Tracking

FRESH_NS = 50_000_000
"""Largest difference of stamps of tracker poses that are averaged, ns."""


class TrackerFeed:
    """The newest pose of each tracker; the base is computed from them only when due.

    `each` has map_from_base by each tracker in the last mean.
    """

    def __init__(self, tracking: Tracking) -> None:
        self._tracking = tracking
        self._newest: dict[str, tuple[int, TrackerPose]] = {}
        self._given_ns: int | None = None
        self.each: list[Pose2] = []

    def add_tracker_pose(self, stamp_ns: int, seen: TrackerPose, period: float) -> Pose2 | None:
        """Take a pose of a tracker; map_from_base at its stamp once per `period`, s, else None.

        It is the mean over all trackers with a fresh pose.
        """
        self._newest[seen.tracker] = stamp_ns, seen
        given = self._given_ns
        if given is not None and 0 <= stamp_ns - given < round(period * 1e9):
            return None
        fresh = (last for at, last in self._newest.values() if abs(stamp_ns - at) <= FRESH_NS)
        poses = [pose for last in fresh if (pose := self._tracking.base_by(last)) is not None]
        if not poses:
            return None
        self._given_ns, self.each = stamp_ns, poses
        return _mean(poses)


def _mean(poses: list[Pose2]) -> Pose2:
    cosine = total(math.cos(pose.yaw) for pose in poses)
    sine = total(math.sin(pose.yaw) for pose in poses)
    x = math.fsum(pose.x for pose in poses) / len(poses)
    y = math.fsum(pose.y for pose in poses) / len(poses)
    return Pose2(x, y, math.atan2(sine, cosine))
