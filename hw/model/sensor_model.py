"""Delay and white noise of simulated measurements, for tiers without sensor models.

Every random number depends on seed, source and stamp alone, so that a source is not affected by how
often another one is measured or read.
"""

from __future__ import annotations

import math
import random
from dataclasses import dataclass, replace

from hw.geometry import Pose2, Pose3, wrap
from hw.samples import UserPose


@dataclass(frozen=True, slots=True)
class SensorModel:
    """Errors of the simulated robot and its surroundings; all 0: ideal.

    `tracking_delay`: age of a pose of the person on arrival, s. `tracking_noise`, `pose_noise`:
    standard deviation of each coordinate of the person's and the base's pose, m; for yaws half of
    that figure, in rad.
    """

    tracking_delay: float = 0.0
    tracking_noise: float = 0.0
    pose_noise: float = 0.0
    seed: int = 0

    def __post_init__(self) -> None:
        for name in ("tracking_delay", "tracking_noise", "pose_noise"):
            if not 0.0 <= getattr(self, name) < math.inf:
                raise ValueError(f"sensors: {name} is {getattr(self, name)}; it must be 0 or more")

    @property
    def of_tracking(self) -> WhiteNoise | None:
        """The noise of `user.pose`."""
        return self._noise("user.pose", self.tracking_noise)

    @property
    def of_pose(self) -> WhiteNoise | None:
        """The noise of `base.pose`."""
        return self._noise("base.pose", self.pose_noise)

    def _noise(self, source: str, sigma: float) -> WhiteNoise | None:
        return WhiteNoise(self.seed, source, sigma) if sigma > 0.0 else None


IDEAL = SensorModel()


class WhiteNoise:
    """White noise of one source; `sigma` in m, for yaws half of that figure in rad."""

    def __init__(self, seed: int, source: str, sigma: float) -> None:
        self._stream = f"{seed}/{source}/"
        self._sigma = sigma
        self._chance = random.Random(0)  # making one seeds it twice

    def error(self, stamp_ns: int) -> Pose2:
        """The error of a planar pose with this stamp, to be added."""
        return self._plane(self._at(stamp_ns))

    def user(self, pose: UserPose, stamp_ns: int) -> UserPose:
        """The measured pose of a person with this stamp."""
        chance = self._at(stamp_ns)
        body = added(pose.body, self._plane(chance))
        head_yaw = wrap(pose.head_yaw + chance.gauss(0.0, 0.5 * self._sigma))
        head = pose.head and self._moved(pose.head, chance)
        left = pose.left_hand and self._moved(pose.left_hand, chance)
        right = pose.right_hand and self._moved(pose.right_hand, chance)
        return UserPose(body, head_yaw, head, left, right)

    def _at(self, stamp_ns: int) -> random.Random:
        """The generator at the start of this stamp's numbers; the next call resets it."""
        self._chance.seed(f"{self._stream}{stamp_ns}")
        return self._chance

    def _plane(self, chance: random.Random) -> Pose2:
        sigma = self._sigma
        return Pose2(
            chance.gauss(0.0, sigma), chance.gauss(0.0, sigma), chance.gauss(0.0, 0.5 * sigma)
        )

    def _moved(self, pose: Pose3, chance: random.Random) -> Pose3:
        x, y, z = (value + chance.gauss(0.0, self._sigma) for value in (pose.x, pose.y, pose.z))
        return replace(pose, x=x, y=y, z=z)


def added(pose: Pose2, error: Pose2) -> Pose2:
    """A pose with an error of its coordinates."""
    return Pose2(pose.x + error.x, pose.y + error.y, wrap(pose.yaw + error.yaw))
