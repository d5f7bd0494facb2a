"""Places that a path returns to: a scan is matched to the walls that were seen there long before.

Walls of old stretches of the path are kept as submaps in the frame of their middle pose, so that
they stay right when the path is bent. A scan near one is matched to it, from where it should be, or
in a window as large as the path may have drifted by. The match is measured against that middle
pose: an edge of the pose graph (`pose_graph.py`), which leaves out those that contradict the rest.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.spatial import cKDTree

from hw import Pose2
from states.localization.matching import Match, TrackerValues, Window, correlated, match
from states.localization.slam.incremental_mapping import (
    GrowingWalls,
    matched_information,
    points_in,
)
from states.localization.slam.pose_graph import PoseEdge
from states.maps import RESOLUTION, Array


@dataclass(frozen=True, slots=True)
class LoopValues:
    """What counts as a loop.

    A scan is compared with the nearest submap at least `gone` m of path earlier, if that lies
    within `near` m plus `drift` m per metre of path between, at most `farthest` m. Submaps lie
    `about` m of path apart and reach as far to both sides. A match counts if a share `sure` of its
    beams fits and every other place fits by `margin` less. Scans are compared every `step` m of
    path; a window is searched at most at every `every`-th of them, up to `turn` rad.
    """

    step: float = 0.5
    gone: float = 8.0
    near: float = 1.5
    drift: float = 0.05
    farthest: float = 10.0
    about: float = 3.0
    sure: float = 0.75
    margin: float = 0.05
    turn: float = 0.4
    every: int = 5


_WIDE = TrackerValues(beams=1000, scale=0.2, inlier_distance=0.15, iterations=20, healthy=0.3)
_SPREAD = np.diag([0.3**2, 0.3**2, 0.1**2])
_APART = 0.5
"""Matches farther apart than this are different places, m."""
_NEAREST = 16
"""Number of submaps that are looked at for one that is old enough."""


class Loops:
    """Finds where a path returns to. Poses (map_from_base) and clouds (n, 2), base frame, in order.

    The initial poses are trusted within a submap only.
    """

    def __init__(
        self, poses: Sequence[Pose2], clouds: Sequence[Array], values: LoopValues | None = None
    ) -> None:
        self._values = values or LoopValues()
        self._local, self._clouds = list(poses), clouds
        self._gone = path_lengths(poses)
        self._middles = _every(self._gone, self._values.about)
        self._tried = _every(self._gone, self._values.step)
        self._walls: dict[int, GrowingWalls] = {}
        self.edges: dict[int, PoseEdge] = {}

    def look(self, poses: Sequence[Pose2]) -> bool:
        """Look for loops at scans without one, with the poses known by now; True if some appear."""
        before, moved, searched = len(self.edges), Pose2(0.0, 0.0), -self._values.every
        tree = cKDTree([(poses[n].x, poses[n].y) for n in self._middles])
        for order, number in enumerate(self._tried):
            there = None if number in self.edges else self._place_of_long_ago(number, poses, tree)
            if there is None:
                continue
            field, cloud = self._submap(there).field, self._clouds[number]
            predicted = poses[there].inverse() @ moved @ poses[number]
            best = _sure(match(field, cloud, predicted, _SPREAD, _WIDE), self._values)
            if best is None and order - searched >= self._values.every:
                searched = order
                predicted = poses[there].inverse() @ poses[number]
                best = self._searched(there, number, predicted)
            if best is not None:
                moved = poses[there] @ best.map_from_base @ poses[number].inverse()
                known = matched_information(best)
                self.edges[number] = PoseEdge(there, number, best.map_from_base, known, True)
        return len(self.edges) > before

    def _place_of_long_ago(self, number: int, poses: Sequence[Pose2], tree: cKDTree) -> int | None:
        """The middle of the nearest submap that is old enough; None if none is near enough."""
        here = (poses[number].x, poses[number].y)
        far, found = tree.query(here, k=min(_NEAREST, len(self._middles)))
        for distance, index in zip(np.atleast_1d(far), np.atleast_1d(found), strict=True):
            there = self._middles[int(index)]
            if self._gone[number] - self._gone[there] >= self._values.gone:
                return there if distance <= self._reach(there, number) else None
        return None

    def _reach(self, there: int, number: int) -> float:
        values, between = self._values, self._gone[number] - self._gone[there]
        return min(values.farthest, values.near + values.drift * between)

    def _submap(self, middle: int) -> GrowingWalls:
        """Walls of the scans about a pose, in its frame."""
        if middle not in self._walls:
            walls, about = GrowingWalls(RESOLUTION), self._values.about
            low, high = np.searchsorted(
                self._gone, [self._gone[middle] - about, self._gone[middle] + about]
            )
            origin = self._local[middle].inverse()
            for n in range(low, high):
                walls.add(points_in(origin @ self._local[n], self._clouds[n]))
            self._walls[middle] = walls
        return self._walls[middle]

    def _searched(self, there: int, number: int, predicted: Pose2) -> Match | None:
        """The best match in the window; None unless it is clearly better than other places."""
        field, cloud, values = self._submap(there).field, self._clouds[number], self._values
        reach = self._reach(there, number)
        covariance = np.diag([reach**2, reach**2, values.turn**2])
        window = Window(predicted, covariance, reach, values.turn)
        starts = correlated(field, cloud, window)
        found = [match(field, cloud, start, _SPREAD, _WIDE) for start in starts]
        if not found:
            return None
        best = max(found, key=lambda one: one.share)
        others = (one for one in found if _are_apart(one, best))
        second = max((one.share for one in others), default=0.0)
        return _sure(best, values) if second < best.share - values.margin else None


def path_lengths(poses: Sequence[Pose2]) -> list[float]:
    """Path length up to each pose, m."""
    gone = [0.0]
    for before, after in pairwise(poses):
        gone.append(gone[-1] + before.distance_to(after))
    return gone


def _every(gone: Sequence[float], step: float) -> list[int]:
    """Numbers of poses at least `step` m of path apart, the first included."""
    chosen = [0]
    for number, length in enumerate(gone):
        if length - gone[chosen[-1]] >= step:
            chosen.append(number)
    return chosen


def _are_apart(one: Match, other: Match) -> bool:
    return one.map_from_base.distance_to(other.map_from_base) > _APART


def _sure(found: Match, values: LoopValues) -> Match | None:
    return found if found.share >= values.sure and found.step <= _WIDE.step else None
