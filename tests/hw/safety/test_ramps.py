"""Whatever the velocity, the next one is a number within the ramps."""

from __future__ import annotations

import math

import pytest
from hypothesis import given, settings, strategies as st

from hw.geometry import Twist2
from hw.interfaces import DriveMode
from hw.model.robot import MotionLimits, load_robot
from hw.safety.ramps import Ramps

H = 0.01
LIMITS = MotionLimits(base_acceleration=1.0, base_yaw_acceleration=1.5)
BASE = load_robot("rbkairos_ur10").base
RAMPS = Ramps(BASE, LIMITS)
speeds = st.floats(-3.0, 3.0, allow_subnormal=False)
rates = st.floats(-4.0, 4.0, allow_subnormal=False)


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


@pytest.mark.requirement(50)
@given(
    vx=speeds, vy=speeds, wz=rates, speed=st.floats(0.1, 5.0), rate=st.floats(0.1, 5.0),
    mode=st.sampled_from(["omni", "differential"]),
)  # fmt: skip
@settings(deadline=None)
def test_a_command_is_scaled_to_the_lesser_of_the_robots_and_the_profiles_limits(
    vx: float, vy: float, wz: float, speed: float, rate: float, mode: DriveMode
) -> None:
    """It keeps its direction, and no wheel's rim is faster than it can be."""
    ramps = Ramps(BASE, MotionLimits(base_speed=speed, base_yaw_rate=rate))
    sideways = vy if mode == "omni" else 0.0
    rim = BASE.max_wheel_rate * BASE.wheel_radius

    found = ramps.limited(Twist2(vx, vy, wz), mode)

    assert found.speed <= min(speed, BASE.max_speed) * (1.0 + 1e-12)
    assert abs(found.wz) <= min(rate, BASE.max_yaw_rate) * (1.0 + 1e-12)
    lever = BASE.half_wheelbase + BASE.half_track
    wheels = abs(found.vx) + abs(found.vy) + lever * abs(found.wz)
    assert wheels <= rim * (1.0 + 1e-12)
    shares = [
        a / b for a, b in zip((found.vx, found.vy, found.wz), (vx, sideways, wz), strict=True) if b
    ]
    assert shares == pytest.approx([shares[0]] * len(shares)) if shares else True
    bounded = (
        found.speed / min(speed, BASE.max_speed),
        abs(found.wz) / min(rate, BASE.max_yaw_rate),
        wheels / rim,
        shares[0] if shares else 1.0,
    )
    assert max(bounded) == pytest.approx(1.0)  # and no more than one of them asks for
