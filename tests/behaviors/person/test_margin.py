"""Lines of walk: whether one meets the robot, and the time to get out of it, against grids."""

from __future__ import annotations

import cmath
import math
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import assume, given, settings, strategies as st

from behaviors.person.margin import (
    STEP_S,
    Clearing,
    is_met_braking,
    lacking,
    time_aside,
    time_left,
    turns_at_it,
)
from behaviors.profile.profile import Profile
from behaviors.situation.present_situation import Situation
from hw.geometry import Pose2, Twist2
from hw.samples import UserPose
from tests.repeats import examples

GRID = np.arange(0.0, 20.0, 0.001)


def last_too_near(
    lateral: float, drift: float, contact: float, acceleration: float, side: float
) -> float:
    """The last time on the grid at which a robot that drives to this side is in the way, s."""
    ways = lateral + drift * GRID + 0.5 * side * acceleration * GRID * GRID
    near = GRID[side * ways < contact]
    return float(near[-1]) if len(near) else 0.0


@pytest.mark.requirement(104)
@given(
    lateral=st.floats(-2.0, 2.0),
    drift=st.floats(-2.5, 2.5),
    contact=st.floats(0.5, 1.5),
    acceleration=st.floats(0.5, 2.5),
)
@settings(deadline=None, max_examples=examples(200))
def test_the_time_aside_is_the_last_at_which_the_robot_is_too_near_to_the_line(
    lateral: float, drift: float, contact: float, acceleration: float
) -> None:
    sides = (last_too_near(lateral, drift, contact, acceleration, side) for side in (1.0, -1.0))

    assert time_aside(lateral, drift, contact, acceleration) == pytest.approx(
        min(sides), abs=0.0011
    )


@pytest.mark.requirement(104)
@pytest.mark.parametrize(("speed", "left"), [(1.0, -0.15), (0.3, math.inf), (0.0, math.inf)])
def test_towards_somebody_who_stands_only_braking_counts(speed: float, left: float) -> None:
    """0.6 m are left; 0.15 s at 1 m/s and braking at 1 m/s2 take 0.65 m."""
    rules = Clearing(1.27, 0.15, 1.0, 3.0)

    assert time_left((-1.27 - 0.6, 0.0), (0.0, 0.0), (speed, 0.0), rules) == left


@pytest.mark.requirement(104)
@given(
    along=st.floats(1.6, 4.0),
    lateral=st.floats(-1.2, 1.2),
    heading=st.floats(-3.1, 3.1),
    pace=st.floats(0.5, 1.6),
    motion=st.tuples(st.floats(-0.4, 0.4), st.floats(-0.4, 0.4)),
    reaction=st.floats(0.0, 0.5),
)
@settings(deadline=None, max_examples=examples(200))
def test_the_margin_is_what_is_left_until_the_walker_is_there_less_reaction_and_the_way_aside(
    along: float,
    lateral: float,
    heading: float,
    pace: float,
    motion: tuple[float, float],
    reaction: float,
) -> None:
    """In the frame of the line by complex numbers; the way aside on a grid of times."""
    turn = cmath.rect(1.0, heading)
    apart, drives = complex(along, lateral), complex(*motion)
    meets = np.abs(apart + (drives - pace) * GRID[:4000]) < 1.27
    assume(abs(lateral) < 1.27)
    arrival = (along - math.sqrt(1.27**2 - lateral**2)) / (pace - drives.real)
    sides = (
        last_too_near(lateral + reaction * drives.imag, drives.imag, 1.27, 1.0, side)
        for side in (1.0, -1.0)
    )

    left = time_left(
        pair(turn * apart), pair(turn * pace), pair(turn * drives), Clearing(1.27, reaction, 1.0, 3)
    )

    if left < math.inf:
        assert left == pytest.approx(max(0.0, arrival) - reaction - min(sides), abs=0.002)
    elif meets.any():
        assert GRID[int(np.argmax(meets))] > 2.99


def pair(number: complex) -> tuple[float, float]:
    return number.real, number.imag


@pytest.mark.parametrize(("drift", "aside"), [(0.0, 2.0), (1.0, 5.0**0.5 - 1.0)])
def test_a_drive_lacks_what_is_wanted_less_the_margin_at_each_step(
    drift: float, aside: float
) -> None:
    """1 m/s from 4 m, of which 2 m are in the way: 2 s; 2 m aside at 1 m/s2 take 2 s from rest."""
    line = np.array([[[0.0, 0.0, 0.0], [0.1, 0.0, 0.0]], [[0.0, 0.0, 0.0], [0.0, 0.1, 0.0]]])
    robot = np.array([[[4.0, 0.0], [4.0, 0.1 * drift]]])

    [found] = lacking(robot, line, 0.5, Clearing(2.0, 1.0, 1.0, 5.0))

    assert found == pytest.approx([(0.5 + 1.0 + aside - 2.0) ** 2, 0.0])


def test_a_robot_that_leaves_along_the_line_of_walk_lacks_margin() -> None:
    line = np.array([[[0.0, 0.0, 0.0], [0.1, 0.0, 0.0]]])
    ahead, beside = [[2.5, 0.0], [2.6, 0.0]], [[2.5, 2.1], [2.6, 2.1]]

    found = lacking(np.array([ahead, beside]), line, 0.5, Clearing(2.0, 1.0, 1.0, 5.0))

    assert found[:, 0] == pytest.approx([(0.5 + 1.0 + 2.0 - 0.5) ** 2, 0.0])


def test_somebody_who_stands_at_a_wall_is_in_nobodys_way() -> None:
    robot, line = np.array([[[1.5, 0.0]] * 2]), np.array([[[0.0, 0.0, 0.0]] * 2])

    assert lacking(robot, line, 9.0, Clearing(2.0, 1.0, 1.0, 5.0)) == [[0.0]]


def meets(off: float, distance: float, rate: float, contact: float) -> bool:
    """True if a ray at one of 400 angles of the turn passes the robot nearer than `contact`."""
    robot = distance * np.exp(1j * (off - np.linspace(0.0, rate * 0.45, 400)))
    return bool(np.any((robot.real > 0.0) & (np.abs(robot.imag) < contact)))


@pytest.mark.requirement(91)
@given(
    off=st.floats(-3.1, 3.1),
    distance=st.floats(1.0, 4.5),
    rate=st.floats(0.4, 3.5) | st.floats(-3.5, -0.4),
)
@settings(deadline=None, max_examples=examples(200))
def test_who_turns_at_the_robot_may_set_off_on_a_line_that_meets_it(
    tuned: Profile,
    situation_of: Callable[..., Situation],
    off: float,
    distance: float,
    rate: float,
) -> None:
    robot = complex(10.0, 10.0) + cmath.rect(distance, 0.4 + off)
    user = UserPose(Pose2(10.0, 10.0, 0.4), 0.4)
    now = situation_of(tuned, Pose2(*pair(robot)), user, Twist2(0.0, 0.0, rate))

    if turns_at_it(now):
        assert meets(off, distance, rate, 1.29)
    else:
        assert not meets(off, distance, rate, 1.25)


@pytest.mark.requirement(104)
@given(
    x=st.floats(-3.0, 3.0),
    y=st.floats(-3.0, 3.0),
    walks=st.tuples(st.floats(-2.0, 2.0), st.floats(-2.0, 2.0)),
    drives=st.tuples(st.floats(-2.0, 2.0), st.floats(-2.0, 2.0)),
    reaction=st.floats(0.0, 0.5),
    acceleration=st.floats(0.5, 2.5),
)
@settings(deadline=None, max_examples=examples(200))
def test_a_walker_meets_a_robot_that_brakes_if_the_integral_of_its_speed_leads_there(
    x: float,
    y: float,
    walks: tuple[float, float],
    drives: tuple[float, float],
    reaction: float,
    acceleration: float,
) -> None:
    speed = float(np.hypot(*drives))
    assume(speed > 0.01)
    times = np.arange(0.0, reaction + speed / acceleration + 2.0 * STEP_S, 1e-3)
    speeds = np.clip(speed - acceleration * (times - reaction), 0.0, speed)
    driven = np.append(0.0, np.cumsum(0.5 * (speeds[1:] + speeds[:-1])) * 1e-3) / speed
    apart = np.hypot(
        x + driven * drives[0] - times * walks[0], y + driven * drives[1] - times * walks[1]
    )
    steps = int(np.ceil((reaction + speed / acceleration) / STEP_S)) + 1
    least = float(apart[:: round(STEP_S / 1e-3)][:steps].min())
    assume(abs(least - 1.0) > 2e-3)

    met = is_met_braking((x, y), walks, drives, 1.0, reaction, acceleration)

    assert met == (least < 1.0)
