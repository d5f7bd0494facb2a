"""The frames of a run as a tree with a history: the signal `transforms`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from hw import Pose2, Pose3, UserPose
from hw.model import RobotModel, Tracking
from states.signals import StampedPlace

if TYPE_CHECKING:
    from states.localization.frames.transforms import TransformBuffer

MAP, BASE, USER, VIVE, ARM = "map", "base", "user", "vive", "arm"
HEAD, HANDS = "user_head", ("user_left_hand", "user_right_hand")


class FramesEstimator:
    """Puts poses of robot and person into a `TransformBuffer`, which is its value.

    Frames: `map`, `vive` (the tracking frame), `base`; on the base `arm` and, by name, each scanner
    and tracker; `user` (their body on the floor) and, where tracked, `user_head` and the hands.
    The buffer grows as poses arrive; a lookup at a past stamp always gives the same answer.
    """

    def __init__(self, robot: RobotModel, tracking: Tracking) -> None:
        from states.localization.frames.transforms import TransformBuffer

        self._frames: TransformBuffer = TransformBuffer()
        self._frames.fix(MAP, VIVE, tracking.map_from_vive)
        for name, mount in tracking.mounts.items():
            self._frames.fix(BASE, name, mount)
        for name, lidar in robot.sensing.lidars.items():
            self._frames.fix(BASE, name, lidar.mount.pose)
        if robot.arm is not None:
            self._frames.fix(BASE, ARM, Pose3(*robot.arm.mount.xyz))
        self._stamp: int | None = None

    def update(self, _signal: str, sample: StampedPlace) -> None:
        """Take one pose of the base or of the user."""
        pose, stamp = sample.value, sample.stamp
        if isinstance(pose, Pose2):
            self._set_pose(BASE, stamp, pose.upright())
        elif isinstance(pose, UserPose):
            self._set_pose(USER, stamp, pose.body.upright())
            others = zip((HEAD, *HANDS), (pose.head, pose.left_hand, pose.right_hand), strict=True)
            for name, other in others:
                if other is not None:
                    self._set_pose(name, stamp, other)

    def value(self) -> TransformBuffer:
        """The buffer with all frames."""
        return self._frames

    def stamp(self) -> int | None:
        """Stamp of the newest pose, ns."""
        return self._stamp

    def _set_pose(self, frame: str, stamp: int, map_from_frame: Pose3) -> None:
        self._frames.set_transform(MAP, frame, stamp, map_from_frame)
        self._stamp = stamp if self._stamp is None else max(stamp, self._stamp)
