"""Times along a line under limits of speed and acceleration."""

from __future__ import annotations

import math

import pytest
from hypothesis import given, settings, strategies as st

from states.navigation.local.speed_profile import SpeedLimits, stretch_time

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
