"""Likely poses of one scan on the whole floor or around a place, found slice by slice.

The scan is tried at every pose of a lattice, and the likeliest ones, well apart from each other,
are proposed. A lattice misses no place, as random particles can; a slice bounds the work of one
update.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from hw import Pose2, compiled, wrap
from states.localization.matching.correlative import apart, fit_of
from states.maps import Array, Field, Table, distance_at

SPACING, TURN = 0.25, math.radians(10.0)
"""Steps of the lattice, m and rad."""
SPREAD, REACHES = 0.2, 0.6
"""Standard deviation of beam ends, m, about half a step of the lattice, and the distance from which
all beams count alike, m."""
BEAMS = 60
"""Largest number of beams that are tried."""
SLICE = 5_000
"""Most poses that are tried at once."""
LIKELIEST = 4_096
"""Number of poses of the lattice from which the proposals are chosen."""
PROPOSED, AROUND = 100, 20
"""Largest number of proposals on the whole floor, and around a pose."""
APART = (0.3, 0.25)
"""Least distance between proposals, m and rad."""
LIKE = 0.5
"""Log-likelihood per beam by which a pose of the lattice may be behind another and be as likely."""
WIDE = 3.0
"""Standard deviations of a prior within which poses are tried."""


class Proposals:
    """Poses for points (n, 2) of the base frame; about a pose with covariance (3, 3), if given.

    `more` is true if there are more places as likely as those that were chosen.
    """

    def __init__(
        self, field: Field, points: Array, about: tuple[Pose2, Array] | None = None
    ) -> None:
        self._field = field
        self._points = np.ascontiguousarray(points[:: math.ceil(max(1, len(points)) / BEAMS)])
        self._table = _coarse(field.table)
        self._slices = _everywhere(field) if about is None else _around(field, *about)
        self._most, self.more = PROPOSED if about is None else AROUND, False
        self._likeliest = np.empty((0, 3))
        self._fits = np.empty(0)

    def advance(self) -> bool:
        """Try one more slice; False once all have been tried."""
        poses = next(self._slices, None)
        if poses is None:
            return False
        least = self._fits[-1] if len(self._fits) == LIKELIEST else -math.inf
        fits = _fits(self._points, poses, self._table, (SPREAD, REACHES), least)
        self._fits = np.concatenate((self._fits, fits))
        self._likeliest = np.concatenate((self._likeliest, poses))
        best = np.argsort(-self._fits, kind="stable")[:LIKELIEST]
        self._fits, self._likeliest = self._fits[best], self._likeliest[best]
        return True

    def chosen(self) -> list[Pose2]:
        """The proposals so far, likeliest first, map_from_base; sets `more`."""
        corner = self._field.map_from_corner
        rows = apart(self._likeliest, self._most, *APART)
        if len(rows) == self._most:
            last = int(np.flatnonzero((self._likeliest == rows[-1]).all(axis=1))[0])
            self.more = bool(self._fits[last] > self._fits[0] - LIKE * len(self._points))
        return [corner @ Pose2(x, y, wrap(yaw)) for x, y, yaw in rows.tolist()]


def _coarse(table: Table) -> Table:
    """The table of a drawn room with distances at the centres of its cells, faster to look up."""
    if len(table.nearest):
        return table
    return table._replace(nearest=_distances(table))


@compiled
def _distances(table: Table) -> Array:
    found = np.empty((table.rows, table.columns))
    for row in range(table.rows):
        for column in range(table.columns):
            x, y = (column + 0.5) * table.cell, (row + 0.5) * table.cell
            found[row, column] = distance_at(x, y, table)[0]
    return found


def _everywhere(field: Field) -> Iterator[Array]:
    """Slices (n, 3) of the lattice over the floor, from the corner of the table."""
    table = field.table
    step = max(1, round(SPACING / table.cell))
    row, column = np.nonzero(table.floor)
    kept = (row % step == step // 2) & (column % step == step // 2)
    places = table.cell * (np.stack([column[kept], row[kept]], axis=1) + 0.5)
    yield from _slices(places, np.arange(-math.pi, math.pi - 1e-9, TURN))


def _around(field: Field, map_from_base: Pose2, covariance: Array) -> Iterator[Array]:
    """Slices (n, 3) of the lattice around a pose."""
    pose = field.map_from_corner.inverse() @ map_from_base
    reach = WIDE * math.sqrt(max(covariance[0, 0], covariance[1, 1]))
    turn = min(math.pi, WIDE * math.sqrt(covariance[2, 2]))
    off = np.arange(-reach, reach + 1e-9, SPACING)
    places = np.stack(np.meshgrid(pose.x + off, pose.y + off), axis=-1).reshape(-1, 2)
    yield from _slices(places, pose.yaw + np.arange(-turn, turn + 1e-9, TURN))


def _slices(places: Array, yaws: Array) -> Iterator[Array]:
    each = max(1, SLICE // len(yaws))
    for first in range(0, len(places), each):
        some = places[first : first + each]
        poses = np.empty((len(some), len(yaws), 3))
        poses[:, :, :2] = some[:, None]
        poses[:, :, 2] = yaws
        yield poses.reshape(-1, 3)


@compiled
def _fits(
    points: Array, poses: Array, table: Table, lengths: tuple[float, float], least: float
) -> Array:
    """Fit of each pose (n, 3); minus infinity, found early, below `least`."""
    found = np.empty(len(poses))
    for k in range(len(poses)):
        pose = (poses[k, 0], poses[k, 1], poses[k, 2])
        found[k] = fit_of(points, pose, table, lengths, (0.0, 0.0), least)
    return found
