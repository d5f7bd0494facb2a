"""What is sensed: scans, and the costs or obstacles that a planner makes of them."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from cobodeck.shapes.shape import Flat, MapShape, flat
from hw import Pose2, Scan
from hw.model import Sensing
from hw.scene import Point
from states.maps import Array
from states.navigation import GlobalPlanner
from states.navigation.grid import LETHAL, NO_INFORMATION, Costs, GridPlanner

MOST_CELLS = 64
"""A window of costs has at most so many cells in a row; where it has more, the highest cost of
each block of cells is shown."""


def scan_shapes(scans: Iterable[tuple[Pose2, Scan]], sensing: Sensing) -> list[MapShape]:
    """The ends of beams as dots; each scan with map_from_base at its time."""
    found = []
    for pose, scan in scans:
        at, ranges = pose @ sensing.mount(scan.sensor), scan.array
        bearings = at.yaw + scan.start + scan.step * np.arange(len(ranges))
        hit = np.isfinite(ranges) & (ranges > 0.0)
        ranges, bearings = ranges[hit], bearings[hit]
        xs, ys = at.x + ranges * np.cos(bearings), at.y + ranges * np.sin(bearings)
        found.append(MapShape("scan", "dots", "scan", paired(xs, ys), "end of a beam"))
    return found


def costmap_shapes(planner: GlobalPlanner, robot: Pose2, window: Point) -> list[MapShape]:
    """The costs in a window around the robot, width and height in m, by a planner on a costmap.

    Of other planners the obstacles that scans have shown them.
    """
    if not isinstance(planner, GridPlanner):
        return [
            MapShape(
                "costmap", "poly", "costmap", flat(ring), "obstacle seen", fill=True, alpha=0.4
            )
            for ring in planner.boxes
        ]
    grid = planner.grid
    rows, low = _part(robot.y - grid.y, window[1], grid.resolution, grid.rows)
    columns, left = _part(robot.x - grid.x, window[0], grid.resolution, grid.columns)
    costs = planner.costs[rows, columns]
    if not costs.size:
        return []
    block = math.ceil(max(costs.shape) / MOST_CELLS)
    costs, side = _highest(costs, block), block * grid.resolution
    row, column = np.nonzero(costs)
    places = paired(grid.x + left + side * (column + 0.5), grid.y + low + side * (row + 0.5))
    weights = tuple((costs[row, column] / LETHAL).tolist())
    return [
        MapShape("costmap", "cells", "costmap", places, "cost", weights=weights, yaw=0.0, cell=side)
    ]


def _part(middle: float, length: float, size: float, count: int) -> tuple[slice, float]:
    """The cells of an axis in a window, and where the first of them begins, m."""
    low, high = (math.floor((middle + side * length) / size) for side in (-0.5, 0.5))
    low = min(max(low, 0), count)
    return slice(low, max(low, high + 1)), low * size


def _highest(costs: Costs, block: int) -> Costs:
    """The highest known cost of each block of cells."""
    known = np.where(costs == NO_INFORMATION, 0, costs).astype(costs.dtype)
    rows, columns = (math.ceil(count / block) for count in costs.shape)
    whole = np.zeros((rows * block, columns * block), costs.dtype)
    whole[: costs.shape[0], : costs.shape[1]] = known
    found: Costs = whole.reshape(rows, block, columns, block).max(axis=(1, 3))
    return found


def paired(xs: Array, ys: Array) -> Flat:
    """Coordinates (n,) and (n,) as x1, y1, x2, y2, and so on."""
    return tuple(np.column_stack((xs, ys)).ravel().tolist())
