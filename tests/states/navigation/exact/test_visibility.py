import ast
import math
import os
import subprocess
import sys
from pathlib import Path

import pytest
from hypothesis import assume, given, settings, strategies as st
from shapely import LineString, Point, affinity, box as box_of

from hw.scene.room import Disc
from states.navigation.exact.visibility import ExactPlanner
from tests.repeats import examples

ROOM = ((0.0, 0.0), (10.0, 0.0), (10.0, 8.0), (0.0, 8.0))
BOX = ((4.0, 3.0), (6.0, 3.0), (6.0, 5.0), (4.0, 5.0))
USER = Disc(5.0, 4.0, 1.27)


def room_with_gap(width):
    lower = ((4.9, 0.0), (5.1, 0.0), (5.1, 3.0), (4.9, 3.0))
    upper = ((4.9, 3.0 + width), (5.1, 3.0 + width), (5.1, 8.0), (4.9, 8.0))
    return ROOM, (lower, upper)


def way_round_disc(start, goal, disc):
    """Length of two tangents and the arc between them, from the textbook."""
    one, two = (math.dist(p, (disc.x, disc.y)) for p in (start, goal))
    angle = math.acos(
        ((start[0] - disc.x) * (goal[0] - disc.x) + (start[1] - disc.y) * (goal[1] - disc.y))
        / (one * two)
    )
    arc = angle - math.acos(disc.radius / one) - math.acos(disc.radius / two)
    legs = math.sqrt(one**2 - disc.radius**2) + math.sqrt(two**2 - disc.radius**2)
    return legs + disc.radius * arc


def test_a_free_line_of_sight_is_the_way():
    path = ExactPlanner(ROOM, inflation_radius=1.0).plan((1.0, 1.0), (9.0, 7.0))
    assert path.points == ((1.0, 1.0), (9.0, 7.0))
    assert path.length == math.hypot(8.0, 6.0)


def test_the_way_round_the_user_is_two_tangents_and_an_arc():
    start, goal = (2.0, 3.9), (8.0, 4.0)
    path = ExactPlanner(ROOM, inflation_radius=0.5).plan(start, goal, USER)
    assert path.length == pytest.approx(way_round_disc(start, goal, USER), abs=1e-12)
    assert all(math.dist(p, (USER.x, USER.y)) > USER.radius - 1e-9 for p in path.points)
    assert path.radii[0] == path.radii[-1] == math.inf
    assert set(path.radii[1:-1]) == {USER.radius}


def test_the_way_round_a_box_follows_its_side_at_the_radius():
    path = ExactPlanner(ROOM, (BOX,), inflation_radius=0.5).plan((2.0, 3.2), (8.0, 3.2))
    quarter = way_round_disc((2.0, 3.2), (8.0, 2.5), Disc(4.0, 3.0, 0.5)) - 4.0
    assert path.length == pytest.approx(2.0 * quarter + 2.0, abs=1e-12)


@pytest.mark.parametrize(("side", "below"), [(1, True), (-1, False)])
def test_either_way_round_the_user_can_be_asked_for(side, below):
    planner = ExactPlanner(ROOM, inflation_radius=0.5)
    for start in ((2.0, 4.0), (2.0, 4.1), (2.0, 3.9)):
        path = planner.plan(start, (8.0, 4.0), USER, side)
        assert all((y < USER.y) == below for _, y in path.points[1:-1])


def test_the_long_way_round_is_given_even_if_the_short_one_is_straight():
    planner = ExactPlanner(ROOM, inflation_radius=0.5)
    assert len(planner.plan((2.0, 2.0), (8.0, 2.0), USER, 1).points) == 2
    assert planner.plan((2.0, 2.0), (8.0, 2.0), USER, -1).length > 7.0


def test_a_side_without_passage_gives_no_way():
    planner = ExactPlanner(ROOM, inflation_radius=0.5)
    near_wall = Disc(5.0, 1.5, 1.27)
    assert planner.plan((2.0, 1.5), (8.0, 1.5), near_wall, 1) is None
    assert planner.plan((2.0, 1.5), (8.0, 1.5), near_wall, -1) is not None


@pytest.mark.requirement(119, 120)
@pytest.mark.parametrize(("width", "passes"), [(1.53, False), (1.54, True), (1.56, True)])
def test_a_passage_must_be_as_wide_as_twice_the_enclosing_radius(width, passes):
    planner = ExactPlanner(*room_with_gap(width), inflation_radius=0.77)
    assert (planner.plan((2.0, 4.0), (8.0, 4.0)) is not None) == passes


def test_boxes_that_touch_leave_no_gap_even_without_inflation():
    lower = ((4.0, -1.0), (5.0, -1.0), (5.0, 4.0), (4.0, 4.0))
    upper = ((5.0, 4.0), (6.0, 4.0), (6.0, 9.0), (5.0, 9.0))
    planner = ExactPlanner(ROOM, (lower, upper), inflation_radius=0.0)
    assert planner.plan((2.0, 4.0), (8.0, 4.0)) is None


def test_start_at_the_goal_is_a_way_of_length_zero():
    path = ExactPlanner(ROOM, inflation_radius=1.0).plan((2.0, 2.0), (2.0, 2.0))
    assert path.length == 0.0
    assert path.points == ((2.0, 2.0), (2.0, 2.0))


def test_a_goal_on_the_edge_of_the_inflation_is_reached():
    planner = ExactPlanner(ROOM, (BOX,), inflation_radius=0.5)
    assert planner.plan((2.0, 4.0), (6.5, 4.0)) is not None
    assert planner.plan((2.0, 4.0), (5.0, 5.5)) is not None


@pytest.mark.parametrize(
    "goal", [(5.0, 5.2), (5.0, 4.0), (-1.0, 4.0), (11.0, 4.0), (math.nan, 1.0), (1.0, math.inf)]
)
def test_a_goal_that_is_not_free_has_no_way(goal):
    assert ExactPlanner(ROOM, (BOX,), inflation_radius=0.5).plan((2.0, 4.0), goal) is None


def test_a_start_that_is_no_number_has_no_way():
    assert ExactPlanner(ROOM, inflation_radius=0.5).plan((math.nan, 4.0), (5.0, 5.0)) is None


def test_a_start_inside_an_inflation_is_left_straight_away_from_the_wall():
    path = ExactPlanner(ROOM, (BOX,), inflation_radius=0.5).plan((3.8, 4.0), (2.0, 7.0))
    assert path.points[1] == pytest.approx((3.5, 4.0), abs=1e-9)
    rest = math.dist((3.5, 4.0), (2.0, 7.0))
    assert path.length == pytest.approx(0.3 + rest, abs=1e-9)


def test_a_start_too_near_the_user_is_left_straight_away_from_the_user():
    path = ExactPlanner(ROOM, inflation_radius=0.5).plan((5.0, 4.8), (9.0, 7.0), USER)
    assert path.points[1] == pytest.approx((5.0, 5.27), abs=1e-9)


def test_a_start_in_a_corner_is_left_to_where_both_inflations_end():
    planner = ExactPlanner(ROOM, inflation_radius=1.0)
    assert planner.nearest_free((0.3, 0.4)) == pytest.approx((1.0, 1.0), abs=2e-6)


def test_an_inflation_is_never_left_through_a_wall():
    thin = ((0.0, 1.4), (6.0, 1.4), (6.0, 1.5), (0.0, 1.5))
    planner = ExactPlanner(ROOM, (thin,), inflation_radius=1.0)
    place = planner.nearest_free((5.0, 1.0))
    assert place == pytest.approx((6.0 + math.sqrt(1.0 - 0.4**2), 1.0), abs=1e-5)


def test_a_pocket_that_no_straight_line_leaves_has_no_way():
    thin = ((0.0, 1.4), (9.5, 1.4), (9.5, 1.5), (0.0, 1.5))
    planner = ExactPlanner(ROOM, (thin,), inflation_radius=1.0)
    assert planner.plan((1.0, 0.7), (5.0, 5.0)) is None


@pytest.mark.requirement(34)
@pytest.mark.parametrize("depth", [0.0, 0.003, 0.2])
def test_who_starts_too_near_to_a_wall_may_pass_its_end_no_nearer(depth):
    """The end of the wall belongs to two sides, and the start is too near to one of them only."""
    planner = ExactPlanner(ROOM, (BOX,), inflation_radius=0.5)
    x = 4.0 - 0.5 + depth  # beside the box, whose corner is (4, 3)
    assert planner.allows((x, 3.5), (x, 3.1))
    assert planner.allows((x, 3.1), (x, 2.5))
    assert planner.allows((x, 3.0), (x, 2.5))
    assert not planner.allows((x, 3.1), (x + 0.01, 2.99))
    assert not planner.allows((x, 3.5), (4.5, 3.0 - 0.45))


@settings(deadline=None, max_examples=examples(300), derandomize=True)
@given(
    st.floats(0.0, math.pi), st.floats(0.05, 3.0), st.floats(0.05, 3.0), st.floats(0.05, 1.0),
    st.tuples(st.floats(-2.5, 2.5), st.floats(-2.5, 2.5)),
    st.floats(-math.pi, math.pi), st.floats(0.0, 1.0),
)  # fmt: skip
def test_no_line_that_is_allowed_comes_nearer_to_a_box_than_its_start(
    turn, length, width, radius, start, heading, far
):
    box = affinity.rotate(
        box_of(-length / 2, -width / 2, length / 2, width / 2), turn, "center", True
    )
    corners = tuple(box.exterior.coords)[:-1]
    planner = ExactPlanner(
        ((-9.0, -9.0), (9.0, -9.0), (9.0, 9.0), (-9.0, 9.0)), (corners,), inflation_radius=radius
    )
    end = start[0] + far * math.cos(heading), start[1] + far * math.sin(heading)
    before, on_it = Point(start).distance(box), LineString([start, end]).distance(box)
    assume(before > 0.0)
    if on_it >= radius + 1e-5:
        assert planner.allows(start, end)
    if planner.allows(start, end):
        assert on_it >= min(radius, before) - 1e-5


def test_integers_are_as_good_as_floats():
    planner = ExactPlanner(((0, 0), (10, 0), (10, 8), (0, 8)), inflation_radius=1)
    path = planner.plan((2, 4), (8, 4), Disc(5, 4, 1))
    same = planner.plan((2.0, 4.0), (8.0, 4.0), Disc(5.0, 4.0, 1.0))
    assert path is not None
    assert same is not None
    assert (path.points, path.radii, path.length) == (same.points, same.radii, same.length)


@pytest.mark.parametrize(
    ("outer", "radius"),
    [(ROOM[:2], 1.0), (((0, 0), (1, 0), (math.nan, 1)), 1.0), (ROOM, math.inf), ((), 1.0)],
)
def test_a_room_that_is_no_polygon_is_refused(outer, radius):
    with pytest.raises(ValueError, match="ring 0"):
        ExactPlanner(outer, inflation_radius=radius)


def test_the_same_without_compiler():
    code = (
        "from hw.scene.room import Disc\n"
        "from states.navigation.exact.visibility import ExactPlanner\n"
        f"planner = ExactPlanner({ROOM}, ({BOX},), inflation_radius=0.5)\n"
        "path = planner.plan((2.0, 3.2), (8.0, 4.4), Disc(3.0, 2.5, 1.0))\n"
        "print((path.length, path.points))\n"
    )
    planner = ExactPlanner(ROOM, (BOX,), inflation_radius=0.5)
    path = planner.plan((2.0, 3.2), (8.0, 4.4), Disc(3.0, 2.5, 1.0))
    environment = {**os.environ, "NUMBA_DISABLE_JIT": "1"}
    run = subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        text=True,
        env=environment,
        check=True,
        cwd=Path(__file__).parents[4],
    )
    length, points = ast.literal_eval(run.stdout)
    assert length == pytest.approx(path.length, abs=1e-12)
    assert len(points) == len(path.points)
