"""Loop closing: where a path returns to a place seen before, the whole path is corrected.

A scan taken near a place passed much earlier is matched to the walls seen then, from many start
poses around its estimate. A good match becomes an edge of a pose graph, beside the edges from scan
to scan. The graph is solved by Gauss-Newton (Lu and Milios 1997), on errors of each edge in the
frame of its first pose: R_i^T (p_j - p_i) and yaw_j - yaw_i, less the measured ones, over sigma.
Loops that contradict the rest lose their weight (Geman and McClure).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.linalg import spsolve

from hw.geometry import Pose2, wrap
from states.localization.growing import GrowingWalls, points_in
from states.localization.scan_tracker import Match, TrackerValues, match
from states.maps.distance import Array
from states.maps.field import Field
from states.maps.mapping import FARTHEST, RESOLUTION


@dataclass(frozen=True, slots=True)
class LoopValues:
    """What counts as a loop, and the weights of edges.

    A scan is compared with the nearest pose at least `gone` m of path earlier, if that lies within
    `near` m plus `drift` m per metre of path between. The walls are those of scans within `about` m
    of path around it. A match counts if a share `sure` of its beams fits and every other place fits
    by `margin` less. Sigmas are `slip` m and `twist` rad per m, plus 1 cm and 3 mrad, for edges
    from scan to scan, and `sigma` (m, rad) for loops. Graph nodes are `step` m apart; a search from
    many starts is made at most at every `every`-th of them; `rounds` bounds how often loops are
    looked for.
    """

    step: float = 0.5
    gone: float = 8.0
    near: float = 1.5
    drift: float = 0.05
    about: float = 3.0
    sure: float = 0.75
    margin: float = 0.05
    slip: float = 0.03
    twist: float = 0.01
    sigma: tuple[float, float] = (0.03, 0.01)
    rounds: int = 3
    every: int = 5


class PoseEdge(NamedTuple):
    """A measured first_from_second between the poses of two numbers, with its sigmas, m and rad."""

    first: int
    second: int
    pose: Pose2
    sigma: tuple[float, float]
    is_loop: bool


_WIDE = TrackerValues(beams=1000, scale=0.2, inlier_distance=0.15, iterations=20, healthy=0.3)
_SPREAD = np.diag([0.3**2, 0.3**2, 0.1**2])
_APART = 0.5
"""Matches farther apart than this are different places, m."""


def close_loops(
    poses: Sequence[Pose2], clouds: Sequence[Array], values: LoopValues | None = None
) -> list[Pose2]:
    """Poses of scans, map_from_base, with loops closed; clouds (n, 2) are in the base frame."""
    values = values or LoopValues()
    keys = _keys(poses, values.step)
    kept = [clouds[key] for key in keys]
    near = [cloud[np.hypot(cloud[:, 0], cloud[:, 1]) < FARTHEST] for cloud in kept]
    bent = [poses[key] for key in keys]
    gone = _gone([poses[key] for key in keys])
    steps = [_step(n, bent, gone, values) for n in range(len(keys) - 1)]
    for _ in range(values.rounds):
        loops = _loops(bent, near, gone, values)
        if not loops:
            break
        bent = relaxed(bent, [*steps, *loops])
    return _carried(poses, keys, bent)


def polished(poses: Sequence[Pose2], clouds: Sequence[Array], field: Field) -> list[Pose2]:
    """Poses with each scan matched to a field made from all scans."""
    spread = np.diag([0.1**2, 0.1**2, 0.03**2])
    found = []
    for pose, cloud in zip(poses, clouds, strict=True):
        near = cloud[np.hypot(cloud[:, 0], cloud[:, 1]) < FARTHEST]
        one = match(field, near, pose, spread, _WIDE)
        found.append(one.map_from_base if one.is_healthy(_WIDE) else pose)
    return found


def relaxed(poses: Sequence[Pose2], edges: Sequence[PoseEdge], iterations: int = 20) -> list[Pose2]:
    """Poses that fit the edges best (least squares); the first one is held."""
    state = np.array([[pose.x, pose.y, pose.yaw] for pose in poses])
    for _ in range(iterations):
        rows, right = _linear(state, edges)
        normal = (rows.T @ rows).tocsc()
        delta = spsolve(normal, -(rows.T @ right)).reshape(-1, 3)
        state += delta
        if np.abs(delta).max() < 1e-6:
            break
    return [Pose2(x, y, wrap(yaw)) for x, y, yaw in state.tolist()]


def _keys(poses: Sequence[Pose2], step: float) -> list[int]:
    keys = [0]
    for number, pose in enumerate(poses):
        if poses[keys[-1]].distance_to(pose) >= step:
            keys.append(number)
    return keys


def _gone(poses: Sequence[Pose2]) -> list[float]:
    """Path length up to each pose, m."""
    gone = [0.0]
    for before, after in pairwise(poses):
        gone.append(gone[-1] + before.distance_to(after))
    return gone


def _step(
    number: int, poses: Sequence[Pose2], gone: Sequence[float], values: LoopValues
) -> PoseEdge:
    distance = gone[number + 1] - gone[number]
    # an error of a single match, m and rad, and what slip adds over the distance
    sigma = (0.01 + values.slip * distance, 0.003 + values.twist * distance)
    between = poses[number].inverse() @ poses[number + 1]
    return PoseEdge(number, number + 1, between, sigma, is_loop=False)


def _loops(
    poses: Sequence[Pose2], clouds: Sequence[Array], gone: Sequence[float], values: LoopValues
) -> list[PoseEdge]:
    """Loop edges: from each pose that matches the walls near an earlier one.

    A match is tried first with the correction of the last loop applied; if that fails, from many
    starts, but not at every pose.
    """
    found: list[PoseEdge] = []
    moved, tried = Pose2(0.0, 0.0), -values.every
    for number, pose in enumerate(poses):
        there = _place_of_long_ago(number, poses, gone, values)
        if there is None:
            continue
        walls = GrowingWalls(RESOLUTION)
        for n in range(number):
            if abs(gone[n] - gone[there]) <= values.about:
                walls.add(points_in(poses[n], clouds[n]))
        best = _sure(match(walls.field, clouds[number], moved @ pose, _SPREAD, _WIDE), values)
        if best is None and number - tried >= values.every:
            tried = number
            reach = _reach(number, there, gone, values)
            best = _best_of_many(walls, clouds[number], pose, reach, values)
        if best is not None:
            moved = best @ pose.inverse()
            found.append(PoseEdge(there, number, poses[there].inverse() @ best, values.sigma, True))
    return found


def _place_of_long_ago(
    number: int, poses: Sequence[Pose2], gone: Sequence[float], values: LoopValues
) -> int | None:
    old = [n for n in range(number) if gone[number] - gone[n] >= values.gone]
    if not old:
        return None
    there = min(old, key=lambda n: poses[n].distance_to(poses[number]))
    is_near = poses[there].distance_to(poses[number]) <= _reach(number, there, gone, values)
    return there if is_near else None


def _reach(number: int, there: int, gone: Sequence[float], values: LoopValues) -> float:
    return values.near + values.drift * (gone[number] - gone[there])


def _sure(found: Match, values: LoopValues) -> Pose2 | None:
    fits = found.share >= values.sure and found.step <= _WIDE.step
    return found.map_from_base if fits else None


def _best_of_many(
    walls: GrowingWalls, points: Array, here: Pose2, reach: float, values: LoopValues
) -> Pose2 | None:
    """The best match from many start poses; None unless it is clearly better than other places."""
    field, few = walls.field, points[:: max(1, len(points) // 60)]
    offsets = np.arange(-reach, reach + 0.1, 0.5).tolist()
    turns = np.arange(-0.3, 0.31, 0.1).tolist()
    starts = [
        Pose2(here.x + dx, here.y + dy, here.yaw + turn)
        for dx in offsets for dy in offsets for turn in turns if math.hypot(dx, dy) <= reach
    ]  # fmt: skip
    found = [match(field, few, start, _SPREAD, _WIDE) for start in starts]
    found.sort(key=lambda one: -one.share)
    polished = [match(field, points, one.map_from_base, _SPREAD, _WIDE) for one in found[:10]]
    best = max(polished, key=lambda one: one.share)
    others = (one for one in polished if one.map_from_base.distance_to(best.map_from_base) > _APART)
    second = max((one.share for one in others), default=0.0)
    return _sure(best, values) if second < best.share - values.margin else None


def _linear(state: Array, edges: Sequence[PoseEdge]) -> tuple[coo_matrix, Array]:
    """Weighted errors of all edges and their Jacobian by all poses; the first pose is held.

    The Jacobian of R_i^T (p_j - p_i) = (ahead, aside) is R_i^T by p_j, -R_i^T by p_i, and (aside,
    -ahead) by yaw_i.
    """
    entries, right = [], np.zeros(3 * len(edges) + 3)
    for n, edge in enumerate(edges):
        i, j = edge.first, edge.second
        c, s = math.cos(state[i, 2]), math.sin(state[i, 2])
        dx, dy = state[j, :2] - state[i, :2]
        ahead, aside = c * dx + s * dy, -s * dx + c * dy
        error = np.array(
            [
                ahead - edge.pose.x,
                aside - edge.pose.y,
                wrap(state[j, 2] - state[i, 2] - edge.pose.yaw),
            ]
        )
        weight = 1.0 / np.array([edge.sigma[0], edge.sigma[0], edge.sigma[1]])
        if edge.is_loop:
            weight = weight / (1.0 + float(np.sum((weight * error) ** 2)) / _LOOSE)
        right[3 * n : 3 * n + 3] = weight * error
        first = np.array([[-c, -s, aside], [s, -c, -ahead], [0.0, 0.0, -1.0]])
        second = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
        for a in range(3):
            for b in range(3):
                entries.append((3 * n + a, 3 * i + b, weight[a] * first[a, b]))
                entries.append((3 * n + a, 3 * j + b, weight[a] * second[a, b]))
    entries += [(3 * len(edges) + a, a, 1e6) for a in range(3)]
    row, column, value = (np.array(part) for part in zip(*entries, strict=True))
    shape = (len(right), 3 * len(state))
    return coo_matrix((value, (row, column)), shape=shape), right


_LOOSE = 1e3
"""Squared error of a loop, in units of its variance, at which its weight is half."""


def _carried(poses: Sequence[Pose2], keys: Sequence[int], bent: Sequence[Pose2]) -> list[Pose2]:
    """All poses, each moved along with the last graph node before it."""
    found, at = [], 0
    for number, pose in enumerate(poses):
        while at + 1 < len(keys) and keys[at + 1] <= number:
            at += 1
        found.append(bent[at] @ (poses[keys[at]].inverse() @ pose))
    return found
