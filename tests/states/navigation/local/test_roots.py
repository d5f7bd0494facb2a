"""Where rounding takes what is under a root, or in an arc function, past its bound."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from states.navigation.exact.tangents import tangent
from states.navigation.local.speed_profile import SpeedLimits, corner_speed, reachable_speed

PACE = SpeedLimits(1.5, 1.0, 0.7, 0.05)
angles, radii = st.floats(-math.pi, math.pi), st.floats(0.05, 3.0)


@given(
    x=st.floats(-20.0, 20.0),
    first=radii,
    second=radii,
    around=angles,
    off=st.sampled_from([0.0, 1e-9, -1e-9, 1e-3]),
    inner=st.booleans(),
    turn=st.sampled_from([-1.0, 1.0]),
)
@settings(deadline=None)
def test_discs_that_touch_have_a_tangent_at_the_place_where_they_do(
    x: float, first: float, second: float, around: float, off: float, inner: bool, turn: float
) -> None:
    """From outside it crosses between them, from inside it is common to both; its length is 0."""
    apart = (abs(first - second) if inner else first + second) + off
    if apart < 1e-3:
        return
    u = math.cos(around), math.sin(around)
    a, b = np.array([x, -x, first]), np.array([x + apart * u[0], apart * u[1] - x, second])
    line = np.empty(7)

    assert tangent(a, turn, b, turn if inner else -turn, line)

    assert np.isfinite(line).all()
    assert line[6] == pytest.approx(math.sqrt(max(0.0, off * (2.0 * apart - off))), abs=1e-5)
    for end, disc in ((line[:2], a), (line[2:4], b)):
        assert math.dist(end, disc[:2]) == pytest.approx(disc[2], abs=1e-6)


@given(around=angles, length=radii, back=radii, x=st.floats(-20.0, 20.0))
@settings(deadline=None)
def test_a_corner_that_turns_back_is_passed_at_a_stop(
    around: float, length: float, back: float, x: float
) -> None:
    c, s = math.cos(around), math.sin(around)
    corner = np.array([x, -x])
    before, after = (corner - way * np.array([c, s]) for way in (length, back))

    assert 0.0 <= corner_speed(before, corner, after, PACE) < 1e-3
    assert corner_speed(before, corner, 2.0 * corner - before, PACE) == 1.5


@given(radius=st.floats(0.01, 10.0), share=st.floats(0.9, 1.5), step=st.floats(0.0, 1.0))
@settings(deadline=None)
def test_in_a_bend_no_speed_can_be_reached_beyond_what_holds_it(
    radius: float, share: float, step: float
) -> None:
    top = math.sqrt(0.7 * 1.0 * radius)

    found = reachable_speed(share * top, step, radius, PACE)

    assert min(share, 1.0) * top - 1e-9 <= found <= top * (1.0 + 1e-12)
