"""Contact of the robot's footprint with the walls of a room."""

from __future__ import annotations

import math

from hw.geometry import Pose2
from hw.robot import RobotModel
from hw.room import Room
from hw.sim.contact import rectangle_segment_distance


class Walls:
    """The walls of a room; distances are recomputed only when a wall may be in reach."""

    def __init__(self, room: Room, robot: RobotModel) -> None:
        self._room, self._footprint = room, robot.footprint
        self._clear = 0.0
        self._at = Pose2(math.inf, math.inf)

    def hit_by(self, pose: Pose2, margin: float = 0.0) -> bool:
        """True if the footprint at this pose is within `margin`, m, of a wall, or outside the room.

        Without a margin: if it touches a wall.
        """
        reach = self._footprint.half_diagonal
        at = self._at
        moved = math.hypot(pose.x - at.x, pose.y - at.y) + reach * abs(pose.yaw - at.yaw)
        if moved < self._clear - margin:
            return False
        self._at, self._clear = pose, self._distance(pose)
        return self._clear <= margin or not self._room.is_free(pose.x, pose.y)

    def _distance(self, pose: Pose2) -> float:
        length, width = self._footprint.half_length, self._footprint.half_width
        base_from_map = pose.inverse()
        return min(
            rectangle_segment_distance(
                length, width, base_from_map.transform(x1, y1), base_from_map.transform(x2, y2)
            )
            for x1, y1, x2, y2 in self._room.segments
        )
