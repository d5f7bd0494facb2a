"""Scan matching by Gauss-Newton on the distance field of a map.

For a pose p let d_i(p) be the distance from the end of beam i to the nearest wall. Minimised is

    sum_i rho(d_i) / sigma^2 + (p - p0)^T P^-1 (p - p0)

with the predicted pose p0, its covariance P, and the loss of Geman and McClure, rho(d) = d^2 / (1 +
d^2 / scale^2), by which a beam that ends farther than `scale` from all walls hardly counts. The
gradient n of the distance field is the unit normal of the nearest wall, so J_i = (n_x, n_y, n . dq/
dyaw) with q the beam's end seen from the base. Weights w_i = rho'(d) / 2d = 1 / (1 + d^2 /
scale^2)^2 turn each step into a linear problem: (sum w J^T J / sigma^2 + P^-1) step = -(sum w J^T d
/ sigma^2) + P^-1 (p0 - p).

The scale of each beam starts at the predicted error of its end, larger for long beams, and is
halved per step down to `scale`, so that beams on people and chairs are dropped as the pose
converges.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from engine.files import Length
from engine.files.declared import Range
from hw import Pose2, compiled, wrap
from states.maps import Array, Field, Table, distance_at, is_floor

FEW = 4.0
"""A direction that fewer beams than this show is as open as that along a corridor."""
LONGEST = 0.5
"""Longest step of an iteration, m and rad."""
_Length = Annotated[Length, Range(0.001, 5.0)]


@dataclass(frozen=True, slots=True)
class TrackerValues:
    """Parameters of scan matching.

    `beams`: largest number used of a scan. `sigma_range`: least standard deviation of a beam, m;
    that of a scan is estimated from the beams that fit. `scale`: scale of the robust loss, m;
    `widest`: its largest start value. A beam fits if it ends within `inlier_distance` of a wall, m;
    one that ends twice that far behind a wall contradicts the match (clutter cannot cause that) and
    is subtracted from those that fit. A match is healthy if at least a share `healthy` of its beams
    fits, and `fewest` of them; fair with a share `fair`. `iterations` bounds the steps; the last
    one of a fair match is below `step`, m and rad, or below the accuracy of a scanned map's walls.
    """

    beams: Annotated[int, Range(3, 10_000)] = 180
    sigma_range: _Length = 0.01
    scale: _Length = 0.1
    widest: _Length = 1.0
    inlier_distance: _Length = 0.1
    healthy: Annotated[float, Range(0.0, 1.0)] = 0.4
    fair: Annotated[float, Range(0.0, 1.0)] = 0.25
    fewest: Annotated[int, Range(1, 10_000)] = 12
    iterations: Annotated[int, Range(1, 100)] = 10
    step: _Length = 0.005


@dataclass(frozen=True, slots=True, eq=False)
class Match:
    """The pose of a scan in the map.

    `information` (3, 3) is that of the beams alone about x, y (map) and yaw, 1/m2 and 1/rad2. It is
    near 0 in directions that walls do not constrain, as along a corridor; there the pose is the
    predicted one. `count`: beams that fit less those that end behind walls; `share`: their share;
    `step`: size of the last iteration's step, m and rad.
    """

    map_from_base: Pose2
    information: Array
    share: float
    count: int
    step: float
    iterations: int
    field_sigma: float = 0.0

    def is_healthy(self, values: TrackerValues) -> bool:
        """True if the match has converged with about as many beams on walls as one can expect."""
        return self.share >= values.healthy and self.is_fair(values)

    def is_fair(self, values: TrackerValues) -> bool:
        """True if the match has converged with enough beams on walls to correct the pose."""
        enough = self.share >= values.fair and self.count >= values.fewest
        return enough and self.step <= max(values.step, self.field_sigma)


def match(
    field: Field,
    points: Array,
    predicted: Pose2,
    covariance: Array,
    values: TrackerValues | None = None,
) -> Match:
    """Match points (n, 2) of the base frame to the walls of a map, near a predicted pose.

    `covariance` (3, 3) is that of the prediction: x, y in the map, m2, and yaw, rad2. Without
    points the result is the prediction, with no information.
    """
    values = values or TrackerValues()
    near = field.map_from_corner.inverse() @ predicted
    yaw_of_map = field.map_from_corner.yaw
    prior = rotated(np.asarray(np.linalg.inv(covariance), np.float64), -yaw_of_map)
    off = 3.0 * math.sqrt(max(0.5 * (covariance[0, 0] + covariance[1, 1]), 0.0))
    turned = 3.0 * math.sqrt(max(covariance[2, 2], 0.0))
    x, y, yaw, information, inliers, step, iterations = _matched(
        points, (near.x, near.y, near.yaw), prior, field.table,
        (values.sigma_range, values.scale + field.sigma, values.widest, off, turned),
        values.inlier_distance + field.sigma, values.iterations,
    )  # fmt: skip
    pose = field.map_from_corner @ Pose2(x, y, wrap(yaw))
    share = inliers / len(points) if len(points) else 0.0
    information = rotated(information, yaw_of_map)
    return Match(pose, information, share, inliers, step, iterations, field.sigma)


def rotated(matrix: Array, yaw: float) -> Array:
    """A covariance or information (3, 3) of x, y, yaw, in a frame turned by -yaw."""
    if yaw == 0.0:
        return matrix
    c, s = math.cos(yaw), math.sin(yaw)
    turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    moved: Array = turn @ matrix @ turn.T
    return moved


@compiled
def _matched(
    points: Array,
    predicted: tuple[float, float, float],
    prior: Array,
    table: Table,
    lengths: tuple[float, float, float, float, float],
    fits: float,
    iterations: int,
) -> tuple[float, float, float, Array, int, float, int]:
    """Pose, information of the beams alone, beams that fit less others, last step, steps done."""
    sigma, scale, widest, off, turned = lengths
    x, y, yaw = predicted
    information, gradient = np.zeros((3, 3)), np.zeros(3)
    least = sigma
    step, done, wide = 0.0, 0, 1.0
    while done < iterations:
        spread, _ = _normal_equations(
            points,
            (x, y, yaw),
            table,
            (scale, widest, wide * off, wide * turned, fits),
            information,
            gradient,
        )
        least = max(sigma, spread)
        dx, dy, dyaw = predicted[0] - x, predicted[1] - y, _wrapped(predicted[2] - yaw)
        inverse = 1.0 / (least * least)
        whole, right = np.empty((3, 3)), np.empty(3)
        for i in range(3):
            right[i] = gradient[i] * inverse
            right[i] += prior[i, 0] * dx + prior[i, 1] * dy + prior[i, 2] * dyaw
            for j in range(3):
                whole[i, j] = information[i, j] * inverse + prior[i, j]
        _solve(whole, right)
        length = max(math.hypot(right[0], right[1]), abs(right[2]))
        cut = min(1.0, LONGEST / length) if length > 0.0 else 1.0
        x, y, yaw = x + cut * right[0], y + cut * right[1], yaw + cut * right[2]
        step, done = cut * length, done + 1
        if step < 1e-4 and wide * off < 0.2 * scale:
            break
        wide *= 0.5
    spread, inliers = _normal_equations(
        points, (x, y, yaw), table, (scale, scale, 0.0, 0.0, fits), information, gradient
    )
    inliers -= _behind_walls(points, (x, y, yaw), table, 2.0 * fits)
    _leave_open(information)
    least = max(sigma, spread)
    for i in range(3):
        for j in range(3):
            information[i, j] /= least * least
    return x, y, yaw, information, inliers, step, done


@compiled
def _normal_equations(
    points: Array,
    pose: tuple[float, float, float],
    table: Table,
    lengths: tuple[float, float, float, float, float],
    information: Array,
    gradient: Array,
) -> tuple[float, int]:
    """Write sum w J^T J and -sum w J^T d (see the module); returns spread and inliers.

    The scale of a beam is raised to the predicted error of its end, at most to `widest`. The spread
    is the weighted root mean square of the distances.
    """
    (x, y, yaw), (scale, widest, off, turned, fits) = pose, lengths
    c, s = math.cos(yaw), math.sin(yaw)
    xx = xy = yy = xt = yt = tt = gx = gy = gt = 0.0
    squares = total = 0.0
    inliers = 0
    for i in range(len(points)):
        px = c * points[i, 0] - s * points[i, 1]
        py = s * points[i, 0] + c * points[i, 1]
        d, nx, ny = distance_at(x + px, y + py, table)
        own = scale
        if off > 0.0 or turned > 0.0:
            own = _scale(px, py, (scale, widest, off, turned))
        root = 1.0 / (1.0 + d * d / (own * own))
        w = root * root
        if nx != 0.0 or ny != 0.0:
            nt = ny * px - nx * py
            xx += w * nx * nx
            xy += w * nx * ny
            yy += w * ny * ny
            xt += w * nx * nt
            yt += w * ny * nt
            tt += w * nt * nt
            gx -= w * nx * d
            gy -= w * ny * d
            gt -= w * nt * d
        squares += w * d * d
        total += w
        if d < fits:
            inliers += 1
    information[0, 0], information[1, 1], information[2, 2] = xx, yy, tt
    information[0, 1] = information[1, 0] = xy
    information[0, 2] = information[2, 0] = xt
    information[1, 2] = information[2, 1] = yt
    gradient[0], gradient[1], gradient[2] = gx, gy, gt
    spread = math.sqrt(squares / total) if total > 0.0 else 0.0
    return spread, inliers


@compiled
def _scale(x: float, y: float, lengths: tuple[float, float, float, float]) -> float:
    """`off` + `turned` hypot(x, y), not below `scale` nor above `widest`.

    Most are beyond one of these by far: for them the square root, inexact, is enough.
    """
    scale, widest, off, turned = lengths
    about = off + turned * math.sqrt(x * x + y * y)
    if about > 1.000001 * widest:
        return max(scale, widest)
    if about < 0.999999 * scale:
        return scale
    return max(scale, min(widest, off + turned * math.hypot(x, y)))


@compiled
def _leave_open(information: Array) -> None:
    """Take away what is known along a direction that fewer than `FEW` beams show: clutter may be.

    `information` is in beams: its x, y block (xx xy; xy yy) has the eigenvalue
    m - hypot(h, xy), with m and h half the sum and half the difference of xx and yy, for the
    direction at angle a + pi/2, where 2a = atan2(xy, h). A unit vector u of it is projected out.
    """
    xx, xy, yy = information[0, 0], information[0, 1], information[1, 1]
    half = 0.5 * (xx - yy)
    if 0.5 * (xx + yy) - math.hypot(half, xy) >= FEW:
        return
    angle = 0.5 * math.atan2(xy, half) + 0.5 * math.pi
    u, v = math.cos(angle), math.sin(angle)
    for _ in range(2):  # rows, then columns of the symmetric matrix
        for i in range(3):
            along = u * information[i, 0] + v * information[i, 1]
            information[i, 0] -= u * along
            information[i, 1] -= v * along
        for i in range(3):
            for j in range(i):
                information[i, j], information[j, i] = information[j, i], information[i, j]


@compiled
def _behind_walls(
    points: Array, pose: tuple[float, float, float], table: Table, distance: float
) -> int:
    """Number of points off the floor and farther than `distance` from all walls."""
    c, s = math.cos(pose[2]), math.sin(pose[2])
    count = 0
    for i in range(len(points)):
        x = pose[0] + c * points[i, 0] - s * points[i, 1]
        y = pose[1] + s * points[i, 0] + c * points[i, 1]
        if not is_floor(x, y, table) and distance_at(x, y, table)[0] > distance:
            count += 1
    return count


@compiled
def _solve(matrix: Array, right: Array) -> None:
    """Solve a symmetric positive definite 3 x 3 system in place, by Cholesky factorisation."""
    for j in range(3):
        for k in range(j):
            matrix[j, j] -= matrix[j, k] * matrix[j, k]
        matrix[j, j] = math.sqrt(max(matrix[j, j], 1e-300))
        for i in range(j + 1, 3):
            for k in range(j):
                matrix[i, j] -= matrix[i, k] * matrix[j, k]
            matrix[i, j] /= matrix[j, j]
    for i in range(3):
        for k in range(i):
            right[i] -= matrix[i, k] * right[k]
        right[i] /= matrix[i, i]
    for i in range(2, -1, -1):
        for k in range(i + 1, 3):
            right[i] -= matrix[k, i] * right[k]
        right[i] /= matrix[i, i]


@compiled
def _wrapped(angle: float) -> float:
    return angle - 2.0 * math.pi * math.floor(angle / (2.0 * math.pi) + 0.5)
