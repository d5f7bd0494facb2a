"""The objective against numbers worked out by hand, the solver against scipy, and drives."""

import math

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.optimize import least_squares

from cobodeck.bench.navigation.drive_trials import OPEN_ROOM, TRIALS, Trial, drive
from hw.geometry import STILL, Pose2
from hw.scene.room import Disc
from states.navigation.exact.visibility import ExactPlanner
from states.navigation.local.teb import (
    ACCELERATION,
    FORWARD,
    LENGTH,
    NEAR,
    NEAR_VELOCITY,
    NONHOLONOMIC,
    OBSTACLE,
    ROTATION,
    START_ACCELERATION,
    TIME,
    VELOCITY,
    VIA,
    TebScene,
    TebValues,
    residuals,
)
from states.navigation.local.teb_planner import TebPlanner, values_for
from states.navigation.local.teb_solver import (
    derivatives,
    iterated,
    nearest_obstacles,
    optimized,
    resized,
)
from states.navigation.planner_interfaces import Limits, Tolerance

VALUES = TebValues(
    max_vel_x=1.0,
    max_vel_x_backwards=0.5,
    max_vel_y=0.6,
    max_vel_trans=1.0,
    max_vel_theta=0.5,
    acc_lim_x=1.0,
    acc_lim_y=0.8,
    acc_lim_theta=0.5,
)
STRAIGHT = np.array([[0.0, 0.0, 0.0, 0.5], [1.0, 0.0, 0.0, 0.25], [1.25, 0.0, 0.0, 0.0]])
QUARTER = np.array([[0.0, 0.0, 0.0, 1.0], [1.0, 1.0, math.pi / 2, 0.0]])
NO_OBSTACLES = np.empty((0, 7))


def scene_of(band, obstacles=(), *, ends=None, factor=1.0, holonomic=True, times=None, via=None):
    near = np.full((len(band), NEAR), -1)
    near[:, : len(obstacles)] = np.arange(len(obstacles))
    return TebScene(
        np.zeros((2, 3)) if ends is None else np.array(ends, float),
        np.array(obstacles, float).reshape(-1, 7),
        near,
        np.zeros(len(band)) if times is None else np.array(times, float),
        np.full((len(band), 2), math.nan) if via is None else np.array(via, float),
        factor,
        holonomic,
    )


def cost(band, row, column, values=VALUES, **scene):
    return float(residuals(band, values, scene_of(band, **scene))[row, column] ** 2)


POST = (1.0, 0.3, 1.0, 0.3, 0.0, 0.0, 0.0)  # a point 0.3 m beside the middle pose of STRAIGHT
WALL = (0.0, 0.55, 9.0, 0.55, 0.0, 0.0, 0.0)  # a line 0.55 m beside it
MOVING = (1.0, 1.3, 1.0, 1.3, 0.0, 0.0, -1.0)  # comes down to 0.3 m within 1 s
HEAVY = VALUES._replace(weight_shortest_path=2.0, weight_velocity_obstacle_ratio=3.0)

TABLE = [
    # what, band, row, column, arguments, the cost by hand (weight * residual^2)
    ("time optimal: 1 * 0.5^2", STRAIGHT, 0, TIME, {}, 0.25),
    ("time optimal: 1 * 0.25^2", STRAIGHT, 1, TIME, {}, 0.0625),
    ("shortest path: off by default", STRAIGHT, 0, LENGTH, {}, 0.0),
    ("shortest path: 2 * 1^2", STRAIGHT, 0, LENGTH, {"values": HEAVY}, 2.0),
    # 1 m in 0.5 s is 2 m/s, the limit less epsilon 0.9
    ("velocity x: 2 * (2 - 0.9)^2", STRAIGHT, 0, VELOCITY, {}, 2.42),
    ("velocity x: 2 * (1 - 0.9)^2", STRAIGHT, 1, VELOCITY, {}, 0.02),
    ("velocity x backwards: 2 * (2 - 0.4)^2", STRAIGHT * [-1, 1, 1, 1], 0, VELOCITY, {}, 5.12),
    # 1 m/s ahead and 1 m/s aside: nothing of max_vel_trans 1 is left for either
    ("velocity y: 2 * (1 - 0)^2, no epsilon", QUARTER, 0, VELOCITY + 1, {}, 2.0),
    ("velocity x beside it: 2 * (1 - (0 - 0.1))^2", QUARTER, 0, VELOCITY, {}, 2.42),
    ("turn: 1 * (pi/2 - 0.4)^2", QUARTER, 0, VELOCITY + 2, {}, (math.pi / 2 - 0.4) ** 2),
    # (cos 0 + cos 90) * 1 - (sin 0 + sin 90) * 1 = 0: an arc, as the residual wants it
    ("non-holonomic: a circular arc", QUARTER, 0, NONHOLONOMIC, {}, 0.0),
    # from (0, 0, 0) to (1, 1, 0): 2 * 1 - 0 = 2
    ("non-holonomic: 1000 * 2^2", QUARTER * [1, 1, 0, 1], 0, NONHOLONOMIC, {}, 4000.0),
    ("forward drive: 1 * 1^2", QUARTER * [-1, 1, 0, 1], 0, FORWARD, {}, 1.0),
    ("forward drive: ahead", QUARTER, 0, FORWARD, {}, 0.0),
    ("rotation: off without a preferred sense", QUARTER, 0, ROTATION, {}, 0.0),
    ("rotation: 50 * (pi/2)^2 against it", QUARTER, 0, ROTATION,
     {"values": VALUES._replace(prefer_rotdir=-1.0)}, 50.0 * (math.pi / 2) ** 2),
    # 2 m/s then 1 m/s: (1 - 2) / ((0.5 + 0.25) / 2) = -2.667, the limit less epsilon 0.9
    ("acceleration x: 1 * (8/3 - 0.9)^2", STRAIGHT, 0, ACCELERATION, {}, (8 / 3 - 0.9) ** 2),
    # from rest to 2 m/s within the whole first dt 0.5: 4
    ("start acceleration: 1 * (4 - 0.9)^2", STRAIGHT, 0, START_ACCELERATION, {}, 9.61),
    ("start acceleration from 1.8 m/s: 0.4 is free", STRAIGHT, 0, START_ACCELERATION,
     {"ends": [[1.8, 0, 0], [0, 0, 0]]}, 0.0),
    # from 1 m/s to rest within the whole last dt 0.25: -4
    ("goal acceleration: 1 * (4 - 0.9)^2", STRAIGHT, 1, ACCELERATION, {}, 9.61),
    ("acceleration y: 1 * (1/1 - 0.7)^2", QUARTER, 0, START_ACCELERATION + 1, {}, 0.09),
    ("turn acceleration: 1 * (pi/2 - 0.4)^2", QUARTER, 0, START_ACCELERATION + 2, {},
     (math.pi / 2 - 0.4) ** 2),
    ("via point: 1 * 0.5^2", STRAIGHT, 1, VIA,
     {"via": [[math.nan] * 2, [1.3, 0.4], [math.nan] * 2]}, 0.25),
    # 0.3 m from a point, wanted 0.5 + 0.1
    ("obstacle: 50 * (0.6 - 0.3)^2", STRAIGHT, 1, OBSTACLE, {"obstacles": [POST]}, 4.5),
    ("obstacle in the third outer iteration: 4 * that", STRAIGHT, 1, OBSTACLE,
     {"obstacles": [POST], "factor": 4.0}, 18.0),
    ("inflation: 0.1 * (0.6 - 0.3)^2", STRAIGHT, 1, OBSTACLE + 1, {"obstacles": [POST]}, 0.009),
    ("a wall 0.55 m away: 50 * (0.6 - 0.55)^2", STRAIGHT, 1, OBSTACLE,
     {"obstacles": [WALL]}, 0.125),
    ("a radius of 0.2 m counts: 50 * (0.6 - 0.1)^2", STRAIGHT, 1, OBSTACLE,
     {"obstacles": [(1.0, 0.3, 1.0, 0.3, 0.2, 0.0, 0.0)]}, 12.5),
    ("no obstacle term at the fixed start", STRAIGHT, 0, OBSTACLE, {"obstacles": [POST]}, 0.0),
    ("moving: where it will be after 1 s", STRAIGHT, 1, OBSTACLE,
     {"obstacles": [MOVING], "times": [0.0, 1.0, 1.0]}, 4.5),
    ("moving: where it is now", STRAIGHT, 1, OBSTACLE, {"obstacles": [MOVING]}, 0.0),
    # 0.3 m of 0.5 m: 0.6 of 1 m/s is allowed, 1 m/s driven
    ("slow near obstacles: 3 * (1 - 0.6)^2", STRAIGHT, 1, NEAR_VELOCITY,
     {"obstacles": [POST], "values": HEAVY}, 0.48),
    ("slow near obstacles: off by default", STRAIGHT, 1, NEAR_VELOCITY, {"obstacles": [POST]}, 0.0),
]  # fmt: skip


@pytest.mark.requirement(39)
@pytest.mark.parametrize(
    ("band", "row", "column", "arguments", "expected"),
    [entry[1:] for entry in TABLE],
    ids=[entry[0] for entry in TABLE],
)
def test_every_term_costs_what_the_table_says(band, row, column, arguments, expected):
    assert cost(band, row, column, **arguments) == pytest.approx(expected, abs=1e-9)


def test_defaults_are_the_published_ones():
    published = {
        "dt_ref": 0.3, "dt_hysteresis": 0.1, "min_samples": 3, "max_vel_x": 0.4,
        "max_vel_theta": 0.3, "acc_lim_x": 0.5, "min_obstacle_dist": 0.5, "inflation_dist": 0.6,
        "penalty_epsilon": 0.1, "no_inner_iterations": 5, "no_outer_iterations": 4,
        "weight_max_vel_x": 2, "weight_max_vel_y": 2, "weight_max_vel_theta": 1,
        "weight_acc_lim_x": 1, "weight_acc_lim_theta": 1, "weight_kinematics_nh": 1000,
        "weight_kinematics_forward_drive": 1, "weight_optimaltime": 1, "weight_shortest_path": 0,
        "weight_obstacle": 50, "weight_inflation": 0.1, "weight_dynamic_obstacle": 50,
        "weight_viapoint": 1, "weight_prefer_rotdir": 50, "weight_adapt_factor": 2,
    }  # fmt: skip
    assert {name: getattr(TebValues(), name) for name in published} == published


def test_a_steering_robot_has_a_signed_speed_and_no_sideways_one():
    rows = residuals(STRAIGHT, VALUES, scene_of(STRAIGHT, holonomic=False))
    assert rows[0, VELOCITY] ** 2 == pytest.approx(2.0 * (2.0 * 100 / 101 - 0.9) ** 2)
    assert rows[0, VELOCITY + 1] == 0.0
    backwards = STRAIGHT * [-1, 1, 1, 1]
    rows = residuals(backwards, VALUES, scene_of(backwards, holonomic=False))
    assert rows[0, VELOCITY] ** 2 == pytest.approx(2.0 * (2.0 * 100 / 101 - 0.4) ** 2)


def test_the_acceleration_may_be_limited_as_a_vector_in_one_frame():
    values = VALUES._replace(acc_lim_trans=1.0)
    # the same velocity in the map while turning by 90 degrees: no acceleration at all
    band = np.array(
        [[0.0, 0.0, 0.0, 1.0], [0.5, 0.0, math.pi / 2, 1.0], [1.0, 0.0, math.pi / 2, 0]]
    )
    assert cost(band, 0, ACCELERATION, values) == 0.0
    assert cost(band, 0, ACCELERATION + 1, values) == 0.0
    # (0.8, 0.8): 0.6 is left for each
    quarter = QUARTER * [0.8, 0.8, 0, 1]
    assert cost(quarter, 0, START_ACCELERATION, values) == pytest.approx((0.8 - 0.5) ** 2)


# solver


def random_band(rng, count):
    band = rng.normal(0.0, 0.4, (count, 4)).cumsum(axis=0)
    band[:, 3] = rng.uniform(0.2, 0.4, count)
    return band


def random_scene(rng, band, holonomic=True):
    obstacles = rng.uniform(-2, 2, (3, 7))
    obstacles[:, 4] = 0.0
    near, times = nearest_obstacles(band, obstacles)
    via = np.full((len(band), 2), math.nan)
    via[len(band) // 2] = rng.uniform(-1, 1, 2)
    return TebScene(rng.normal(0, 0.3, (2, 3)), obstacles, near, times, via, 2.0, holonomic)


@settings(deadline=None, max_examples=25)
@given(seed=st.integers(0, 10_000), count=st.integers(2, 9), holonomic=st.booleans())
def test_derivatives_by_colours_are_those_of_each_variable_alone(seed, count, holonomic):
    rng = np.random.default_rng(seed)
    band = random_band(rng, count)
    scene = random_scene(rng, band, holonomic)
    rows = residuals(band, VALUES, scene)
    slopes = derivatives(band, rows, VALUES, scene)
    for block, component in np.ndindex(count, 4):
        if component < 3 and block in (0, count - 1):
            continue
        moved = band.copy()
        moved[block, component] += 1e-6
        alone = (residuals(moved, VALUES, scene) - rows) / 1e-6
        expected = np.zeros_like(rows)
        for i in range(max(0, block - 2), block + 1):
            expected[i] = slopes[i, :, 4 * (block - i) + component]
        assert np.allclose(alone, expected, atol=1e-9)


@settings(deadline=None, max_examples=25, derandomize=True)
@given(seed=st.integers(0, 10_000), count=st.integers(4, 8))
def test_no_iteration_raises_the_cost_and_enough_of_them_leave_scipy_little_to_gain(seed, count):
    rng = np.random.default_rng(seed)
    band = np.zeros((count, 4))
    band[:, 0], band[:, 3] = 0.3 * np.arange(count), 0.3
    band[1:-1, :3] += rng.normal(0.0, 0.05, (count - 2, 3))
    post = [(*rng.uniform((0.3, 0.2), (0.9, 0.5)),) * 2 + (0.0, 0.0, 0.0)]
    scene = scene_of(band, post, ends=[[0.5, 0.0, 0.0], [0.0, 0.0, 0.0]])
    free = [(i, j) for i in range(count) for j in range(4)]
    free = [(i, j) for i, j in free if (i < count - 1 if j == 3 else 0 < i < count - 1)]

    def total(some_band):
        return float(np.sum(residuals(some_band, VALUES, scene) ** 2))

    def fun(x):
        moved = band.copy()
        for (i, j), value in zip(free, x, strict=True):
            moved[i, j] = value
        return residuals(moved, VALUES, scene).ravel()

    now = band
    for _ in range(20):
        following = iterated(now.copy(), VALUES, scene, 5)
        assert total(following) <= total(now) + 1e-9
        now = following
    start = np.array([now[index] for index in free])
    low = [0.9e-3 if j == 3 else -np.inf for _, j in free]
    theirs = least_squares(fun, start, bounds=(low, np.inf), x_scale="jac", max_nfev=300)
    assert total(now) <= 2.0 * theirs.cost * 1.25  # slow at kinks of the hinges


@settings(deadline=None, max_examples=50)
@given(st.lists(st.floats(0.001, 3.0), min_size=1, max_size=12))
def test_resizing_keeps_the_whole_time_and_the_ends_and_splits_what_is_long(steps):
    band = np.zeros((len(steps) + 1, 4))
    band[:, 0] = np.arange(len(band))
    band[:-1, 3] = steps
    new = resized(band, TebValues())
    assert new[:-1, 3].sum() == pytest.approx(sum(steps))
    assert new[0, :3].tolist() == band[0, :3].tolist()
    assert new[-1, :3].tolist() == band[-1, :3].tolist()
    assert new[:-1, 3].max() <= 0.4 + 1e-12
    assert (
        len(new) <= 3
        or np.sort(new[:-2, 3])[: max(0, len(new) - 4)].min(initial=1.0) >= 0.2 - 1e-12
    )


def test_a_band_takes_the_way_round_that_it_began_with():
    parts = np.linspace(-2.0, 2.0, 10)
    for side in (1.0, -1.0):
        band = np.zeros((10, 4))
        band[:, 0], band[:, 1] = parts, side * 0.2 * (4.0 - parts**2) / 4.0
        band[:, 3] = 0.3
        disc = np.array([[0.0, 0.0, 0.0, 0.0, 0.3, 0.0, 0.0]])
        values = values_for(Limits(), "omni")
        found = optimized(band, np.zeros((2, 3)), disc, np.empty((0, 2)), True, values)
        middle = found[len(found) // 2]
        assert side * middle[1] > 0.6


# drives

FREE = ExactPlanner(OPEN_ROOM, inflation_radius=0.5)
USER = Disc(0.0, 0.0, 1.27)


@pytest.mark.requirement(39, 50)
@pytest.mark.parametrize("hz", [20, 30])
def test_teb_comes_within_five_percent_of_the_least_time_and_never_into_the_disc(hz):
    over = {}
    for trial in TRIALS:
        outcome = drive(TebPlanner(FREE, Limits(), Tolerance()), trial, 1.0 / hz)
        assert outcome.arrived
        over[trial.name] = outcome.time / trial.least_time - 1.0
        assert outcome.intrusion <= 0.0
        assert outcome.acceleration <= 1.0 + 1e-6
    assert max(over.values()) <= 0.051, over
    assert sum(over.values()) / len(over) <= 0.04, over


@pytest.mark.requirement(2, 39)
def test_teb_steers_a_differential_base_to_its_goal():
    driver = TebPlanner(FREE, Limits(), Tolerance(), "differential")
    trial = Trial("round the user", Pose2(-3.0, 0.5), Pose2(3.0, 0.0), USER, 5.5)
    outcome = drive(driver, trial)
    assert outcome.arrived
    assert outcome.intrusion <= 1e-6
    assert outcome.acceleration <= 1.1
    assert outcome.time < 10.0


def test_walls_are_kept_at_their_distance():
    wall = ((-0.2, 0.0), (0.2, 0.0), (0.2, 6.0), (-0.2, 6.0))
    planner = ExactPlanner(OPEN_ROOM, (wall,), inflation_radius=0.6)
    driver = TebPlanner(planner, Limits(), Tolerance(), walls=(wall,), wall_distance=0.6)
    outcome = drive(driver, Trial("past a wall", Pose2(-3.0, 1.0), Pose2(3.0, 1.0), None, 6.0))
    assert outcome.arrived
    assert min(planner.clearance(place) for place in outcome.places) >= 0.6 - 0.01


def test_without_a_way_the_robot_brakes():
    driver = TebPlanner(FREE, Limits(), Tolerance())
    driver.go_to(Pose2(20.0, 0.0))
    command = driver.command(Pose2(0.0, 5.0), STILL, USER, 0.05)
    assert driver.status == "blocked"
    assert command == STILL
    assert driver.band is None


def test_a_goal_far_from_the_last_one_begins_a_new_band():
    driver = TebPlanner(FREE, Limits(), Tolerance())
    driver.go_to(Pose2(5.0, 5.0))
    driver.command(Pose2(0.0, 5.0), STILL, None, 0.05)
    driver.go_to(Pose2(5.2, 5.0))
    assert driver.band is not None
    driver.go_to(Pose2(-5.0, 5.0))
    assert driver.band is None
