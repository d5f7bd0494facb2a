"""Parts of the search for a way out, one by one: turns of the person and the robot, last stops."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from cobodeck.avoidable.motion_search import (
    Question,
    RobotLimits,
    RobotState,
    Walk,
    _braked_yaws,
    _task,
)
from cobodeck.avoidable.motions import ACCELERATE, moved, stops_free

LIMITS = RobotLimits(1.0, 3.0, 2.5, 0.565, 0.455)


@given(st.floats(-math.pi, math.pi), st.floats(-3.0, 3.0), st.floats(0.0, 1.0))
def test_a_person_turns_from_row_to_row_by_the_shorter_way(view, turn, share) -> None:
    after = math.remainder(view + turn, math.tau)
    walk = Walk(np.array([1.0, 2.0]), np.array([(0.0, 0.0, view), (0.0, 0.0, after)]))

    [(_, _, found)] = walk.at([1.0 + share]).tolist()

    assert math.remainder(found - view - share * turn, math.tau) == pytest.approx(0.0, abs=1e-9)


@given(st.floats(-3.1, 3.1), st.floats(-2.0, 2.0), st.floats(0.5, 4.0))
@settings(max_examples=50)
def test_a_rotation_is_braked_evenly_to_a_stop_whichever_way_it_goes(yaw, rate, braking) -> None:
    times = np.linspace(0.0, 5.0, 5001)
    slowing = np.sign(rate) * np.maximum(abs(rate) - braking * times, 0.0)
    turned = np.append(0.0, np.cumsum(0.5 * (slowing[1:] + slowing[:-1])) * 1e-3)

    found = _braked_yaws(RobotState(0.0, 0.0, yaw, wz=rate), braking, times)

    np.testing.assert_allclose(found, yaw + turned, atol=1e-5)


@pytest.mark.parametrize("speed", [0.5, 1.5, 2.5])
@pytest.mark.parametrize("spare", [-0.02, 0.02])
def test_a_motion_may_end_where_the_brakes_still_stop_it_before_a_wall(speed, spare) -> None:
    """From v it takes v^2 / 2a more with the brakes' deceleration of 3 m/s2, to the front."""
    front = 5.0 - LIMITS.half_length - speed**2 / (2.0 * 3.0)
    corners = ((-5.0, -5.0), (5.0, -5.0), (5.0, 5.0), (-5.0, 5.0))
    walls = np.array([(*corners[i - 1], *corners[i]) for i in range(4)])
    walk = Walk(np.array([0.0, 1.0]), np.zeros((2, 3)))
    task = _task(Question(RobotState(-3.0, 0.0, 0.0), LIMITS, walk, walls=walls), math.inf)

    assert stops_free(task, (front - spare, 0.0, speed, 0.0)) == (spare > 0.0)


SLOW = _task(
    Question(
        RobotState(0.0, 0.0, 0.0),
        RobotLimits(1.0, 3.0, 0.8, 0.565, 0.455),
        Walk(np.array([0.0, 1.0]), np.zeros((2, 3))),
    ),
    math.inf,
)
"""Of a robot that may drive at 0.8 m/s, and accelerate with 1 m/s2, in steps of 50 ms."""


@given(st.floats(0.0, 2.0), st.floats(-3.1, 3.1), st.floats(-3.1, 3.1))
def test_a_robot_that_is_too_fast_gets_no_faster_and_slows_no_harder_than_it_may(
    speed, heading, push
) -> None:
    before = speed * math.cos(heading), speed * math.sin(heading)

    *_, vx, vy = moved(SLOW, (0.0, 0.0, *before), (ACCELERATE, math.cos(push), math.sin(push)))

    assert math.hypot(vx, vy) <= max(0.8, speed) + 1e-9
    assert math.dist((vx, vy), before) <= 0.05 + 1e-9
