"""Capsules that enclose shapes: every point of a shape lies within the union of its capsules.

A box or a cylinder of half length h along its axis and radius r across it (of a box: half the
diagonal across) fits a capsule with an axis of half length a, 0 <= a <= h, and the radius
sqrt(r^2 + (h - a)^2). A long one is kept slim (a = h), a short one takes as little room as it can.
Flat boxes are cut into several. Of a mesh each triangle lies within one capsule.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from hw.model.urdf.frames import Matrix

LONG = 2.0
"""Half length over radius from which a shape counts as long."""
MOST = 4
"""Most pieces into which a flat box is cut along one side, or a mesh along its length."""
WORTH = 0.85
"""A mesh is cut once more where that takes less than this share of the room."""
MANY = 5_000
"""Points from which on only the corners of their convex hull are looked at."""
GRAIN = 1e-9
"""Added to the radius of a mesh's capsule for rounding, m."""


@dataclass(frozen=True, slots=True, eq=False)
class Fitted:
    """A capsule: ends of its axis (2, 3) and radius, m."""

    ends: Matrix
    radius: float

    @property
    def room(self) -> float:
        """Its volume, m3."""
        length = float(np.linalg.norm(self.ends[1] - self.ends[0]))
        return math.pi * self.radius**2 * (length + 4.0 / 3.0 * self.radius)

    def moved(self, pose: Matrix) -> Fitted:
        """The same in the frame in which a pose (4, 4) is given."""
        return Fitted(self.ends @ pose[:3, :3].T + pose[:3, 3], self.radius)

    def holds(self, other: Fitted) -> bool:
        """True if all of another capsule lies within this one."""
        start, along = self.ends[0], self.ends[1] - self.ends[0]
        square = max(float(along @ along), 1e-18)
        shares = np.clip((other.ends - start) @ along / square, 0.0, 1.0)
        away = np.linalg.norm(other.ends - start - shares[:, None] * along, axis=1)
        return bool(away.max() + other.radius <= self.radius + 1e-6)


def around_sphere(radius: float) -> list[Fitted]:
    """A ball about the origin."""
    return [Fitted(np.zeros((2, 3)), radius)]


def around_cylinder(radius: float, length: float) -> list[Fitted]:
    """A cylinder about z, centred on the origin."""
    half, wide = _slim(0.5 * length, radius)
    return [Fitted(np.array([[0.0, 0.0, -half], [0.0, 0.0, half]]), wide)]


def around_box(sizes: Sequence[float]) -> list[Fitted]:
    """A box centred on the origin, cut where it is flat."""
    thin, flat, long = np.argsort(sizes, kind="stable").tolist()
    pieces = min(MOST, max(1, round(sizes[flat] / max(sizes[thin], 1e-6))))
    strip = sizes[flat] / pieces
    half, radius = _slim(0.5 * sizes[long], 0.5 * math.hypot(strip, sizes[thin]))
    found = []
    for n in range(pieces):
        ends = np.zeros((2, 3))
        ends[:, flat] = (n + 0.5) * strip - 0.5 * sizes[flat]
        ends[:, long] = -half, half
        found.append(Fitted(ends, radius))
    return found


def _slim(half: float, radius: float) -> tuple[float, float]:
    """Half length and radius of the capsule about a bar of this half length and radius."""
    if half >= LONG * radius:
        return half, radius
    tried = [half * n / 32.0 for n in range(33)]
    rooms = [(_room(a, math.hypot(radius, half - a)), a) for a in tried]
    _, best = min(rooms)
    return best, math.hypot(radius, half - best)


def _room(half: float, radius: float) -> float:
    return radius**2 * (2.0 * half + 4.0 / 3.0 * radius)


def around_mesh(triangles: Matrix) -> list[Fitted]:
    """The triangles (n, 3, 3) of a mesh, cut along its length where that is worth it.

    A capsule is convex: it holds a piece if it holds the corners of the piece's convex hull.
    """
    points = triangles.reshape(-1, 3)
    centred = points - points.mean(axis=0)
    axes = np.linalg.svd(centred.T @ centred)[0].T
    along = triangles.mean(axis=1) @ axes[0]
    best = [_around(_corners(points), axes)]
    for pieces in range(2, MOST + 1):
        edges = np.linspace(along.min(), along.max(), pieces + 1)[1:-1]
        which = np.searchsorted(edges, along)
        parts = [triangles[which == n].reshape(-1, 3) for n in range(pieces)]
        found = [_around(_corners(part), axes) for part in parts if len(part)]
        if sum(f.room for f in found) < WORTH * sum(b.room for b in best):
            best = found
    return best


def _corners(points: Matrix) -> Matrix:
    """Those of many points (n, 3) that span their convex hull; all of them where it is flat."""
    if len(points) <= MANY:
        return points
    from scipy.spatial import ConvexHull, QhullError

    try:
        return np.asarray(points[ConvexHull(points).vertices])
    except QhullError:
        return np.unique(points, axis=0)


def _around(points: Matrix, axes: Matrix) -> Fitted:
    """The smallest of three capsules about points (n, 3), one along each axis."""
    return min((_along(points, axes, n) for n in range(3)), key=lambda capsule: capsule.room)


def _along(points: Matrix, axes: Matrix, n: int) -> Fitted:
    turned = np.concatenate([axes[n : n + 1], np.delete(axes, n, axis=0)])
    seen = points @ turned.T
    centre = _centre(seen[:, 1:])
    off = np.linalg.norm(seen[:, 1:] - centre, axis=1)
    radius = float(off.max())
    rest = np.sqrt(np.maximum(radius**2 - off**2, 0.0))
    low, high = float((seen[:, 0] + rest).min()), float((seen[:, 0] - rest).max())
    if low > high:  # one ball holds all
        low = high = 0.5 * (low + high)
        middle = np.array([low, *centre])
        radius = float(np.linalg.norm(seen - middle, axis=1).max())
    ends = np.array([[low, *centre], [high, *centre]]) @ turned
    return Fitted(ends, radius + GRAIN)


def _centre(points: Matrix) -> Matrix:
    """About the centre of the least circle around points (n, 2) (Badoiu and Clarkson 2003)."""
    centre = 0.5 * (points.min(axis=0) + points.max(axis=0))
    for n in range(1, 101):
        farthest = points[np.linalg.norm(points - centre, axis=1).argmax()]
        centre = centre + (farthest - centre) / (n + 1)
    return np.asarray(centre)


def without_covered(capsules: list[Fitted]) -> Iterator[Fitted]:
    """Those that do not lie within another one; of equal ones the first."""
    left = list(capsules)
    for one, other in itertools.permutations(capsules, 2):
        if one in left and other in left and one is not other and one.holds(other):
            left.remove(other)
    return iter(left)
