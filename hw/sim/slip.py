"""The slip of a body against its wheels, which turn exactly as commanded (R29, R146)."""

from __future__ import annotations

import math

from hw.geometry import Pose2, wrap
from hw.model import Slip
from hw.sim.sensors import Normals

_LEVER = 0.5
"""Distance that one rad of rotation counts as, m, for the length of floor covered."""
Velocity = tuple[float, float, float]
"""vx, vy, wz in the frame of the base."""


class SlipperyFloor:
    """The pose of the body on a floor, from the motion of its wheels."""

    def __init__(self, slip: Slip, start: Pose2, seed: int) -> None:
        self.pose = start
        self._slip = slip
        self._patches = Normals(seed, "floor", 3)
        self._way = 0.0

    def move(self, wheels: Velocity, before: Velocity, after: Velocity) -> float:
        """Move the body by a short motion of the wheels.

        A share of each component is lost (`Slip`); a change of velocity dv adds -lag dv, so that
        the body trails while speeding up and overshoots while braking.

        Args:
            wheels: distances ahead and to the left, m, and rotation, rad, by the wheels, in the
                base frame at half of the rotation.
            before: velocity of the wheels at the start, in the same frame.
            after: the same at the end.

        Returns:
            The path length of the body, m.
        """
        slip, (dx, dy, turn) = self._slip, wheels
        a, b, c = self._patch(math.hypot(dx, dy) + _LEVER * abs(turn))
        change = [v - u for u, v in zip(before, after, strict=True)]
        speed, other = math.hypot(*before[:2]), math.hypot(*after[:2])
        lag = _lag(slip, speed, other)
        ahead = dx * (1.0 - slip.along - slip.patchy * a) - lag * change[0]
        aside = dy * (1.0 - slip.across - slip.patchy * b) - lag * change[1]
        turned = turn * (1.0 - slip.turning - slip.patchy * c)
        turned -= _lag(slip, abs(before[2]), abs(after[2])) * change[2]
        pose = self.pose
        x, y = Pose2(pose.x, pose.y, pose.yaw + 0.5 * turned).transform(ahead, aside)
        self.pose = Pose2(x, y, wrap(pose.yaw + turned))
        return math.hypot(ahead, aside)

    def _patch(self, way: float) -> list[float]:
        self._way += way
        row: list[float] = self._patches.row(int(self._way / self._slip.patch)).tolist()
        return row


def _lag(slip: Slip, before: float, after: float) -> float:
    return slip.braking if after < before else slip.pulling
