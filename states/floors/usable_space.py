"""How much of a floor the robot can use, and whether that is enough (paper 5.1).

A floor is a room of polygons (`floor_plan`) or a map of cells (`floor_cells`). The inflation is the
clearance of the robot's centre from walls, m (R120).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from hw import USER_RADIUS
from hw.scene import Point
from states.navigation.exact import Array
from states.subsystems import QUARTER

Corners = Literal["round", "square"]
"""Shape of the inflation around corners: a circle, or its bounding square (R118)."""

LEAST_PIECE = 0.05
"""Smaller pieces of the usable floor are ignored, m2."""
LISTED = 3
"""Number of obstacles that are named one by one."""
_FINE = 0.05  # to which the radius of the largest quarter is found, m
_WALL = 3.0  # what is longer is called a wall, m
_TURN = 2.0 * math.pi
_MOST_PLACES = 40_000  # at which users are looked at: 50 x 50 m, every 25 cm


@dataclass(frozen=True, slots=True)
class Passage:
    """A passage too narrow for the robot: the ends of its narrowest line and its width, m."""

    start: Point
    end: Point
    width: float

    @property
    def middle(self) -> Point:
        """The middle of the narrowest line."""
        (x1, y1), (x2, y2) = self.start, self.end
        return 0.5 * (x1 + x2), 0.5 * (y1 + y2)


@dataclass(frozen=True, slots=True)
class Quarter:
    """A quarter of a circle: its centre and radius, m, and the angle at which it begins, rad."""

    x: float
    y: float
    angle: float
    radius: float

    def corners(self) -> Array:
        """It as a polygon, (20, 2): the centre, then points of the arc."""
        angles = self.angle + np.linspace(0.0, 0.5 * math.pi, 19)
        x = self.x + self.radius * np.cos(angles)
        y = self.y + self.radius * np.sin(angles)
        return np.column_stack((np.append(self.x, x), np.append(self.y, y)))


@dataclass(frozen=True, slots=True)
class Obstacle:
    """The middle and the sides of the box around an obstacle, m."""

    x: float
    y: float
    width: float
    depth: float

    def __str__(self) -> str:
        kind = "a wall" if max(self.width, self.depth) > _WALL else "an obstacle"
        return f"{kind} of {self.width:.2g} x {self.depth:.2g} m at ({self.x:.1f}, {self.y:.1f})"


def obstacle_in(bounds: tuple[float, float, float, float]) -> Obstacle:
    """The obstacle that fills x_min, y_min, x_max, y_max, m."""
    x_low, y_low, x_high, y_high = bounds
    return Obstacle(0.5 * (x_low + x_high), 0.5 * (y_low + y_high), x_high - x_low, y_high - y_low)


class Floor(Protocol):
    """A floor that can be measured; m, in the map."""

    @property
    def bounds(self) -> tuple[float, float, float, float]:
        """x_min, y_min, x_max, y_max of the free floor; all 0 where there is none."""
        ...

    @property
    def free_m2(self) -> float:
        """Free area."""
        ...

    def usable_m2(self, inflation: float) -> float:
        """Area that the robot's centre can be in."""
        ...

    def pieces(self, inflation: float) -> tuple[float, ...]:
        """Areas of the connected pieces of the usable floor, m2, largest first."""
        ...

    def closed_passages(self, inflation: float) -> tuple[Passage, ...]:
        """Passages between usable pieces that the inflation closes, narrowest first."""
        ...

    def is_clear(self, x: Array, y: Array, clearance: float) -> NDArray[np.bool_]:
        """True for places on the free floor at least `clearance` from walls; any array shape."""
        ...

    def quarter(self, inflation: float, radius: float) -> Quarter | None:
        """A quarter of a circle of this radius, m, that fits in at some place and angle."""
        ...

    def obstacles_at(self, quarter: Quarter, inflation: float) -> tuple[Obstacle, ...]:
        """What stands nearer to a quarter than the inflation, nearest to its centre first."""
        ...


@dataclass(frozen=True, slots=True)
class Space:
    """The usable part of a floor at one inflation."""

    inflation: float
    free_m2: float
    usable_m2: float
    pieces: tuple[float, ...]
    closed: tuple[Passage, ...]

    @property
    def share(self) -> float | None:
        """Usable share of the free area; None if there is no free area."""
        return self.usable_m2 / self.free_m2 if self.free_m2 > 0.0 else None


def measure(floor: Floor, inflation: float) -> Space:
    """Areas, pieces and closed passages at an inflation.

    Raises:
        ValueError: the inflation is not a finite number above 0.
    """
    if not (math.isfinite(inflation) and inflation > 0.0):
        raise ValueError(f"inflation of {inflation:g} m; it must be above 0")
    return Space(
        inflation,
        floor.free_m2,
        floor.usable_m2(inflation),
        floor.pieces(inflation),
        floor.closed_passages(inflation),
    )


def smallest_square(inflation: float, reach: float = QUARTER) -> float:
    """Side of the smallest square room in which all behaviours fit, m (R124).

    The quarter of a circle is as wide as its radius; the inflation is added at both walls.
    """
    return reach + 2.0 * inflation


def shortcoming(floor: Floor, inflation: float, reach: float = QUARTER) -> str | None:
    """Why the floor is too small for all behaviours; None if it is large enough (R124)."""
    if floor.quarter(inflation, reach) is not None:
        return None
    x_low, y_low, x_high, y_high = floor.bounds
    side = smallest_square(inflation, reach)
    return (
        f"the floor of {x_high - x_low:.4g} x {y_high - y_low:.4g} m is too small for all "
        f"behaviours: kept {inflation:g} m from walls, the robot has no quarter of a circle of "
        f"{reach:g} m about the user{_largest(floor, inflation, reach)}; an empty square room "
        f"needs {side:.4g} x {side:.4g} m"
    )


def _largest(floor: Floor, inflation: float, reach: float) -> str:
    """The largest quarter that there is, and what stands in the way of a larger one there."""
    best, too_large = None, reach
    while too_large - (best.radius if best else 0.0) > _FINE:
        radius = 0.5 * (too_large + (best.radius if best else 0.0))
        found = floor.quarter(inflation, radius)
        best, too_large = (best, radius) if found is None else (found, too_large)
    if best is None:
        return ""
    near = floor.obstacles_at(replace(best, radius=reach), inflation)
    named = ", ".join(str(obstacle) for obstacle in near[:LISTED])
    more = f" and {len(near) - LISTED} more" if len(near) > LISTED else ""
    return (
        f"; the largest is of {best.radius:.1f} m, at ({best.x:.1f}, {best.y:.1f}), and in its way "
        f"{'is' if len(near) == 1 else 'are'} {named or 'the outer walls'}{more}"
    )


@dataclass(frozen=True, slots=True)
class Untouchable:
    """User poses without a Haptic pose: at each place, the share of headings without one.

    `x`, `y` (m) and `share` have one entry per place; `step` is the spacing of the places, m.
    """

    x: Array
    y: Array
    share: Array
    step: float

    @property
    def overall(self) -> float | None:
        """Share of all user poses; None if a user can stand nowhere."""
        return float(self.share.mean()) if len(self.share) else None


def without_haptic_pose(
    floor: Floor,
    poses: Sequence[Point],
    inflation: float,
    step: float = 0.25,
    headings: int = 24,
) -> Untouchable:
    """Find the user poses on a floor for which no Haptic rover pose is free (R75, R77, R126).

    Args:
        floor: floor on whose grid users stand, at least USER_RADIUS from walls.
        poses: Haptic rover poses in the user's frame, x ahead and y left, m.
        inflation: clearance that a pose needs, m.
        step: spacing of the grid, m; of large floors it is coarser.
        headings: number of headings, evenly over the whole turn.
    """
    x_low, y_low, x_high, y_high = floor.bounds
    step = max(step, math.sqrt((x_high - x_low) * (y_high - y_low) / _MOST_PLACES))
    x, y = _grid(floor, step)
    stands = floor.is_clear(x, y, USER_RADIUS)
    x, y = x[stands], y[stands]
    missing = np.zeros(len(x))
    for heading in np.arange(headings) * (_TURN / headings):
        free = np.zeros(len(x), dtype=np.bool_)
        for dx, dy in _turned(poses, float(heading)):
            free |= floor.is_clear(x + dx, y + dy, inflation)
        missing += ~free
    return Untouchable(x, y, missing / headings, step)


def room_ahead(pose: Point, inflation: float, tolerance: float) -> float:
    """Least distance of a wall ahead of the user for a Haptic pose in the user's frame, m (R126).

    `tolerance` is added because the robot may stop that much nearer to the wall.
    """
    return pose[0] + inflation + tolerance


def _turned(places: Sequence[Point], yaw: float) -> Iterator[Point]:
    c, s = math.cos(yaw), math.sin(yaw)
    for x, y in places:
        yield c * x - s * y, s * x + c * y


def _grid(floor: Floor, step: float) -> tuple[Array, Array]:
    x_low, y_low, x_high, y_high = floor.bounds
    xs = np.arange(x_low + 0.5 * step, x_high, step)
    ys = np.arange(y_low + 0.5 * step, y_high, step)
    x, y = np.meshgrid(xs, ys)
    return x.ravel(), y.ravel()
