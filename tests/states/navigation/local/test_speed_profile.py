"""Times along a line under limits of speed and acceleration."""

from __future__ import annotations

import math

import pytest
from hypothesis import given, settings, strategies as st

from states.navigation.local.speed_profile import (
    SpeedLimits,
    reachable_speed,
    speed_before,
    stretch_time,
)

PACE = SpeedLimits(1.5, 0.8, 0.7, 0.05)


@given(start=st.floats(0.0, 1.5), end=st.floats(0.0, 1.5), more=st.floats(1e-3, 5.0))
@settings(deadline=None, max_examples=30)
def test_the_time_of_a_straight_is_that_of_its_speed_profile(
    start: float, end: float, more: float
) -> None:
    """Summed up in small pieces of the way: at each the speed is the lesser of both parabolas."""
    least = abs(end * end - start * start) / (2.0 * 0.8)
    way, pieces = least + more, 2000
    total = 0.0
    for n in range(pieces):
        at = way * (n + 0.5) / pieces
        up, down = start * start + 1.6 * at, end * end + 1.6 * (way - at)
        total += way / pieces / math.sqrt(min(up, down, 1.5 * 1.5))

    assert stretch_time(way, start, end, math.inf, PACE) == pytest.approx(total, rel=0.02, abs=1e-9)


@given(share=st.floats(0.0, 1.2), step=st.floats(0.0, 2.0), radius=st.floats(0.01, 5.0))
@settings(deadline=None, max_examples=300)
def test_the_speed_after_a_stretch_of_a_bend_is_that_by_the_sine_to_the_last_bit(
    share: float, step: float, radius: float
) -> None:
    top = 0.7 * 0.8 * radius
    speed = share * math.sqrt(top)
    phase = math.asin(min(1.0, speed * speed / top)) + 2.0 * step / radius

    expected = math.sqrt(top * math.sin(min(0.5 * math.pi, phase)))
    assert reachable_speed(speed, step, radius, PACE) == expected


@given(short=st.floats(1e-9, 1e-3), part=st.floats(0.99, 1.01), radius=st.floats(0.01, 5.0))
@settings(deadline=None, max_examples=300)
def test_so_it_is_where_the_sine_just_reaches_its_top(
    short: float, part: float, radius: float
) -> None:
    top = 0.7 * 0.8 * radius
    speed, step = math.sqrt((1.0 - short) * top), 0.5 * radius * part * math.sqrt(5.0 * short)
    phase = math.asin(min(1.0, speed * speed / top)) + 2.0 * step / radius

    expected = math.sqrt(top * math.sin(min(0.5 * math.pi, phase)))
    assert reachable_speed(speed, step, radius, PACE) == expected


@given(rest=st.floats(0.0, 5.0), end=st.floats(0.0, 1.5), period=st.floats(0.005, 0.2))
@settings(deadline=None, max_examples=50)
def test_half_a_period_at_the_speed_sent_and_the_braking_after_it_use_up_what_is_left(
    rest: float, end: float, period: float
) -> None:
    speed = speed_before(rest, end, math.inf, period, PACE)

    braking = (speed * speed - end * end) / (2.0 * 0.8)
    assert 0.5 * period * speed + braking == pytest.approx(rest, abs=1e-9)
