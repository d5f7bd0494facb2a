"""Kernels of the obstacle layer: where beams end, which cells they hit, which they clear.

Coordinates are in m from the lower left corner of the grid; a cell is numbered row * columns +
column.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hw import compiled, wrapped
from states.localization.wheels import Planar, composed
from states.navigation.exact import Array

Cells = NDArray[np.int64]

SURE = 3
"""Scans, or neighbouring beams of one scan, that have to hit a cell to mark it."""
NEIGHBOURS = 3
"""Largest difference of the indices of neighbouring beams."""
TOGETHER_M = 0.15
"""Neighbouring beams that end at most this far apart have hit the same thing."""
UNSURE_NS = 500_000_000
"""Hits of a cell that is not marked within this time are forgotten, ns."""


class ScanSweep(NamedTuple):
    """One scan: the sensor's pose at the first beam (grid frame) and its motion to the last one."""

    x: float
    y: float
    yaw: float
    dx: float
    dy: float
    turn: float
    start: float
    step: float
    ranges: Array


class Cut(NamedTuple):
    """The window around the robot: centre and half sides, m; cell size, m; columns of the grid."""

    x: float
    y: float
    half_width: float
    half_height: float
    resolution: float
    columns: int


class Ignored(NamedTuple):
    """What beams may hit without marking, in the form of the kernels; see `KnownObstacles`."""

    margin: float
    margin_per_m: float
    user: tuple[float, float, float]
    mount: Planar
    outline: tuple[float, float, float, float]


class Marks(NamedTuple):
    """Numbers of the cells hit; for every cell, scans that hit it (up to SURE) and the last, ns."""

    active: Cells
    hits: NDArray[np.uint8]
    last: Cells


@compiled
def take(
    scan: tuple[float, float, Array],
    poses: tuple[Planar, Planar, Planar],
    window: tuple[float, float, float, float, float],
    known: tuple[float, float, tuple[float, float, float], tuple[float, float, float, float]],
    times: tuple[int, int, int],
    cells: tuple[Array, Cells, NDArray[np.uint8], Cells],
    count: int,
) -> int:
    """Mark and clear by one scan; the number of active cells then, -1 if nothing is to be done.

    Args:
        scan: direction of the first beam and from beam to beam, rad; ranges, m.
        poses: map_from_base at the first and at the last beam; base_from_sensor.
        window: the grid's corner, half width and height of the window, cell size, m.
        known: margin, margin per m, the user's disc (map), the robot's outline; see `Ignored`.
        times: of the scan; age from which on a cell may be cleared, and its lifetime, ns.
        cells: (rows, columns) distances to walls, m; then see `Marks`.
        count: number of active cells.
    """
    x, y, half_width, half_height, resolution = window
    walls = cells[0]
    first, last = composed(poses[0], poses[2]), composed(poses[1], poses[2])
    sweep = ScanSweep(
        first[0] - x,
        first[1] - y,
        first[2],
        last[0] - first[0],
        last[1] - first[1],
        wrapped(last[2] - first[2]),
        scan[0],
        scan[1],
        scan[2],
    )
    here = poses[1]
    cut = Cut(here[0] - x, here[1] - y, half_width, half_height, resolution, walls.shape[1])
    user = (known[2][0] - x, known[2][1] - y, known[2][2])
    ends, beams = news(sweep, walls, cut, Ignored(known[0], known[1], user, poses[2], known[3]))
    if len(ends) == 0 and count == 0:
        return -1
    marks = Marks(cells[1], cells[2], cells[3])
    count = mark(ends, beams, cut, times[0], marks, count)
    return tend(sweep, cut, times[0], (times[1], times[2]), marks, count)


@compiled
def sensor_at(sweep: ScanSweep, beam: float) -> tuple[float, float, float]:
    """The sensor's position at a beam, and the beam's direction in the map."""
    part = beam / max(1, len(sweep.ranges) - 1)
    direction = sweep.yaw + part * sweep.turn + sweep.start + beam * sweep.step
    return sweep.x + part * sweep.dx, sweep.y + part * sweep.dy, direction


@compiled
def news(sweep: ScanSweep, walls: Array, cut: Cut, ignored: Ignored) -> tuple[Array, Cells]:
    """End points of beams that hit something unknown, (k, 2), and their indices, (k,)."""
    rows, columns = walls.shape
    ends, beams = np.empty((len(sweep.ranges), 2)), np.empty(len(sweep.ranges), np.int64)
    count = 0
    # the sensor is on the robot: beams longer than this end outside the window
    reach = math.hypot(cut.half_width, cut.half_height)
    reach += math.hypot(ignored.mount[0], ignored.mount[1])
    for i in range(len(sweep.ranges)):
        far = sweep.ranges[i]
        if not 0.0 < far < reach:
            continue
        x, y, direction = sensor_at(sweep, i)
        x, y = x + far * math.cos(direction), y + far * math.sin(direction)
        if not in_window(x, y, cut):
            continue
        row, column = math.floor(y / cut.resolution), math.floor(x / cut.resolution)
        if not (0 <= row < rows and 0 <= column < columns):
            continue
        if walls[row, column] <= ignored.margin + ignored.margin_per_m * far:
            continue
        if math.hypot(x - ignored.user[0], y - ignored.user[1]) <= ignored.user[2]:
            continue
        if is_own(far, sweep.start + i * sweep.step, ignored):
            continue
        ends[count, 0], ends[count, 1], beams[count] = x, y, i
        count += 1
    return ends[:count], beams[:count]


@compiled
def in_window(x: float, y: float, cut: Cut) -> bool:
    """True if a position is in the window."""
    return abs(x - cut.x) <= cut.half_width and abs(y - cut.y) <= cut.half_height


@compiled
def is_own(far: float, angle: float, ignored: Ignored) -> bool:
    """True if a beam ends within the robot's own outline."""
    turned = ignored.mount[2] + angle
    x = ignored.mount[0] + far * math.cos(turned)
    y = ignored.mount[1] + far * math.sin(turned)
    front, back, left, right = ignored.outline
    return -back <= x <= front and -right <= y <= left


@compiled
def hit_together(i: int, ends: Array, beams: Cells) -> bool:
    """True if enough neighbouring beams end near this one to mark its cell at once."""
    together = 1
    for step in (-1, 1):
        j = i + step
        while 0 <= j < len(beams) and abs(beams[j] - beams[i]) <= NEIGHBOURS:
            if math.hypot(ends[j, 0] - ends[i, 0], ends[j, 1] - ends[i, 1]) <= TOGETHER_M:
                together += 1
            j += step
    return together >= SURE


@compiled
def mark(ends: Array, beams: Cells, cut: Cut, now: int, marks: Marks, count: int) -> int:
    """Count the hits of a scan; returns the number of active cells."""
    hits, last = marks.hits, marks.last
    for i in range(len(ends)):
        row, column = (
            math.floor(ends[i, 1] / cut.resolution),
            math.floor(ends[i, 0] / cut.resolution),
        )
        cell = row * cut.columns + column
        if hits[cell] == 0:
            marks.active[count] = cell
            count += 1
        elif hits[cell] < SURE and now - last[cell] > UNSURE_NS:
            hits[cell] = 0
        if hits[cell] == 0 or last[cell] != now:
            hits[cell] = min(hits[cell] + 1, SURE)
        if hits[cell] < SURE and hit_together(i, ends, beams):
            hits[cell] = SURE
        last[cell] = now
    return count


@compiled
def tend(
    sweep: ScanSweep, cut: Cut, now: int, ages: tuple[int, int], marks: Marks, count: int
) -> int:
    """Drop cells that are seen through, too old or out of the window; returns how many stay.

    `ages`: the age from which on a cell may be cleared, and its lifetime, ns.
    """
    kept, half = 0, 0.5 * cut.resolution
    for i in range(count):
        cell = marks.active[i]
        x = (cell % cut.columns + 0.5) * cut.resolution
        y = (cell // cut.columns + 0.5) * cut.resolution
        age = now - marks.last[cell]
        gone = age > (ages[1] if marks.hits[cell] >= SURE else UNSURE_NS)
        gone = gone or not in_window(x, y, cut)
        if gone or (age >= ages[0] and is_seen_through(x, y, half, sweep)):
            marks.hits[cell] = 0
        else:
            marks.active[kept] = cell
            kept += 1
    return kept


@compiled
def is_seen_through(x: float, y: float, half: float, sweep: ScanSweep) -> bool:
    """True if at least one beam goes towards the cell, and all that do pass through it."""
    if sweep.step == 0.0:
        return False
    beam = 0.5 * (len(sweep.ranges) - 1)
    far = 0.0
    for _ in range(3):  # fixed-point iteration: the sensor moves little during a scan
        sx, sy, direction = sensor_at(sweep, beam)
        off = math.atan2(y - sy, x - sx) - direction
        beam += (off - 2.0 * math.pi * round(off / (2.0 * math.pi))) / sweep.step
        far = math.hypot(x - sx, y - sy)
    spread = math.atan2(half, max(half, far)) / abs(sweep.step)
    first, last, beams = math.ceil(beam - spread), math.floor(beam + spread), len(sweep.ranges)
    all_round = beams * abs(sweep.step) > 2.0 * math.pi - 1e-6
    if first > last or not (all_round or (first >= 0 and last < beams)):
        return False
    for i in range(first, last + 1):  # noqa: SIM110  compiled generators are slow
        if not sweep.ranges[i % beams] > far + 2.0 * half:
            return False
    return True
