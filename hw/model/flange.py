"""Where the flange of an arm is: its joints one after another, in plain Python."""

from __future__ import annotations

import math

from hw.geometry import Pose3
from hw.model.robot import ArmModel
from hw.samples import Joints
from hw.se3 import IDENTITY, product


class FlangeChain:
    """The chain of an arm, by its calibration or, without one, by its arm file.

    What a URDF in a robot file says of mount and lengths does not count.
    """

    def __init__(self, arm: ArmModel) -> None:
        self._mount = arm.mount.pose()
        chain = arm.calibration or arm.model.placements
        self._flange = arm.model.flange.pose().as_motion()
        self._origins = [placement.pose().as_motion() for placement in chain]

    def on_base(self, joints: Joints) -> Pose3:
        """base_from_flange at these angles, rad; `base` is that of the arm's controller."""
        found = IDENTITY
        for origin, angle in zip(self._origins, joints, strict=True):
            turn = (0.0, 0.0, 0.0, 0.0, 0.0, math.sin(0.5 * angle), math.cos(0.5 * angle))
            found = product(product(found, origin), turn)
        if self._flange != IDENTITY:
            found = product(found, self._flange)
        return Pose3(*found)

    def on_rover(self, joints: Joints) -> Pose3:
        """rover_from_flange at these angles, rad."""
        return self._mount @ self.on_base(joints)
