"""Localization without a map: each scan is matched to the walls that earlier scans have shown.

Scans from new places add walls. Loops are not closed here (`placing.py` does), so errors of
matching accumulate slowly along the path.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from hw import Pose2, compiled, wrap
from states.localization.matching import (
    ALIKE,
    Match,
    TrackerValues,
    Window,
    correlated,
    match,
    rotated,
)
from states.maps import FARTHEST, RESOLUTION, Array, Corner, Field, Mask, Table, covering

_REACH = 1.0
"""Distances to walls are capped at this, m."""
_FLOOR = np.diag([0.01**2, 0.01**2, 0.003**2])
"""Least covariance of a match: walls are rough, and errors of cells do not average out."""
_UNKNOWN_M, _UNKNOWN_RAD = 0.3, 0.3
"""Without odometry the motion between two scans may change by this (standard deviations)."""


def _wide() -> TrackerValues:
    """Parameters for surroundings known in part: many beams end elsewhere, and walls are rough."""
    return TrackerValues(beams=1000, scale=0.2, inlier_distance=0.2, healthy=0.3)


@dataclass(frozen=True, slots=True)
class GrowingValues:
    """How scans are matched and when their walls are added.

    A scan's walls are added once the base is `distance` m or `turn` rad from the last such scan of
    the sensor. Wheel errors are assumed to be `slip` m per m, `twist` rad per m and `spin` rad per
    rad, plus 1 cm and 0.01 rad. Matches that are not healthy are ignored. Without odometry the base
    is assumed to go on as it did between the last two scans.
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
        self._pose, self._step = Pose2(0.0, 0.0), Pose2(0.0, 0.0)
        self._added: dict[str, Pose2] = {}
        self.information = np.zeros((3, 3))
        """Of the last match (see `matched_information`), in the map; 0 without a healthy one."""

    def add_scan(self, odom_from_base: Pose2 | None, sensor: str, points: Array) -> Pose2:
        """map_from_base after a scan of a sensor, points (n, 2) in the base frame, m.

        Raises:
            ValueError: the map becomes too large.
        """
        near = near_points(points)
        if not self._added:
            self._pose = odom_from_base or self._pose
        elif odom_from_base is not None and self._odom is not None:
            step = self._odom.inverse() @ odom_from_base
            self._move(step, wheel_covariance(step, self._values), near)
        else:
            self._move(self._step, _UNKNOWN, near)
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

    def _move(self, step: Pose2, covariance: Array, points: Array) -> None:
        """Predict by a displacement with its covariance (base frame), correct by the walls."""
        before, values = self._pose, self._values.matching
        self._pose, self.information = before @ step, np.zeros((3, 3))
        if len(points):
            found = self._matched(points, rotated(covariance, before.yaw))
            if found.is_healthy(values):
                self._pose, self.information = found.map_from_base, matched_information(found)
        self._step = before.inverse() @ self._pose

    def _matched(self, points: Array, covariance: Array) -> Match:
        """The match near the prediction; unless it is healthy, the best one within 3 sigma."""
        field, values = self._walls.field, self._values.matching
        found = match(field, points, self._pose, covariance, values)
        if found.is_healthy(values) or found.count == 0:
            return found
        metres, radians = 3.0 * np.sqrt([covariance[:2, :2].trace() / 2.0, covariance[2, 2]])
        window = Window(self._pose, covariance, float(metres), float(radians))
        for start in correlated(field, points, window)[:1]:
            other = match(field, points, start, covariance, values)
            found = max(found, other, key=lambda one: one.share)
        return found


def wheel_covariance(step: Pose2, values: GrowingValues) -> Array:
    """Covariance (3, 3) of a displacement measured by wheels, base frame, m2 and rad2."""
    distance, turn = math.hypot(step.x, step.y), abs(step.yaw)
    off = 0.01 + values.slip * distance
    about = 0.01 + values.twist * distance + values.spin * turn
    return np.diag([off * off, off * off, about * about])


def matched_information(found: Match) -> Array:
    """Information of a match about x, y, yaw (3, 3): (I^-1 + F)^-1 = I (1 + F I)^-1.

    I is that of independent beams (see `correlative.ALIKE`), F the least covariance of a match.
    """
    beams = ALIKE * found.information
    known = beams @ np.linalg.inv(np.eye(3) + _FLOOR @ beams)
    symmetric: Array = 0.5 * (known + known.T)
    return symmetric


_UNKNOWN = np.diag([_UNKNOWN_M**2, _UNKNOWN_M**2, _UNKNOWN_RAD**2])


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


def near_points(points: Array) -> Array:
    """Those of the points (n, 2) of the base frame that are near enough to form walls."""
    near: Array = points[np.hypot(points[:, 0], points[:, 1]) < FARTHEST]
    return near


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
