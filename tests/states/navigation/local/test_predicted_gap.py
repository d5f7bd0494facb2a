import math

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from cobodeck.bench.navigation.drive_trials import OPEN_ROOM
from hw.geometry import STILL, Pose2, Twist2, wrap
from hw.scene.room import Disc
from states.navigation.exact.visibility import ExactPlanner
from states.navigation.local.predicted_gap import (
    HORIZON,
    least_gap_braking,
    least_gap_on,
    predicted_disc,
    steps_aside,
)
from states.navigation.local.profile_planner import ProfilePlanner, _Choice
from states.navigation.local.speed_profile import SpeedLimits
from states.navigation.planner_interfaces import Limits, Tolerance

FREE = ExactPlanner(OPEN_ROOM, inflation_radius=0.5)
PACE = SpeedLimits(1.5, 1.0, 0.9, 0.03)
SPEED = st.floats(-1.5, 1.5)
PLACE = st.floats(-4.0, 4.0)


def straight_line(length):
    return np.array([[0.0, 0.0, math.inf], [length, 0.0, math.inf]])


@settings(deadline=None, max_examples=150)
@given(
    x=PLACE,
    y=PLACE,
    vx=SPEED,
    vy=SPEED,
    length=st.floats(0.2, 4.0),
    speed=st.floats(0.0, 1.5),
    spread=st.sampled_from([0.0, 0.1]),
)
def test_the_least_gap_on_a_straight_is_that_of_small_steps_in_time(
    x, y, vx, vy, length, speed, spread
):
    speed = min(speed, math.sqrt(2.0 * length))
    place, now, expected = 0.0, speed, math.inf
    for k in range(int(HORIZON * 1000)):
        time = k * 1e-3
        gap = math.hypot(place - x - time * vx, -y - time * vy) - 1.27 - spread * time
        expected = min(expected, gap)
        allowed = math.sqrt(2.0 * max(0.0, length - place))
        now = min(1.5, now + 1e-3, allowed)
        place = min(length, place + now * 1e-3)
    walker = (x, y, 1.27, vx, vy, spread)
    # between places 0.15 m apart, at most 0.6 s, it is taken to move evenly
    found = least_gap_on(straight_line(length), speed, walker, PACE)
    assert expected - 0.05 - 0.6 * spread <= found <= expected + 0.05


def test_braking_ends_where_the_stopping_distance_says():
    # 1 m/s stops after 0.5 m: 0.5 m are left to a disc that stands 1 m further
    assert least_gap_braking(
        0.0, 0.0, 1.0, 0.0, (2.0, 0.0, 1.0, 0.0, 0.0, 0.0), PACE
    ) == pytest.approx(0.5)


def test_a_disc_is_foreseen_where_the_user_will_be_and_never_over_the_robot():
    user = Disc(0.0, 0.0, 1.27)
    assert predicted_disc(user, (1.0, 0.0), 2.0, (5.0, 0.0)) == Disc(2.0, 0.0, 1.27)
    over = predicted_disc(user, (1.0, 0.0), 2.0, (2.5, 0.0))
    assert math.dist((over.x, over.y), (2.5, 0.0)) > over.radius
    assert predicted_disc(user, (1.0, 0.0), 0.0, (0.5, 0.0)) == user


@given(st.floats(-1.5, 1.5), st.floats(0.1, 1.5), PLACE, PLACE)
def test_steps_aside_lead_out_of_the_users_track(vx, vy, x, y):
    user = Disc(0.0, 0.0, 1.27)
    for px, py in steps_aside(user, (vx, vy), (x, y), 0.01):
        across = (px * vy - py * vx) / math.hypot(vx, vy)
        assert abs(across) == pytest.approx(1.28)
        along = (px - x) * vx + (py - y) * vy
        assert along == pytest.approx(0.0, abs=1e-9)


def meeting(user_start, velocity, *, prediction=True, start=(-3.0, 0.0), goal=(3.0, 0.0)):
    """Drive while somebody walks straight on for 6 s; time, least gap to their disc."""
    driver = ProfilePlanner(FREE, Limits(), Tolerance())
    driver.go_to(Pose2(*goal))
    pose, motion, dt, least = Pose2(*start), STILL, 0.05, math.inf
    for k in range(600):
        time = k * dt
        walking = time < 6.0
        user = Disc(user_start[0] + time * velocity[0], user_start[1] + time * velocity[1], 1.27)
        seen = user if walking else None
        told = velocity if walking and prediction else (0.0, 0.0)
        command = driver.command(pose, motion.rotated(-pose.yaw), seen, dt, told)
        if driver.status == "arrived":
            break
        following = command.rotated(pose.yaw + 0.5 * command.wz * dt)
        mean = Twist2(0.5 * (motion.vx + following.vx), 0.5 * (motion.vy + following.vy))
        yaw = wrap(pose.yaw + following.wz * dt)
        pose, motion = Pose2(pose.x + mean.vx * dt, pose.y + mean.vy * dt, yaw), following
        if walking:
            least = min(least, math.dist((pose.x, pose.y), (user.x, user.y)) - user.radius)
    return k * dt, least


CROSSINGS = {
    "from the left": ((0.0, 4.0), (0.0, -1.0)),
    "from the right, slowly": ((0.0, -2.5), (0.0, 0.6)),
    "slantwise towards the robot": ((1.5, 3.0), (-0.8, -0.8)),
    "the same way, overtaken": ((-1.0, 0.3), (0.5, 0.0)),
    "head on": ((4.0, 0.2), (-0.8, 0.0)),
}


@pytest.mark.requirement(51, 52)
@pytest.mark.parametrize("name", list(CROSSINGS))
def test_who_walks_across_is_let_pass(name):
    place, velocity = CROSSINGS[name]
    time, gap = meeting(place, velocity)
    assert gap >= -0.02
    assert time < 12.0


@pytest.mark.requirement(51)
def test_prediction_keeps_further_off_than_going_round_where_the_user_is():
    seeing = [meeting(*CROSSINGS[name])[1] for name in CROSSINGS]
    blind = [meeting(*CROSSINGS[name], prediction=False)[1] for name in CROSSINGS]
    assert sum(seeing) > sum(blind) + 0.5


@pytest.mark.requirement(51)
@pytest.mark.parametrize(
    ("choices", "best"),
    [
        ({"long": (0.3, 5.0), "short": (0.0, 4.0), "wait": (0.9, None)}, "short"),
        ({"long": (0.0, 5.0), "short": (-0.02, 4.0), "wait": (-0.5, None)}, "long"),
        ({"long": (-0.102, 5.0), "short": (-0.098, 4.0), "wait": (-0.3, None)}, "short"),
        ({"long": (-0.2, 5.0), "wait": (-0.1, None)}, "wait"),
    ],
)
def test_of_ways_that_keep_off_the_user_equally_well_the_fastest_is_driven(choices, best):
    driver = ProfilePlanner(FREE, Limits(), Tolerance())
    ranks = {
        name: _Choice(gap, length and straight_line(length), driver).rank(STILL, PACE)
        for name, (gap, length) in choices.items()
    }

    assert max(ranks, key=lambda name: ranks[name]) == best


def test_a_user_who_stands_or_is_far_changes_nothing():
    for user, velocity in ((Disc(0.0, 1.5, 1.27), (0.05, 0.0)), (Disc(0.0, 9.9, 1.0), (0.5, 0.5))):
        commands = []
        for told in ((0.0, 0.0), velocity):
            driver = ProfilePlanner(FREE, Limits(), Tolerance())
            driver.go_to(Pose2(3.0, 0.0))
            commands.append(driver.command(Pose2(-3.0, 0.0), STILL, user, 0.05, told))
        assert commands[0] == commands[1]
