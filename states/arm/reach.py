"""Where the rover must stand for the arm to get to a DEEP, and how high the arm reaches at all.

A rover pose is good if the prop gets to the DEEP from everywhere within the drive's tolerance
around it (R79, R80) and drive and arm together are quick (R76, R78). Everything is by true reach:
every branch of the inverse kinematics, checked for contact.
"""

from __future__ import annotations

import math
from collections.abc import Generator, Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hw.geometry import Pose2, wrap
from states.arm.collision import CollisionChecker, CollisionModel, Cylinder, Surroundings
from states.arm.inverse import Solutions, inverse, nearest_copies
from states.arm.kernels import Array
from states.arm.kinematics import KinematicChain, inverted
from states.arm.timing import line_durations
from states.arm.trajectory import ArmLimits

ANGLES = tuple(math.radians(degrees) for degrees in (0, 30, -30, 60, -60, 90, -90))
"""The paper's seven directions around the DEEP, 0 is straight behind it (R75)."""

_RINGS = ((0.0, 1), (0.5, 6), (1.0, 12))


@dataclass(frozen=True, slots=True)
class ReachPlace:
    """Walls (x1, y1, x2, y2) and people as upright cylinders, in the map; m."""

    walls: Sequence[tuple[float, float, float, float]] = ()
    people: Sequence[Cylinder] = ()


@dataclass(frozen=True, slots=True)
class Candidate:
    """A rover pose, number `index` of those asked for.

    `reach` is the share of the tolerance disc from which the DEEP is reached; times in s, that of
    the arm inf where not even the pose itself will do.
    """

    index: int
    pose: Pose2
    reach: float
    drive_time: float
    arm_time: float

    @property
    def total_time(self) -> float:
        """Drive and arm one after the other, s."""
        return self.drive_time + self.arm_time


@dataclass(frozen=True, slots=True, eq=False)
class ReachTable:
    """Shares (h, d) of rover directions from which a level DEEP is reached (R147)."""

    heights: tuple[float, ...]
    distances: tuple[float, ...]
    angles: tuple[float, ...]
    share: Array


@dataclass(frozen=True, slots=True, eq=False)
class Reach:
    """An arm, asked where its prop gets to."""

    chain: KinematicChain
    model: CollisionModel

    def branches(self, checker: CollisionChecker, targets: ArrayLike) -> Solutions:
        """Joints for rover_from_deep (n, 4, 4) that touch nothing."""
        found = inverse(self.chain, targets)
        valid = found.valid.copy()
        valid[found.valid] = checker.free(found.joints[found.valid])
        return Solutions(found.joints, valid)

    def reached(self, poses: Iterable[Pose2], deep: Array, place: ReachPlace) -> NDArray[np.bool_]:
        """From which rover poses the prop gets to map_from_deep (4, 4): (n,)."""
        return np.array([self._from(pose, deep, place).valid.any() for pose in poses], np.bool_)

    def ranked(
        self,
        poses: Sequence[Pose2],
        deep: Array,
        place: ReachPlace,
        drive_times: Sequence[float],
        tolerance: tuple[float, float],
        parked: ArrayLike,
        limits: ArmLimits,
    ) -> Generator[None, None, list[Candidate]]:
        """The poses, best first: those that reach from the whole disc by total time, then by reach.

        `tolerance` is that of the drive in m and rad. Yields after each pose.
        """
        found = []
        for i, (pose, drive) in enumerate(zip(poses, drive_times, strict=True)):
            share = float(self.reached(disc(pose, *tolerance), deep, place).mean())
            arm = self._arm_time(pose, deep, place, np.asarray(parked, np.float64), limits)
            found.append(Candidate(i, pose, share if math.isfinite(arm) else 0.0, drive, arm))
            yield
        return sorted(found, key=lambda c: (-c.reach, c.total_time, c.index))

    def table(
        self,
        heights: Sequence[float],
        distances: Sequence[float],
        angles: Sequence[float] = ANGLES,
        tolerance: tuple[float, float] = (0.0, 0.0),
    ) -> ReachTable:
        """Reach of level DEEPs by height and distance in an empty room, with a drive's tolerance.

        A direction counts where the DEEP is reached from the whole disc.
        """
        checker = CollisionChecker.of(self.model, Surroundings.empty())
        share = np.zeros((len(heights), len(distances)))
        for i, height in enumerate(heights):
            deep = level(0.0, 0.0, height, 0.0)
            for j, distance in enumerate(distances):
                discs = [disc(rover, *tolerance) for rover in around(deep, angles, [distance])]
                targets = np.array([seen_from(pose, deep) for poses in discs for pose in poses])
                valid = self.branches(checker, targets).valid.any(axis=1)
                share[i, j] = valid.reshape(len(angles), -1).all(axis=1).mean()
        return ReachTable(tuple(heights), tuple(distances), tuple(angles), share)

    def _from(self, pose: Pose2, deep: Array, place: ReachPlace) -> Solutions:
        surroundings = Surroundings.seen_from(pose, place.walls, place.people)
        return self.branches(CollisionChecker.of(self.model, surroundings), seen_from(pose, deep))

    def _arm_time(
        self, pose: Pose2, deep: Array, place: ReachPlace, parked: Array, limits: ArmLimits
    ) -> float:
        goals = self._from(pose, deep, place).of()
        if not len(goals):
            return math.inf
        near = nearest_copies(self.chain, goals, parked)
        return float(line_durations(self.chain, parked, near, limits).min())


def level(x: float, y: float, z: float, yaw: float) -> Array:
    """map_from_deep (4, 4) of an upright DEEP; yaw is where the person looks, into the surface."""
    c, s = math.cos(yaw), math.sin(yaw)
    return np.array([[c, -s, 0, x], [s, c, 0, y], [0, 0, 1, z], [0, 0, 0, 1]], dtype=np.float64)


def around(deep: Array, angles: Sequence[float], distances: Sequence[float]) -> list[Pose2]:
    """Rover poses on circles around a DEEP, facing it, angle by angle; 0 is straight behind it."""
    ahead = math.atan2(deep[1, 0], deep[0, 0])
    return [
        Pose2(
            float(deep[0, 3]) + distance * math.cos(ahead + angle),
            float(deep[1, 3]) + distance * math.sin(ahead + angle),
            wrap(ahead + angle + math.pi),
        )
        for angle in angles
        for distance in distances
    ]


def disc(pose: Pose2, radius: float, yaw: float = 0.0) -> list[Pose2]:
    """The pose and, with a radius in m, 18 more on two rings about it, turned by +-yaw in turn."""
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


def seen_from(map_from_rover: Pose2, map_from_deep: Array) -> Array:
    """rover_from_deep (4, 4) (R84)."""
    rover = level(map_from_rover.x, map_from_rover.y, 0.0, map_from_rover.yaw)
    return np.asarray(inverted(rover) @ map_from_deep)
