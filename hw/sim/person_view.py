"""How tracking sees the person: like the trackers on the rover, told in the map."""

from __future__ import annotations

import math
from dataclasses import replace

from hw.geometry import Pose2, Pose3, wrap
from hw.samples import Sample, UserPose
from hw.sim.coverage import Coverage
from hw.sim.errors import ViveErrors
from hw.sim.sensors import WhiteNoise
from hw.sim.streams import Stream
from hw.sim.vive import Device

WAIST_M = 1.0
"""Height of the tracker on the tailbone."""


class PersonView:
    """What is told of the person is taken from the frame of tracking to the map as calibrated.

    So after a restart of the tracking their poses and the DEEP are off together. The tailbone's
    tracker is lost now and then; the headset goes on being seen: it tells the body meanwhile, less
    exactly, and only somebody who comes back into the tracked area is off by a jump. `everywhere`:
    the whole room is as good as the tracked area.
    """

    def __init__(
        self, coverage: Coverage, errors: ViveErrors, seed: int, *, everywhere: bool
    ) -> None:
        self._coverage, self._everywhere = coverage, everywhere
        self._device = Device(errors, seed, "user.pose")
        self._noise = WhiteNoise(seed, "user.pose/vive", errors.noise)
        self._told_from_map = errors.restart.inverse()
        self._told_from_map3 = Pose3.from_yaw(
            self._told_from_map.x, self._told_from_map.y, 0.0, self._told_from_map.yaw
        )
        self._left = False
        self._by_headset = errors.by_headset
        self._leans = Stream(seed, "user.pose/headset")
        self._lean: tuple[float, float] | None = None

    def seen(self, sample: Sample) -> Sample | None:
        """A pose as tracking has it; None: it does not. Call in the order of time."""
        name, stamp, value = sample
        if not isinstance(value, UserPose):
            return sample
        covered, to_border = True, math.inf
        if not self._everywhere:
            body = value.body
            covered, to_border = self._coverage.of(body.x, body.y, WAIST_M, stamp)
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
        """Where the headset takes the body to be: off by as much as they lean while it is so."""
        if self._lean is None:
            angle, share = (self._leans.at(stamp_ns).random(2)).tolist()
            lean, turn = share * self._by_headset, 2.0 * math.pi * angle
            self._lean = lean * math.cos(turn), lean * math.sin(turn)
        dx, dy = self._lean
        body = pose.body
        return replace(pose, body=Pose2(body.x + dx, body.y + dy, body.yaw))

    def told(self, deep: Pose3) -> Pose3:
        """The DEEP as it is told, from where it is in the map."""
        return self._told_from_map3 @ deep

    def _moved(self, pose: UserPose, to_border: float) -> UserPose:
        off, body = self._device.off, self._told_from_map @ pose.body
        turn = off.yaw + self._told_from_map.yaw
        dx, dy = self._device.bias(to_border)
        return replace(
            pose,
            body=Pose2(body.x + off.x + dx, body.y + off.y + dy, wrap(body.yaw + off.yaw)),
            head_yaw=wrap(pose.head_yaw + turn),
            head=None if pose.head is None else self.told(pose.head),
            left_hand=None if pose.left_hand is None else self.told(pose.left_hand),
            right_hand=None if pose.right_hand is None else self.told(pose.right_hand),
        )
