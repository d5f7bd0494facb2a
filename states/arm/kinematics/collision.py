"""Collision checks of the arm with itself, the rover, the floor, walls and people (R43, R46).

Capsules enclose the maker's meshes, so what they call free is free; the price is that about one
free pose in six counts as a collision. Distances are never overestimated.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hw import Pose2
from hw.model import Point3
from states.arm.kinematics.kernels import (
    SEEN,
    ArmObstacles,
    Array,
    Integers,
    gaps,
    place_capsules,
    sweep,
    walls_around,
)
from states.arm.kinematics.model import Manipulator

MARGIN = 0.005
"""Clearance kept to everything at each check, m; between two checks half of it is kept."""

OUTSIDE = "surroundings"
"""What `tightest` calls all that is not the arm: rover, floor, room and people."""

_ROOM_HEIGHT = 3.0

Wall = tuple[float, float, float, float]
"""The edge x1, y1, x2, y2 of an upright wall in the map, m."""
WallSegments = Sequence[Wall] | Array
"""Several, or the same as an array (w, 4)."""


@dataclass(frozen=True, slots=True)
class Cylinder:
    """An upright cylinder, such as a person (R23), standing on the floor; m."""

    x: float
    y: float
    radius: float
    height: float


@dataclass(frozen=True, slots=True)
class Limb:
    """A capsule about the axis from `start` to `end`, m; a ball if they are one point."""

    start: Point3
    end: Point3
    radius: float

    def seen_from(self, map_from_rover: Pose2) -> Limb:
        """A limb of the map in the rover frame."""
        seen = map_from_rover.inverse()
        (ax, ay, az), (bx, by, bz) = self.start, self.end
        return Limb((*seen.transform(ax, ay), az), (*seen.transform(bx, by), bz), self.radius)


@dataclass(frozen=True, slots=True, eq=False)
class Surroundings:
    """Obstacles around the rover, in the rover frame.

    `walls` (w, 6) are upright rectangles x1, y1, x2, y2, z_low, z_high. The edges of room and
    columns suffice: an arm that starts outside a column cannot enter it without crossing an edge.
    `cylinders` (c, 5) are x, y, radius, z_low, z_high.
    """

    walls: Array
    cylinders: Array
    limbs: tuple[Limb, ...] = ()

    @classmethod
    def empty(cls) -> Surroundings:
        """Nothing but the floor."""
        return cls(np.zeros((0, 6)), np.zeros((0, 5)))

    @classmethod
    def seen_from(
        cls,
        map_from_rover: Pose2,
        walls: WallSegments = (),
        cylinders: Iterable[Cylinder] = (),
        limbs: Iterable[Limb] = (),
        within: float = SEEN,
        height: float = _ROOM_HEIGHT,
    ) -> Surroundings:
        """Edges (x1, y1, x2, y2) of the map as walls of this height, its cylinders and limbs.

        Walls and cylinders farther than `within` m from the rover's centre are left out.
        """
        seen = map_from_rover.inverse()
        upright = walls_around(edges_of(walls), seen.x, seen.y, seen.yaw, within, height)
        round_ = [
            (*seen.transform(c.x, c.y), c.radius, 0.0, c.height)
            for c in cylinders
            if map_from_rover.distance_to(Pose2(c.x, c.y)) - c.radius <= within
        ]
        bodily = tuple([limb.seen_from(map_from_rover) for limb in limbs])
        return cls(upright, np.array(round_).reshape(-1, 5), bodily)

    @classmethod
    def in_map(
        cls,
        walls: WallSegments,
        cylinders: Iterable[Cylinder],
        height: float = _ROOM_HEIGHT,
    ) -> Surroundings:
        """Edges and cylinders of the map in the map's own frame, for `kernels.free_from`."""
        edges = edges_of(walls)
        upright = np.zeros((len(edges), 6))
        upright[:, :4], upright[:, 5] = edges, height
        round_ = [(c.x, c.y, c.radius, 0.0, c.height) for c in cylinders]
        return cls(upright, np.array(round_, np.float64).reshape(-1, 5))


@dataclass(frozen=True, slots=True, eq=False)
class CollisionChecker:
    """Checks of one arm among fixed obstacles. Joints are (j,) or (n, j) in rad, gaps in m."""

    arm: Manipulator
    around: ArmObstacles
    margin: float = MARGIN

    @classmethod
    def of(
        cls, arm: Manipulator, surroundings: Surroundings, margin: float = MARGIN
    ) -> CollisionChecker:
        """A checker of an arm among these obstacles; the floor is at height 0."""
        walls, cylinders = (
            np.ascontiguousarray(a, dtype=np.float64)
            for a in (surroundings.walls, surroundings.cylinders)
        )
        limbs = np.array([(limb.start, limb.end) for limb in surroundings.limbs], np.float64)
        thickness = np.array([limb.radius for limb in surroundings.limbs], np.float64)
        around = ArmObstacles(0.0, walls, cylinders, limbs.reshape(-1, 2, 3), thickness)
        return cls(arm, around, margin)

    def clearance(self, joints: ArrayLike) -> Array:
        """The least gap of each joint set, (n,); negative where something overlaps."""
        return self._gaps(joints)[0]

    def free(self, joints: ArrayLike) -> NDArray[np.bool_]:
        """True for joint sets that keep the margin everywhere, (n,)."""
        return np.asarray(self.clearance(joints) >= self.margin)

    def tightest(self, joints: ArrayLike) -> tuple[float, str, str]:
        """The least gap of one joint set, and the names of the two parts between which it is."""
        gap, where = self._gaps(joints)
        pairs = self.arm.solid.pairs
        if where[0] < len(pairs):
            first, second = (self.arm.parts[i] for i in pairs[where[0]])
            return float(gap[0]), first, second
        return float(gap[0]), self.arm.parts[where[0] - len(pairs)], OUTSIDE

    def sweep(self, piece: Array, length: float, budget: int = 1_000_000) -> tuple[float, int]:
        """How far along q(x) = piece[0] + piece[1] x + piece[2] x^2 the arm is free, x <= length.

        Holds between samples too: nowhere is less than half the margin left. Returns the x at
        which contact comes (`length` if none does) and the number of joint sets checked.
        """
        return sweep(self.arm.solid, self.around, piece, length, self.margin, budget)

    def sweep_line(self, start: Array, step: Array, budget: int = 1_000_000) -> tuple[float, int]:
        """As `sweep` along the straight joint line start + x step, x <= 1."""
        piece = np.array([start, step, np.zeros(len(start))])
        return sweep(self.arm.solid, self.around, piece, 1.0, self.margin, budget)

    def line_free(self, start: Array, goal: Array) -> bool:
        """True if the straight joint line is free."""
        return self.sweep_line(start, goal - start)[0] >= 1.0

    def _gaps(self, joints: ArrayLike) -> tuple[Array, Integers]:
        q = np.ascontiguousarray(joints, dtype=np.float64).reshape(-1, self.arm.count)
        found, where = np.empty(len(q)), np.empty(len(q), dtype=np.int64)
        gaps(self.arm.solid, self.around, q, found, where)
        return found, where


def outline(arm: Manipulator, joints: ArrayLike) -> tuple[Array, Array]:
    """The placed capsules: ends (m, 2, 3) of their axes in the rover frame, and radii (m,)."""
    q = np.ascontiguousarray(joints, dtype=np.float64).reshape(arm.count)
    solid = arm.solid
    frames, ends = np.empty((arm.count + 1, 4, 4)), np.empty((len(solid.links), 2, 3))
    place_capsules(solid.base, solid.origins, solid.links, solid.ends, q, frames, ends)
    return ends, solid.radii


def extent(arm: Manipulator, joints: ArrayLike) -> tuple[float, float, float, float]:
    """How far the arm with its prop reaches ahead, back, left and right of base_link, m."""
    ends, radii = outline(arm, joints)
    high = (ends[:, :, :2].max(axis=1) + radii[:, None]).max(axis=0)
    low = (ends[:, :, :2].min(axis=1) - radii[:, None]).min(axis=0)
    return float(high[0]), float(-low[0]), float(high[1]), float(-low[1])


def edges_of(walls: WallSegments) -> Array:
    """Walls as an array (w, 4)."""
    return np.asarray(walls, np.float64).reshape(-1, 4)
