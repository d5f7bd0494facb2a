"""Poses of the base by the trackers on it, as often as they are wanted (R30)."""

from __future__ import annotations

import math

from hw.geometry import Pose2, wrap
from hw.samples import TrackerPose
from hw.tracking import Tracking

FRESH_NS = 50_000_000
"""Trackers whose poses lie no farther apart are taken together."""
ALIKE_M, ALIKE_RAD = 0.01, 0.007
"""Two trackers that tell poses of the base no farther apart agree."""


class TrackerFeed:
    """The newest word from each tracker; where the base is by them is computed when asked for.

    `agree`: was what was given last the word of several that tell the same? One that was lost, and
    is off since, is alone with that; a frame that has moved is moved for all.
    """

    def __init__(self, tracking: Tracking) -> None:
        self._tracking = tracking
        self._newest: dict[str, tuple[int, TrackerPose]] = {}
        self._given_ns: int | None = None
        self.agree = False

    def put(self, stamp_ns: int, seen: TrackerPose, period: float) -> Pose2 | None:
        """Take a pose of a tracker; map_from_base at its stamp if `period`, s, has gone by.

        It is the mean of those by all trackers that were heard lately.
        """
        self._newest[seen.tracker] = stamp_ns, seen
        given = self._given_ns
        if given is not None and 0 <= stamp_ns - given < round(period * 1e9):
            return None
        fresh = (last for at, last in self._newest.values() if abs(stamp_ns - at) <= FRESH_NS)
        poses = [pose for last in fresh if (pose := self._tracking.base_by(last)) is not None]
        if not poses:
            return None
        self._given_ns = stamp_ns
        mean = _mean(poses)
        self.agree = len(poses) > 1 and all(_alike(mean, pose) for pose in poses)
        return mean


def _alike(one: Pose2, other: Pose2) -> bool:
    turned = abs(wrap(one.yaw - other.yaw))
    return one.distance_to(other) <= 0.5 * ALIKE_M and turned <= 0.5 * ALIKE_RAD


def _mean(poses: list[Pose2]) -> Pose2:
    cosine = sum(math.cos(pose.yaw) for pose in poses)
    sine = sum(math.sin(pose.yaw) for pose in poses)
    x = math.fsum(pose.x for pose in poses) / len(poses)
    y = math.fsum(pose.y for pose in poses) / len(poses)
    return Pose2(x, y, math.atan2(sine, cosine))
