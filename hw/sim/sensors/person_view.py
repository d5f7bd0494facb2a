"""The tracked poses of the person, with the same kinds of faults as the trackers on the rover."""

from __future__ import annotations

import math
from dataclasses import replace

from hw.geometry import Pose2, Pose3, wrap
from hw.model import ViveErrors, WhiteNoise
from hw.samples import Sample, UserPose
from hw.sim.sensors.coverage import Coverage
from hw.sim.sensors.streams import Stream
from hw.sim.sensors.vive import Device

WAIST_M = 1.0
"""Height of the tracker on the tailbone, m above the floor."""


class PersonView:
    """Measured poses of the person and the DEEP, transformed into the map by the calibration.

    So after a restart of the tracking system all of them are off by the same motion. The tailbone's
    tracker is lost now and then; meanwhile the body is derived from the headset, less exactly. A
    jump after re-acquisition occurs only if the person had left the tracked area. `everywhere`: the
    whole room counts as tracked area.
    """

    def __init__(
        self, coverage: Coverage, errors: ViveErrors, seed: int, *, everywhere: bool
    ) -> None:
        self._coverage, self._everywhere = coverage, everywhere
        self._device = Device(errors, seed, "user.pose")
        self._noise = WhiteNoise(seed, "user.pose/vive", errors.noise)
        self._reported_from_map = errors.restart.inverse()
        self._reported_from_map3 = Pose3.from_yaw(
            self._reported_from_map.x, self._reported_from_map.y, 0.0, self._reported_from_map.yaw
        )
        self._left = False
        self._by_headset = errors.by_headset
        self._leans = Stream(seed, "user.pose/headset")
        self._lean: tuple[float, float] | None = None

    def seen(self, sample: Sample) -> Sample | None:
        """The measured pose; None while tracking is lost. Call in the order of time."""
        name, stamp, value = sample
        if not isinstance(value, UserPose):
            return sample
        covered, to_border = True, math.inf
        if not self._everywhere:
            body = value.body
            covered, to_border = self._coverage.visibility(body.x, body.y, WAIST_M, stamp)
        self._left = self._left or not covered
        if self._device.seen(stamp, covered=covered, alone=self._left):
            self._left = False
            self._lean = None
        elif covered and self._by_headset > 0.0:
            value = self._leaning(value, stamp)
        else:
            return None
        return Sample(name, stamp, self._noise.user(self._moved(value, to_border), stamp))

    def _leaning(self, pose: UserPose, stamp_ns: int) -> UserPose:
        """The body derived from the headset: off by a random lean, held during the drop-out."""
        if self._lean is None:
            angle, share = (self._leans.at(stamp_ns).random(2)).tolist()
            lean, turn = share * self._by_headset, 2.0 * math.pi * angle
            self._lean = lean * math.cos(turn), lean * math.sin(turn)
        dx, dy = self._lean
        body = pose.body
        return replace(pose, body=Pose2(body.x + dx, body.y + dy, body.yaw))

    def reported(self, deep: Pose3) -> Pose3:
        """The DEEP as reported, from its true pose in the map."""
        return self._reported_from_map3 @ deep

    def _moved(self, pose: UserPose, to_border: float) -> UserPose:
        off, body = self._device.off, self._reported_from_map @ pose.body
        turn = off.yaw + self._reported_from_map.yaw
        dx, dy = self._device.bias(to_border)
        return UserPose(
            Pose2(body.x + off.x + dx, body.y + off.y + dy, wrap(body.yaw + off.yaw)),
            wrap(pose.head_yaw + turn),
            pose.head and self.reported(pose.head),
            pose.left_hand and self.reported(pose.left_hand),
            pose.right_hand and self.reported(pose.right_hand),
        )
