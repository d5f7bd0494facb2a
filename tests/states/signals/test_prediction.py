"""Predictors of a person's walk, and the time until something comes near."""

from __future__ import annotations

import math

import pytest
from hypothesis import given, settings, strategies as st

from hw.geometry import Pose2, Twist2, wrap
from states.signals.prediction import PREDICTORS, chord, time_to_contact

HERE = Pose2(1.0, 2.0, 0.0)
ROBOT = Pose2(4.0, 6.0, 0.0)


@given(
    name=st.sampled_from(sorted(PREDICTORS)), vx=st.floats(-2, 2), vy=st.floats(-2, 2),
    wz=st.floats(-3, 3),
)  # fmt: skip
@settings(deadline=None, max_examples=60)
def test_nobody_is_predicted_to_be_elsewhere_now(
    name: str, vx: float, vy: float, wz: float
) -> None:
    found = PREDICTORS[name].at(HERE, Twist2(vx, vy, wz), 0.0, ROBOT)

    assert (found.x, found.y) == (HERE.x, HERE.y)


@given(
    vx=st.floats(-2, 2), vy=st.floats(-2, 2), wz=st.floats(-2, 2), ahead=st.floats(0.1, 3.0),
    turn=st.sampled_from(["constant_velocity", "fading_turn", "turns_left", "turns_right"]),
)  # fmt: skip
@settings(deadline=None, max_examples=60)
def test_nobody_gets_farther_than_their_speed_allows(
    vx: float, vy: float, wz: float, ahead: float, turn: str
) -> None:
    velocity = Twist2(vx, vy, wz)

    found = PREDICTORS[turn].at(HERE, velocity, ahead, ROBOT)

    assert HERE.distance_to(found) <= velocity.speed * ahead + 1e-9


def test_constant_velocity_goes_straight_on() -> None:
    found = PREDICTORS["constant_velocity"].at(HERE, Twist2(0.5, -1.0, 2.0), 2.0, ROBOT)

    assert (found.x, found.y) == pytest.approx((2.0, 0.0))


def test_a_fading_turn_follows_the_integral_of_its_heading() -> None:
    velocity, steps, ahead = Twist2(1.0, 0.0, 0.8), 20000, 2.0
    x = y = 0.0
    for i in range(steps):
        t = (i + 0.5) * ahead / steps
        heading = 0.8 * (1.0 - math.exp(-t))
        x, y = x + math.cos(heading) * ahead / steps, y + math.sin(heading) * ahead / steps

    found = PREDICTORS["fading_turn"].at(Pose2(0.0, 0.0), velocity, ahead, ROBOT)

    assert math.dist((found.x, found.y), (x, y)) < 0.03
    assert found.yaw == pytest.approx(0.8 * (1.0 - math.exp(-2.0)))


def test_left_is_left() -> None:
    left = PREDICTORS["turns_left"].at(Pose2(0.0, 0.0), Twist2(1.0), 2.0, ROBOT)
    right = PREDICTORS["turns_right"].at(Pose2(0.0, 0.0), Twist2(1.0), 2.0, ROBOT)

    assert left.y > 0.3
    assert (right.x, right.y) == pytest.approx((left.x, -left.y))


def test_who_comes_walks_to_the_robot_and_stops_there() -> None:
    comes = PREDICTORS["comes"]

    assert comes.at(HERE, Twist2(0.0), 1.0, ROBOT).distance_to(ROBOT) == pytest.approx(4.0)
    assert comes.at(HERE, Twist2(-2.0), 9.0, ROBOT).distance_to(ROBOT) == pytest.approx(0.0)
    assert wrap(comes.at(HERE, Twist2(0.0), 1.0, ROBOT).yaw) == pytest.approx(math.atan2(4, 3))


@given(
    x=st.floats(-5, 5), y=st.floats(-5, 5), vx=st.floats(-2, 2), vy=st.floats(-2, 2),
    reach=st.floats(0.1, 2.0),
)  # fmt: skip
@settings(deadline=None, max_examples=200)
def test_the_time_to_contact_is_the_first_instant_within_reach(
    x: float, y: float, vx: float, vy: float, reach: float
) -> None:
    found = time_to_contact((x, y), (vx, vy), reach)

    times = [i * 0.01 for i in range(1000)]
    inside = [t for t in times if math.hypot(x + t * vx, y + t * vy) < reach - 1e-6]
    if found == math.inf:
        closing = x * vx + y * vy < 0.0 and math.hypot(vx, vy) > 1e-6  # slower, none arrives
        assert not (inside and closing)
    elif found == 0.0:
        assert math.hypot(x, y) <= reach
    else:
        assert math.hypot(x + found * vx, y + found * vy) == pytest.approx(reach, abs=1e-6)
        assert not [t for t in inside if t < found - 1e-6]


@given(turned=st.floats(-9.0, -1.5).map(lambda e: 10.0**e), left=st.booleans())
@settings(deadline=None)
def test_the_chord_of_a_slight_bend_is_that_of_a_circle(turned: float, left: bool) -> None:
    """sin(a / 2) / (a / 2) by its series, which divides nothing: 1 - a^2 / 24 + a^4 / 1920."""
    fades, ahead = 1.0, 2.0
    rate = (turned if left else -turned) / (fades * -math.expm1(-ahead / fades))

    length, _, found = chord(1.5, rate, fades, ahead)

    assert abs(found) == pytest.approx(turned, rel=1e-9)
    share = 1.0 - turned**2 / 24.0 + turned**4 / 1920.0
    assert length == pytest.approx(1.5 * ahead * share, rel=1e-13)
