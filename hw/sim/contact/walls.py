"""Contact of the robot's footprint with the walls of a room."""

from __future__ import annotations

import math

from hw.geometry import Pose2
from hw.model import RobotModel
from hw.scene import Room
from hw.sim.contact.nearby import Nearby, nearest_wall


class Walls:
    """The walls of a room; distances are recomputed only when a wall may be in reach."""

    def __init__(self, room: Room, robot: RobotModel) -> None:
        self._room, self._footprint = room, robot.footprint
        self._reach = robot.footprint.half_diagonal
        self._clear = 0.0
        self._at = Pose2(math.inf, math.inf)

    def hit_by(self, pose: Pose2, margin: float = 0.0) -> bool:
        """True if the footprint at this pose is within `margin`, m, of a wall, or outside the room.

        Without a margin: if it touches a wall.
        """
        at = self._at
        moved = math.hypot(pose.x - at.x, pose.y - at.y) + self._reach * abs(pose.yaw - at.yaw)
        if moved < self._clear - margin:
            return False
        self._at, self._clear = pose, self._distance(pose)
        return self._clear <= margin or not self._room.is_free(pose.x, pose.y)

    def nearest(self, pose: Pose2) -> Nearby:
        """The wall next to the footprint."""
        return nearest_wall(self._room, self._footprint, pose)

    def _distance(self, pose: Pose2) -> float:
        return self.nearest(pose).gap
