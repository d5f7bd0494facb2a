"""The search of a window finds what looking everywhere finds."""

import itertools
import math

import numpy as np
import pytest

from hw.geometry import Pose2, wrap
from states.localization.matching import correlative
from states.localization.matching.correlative import Window, correlated, score_of
from states.maps.cells import room_map
from states.maps.field import map_field, room_field
from tests.states.localization.world import ROOM

FIELDS = {
    "drawn": room_field(ROOM),
    "scanned": map_field(room_map(ROOM.outer, ROOM.obstacles, 0.05)),
}
PRIOR = np.diag([0.2**2, 0.2**2, 0.15**2])


def seen_from(pose, rng, unmapped=0.0, beams=120):
    """Ends of beams by marching along each until a wall of the drawn room is met."""
    field, points = FIELDS["drawn"], []
    for angle in np.linspace(-math.pi, math.pi, beams, endpoint=False):
        way = np.array([math.cos(angle), math.sin(angle)])
        reach = 0.05
        while reach < 12.0:
            near = field.distances(pose, (reach * way)[None])[0]
            if near < 1e-3:
                break
            reach += near
        share = rng.uniform(0.3, 0.9) if rng.random() < unmapped else 1.0
        points.append((share * reach + rng.normal(0.0, 0.01)) * way)
    return np.array(points)


def off(seed):
    rng = np.random.default_rng(seed)
    true = Pose2(*rng.uniform([2.0, 2.0, -3.0], [3.0, 4.0, 3.0]))
    x, y, yaw = rng.uniform([-0.5, -0.5, -0.35], [0.5, 0.5, 0.35])
    predicted = Pose2(true.x + x, true.y + y, wrap(true.yaw + yaw))
    return true, seen_from(true, rng, unmapped=0.3), Window(predicted, PRIOR, 0.6, 0.45)


@pytest.mark.parametrize("kind", FIELDS)
@pytest.mark.parametrize("seed", range(6))
def test_the_truth_is_found_in_the_window(kind, seed):
    true, points, window = off(seed)
    best = correlated(FIELDS[kind], points, window)[0]
    assert best.distance_to(true) < 0.12
    assert abs(wrap(best.yaw - true.yaw)) < 0.06


@pytest.mark.parametrize("seed", range(2))
def test_nothing_in_a_fine_grid_scores_better(seed):
    _, points, window = off(seed)
    field, at = FIELDS["drawn"], window.predicted
    best = score_of(field, points, window, correlated(field, points, window)[0])
    steps = itertools.product(
        np.arange(-0.56, 0.6, 0.08), np.arange(-0.56, 0.6, 0.08), np.arange(-0.4, 0.45, 0.05)
    )
    grid = [
        score_of(field, points, window, Pose2(at.x + x, at.y + y, at.yaw + yaw))
        for x, y, yaw in steps
    ]
    assert best > max(grid) - 2.0  # the grid lies between the boxes' centres


def test_poses_that_are_found_are_in_the_window_and_best_first():
    _, points, window = off(3)
    found = correlated(FIELDS["drawn"], points, window)
    scores = [score_of(FIELDS["drawn"], points, window, pose) for pose in found]
    assert scores == sorted(scores, reverse=True)
    for pose in found:
        assert abs(pose.x - window.predicted.x) <= window.metres + 1e-9
        assert abs(wrap(pose.yaw - window.predicted.yaw)) <= window.radians + 1e-9


def test_a_wide_window_begins_with_no_more_boxes():
    for metres, radians in itertools.product((0.1, 1.0, 20.0), (0.05, 1.0, math.pi)):
        half = correlative.first_half(metres, radians, 3.0)
        grid = correlative._grid(metres, radians, half, half / 3.0)
        assert len(grid) <= correlative.FIRST
        assert np.abs(grid[:, 0]).max() + half >= metres - 1e-9
        assert np.abs(grid[:, 2]).max() + half / 3.0 >= radians - 1e-9


def test_without_points_there_is_nothing_to_find():
    assert correlated(FIELDS["drawn"], np.empty((0, 2)), Window(Pose2(0, 0), PRIOR, 1.0, 1.0)) == []
