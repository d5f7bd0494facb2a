"""What scans mark and clear: cells in which there is something that no map shows (R37, R51)."""

from __future__ import annotations

import math
import random

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from hw.geometry import Outline, Pose2
from hw.samples import PoseSigma, Scan
from hw.scene.room import Disc, Point
from states.maps.cells import Grid
from states.navigation.grid.obstacles import KnownObstacles, ObstacleLayer, ObstacleValues

GRID = Grid(0.05, 200, 200, -5.0, -5.0)
OPEN = np.full((200, 200), 9.0)
HERE, SENSOR = Pose2(0.0, 0.0), KnownObstacles(Pose2(0.0, 0.0))
SECOND = 10**9


def beams(*ranges: float, first: float = 0.0, step: float = 0.01) -> Scan:
    return Scan("front", first, step, ranges)


def places(layer: ObstacleLayer) -> list[Point]:
    return [layer.grid.center(*divmod(int(cell), layer.grid.columns)) for cell in layer.marked]


class Seeing:
    """A layer in the open, and scans for it."""

    def __init__(self, walls: np.ndarray = OPEN, **values: float) -> None:
        self.layer = ObstacleLayer(GRID, walls, ObstacleValues(10.0, 10.0, **values))

    def see(
        self, *ranges: float, at: float = 0.0, known: KnownObstacles = SENSOR, last=HERE
    ) -> list[Point]:
        self.layer.add_scan(beams(*ranges), HERE, last, round(at * SECOND), known)
        return places(self.layer)


@pytest.mark.requirement(37, 51)
def test_what_several_neighbouring_beams_meet_is_marked_at_once():
    marked = Seeing().see(2.0, 2.0, 2.0)
    assert marked
    for x, y in marked:
        assert math.hypot(x, y) == pytest.approx(2.0, abs=0.04)


def test_one_beam_alone_is_marked_when_it_is_met_in_three_scans():
    seeing = Seeing()
    assert [len(seeing.see(math.inf, 2.0, math.inf, at=0.1 * n)) for n in range(3)] == [0, 0, 1]


def test_beams_that_end_apart_have_not_met_one_thing():
    assert Seeing().see(2.0, 2.5, 3.0, 3.5, 4.0) == []


def test_one_beam_in_now_and_then_is_forgotten():
    seeing = Seeing()
    assert [len(seeing.see(math.nan, 2.0, at=0.6 * n)) for n in range(5)] == [0] * 5


def test_beams_that_end_at_random_mark_next_to_nothing():
    """3 % of the beams end anywhere, for a minute."""
    chance, seeing, marked = random.Random(3), Seeing(), 0
    for n in range(750):
        ranges = [chance.uniform(0.5, 30.0) if chance.random() < 0.03 else 30.0 for _ in range(541)]
        scan = Scan("front", -2.356, math.radians(0.5), tuple(ranges))
        seeing.layer.add_scan(scan, HERE, HERE, round(0.08 * n * SECOND), SENSOR)
        marked += len(seeing.layer.marked) > 0
    assert marked < 15


@pytest.mark.requirement(37, 51)
@pytest.mark.parametrize("later", [8.0, math.inf])
def test_what_left_is_cleared_by_beams_through_it(later: float):
    seeing = Seeing()
    assert seeing.see(2.0, 2.0, 2.0)
    assert seeing.see(later, later, later, at=0.1)
    assert seeing.see(later, later, later, at=0.2) == []


@pytest.mark.parametrize("later", [1.0, math.nan, 0.0, -1.0])
def test_what_is_hidden_or_not_seen_stays_until_its_lifetime_is_over(later: float):
    seeing = Seeing(mark_lifetime=10.0)
    far = seeing.see(2.0, 2.0, 2.0)
    assert set(far) <= set(seeing.see(later, later, later, at=10.0))
    assert not set(far) & set(seeing.see(later, later, later, at=10.1))


def test_a_cell_that_is_met_now_and_then_stays():
    """A leg thinner than the beams are apart."""
    seeing = Seeing()
    seeing.see(2.0, 2.0, 2.0)
    for n in range(1, 20):
        met = [2.0, 2.0, 2.0] if n % 2 == 0 else [8.0] * 3
        assert seeing.see(*met, at=0.08 * n)


@pytest.mark.parametrize("reading", [math.nan, 0.0, -1.0, -math.inf, math.inf])
def test_readings_that_meet_nothing_mark_nothing(reading: float):
    assert Seeing().see(reading, reading, reading) == []


def test_walls_of_the_map_are_no_news_nor_what_the_pose_may_be_wrong_by():
    walls = np.full((200, 200), 0.25)
    assert Seeing(walls, wall_margin=0.3).see(2.0, 2.0, 2.0) == []
    assert Seeing(walls).see(2.0, 2.0, 2.0)
    for sigma in (PoseSigma(0.06, 0.0), PoseSigma(0.0, 0.03)):
        assert Seeing(walls).see(2.0, 2.0, 2.0, known=KnownObstacles(HERE, sigma=sigma)) == []


def test_where_the_robot_cannot_be_there_is_no_news():
    assert Seeing(np.full((200, 200), -1.0)).see(2.0, 2.0, 2.0) == []


def test_who_is_known_better_than_by_cells_is_not_marked():
    assert Seeing().see(2.0, 2.0, 2.0, known=KnownObstacles(HERE, user=Disc(2.3, 0.0, 0.5))) == []
    assert Seeing().see(2.0, 2.0, 2.0, known=KnownObstacles(HERE, user=Disc(2.3, 0.5, 0.5)))


def test_the_robot_itself_is_no_obstacle():
    mount = Pose2(0.3, -0.2, math.pi / 2.0)
    body = KnownObstacles(mount, Outline(0.5, 0.5, 0.4, 0.4))
    assert Seeing().see(0.5, 0.5, 0.5, known=body) == []
    assert Seeing().see(0.7, 0.7, 0.7, known=body)


@pytest.mark.parametrize(("index", "own"), [(1, False), (157, True), (313, False)])
def test_where_the_robot_itself_is_depends_on_the_beam(index, own):
    """A scanner in the middle sees a long part of it to its left only, a quarter turn on."""
    body = KnownObstacles(HERE, Outline(0.3, 0.3, 0.9, 0.3))
    ranges = [math.inf] * 315
    ranges[index - 1 : index + 2] = [0.8] * 3
    assert bool(Seeing().see(*ranges, known=body)) != own


def test_beams_start_at_the_mount_of_the_scanner():
    for x, y in Seeing().see(2.0, 2.0, 2.0, known=KnownObstacles(Pose2(0.5, -0.5, math.pi / 2.0))):
        assert (x, y) == pytest.approx((0.5, 1.5), abs=0.06)


def test_beams_of_a_moving_robot_are_put_where_each_was_taken():
    """A post straight ahead at (3, 0) is met by the last beams, the robot having come nearer."""
    scan = Scan("front", -1.0, 0.01, (*[math.nan] * 98, 2.8, 2.8, 2.8))
    layer = ObstacleLayer(GRID, OPEN, ObstacleValues(10.0, 10.0))
    assert layer.add_scan(scan, Pose2(0.0, 0.0, 0.4), Pose2(0.2, 0.0, 0.0), 0, SENSOR)
    for x, y in places(layer):
        assert (x, y) == pytest.approx((3.0, 0.0), abs=0.06)


@pytest.mark.requirement(37)
def test_what_the_window_has_left_behind_is_forgotten():
    layer = ObstacleLayer(GRID, OPEN, ObstacleValues(5.0, 5.0))
    layer.add_scan(beams(2.0, 2.0, 2.0), HERE, HERE, 0, SENSOR)
    assert places(layer)
    for x, kept in ((-0.4, True), (-0.6, False), (0.0, False)):
        there = Pose2(x, 0.0)
        layer.add_scan(beams(math.nan), there, there, 0, SENSOR)
        assert bool(places(layer)) == kept


def test_what_is_beyond_the_window_is_not_marked():
    layer = ObstacleLayer(GRID, OPEN, ObstacleValues(5.0, 5.0))
    layer.add_scan(beams(2.6, 2.6, 2.6), HERE, HERE, 0, SENSOR)
    assert places(layer) == []


@settings(deadline=None, max_examples=60)
@given(
    x=st.floats(-40, 40), y=st.floats(-40, 40), yaw=st.floats(-9, 9), far=st.floats(0.01, 50.0),
    turn=st.floats(-0.3, 0.3), first=st.floats(-3, 3),
)  # fmt: skip
def test_marks_are_where_beams_end_wherever_the_robot_is(x, y, yaw, far, turn, first):
    layer = ObstacleLayer(GRID, OPEN, ObstacleValues(30.0, 30.0))
    scan = Scan("front", first, 0.004, (far,) * 5)
    here, there = Pose2(x, y, yaw), Pose2(x + 0.1, y, yaw + turn)
    layer.add_scan(scan, here, there, 0, SENSOR)
    for place in places(layer):
        away = [
            math.dist(place, (
                x + 0.1 * i / 4 + far * math.cos(yaw + turn * i / 4 + first + 0.004 * i),
                y + far * math.sin(yaw + turn * i / 4 + first + 0.004 * i),
            ))
            for i in range(5)
        ]  # fmt: skip
        assert min(away) < 0.036
    layer.add_scan(Scan("front", first, 0.004, (math.inf,) * 5), here, there, SECOND, SENSOR)


def test_a_scan_without_news_leaves_a_layer_without_marks_untouched():
    layer = ObstacleLayer(GRID, np.full((200, 200), 0.05))
    assert not layer.add_scan(beams(2.0, 2.0, 2.0), HERE, HERE, 0, SENSOR)
    assert len(layer.marked) == 0
