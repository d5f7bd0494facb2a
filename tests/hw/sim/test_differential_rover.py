"""A base that only drives ahead and turns, without the figures of Mecanum wheels."""

import math
from pathlib import Path

import pytest

from engine.files.finding import FileError
from hw.drivers.can.mecanum import Mecanum
from hw.geometry import Pose2, Twist2
from hw.model.robot import MotionLimits, RobotModel
from hw.safety.guarded import GuardedBase
from hw.safety.limits import SafetyLimits
from hw.safety.ramps import SIDEWAYS, Ramps
from hw.sim.external_base import HostedBase, twist_of
from hw.sim.mock import MockBase
from hw.sim.sim_base import SimBase
from tests.hw.model.differential_rover import runner

LIMITS = MotionLimits(base_acceleration=1.0, base_yaw_acceleration=2.0)
START = Pose2(1.0, 2.0, 0.5)
BASES = {
    "simulated": lambda robot: SimBase(robot, LIMITS, START),
    "mock": lambda robot: MockBase(robot, START),
    "hosted": lambda robot: HostedBase(robot, LIMITS, START),
}


@pytest.fixture
def robot(tmp_path: Path) -> RobotModel:
    return runner(tmp_path)


def test_only_the_mode_omni_needs_the_figures_of_mecanum_wheels(tmp_path: Path) -> None:
    assert runner(tmp_path).base.lever == 0.18
    with pytest.raises(FileError, match="'half_wheelbase' is missing"):
        runner(tmp_path, "[differential]", "[omni]")
    with pytest.raises(FileError, match="'max_wheel_rate' is missing"):
        runner(tmp_path, "[differential]", "[omni, differential]\n  half_wheelbase: 20 cm")


def test_wheel_rates_limit_it_where_they_are_told(tmp_path: Path) -> None:
    """The outer wheel's rim moves at v + w / 2 times the track."""
    free = Ramps(runner(tmp_path).base, MotionLimits())
    assert free.limited(Twist2(1.2, 0.0, 2.0), "differential") == Twist2(1.2, 0.0, 2.0)

    slow = runner(tmp_path, "wheel_radius", "max_wheel_rate: 16 rad/s\n  wheel_radius")
    found = Ramps(slow.base, MotionLimits()).limited(Twist2(1.2, 0.0, 2.0), "differential")
    assert found.vx + 0.18 * found.wz == pytest.approx(16 * 0.075)
    assert found.vx / found.wz == pytest.approx(0.6)
    with pytest.raises(FileError, match="max_speed"):
        runner(tmp_path, "wheel_radius", "max_wheel_rate: 15 rad/s\n  wheel_radius")


@pytest.mark.parametrize("kind", BASES)
def test_a_sideways_command_is_refused_by_every_base(robot: RobotModel, kind: str) -> None:
    bare = BASES[kind](robot)
    guarded = GuardedBase(BASES[kind](robot), SafetyLimits.of(robot, LIMITS))
    for drive in (bare.drive, guarded.drive):
        drive(Twist2(0.5, 0.5 * SIDEWAYS, 0.2))
        with pytest.raises(ValueError, match=r"base: 0\.3 m/s sideways; .* base\.modes has omni"):
            drive(Twist2(0.5, 0.3, 0.2))
    with pytest.raises(ValueError, match="mode 'omni' is not one of differential"):
        guarded.use("omni")


@pytest.mark.parametrize("kind", ["simulated", "mock"])
def test_it_drives_an_arc_along_its_heading(robot: RobotModel, kind: str) -> None:
    """At the end of an arc of radius v / w around a centre to its left, however fast it set off."""
    base = BASES[kind](robot)
    for n in range(1, 601):
        base.drive(Twist2(0.5, 0.0, 0.5))
        base.advance(n * 10_000_000)
        assert base.twist.vy == 0.0
    steady = base.pose
    for n in range(601, 801):
        base.drive(Twist2(0.5, 0.0, 0.5))
        base.advance(n * 10_000_000)
    turned = steady.inverse() @ base.pose
    assert turned.yaw == pytest.approx(1.0, abs=1e-3)
    assert turned.x == pytest.approx(math.sin(1.0), abs=2e-3)
    assert turned.y == pytest.approx(1.0 - math.cos(1.0), abs=2e-3)


def test_four_wheels_without_rollers_turn_by_their_sides(tmp_path: Path) -> None:
    """Left and right rims differ by the track times the turn; drivers and fakes agree on it."""
    base = runner(tmp_path, "wheel_radius", "max_wheel_rate: 20 rad/s\n  wheel_radius").base
    wheels = Mecanum.of(base)
    rates = wheels.rates(Twist2(0.6, 0.0, 1.0))
    assert rates == pytest.approx((5.6, 10.4, 5.6, 10.4))
    for found in (wheels.velocity(rates), twist_of(rates, base)):
        assert (found.vx, found.vy, found.wz) == pytest.approx((0.6, 0.0, 1.0))
    skewed = (5.6, 10.4, 6.6, 9.4)
    assert wheels.velocity(skewed).vy == twist_of(skewed, base).vy == 0.0


def test_drives_on_a_bus_need_to_know_how_fast_their_wheels_turn(robot: RobotModel) -> None:
    with pytest.raises(ValueError, match=r"no base\.max_wheel_rate"):
        Mecanum.of(robot.base)
