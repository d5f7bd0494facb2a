"""A live person: poses and requests pushed in from outside."""

from __future__ import annotations

import math

from hw.geometry import Pose2, Pose3
from hw.samples import Sample, UserPose

_NS = 1e-9


class LivePerson:
    """Takes poses and requests as they come; they take effect at the next step.

    The true pose is the newest one pushed; the speed is computed from the newest two, and 0 if
    nothing came for 0.5 s.
    """

    def __init__(self, start: Pose2) -> None:
        self.body = start
        self.speed = 0.0
        self.request: Pose3 | None = None
        self.measured: Sample | None = None
        self.finished = False
        self._newest: Sample | None = None
        self._taken: Sample | None = None
        self._velocity = 0.0
        self._next_request: Pose3 | None = None
        self._ended = False

    def push(self, stamp_ns: int, pose: UserPose) -> None:
        """Push a measured pose.

        Raises:
            ValueError: not finite, or not newer than the one before.
        """
        body = Pose2.checked(pose.body.x, pose.body.y, pose.body.yaw)
        if not math.isfinite(pose.head_yaw):
            raise ValueError(f"pose: head_yaw is {pose.head_yaw}; a finite number is needed")
        if self._newest is not None:
            elapsed = stamp_ns - self._newest.stamp_ns
            if elapsed <= 0:
                raise ValueError(f"pose: stamp {stamp_ns} ns is not after the one before")
            before = self._newest.value
            assert isinstance(before, UserPose)
            self._velocity = before.body.distance_to(body) / (elapsed * _NS)
            pose = before if pose == before else pose
        self._newest = Sample("user.pose", stamp_ns, pose)

    def ask(self, deep: Pose3) -> None:
        """Request a touch at `deep` (map).

        Raises:
            ValueError: not finite, or no unit quaternion.
        """
        position, quaternion = (deep.x, deep.y, deep.z), (deep.qx, deep.qy, deep.qz, deep.qw)
        self._next_request = Pose3.checked(position, quaternion)

    def let_go(self) -> None:
        """End the request."""
        self._next_request = None

    def end(self) -> None:
        """Mark the person as finished."""
        self._ended = True

    def step(self, now_ns: int, robot: Pose2, informed: bool) -> None:  # noqa: ARG002
        """Advance to now_ns; how a live person reacts to the robot is up to the source."""
        newest = self._newest
        if newest is not None and newest.stamp_ns > now_ns:
            raise ValueError(f"pose: stamp {newest.stamp_ns} ns is in the future of {now_ns} ns")
        self.measured = newest if newest is not self._taken else None
        self._taken = newest
        self.request = self._next_request
        self.finished = self._ended
        if newest is None:
            return
        assert isinstance(newest.value, UserPose)
        self.body = newest.value.body
        fresh = now_ns - newest.stamp_ns < 500_000_000
        self.speed = self._velocity if fresh else 0.0
