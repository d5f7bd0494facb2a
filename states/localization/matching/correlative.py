"""Correlative scan matching (Olson 2009): the likeliest poses of a scan in a window of poses.

Gauss-Newton (`scan_tracker.py`) finds the optimum into whose basin its start falls; after a long
way between two scans the prediction may lie in another's. So the whole window is searched here.
A pose p is scored by

    score(p) = -alike sum_i min(d_i(p), c)^2 / 2 s^2 - min(off^T P^-1 off / 2, carried)

with off = p - p0: the log-likelihood of its beams, `alike` independent beams per beam, and of its
prediction p0 with covariance P; with log-odds `carried` against it, somebody has moved the base.

Boxes of poses are divided from coarse to fine. In a box of half sizes h, h and g the end of beam i
moves by at most e_i = sqrt(2) h + g |q_i|, and d is the distance to the nearest wall, so that
d_i >= d_i(centre) - e_i; with it the score of the centre becomes a bound for the box. At each level
the boxes of the best bounds go on, at most `BOXES` of them, which bounds the work.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from hw import Pose2, compiled, wrap
from states.localization.filter import inverse
from states.localization.matching.particles import wrapped
from states.localization.matching.scan_tracker import rotated
from states.maps import Array, Field, Table, distance_at

ALIKE = 0.1
"""Independent beams per beam of a scan: errors of neighbours correlate."""
CARRIED = 8.0
"""Log-odds that the base has not been carried elsewhere."""
SPREAD, REACHES = 0.1, 0.3
"""Standard deviation of beam ends, m, and the distance from which all beams count alike, m."""
FINEST = 0.04
"""Half size of the smallest boxes, m: well within the basin of Gauss-Newton."""
FIRST, BOXES = 600, 32
"""Largest number of boxes at the start, and of those that are divided at each level."""
BEAMS = 60
"""Largest number of beams that are looked at."""
FOUND = 3
"""Largest number of poses that are returned."""


class Window(NamedTuple):
    """A predicted pose, its covariance (3, 3), and half sizes of the window, m (map) and rad."""

    predicted: Pose2
    covariance: Array
    metres: float
    radians: float


def correlated(field: Field, points: Array, window: Window) -> list[Pose2]:
    """The likeliest poses of points (n, 2) in a window, best first, apart from each other."""
    if not len(points):
        return []
    some = np.ascontiguousarray(points[:: math.ceil(len(points) / BEAMS)])
    near, prior = _in_table(field, window)
    lever = max(1.0, float(np.median(np.hypot(some[:, 0], some[:, 1]))))
    task = _Task(
        some, (near.x, near.y, near.yaw), prior, field.table, _lengths(field),
        ALIKE * len(points) / len(some), lever,
    )  # fmt: skip
    found = _searched(task, window.metres, window.radians)
    return [field.map_from_corner @ Pose2(x, y, wrap(yaw)) for x, y, yaw in found.tolist()]


def score_of(field: Field, points: Array, window: Window, map_from_base: Pose2) -> float:
    """The score of a pose (see the module)."""
    near, prior = _in_table(field, window)
    pose = field.map_from_corner.inverse() @ map_from_base
    off = (pose.x - near.x, pose.y - near.y, wrap(pose.yaw - near.yaw))
    fit: float = fit_of(
        points, (pose.x, pose.y, pose.yaw), field.table, _lengths(field), (0.0, 0.0)
    )
    return ALIKE * fit - min(CARRIED, 0.5 * float(np.array(off) @ prior @ off))


def _lengths(field: Field) -> tuple[float, float]:
    return math.hypot(SPREAD, field.sigma), math.hypot(REACHES, field.sigma)


def _in_table(field: Field, window: Window) -> tuple[Pose2, Array]:
    """Predicted pose and inverse covariance from the corner of the field's table."""
    corner = field.map_from_corner
    prior = rotated(inverse(window.covariance), -corner.yaw)
    return corner.inverse() @ window.predicted, np.ascontiguousarray(prior)


class _Task(NamedTuple):
    """What is matched, as compiled code reads it: points (n, 2), the prediction, the map.

    `prior` is the inverse covariance (3, 3); `lengths` are s and c; `lever` is the distance at
    which a turn moves beams as far as a step does, m.
    """

    points: Array
    predicted: tuple[float, float, float]
    prior: Array
    table: Table
    lengths: tuple[float, float]
    alike: float
    lever: float


@compiled
def _searched(task: _Task, metres: float, radians: float) -> Array:
    """Poses (n, 3) of the best boxes of the finest level, best first."""
    lever = task.lever
    half = first_half(metres, radians, lever)
    boxes = _grid(metres, radians, half, half / lever)
    least = _bounds(task, np.zeros((1, 3)), 0.0, -math.inf)[0]
    while half > FINEST:
        bounds = _bounds(task, boxes, half, least)
        order = np.argsort(-bounds)[:BOXES]
        least = max(least, _bounds(task, boxes[order[:1]], 0.0, -math.inf)[0])
        half *= 0.5
        boxes = _divided(boxes[order[bounds[order] >= least]], half, half / lever)
    scores = _bounds(task, boxes, 0.0, -math.inf)
    best = apart(boxes[np.argsort(-scores)], FOUND, 4.0 * half, 4.0 * half / lever)
    for i in range(3):
        best[:, i] += task.predicted[i]
    return best


@compiled
def first_half(metres: float, radians: float, lever: float) -> float:
    """Half size of the first boxes, m: at most `FIRST` of them cover the window."""
    half = FINEST
    while _count(metres, half) ** 2 * _count(radians, half / lever) > FIRST:
        half *= 2.0
    return half


@compiled
def _bounds(task: _Task, boxes: Array, half: float, least: float) -> Array:
    """Bounds (n,) of the scores in boxes about centres (n, 3); with half size 0: their scores.

    Those that are below `least` are minus infinity.
    """
    halves = (half, half, half / task.lever)
    loose = 0.0
    for i in range(3):
        for j in range(3):
            loose += halves[i] * halves[j] * abs(task.prior[i, j])
    bounds = np.empty(len(boxes))
    for k in range(len(boxes)):
        dx, dy, dyaw = boxes[k, 0], boxes[k, 1], boxes[k, 2]
        pose = (task.predicted[0] + dx, task.predicted[1] + dy, task.predicted[2] + dyaw)
        root = max(0.0, math.sqrt(_square(dx, dy, dyaw, task.prior)) - math.sqrt(loose))
        slack = (math.sqrt(2.0) * half, halves[2])
        prior = min(CARRIED, 0.5 * root * root)
        enough = (least + prior) / task.alike
        fit = fit_of(task.points, pose, task.table, task.lengths, slack, enough)
        bounds[k] = task.alike * fit - prior
    return bounds


@compiled
def apart(poses: Array, count: int, metres: float, radians: float) -> Array:
    """At most `count` of the poses (n, 3), in order, each apart from those chosen before."""
    chosen = np.empty((count, 3))
    found = 0
    for i in range(len(poses)):
        near = False
        for k in range(found):
            dx, dy = poses[i, 0] - chosen[k, 0], poses[i, 1] - chosen[k, 1]
            turn = wrapped(poses[i, 2] - chosen[k, 2])
            if dx * dx + dy * dy < metres * metres and abs(turn) < radians:
                near = True
                break
        if not near:
            chosen[found] = poses[i]
            found += 1
            if found == count:
                break
    return chosen[:found].copy()


@compiled
def _count(window: float, half: float) -> int:
    """Number of boxes of this half size that cover -window to window."""
    return max(1, math.ceil(window / half - 1e-9))


@compiled
def _grid(metres: float, radians: float, half: float, turn: float) -> Array:
    """Centres (n, 3) of the boxes that cover the window about 0."""
    places, turns = _count(metres, half), _count(radians, turn)
    boxes = np.empty((places * places * turns, 3))
    for n in range(len(boxes)):
        boxes[n, 0] = (2 * (n // (places * turns)) + 1 - places) * half
        boxes[n, 1] = (2 * (n // turns % places) + 1 - places) * half
        boxes[n, 2] = (2 * (n % turns) + 1 - turns) * turn
    return boxes


@compiled
def _divided(boxes: Array, half: float, turn: float) -> Array:
    """Centres of the eight parts of each box; `half` and `turn` are the parts' half sizes."""
    parts = np.empty((8 * len(boxes), 3))
    for n in range(len(parts)):
        parts[n, 0] = boxes[n // 8, 0] + (2 * (n % 2) - 1) * half
        parts[n, 1] = boxes[n // 8, 1] + (2 * (n // 2 % 2) - 1) * half
        parts[n, 2] = boxes[n // 8, 2] + (2 * (n // 4 % 2) - 1) * turn
    return parts


@compiled
def _square(dx: float, dy: float, dyaw: float, prior: Array) -> float:
    """Squared Mahalanobis distance from the prediction."""
    off = (dx, dy, dyaw)
    total = 0.0
    for i in range(3):
        for j in range(3):
            total += off[i] * prior[i, j] * off[j]
    return max(0.0, total)


@compiled
def fit_of(
    points: Array,
    pose: tuple[float, float, float],
    table: Table,
    lengths: tuple[float, float],
    slack: tuple[float, float],
    least: float = -math.inf,
) -> float:
    """Sum of -min(d, c)^2 / 2 s^2, with distances less `slack`, m and m per m, at least 0.

    Minus infinity, found early, if it is below `least`.
    """
    c, s = math.cos(pose[2]), math.sin(pose[2])
    sigma, farthest = lengths
    total, lowest = 0.0, 2.0 * sigma * sigma * least
    for i in range(len(points)):
        px, py = points[i, 0], points[i, 1]
        d = distance_at(pose[0] + c * px - s * py, pose[1] + s * px + c * py, table)[0]
        d = min(farthest, max(0.0, d - slack[0] - slack[1] * math.sqrt(px * px + py * py)))
        total -= d * d
        if total < lowest:
            return -math.inf
    return total / (2.0 * sigma * sigma)
