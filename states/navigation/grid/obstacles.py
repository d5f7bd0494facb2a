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

from hw import EXACT, Outline, Pose2, PoseSigma, Scan, example
from hw.scene import Disc
from states.localization.wheels import place_of
from states.maps import Grid
from states.navigation.exact import Array
from states.navigation.grid.obstacle_kernels import SURE, Cells, take

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


class ObstacleLayer:
    """The marked cells of a map's grid within the window around the robot.

    `walls` (rows, columns) is the distance of each cell to the map's walls, m; negative where the
    robot cannot be, so that nothing is marked there.
    """

    def __init__(self, grid: Grid, walls: Array, values: ObstacleValues | None = None) -> None:
        self.grid = grid
        self._walls = walls
        values = values or ObstacleValues()
        half = 0.5 * values.width, 0.5 * values.height
        self._window = grid.x, grid.y, *half, grid.resolution
        self._margin = values.wall_margin
        self._ages = round(values.clear_after * 1e9), round(values.mark_lifetime * 1e9)
        size = grid.rows * grid.columns
        self._active = np.empty(size, np.int64)
        self._hits = np.zeros(size, np.uint8)
        self._last = np.zeros(size, np.int64)
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
        user, sigma = known.user, known.sigma
        count = take(
            (float(scan.start), float(scan.step), scan.array),
            (place_of(first), place_of(last), place_of(known.mount)),
            self._window,
            (
                self._margin + 3.0 * sigma.position,
                3.0 * sigma.yaw,
                (user.x, user.y, user.radius),
                known.outline[:],
            ),
            (stamp_ns, *self._ages),
            (self._walls, self._active, self._hits, self._last),
            self._count,
        )
        if count < 0:
            return False
        self._count = count
        return True

    @property
    def marked(self) -> Cells:
        """The numbers of the marked cells, in no order."""
        active = self._active[: self._count]
        return active[self._hits[active] >= SURE]


@example
def _example() -> None:
    layer = ObstacleLayer(Grid(0.1, 10, 10), np.ones((10, 10)))
    here, known = Pose2(0.5, 0.5), KnownObstacles(Pose2(0.0, 0.0))
    for stamp in (0, 10**9):
        layer.add_scan(Scan("", 0.0, 0.1, (0.3, math.inf)), here, here, stamp, known)
