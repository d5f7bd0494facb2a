"""The obstacle layer: cells in which scans have shown obstacles that are not on the map.

Beams that end at the map's walls, at the tracked user or at the robot itself are ignored; a scan
with only such beams costs next to nothing. Other cells are marked at once if several neighbouring
beams hit them, else when they are hit again: a single beam may be an outlier. A mark is cleared
when beams pass through its cell (those without return too, or people who left would stay as
ghosts), when nothing has hit it for `mark_lifetime`, or when it leaves the rolling window (R37,
R51).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from hw import EXACT, Outline, Pose2, PoseSigma, Scan, example, wrap
from hw.scene import Disc
from states.maps import Grid
from states.navigation.exact import Array
from states.navigation.grid.obstacle_kernels import (
    SURE,
    Cells,
    Cut,
    Ignored,
    Marks,
    ScanSweep,
    mark,
    news,
    tend,
)

NOBODY = Disc(0.0, 0.0, -1.0)
NO_BODY = Outline(-1.0, -1.0, -1.0, -1.0)


@dataclass(frozen=True, slots=True)
class ObstacleValues:
    """The rolling window, m, and the conditions for marking and clearing.

    A beam that ends within `wall_margin` of a wall of the map, m, plus the uncertainty of the pose,
    has hit the wall: it covers the noise of a beam and half a cell. A cell that beams pass through
    is cleared once nothing has hit it for `clear_after`, s: longer than a scanner's period, so that
    a thin leg that only some beams hit stays.
    """

    width: float = 5.0
    height: float = 5.0
    wall_margin: float = 0.1
    clear_after: float = 0.2
    mark_lifetime: float = 10.0


@dataclass(frozen=True, slots=True)
class KnownObstacles:
    """What beams of a scan may hit without marking anything.

    `mount` is base_from_sensor, `outline` the robot's own in the base frame, `user` a disc around
    the tracked user; three times `sigma` of the poses is added to the wall margin.
    """

    mount: Pose2
    outline: Outline = NO_BODY
    user: Disc = NOBODY
    sigma: PoseSigma = EXACT

    def ignored(self, grid: Grid, margin: float) -> Ignored:
        """The same for the kernels."""
        mount, user = self.mount, self.user
        return Ignored(
            margin + 3.0 * self.sigma.position,
            3.0 * self.sigma.yaw,
            (user.x - grid.x, user.y - grid.y, user.radius),
            (mount.x, mount.y, mount.yaw),
            self.outline,
        )


class ObstacleLayer:
    """The marked cells of a map's grid within the window around the robot.

    `walls` (rows, columns) is the distance of each cell to the map's walls, m; negative where the
    robot cannot be, so that nothing is marked there.
    """

    def __init__(self, grid: Grid, walls: Array, values: ObstacleValues | None = None) -> None:
        self.grid = grid
        self._walls = walls
        self._values = values or ObstacleValues()
        size = grid.rows * grid.columns
        self._marks = Marks(
            np.empty(size, np.int64), np.zeros(size, np.uint8), np.zeros(size, np.int64)
        )
        self._count = 0

    def add_scan(
        self, scan: Scan, first: Pose2, last: Pose2, stamp_ns: int, known: KnownObstacles
    ) -> bool:
        """Process one scan; False if it hit nothing unknown and no earlier hits are to be updated.

        Args:
            scan: ranges in m; inf: no return; NaN and values of 0 or less are skipped.
            first: map_from_base at the first beam.
            last: map_from_base at the last beam.
            stamp_ns: time of the scan.
            known: what to ignore.
        """
        grid, values = self.grid, self._values
        sweep = _sweep(scan, first @ known.mount, last @ known.mount, grid)
        half = (0.5 * values.width, 0.5 * values.height)
        cut = Cut(last.x - grid.x, last.y - grid.y, *half, grid.resolution, grid.columns)
        ends, beams = news(sweep, self._walls, cut, known.ignored(grid, values.wall_margin))
        if len(ends) == 0 and self._count == 0:
            return False
        self._count = mark(ends, beams, cut, stamp_ns, self._marks, self._count)
        ages = (round(values.clear_after * 1e9), round(values.mark_lifetime * 1e9))
        self._count = tend(sweep, cut, stamp_ns, ages, self._marks, self._count)
        return True

    @property
    def marked(self) -> Cells:
        """The numbers of the marked cells, in order."""
        active = self._marks.active[: self._count]
        return np.sort(active[self._marks.hits[active] >= SURE])


def _sweep(scan: Scan, first: Pose2, last: Pose2, grid: Grid) -> ScanSweep:
    return ScanSweep(
        first.x - grid.x,
        first.y - grid.y,
        first.yaw,
        last.x - first.x,
        last.y - first.y,
        wrap(last.yaw - first.yaw),
        float(scan.start),
        float(scan.step),
        np.array(scan.ranges, dtype=np.float64),
    )


@example
def _example() -> None:
    layer = ObstacleLayer(Grid(0.1, 10, 10), np.ones((10, 10)))
    here, known = Pose2(0.5, 0.5), KnownObstacles(Pose2(0.0, 0.0))
    for stamp in (0, 10**9):
        layer.add_scan(Scan("", 0.0, 0.1, (0.3, math.inf)), here, here, stamp, known)
