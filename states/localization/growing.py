"""Localization without a map: each scan is matched to the walls that earlier scans have shown.

Scans from new places add walls. Loops are not closed here (`loops.py` does), so errors of matching
accumulate slowly along the path.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from hw.compiled import compiled
from hw.geometry import Pose2, wrap
from states.localization.scan_tracker import TrackerValues, match
from states.maps.cells import Mask
from states.maps.distance import Array
from states.maps.field import Field, Table
from states.maps.mapping import FARTHEST, RESOLUTION, Corner, covering

_REACH = 1.0
"""Distances to walls are capped at this, m."""


def _wide() -> TrackerValues:
    """Parameters for surroundings known in part: many beams end elsewhere, and walls are rough."""
    return TrackerValues(beams=1000, scale=0.2, inlier_distance=0.2, healthy=0.3)


@dataclass(frozen=True, slots=True)
class GrowingValues:
    """How scans are matched and when their walls are added.

    A scan's walls are added once the base is `distance` m or `turn` rad from the last such scan of
    the sensor. Wheel errors are assumed to be `slip` m per m, `twist` rad per m and `spin` rad per
    rad, plus 1 cm and 0.01 rad. Matches that are not healthy are ignored.
    """

    distance: float = 0.25
    turn: float = 0.15
    slip: float = 0.3
    twist: float = 0.15
    spin: float = 0.2
    matching: TrackerValues = field(default_factory=_wide)


class Growing:
    """Tracks a base through unknown surroundings, in the frame of its first odometry."""

    def __init__(self, resolution: float = RESOLUTION, values: GrowingValues | None = None) -> None:
        self._values = values or GrowingValues()
        self._walls = GrowingWalls(resolution)
        self._odom: Pose2 | None = None
        self._pose = Pose2(0.0, 0.0)
        self._added: dict[str, Pose2] = {}

    def take(self, odom_from_base: Pose2, sensor: str, points: Array) -> Pose2:
        """map_from_base after a scan of a sensor, points (n, 2) in the base frame, m.

        Raises:
            ValueError: the map becomes too large.
        """
        near = points[np.hypot(points[:, 0], points[:, 1]) < FARTHEST]
        if self._odom is None:
            self._pose = odom_from_base
        else:
            self._move(self._odom.inverse() @ odom_from_base, near)
        self._odom = odom_from_base
        if self._is_new(self._added.get(sensor)):
            self._added[sensor] = self._pose
            self._walls.add(points_in(self._pose, near))
        return self._pose

    def _is_new(self, last: Pose2 | None) -> bool:
        values, pose = self._values, self._pose
        if last is None or last.distance_to(pose) >= values.distance:
            return True
        return abs(wrap(pose.yaw - last.yaw)) >= values.turn

    def _move(self, step: Pose2, points: Array) -> None:
        """Predict by the wheels, correct by the walls."""
        values = self._values
        distance, turn = math.hypot(step.x, step.y), abs(step.yaw)
        off = 0.01 + values.slip * distance
        about = 0.01 + values.twist * distance + values.spin * turn
        self._pose = self._pose @ step
        if len(points) == 0:
            return
        covariance = np.diag([off * off, off * off, about * about])
        found = match(self._walls.field, points, self._pose, covariance, values.matching)
        if found.is_healthy(values.matching):
            self._pose = found.map_from_base


class GrowingWalls:
    """A distance field to which walls are added and never removed."""

    def __init__(self, resolution: float) -> None:
        self._cell = resolution
        self._corner: Corner = (0, 0)
        self._nearest = np.zeros((0, 0))
        self._floor: Mask = np.zeros((0, 0), np.bool_)

    def add(self, points: Array) -> None:
        """Add walls at points (n, 2) of the map, m.

        Raises:
            ValueError: the map becomes too large.
        """
        if len(points) == 0:
            return
        margin = _REACH + 2.0 * self._cell
        low, high = points.min(axis=0) - margin, points.max(axis=0) + margin
        self._nearest, self._corner = covering(
            self._nearest, self._corner, low / self._cell, high / self._cell, _REACH
        )
        if self._floor.shape != self._nearest.shape:
            self._floor = np.ones(self._nearest.shape, np.bool_)  # nothing is known to be wall
        corner = np.array(self._corner, dtype=np.float64)
        _brush(self._nearest, points / self._cell - corner, self._cell)

    @property
    def field(self) -> Field:
        """The field so far; its table changes as walls are added."""
        rows, columns = self._nearest.shape
        none, nobody = np.empty((0, 5)), np.empty(0, np.int32)
        table = Table(
            self._cell, rows, columns, _REACH, none, nobody, nobody, self._nearest, self._floor
        )
        x, y = (self._cell * count for count in self._corner)
        return Field(Pose2(x, y), table, 0.5 * self._cell)


def points_in(map_from_base: Pose2, points: Array) -> Array:
    """Points (n, 2), m, transformed from the base frame into the map."""
    c, s = math.cos(map_from_base.yaw), math.sin(map_from_base.yaw)
    moved: Array = points @ np.array([[c, s], [-s, c]]) + [map_from_base.x, map_from_base.y]
    return moved


@compiled
def _brush(nearest: Array, places: Array, cell: float) -> None:
    """Lower the distances around the cells at `places` (n, 2), given in units of cells.

    A full distance transform per scan would take ten times as long.
    """
    around = math.ceil(_REACH / cell)
    for i in range(len(places)):
        column, row = math.floor(places[i, 0]), math.floor(places[i, 1])
        if nearest[row, column] == 0.0:
            continue
        for dy in range(-around, around + 1):
            for dx in range(-around, around + 1):
                distance = cell * math.sqrt(dx * dx + dy * dy)
                if distance < nearest[row + dy, column + dx]:
                    nearest[row + dy, column + dx] = distance
