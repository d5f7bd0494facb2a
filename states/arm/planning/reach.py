"""From which rover poses the arm reaches a DEEP, and how high it reaches at all.

A rover pose is good if the prop reaches the DEEP from everywhere within the drive's tolerance
around it (R79, R80). Reach is computed exactly: every branch of the inverse kinematics, checked
for collision.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hw import Pose2, Pose3, wrap
from states.arm.kinematics import (
    MARGIN,
    Array,
    CollisionChecker,
    Cylinder,
    Manipulator,
    Solutions,
    Surroundings,
    WallSegments,
    free_from,
    inverse,
    pose_matrix,
)

ANGLES = tuple(math.radians(degrees) for degrees in (0, 30, -30, 60, -60, 90, -90))
"""The paper's seven directions around the DEEP; 0 is straight behind it (R75)."""

_RINGS = ((0.0, 1), (0.5, 6), (1.0, 12))


@dataclass(frozen=True, slots=True)
class ReachPlace:
    """Walls (x1, y1, x2, y2) and people as upright cylinders, in the map; m."""

    walls: WallSegments = ()
    people: Sequence[Cylinder] = ()


@dataclass(frozen=True, slots=True, eq=False)
class ReachTable:
    """By height and distance (h, d): share of rover directions that reach a level DEEP (R147)."""

    heights: tuple[float, ...]
    distances: tuple[float, ...]
    angles: tuple[float, ...]
    share: Array


@dataclass(frozen=True, slots=True, eq=False)
class Reach:
    """The reach of one arm with its prop; `inverted` is solved for, `arm` touches nothing.

    The nominal arm will do as `inverted` where rover poses are only ranked.
    """

    arm: Manipulator
    inverted: Manipulator

    def branches(self, checker: CollisionChecker, targets: ArrayLike) -> Solutions:
        """Collision-free branches for rover_from_deep (n, 4, 4)."""
        found = inverse(self.inverted, targets)
        valid = found.valid.copy()
        valid[found.valid] = checker.free(found.joints[found.valid])
        return Solutions(found.joints, valid)

    def reached(self, poses: Iterable[Pose2], deep: Pose3, place: ReachPlace) -> NDArray[np.bool_]:
        """True for rover poses from which the prop reaches map_from_deep, (n,)."""
        rovers = _rows(poses)
        branches = inverse(self.inverted, _rovers_from_deep(rovers, deep))
        around = CollisionChecker.of(self.arm, Surroundings.in_map(place.walls, place.people))
        found = np.empty(len(rovers), np.bool_)
        free_from(
            self.arm.solid, around.around, rovers, branches.joints, branches.valid, MARGIN, found
        )
        return found

    def table(
        self,
        heights: Sequence[float],
        distances: Sequence[float],
        angles: Sequence[float] = ANGLES,
        tolerance: tuple[float, float] = (0.0, 0.0),
    ) -> ReachTable:
        """Reach of level DEEPs by height and distance in an empty room.

        A direction counts where the DEEP is reached from the whole disc of the drive's tolerance.
        """
        checker = CollisionChecker.of(self.arm, Surroundings.empty())
        share = np.zeros((len(heights), len(distances)))
        for i, height in enumerate(heights):
            deep = Pose3(0.0, 0.0, height)
            for j, distance in enumerate(distances):
                discs = [disc(rover, *tolerance) for rover in around(deep, angles, [distance])]
                targets = np.array(
                    [rover_from_deep(pose, deep) for poses in discs for pose in poses]
                )
                valid = self.branches(checker, targets).valid.any(axis=1)
                share[i, j] = valid.reshape(len(angles), -1).all(axis=1).mean()
        return ReachTable(tuple(heights), tuple(distances), tuple(angles), share)


def around(deep: Pose3, angles: Sequence[float], distances: Sequence[float]) -> list[Pose2]:
    """Rover poses on circles around a DEEP, facing it, angle by angle; 0 is straight behind it."""
    ahead = deep.yaw
    return [
        Pose2(
            deep.x + distance * math.cos(ahead + angle),
            deep.y + distance * math.sin(ahead + angle),
            wrap(ahead + angle + math.pi),
        )
        for angle in angles
        for distance in distances
    ]


def disc(pose: Pose2, radius: float, yaw: float = 0.0) -> list[Pose2]:
    """The pose and, for a radius > 0, m, 18 more on two rings around it, turned by up to +-yaw."""
    if radius <= 0.0:
        return [pose]
    found = []
    for share, count in _RINGS:
        for k in range(count):
            angle, size = 2.0 * math.pi * k / count, share * radius
            turn = yaw * share * (-1.0) ** k
            x, y = pose.x + size * math.cos(angle), pose.y + size * math.sin(angle)
            found.append(Pose2(x, y, wrap(pose.yaw + turn)))
    return found


def _rows(map_from_rovers: Iterable[Pose2]) -> Array:
    """x, y, cosine and sine of the yaw of each rover pose, (n, 4)."""
    rows = [(p.x, p.y, math.cos(p.yaw), math.sin(p.yaw)) for p in map_from_rovers]
    return np.array(rows, dtype=np.float64).reshape(-1, 4)


def _rovers_from_deep(rovers: Array, map_from_deep: Pose3) -> Array:
    """The DEEP in the frame of each rover, a row of `_rows`: (n, 4, 4)."""
    x, y, c, s = rovers.T
    seen = np.zeros((len(x), 4, 4))
    seen[:, 0, 0], seen[:, 0, 1], seen[:, 0, 3] = c, s, -c * x - s * y
    seen[:, 1, 0], seen[:, 1, 1], seen[:, 1, 3] = -s, c, s * x - c * y
    seen[:, 2, 2] = seen[:, 3, 3] = 1.0
    return seen @ pose_matrix(map_from_deep)


def rover_from_deep(map_from_rover: Pose2, map_from_deep: Pose3) -> Array:
    """The DEEP in the rover frame, (4, 4) (R84)."""
    base = map_from_rover
    return pose_matrix(base.upright().inverse() @ map_from_deep)
