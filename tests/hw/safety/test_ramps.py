"""Whatever the velocity, the next one is a number within the ramps."""

from __future__ import annotations

import math

from hypothesis import given, settings
from hypothesis import strategies as st

from hw.geometry import Twist2
from hw.robot import MotionLimits, load_robot
from hw.safety.ramps import Ramps

H = 0.01
LIMITS = MotionLimits(base_acceleration=1.0, base_yaw_acceleration=1.5)
RAMPS = Ramps(load_robot("rbkairos_ur10").base, LIMITS)
speeds, rates = st.floats(-3.0, 3.0), st.floats(-4.0, 4.0)


@given(speed=speeds, rate=rates, wanted=speeds, turn=rates, yaw=st.floats(-3.1, 3.1))
@settings(deadline=None)
def test_a_differential_base_in_a_bend_too_tight_keeps_its_speed(
    speed: float, rate: float, wanted: float, turn: float, yaw: float
) -> None:
    """Pushed, it may turn faster than its limits let it: what is left to speed up is nothing."""
    now = speed * math.cos(yaw), speed * math.sin(yaw), rate

    target = Twist2(wanted, 0.0, turn)
    *_, (vx, vy, wz) = RAMPS.toward(yaw, now, target, H, "differential", braked=False)

    assert abs(wz - rate) <= 1.5 * H + 1e-12
    assert abs(math.hypot(vx, vy) - abs(speed)) <= 1.0 * H + 1e-12
    if abs(speed * rate) > 1.0:  # the bend takes all of the acceleration
        assert abs(math.hypot(vx, vy) - abs(speed)) <= 1e-9
