"""An exhaustive look for a rover pose from which a refused touch could have been served.

Floor and ways are polygons of shapely, the arm's reach is its exact inverse kinematics with its own
collision checks. Nothing of `behaviors.haptic` and none of the planners is used.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import shapely
from shapely import affinity
from shapely.geometry import LineString, Point, box

from hw.geometry import Pose2, Pose3, wrap
from hw.scene.room import Room
from states.arm.arm_situation import ArmSituation
from states.arm.kinematics.inverse_kinematics import inverse
from states.arm.planning.reach import rover_from_deep
from states.arm.workspace import Workspace

INFLATION, USER_RADIUS, PERSON = 0.77, 1.27, 0.5
"""What the second choice keeps from walls and from the user's centre; the user's own radius, m."""
OUTLINE = box(-0.565, -0.455, 0.565, 0.455)
RADII = tuple(0.8 + 0.05 * k for k in range(11))
BEARINGS = tuple(math.radians(5 * k) for k in range(72))
FINE = 1e-3
"""What the judge keeps clear in addition, m, because its circles are polygons."""
PROP, FLANGE = ((0.05, 0.0), (0.12, 0.0), 0.05), ((0.172, -0.001), (0.172, -0.001), 0.0462)
"""Ends, m ahead and left of the DEEP, and radii of the capsules around prop and flange."""
MARGIN = 0.005
PASSING = 0.02
"""Room that a path past the user needs in addition, m: without any it could not be driven."""


@dataclass(frozen=True)
class Judge:
    """Judges requests in one room, to one arm."""

    room: Room
    arm: Workspace

    def is_blocked(self, user: Pose2, deep: Pose3) -> bool:
        """True if a wall is between user and DEEP, or the prop at the DEEP would touch one."""
        floor: Any = self.room.free_space
        if not floor.covers(LineString([(user.x, user.y), (deep.x, deep.y)])):
            return True
        return any(
            not floor.covers(line) or floor.boundary.distance(line) < radius + MARGIN
            for *ends, radius in (PROP, FLANGE)
            for line in [LineString([deep.flat().transform(*end) for end in ends])]
        )

    def free_poses(self, user: Pose2, deep: Pose3) -> Iterator[Pose2]:
        """The rover poses around a DEEP that keep the distances from walls and user."""
        for radius in RADII:
            for bearing in BEARINGS:
                angle = deep.yaw + bearing
                x, y = deep.x + radius * math.cos(angle), deep.y + radius * math.sin(angle)
                pose = Pose2(x, y, wrap(angle + math.pi))
                if self._is_free(pose, user):
                    yield pose

    def servable(self, robot: Pose2, user: Pose2, deep: Pose3) -> Pose2 | None:
        """A free pose that the robot can get to, and from which the arm reaches the DEEP."""
        ways = dict[float, Any]()
        for pose in self.free_poses(user, deep):
            radius = _kept(robot, user, pose)
            ways[radius] = ways.get(radius) or self._way(robot, user, radius)
            if ways[radius].covers(Point(pose.x, pose.y)) and self._reaches(pose, user, deep):
                return pose
        return None

    def is_reachable(self, pose: Pose2, robot: Pose2, user: Pose2) -> bool:
        """True if a pose is as free as it has to be, and the robot gets there; to 2 mm."""
        way, place = self._way(robot, user, _kept(robot, user, pose)), Point(pose.x, pose.y)
        return way.distance(place) < 2.0 * FINE and self._is_apart(pose, user)

    @cached_property
    def _inner(self) -> Any:
        """Where the robot's centre may be, by the walls alone."""
        found = self.room.free_space.buffer(-INFLATION - FINE, quad_segs=64)
        shapely.prepare(found)
        return found

    def _is_free(self, pose: Pose2, user: Pose2) -> bool:
        place = Point(pose.x, pose.y)
        outside = place.distance(Point(user.x, user.y)) >= USER_RADIUS + FINE
        return outside and self._inner.covers(place) and self._is_apart(pose, user)

    def _is_apart(self, pose: Pose2, user: Pose2) -> bool:
        turned = affinity.rotate(OUTLINE, pose.yaw, origin=(0.0, 0.0), use_radians=True)
        outline = affinity.translate(turned, pose.x, pose.y)
        return bool(outline.distance(Point(user.x, user.y)) > PERSON)

    def _way(self, robot: Pose2, user: Pose2, radius: float) -> Any:
        """That part of the free floor to which the robot can get around a disc about the user."""
        disc = Point(user.x, user.y).buffer(radius, quad_segs=64)
        here, free = Point(robot.x, robot.y), self._inner.difference(disc)
        parts = list(getattr(free, "geoms", [free]))
        found = min(parts, key=here.distance)
        shapely.prepare(found)
        return found

    def _reaches(self, pose: Pose2, user: Pose2, deep: Pose3) -> bool:
        checker = self.arm.checker(ArmSituation(pose, user, self.arm.parked), deep)
        joints = inverse(self.arm.arm, rover_from_deep(pose, deep)).branches()
        return bool(len(joints) and checker.free(joints).any())


def _kept(robot: Pose2, user: Pose2, goal: Pose2) -> float:
    """The distance from the user, m, on the path between robot and goal."""
    nearest = min(robot.distance_to(user), goal.distance_to(user))
    return max(USER_RADIUS, min(USER_RADIUS + PASSING, nearest))
