"""Lines of walk: whether one meets the robot, and the time to get out of it, against grids."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given, settings, strategies as st

from behaviors.person.costs import lateness
from behaviors.person.margin import SETS_OFF_S, STEP_S, is_met_braking, time_aside, turns_at_it
from hw.geometry import Twist2
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


@pytest.mark.parametrize(
    ("drift", "late"), [(0.0, 1.0 + 2.0 - 2.0), (1.0, 1.0 + (5.0**0.5 - 1.0) - 2.0)]
)
def test_lateness_is_what_a_robot_lacks_to_get_aside_of_somebody_who_walks_at_it(
    drift: float, late: float
) -> None:
    """1 m/s from 3 m, of which 1 m is in the way: 2 s; 2 m aside at 1 m/s2 take 2 s from rest."""
    user = np.array([[[0.0, 0.0, 0.0], [0.1, 0.0, 0.0]]])
    robot = np.array([[[4.0, 0.0], [4.0, 0.1 * drift]]])

    [found] = lateness(robot, user, 2.0, 1.0, 1.0)

    assert found == pytest.approx(late**2)


def meets(off: float, distance: float, rate: float, contact: float) -> bool:
    """True if a ray at one of 400 angles of the turn passes the robot nearer than `contact`."""
    robot = distance * np.exp(1j * (off - np.linspace(0.0, rate * SETS_OFF_S[-1], 400)))
    return bool(np.any((robot.real > 0.0) & (np.abs(robot.imag) < contact)))


@pytest.mark.requirement(91)
@given(
    off=st.floats(-3.1, 3.1),
    distance=st.floats(1.0, 4.5),
    rate=st.floats(0.4, 3.5) | st.floats(-3.5, -0.4),
)
@settings(deadline=None, max_examples=examples(200))
def test_who_turns_at_the_robot_may_set_off_on_a_line_that_meets_it(
    off: float, distance: float, rate: float
) -> None:
    if turns_at_it(off, distance, rate, 1.27):
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

    met = is_met_braking((x, y), Twist2(*walks), Twist2(*drives), 1.0, reaction, acceleration)

    assert met == (least < 1.0)
