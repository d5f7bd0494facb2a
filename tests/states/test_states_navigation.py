"""States that drive the base, on the simulated base."""

from __future__ import annotations

from typing import Any

import pytest

from hw.geometry import Pose2
from hw.samples import UserPose
from hw.sim.base import SimBase
from states.navigation.states import DriveTo
from states.navigation.wheels import Wheels
from states.site import Site, SubsystemName

HZ = 30
START = Pose2(2.0, 2.0, 0.0)


class Drive:
    """A state that drives a simulated base, tick by tick."""

    def __init__(
        self, site: Site, context: Any, goal: Pose2, name: SubsystemName = "chase"
    ) -> None:
        self.base = SimBase(site.robot, site.limits, START)
        values = {"site": site, "base.pose": START, "base.twist": self.base.twist}
        self.wheels = Wheels(self.base)
        self.ctx = context(values, {"base": self.wheels})
        self.run = DriveTo(name).run(self.ctx, goal)
        self.fastest = 0.0

    def until_end(self, take_step: Any, seconds: float) -> str | None:
        for tick in range(round(seconds * HZ)):
            now = tick * 10**9 // HZ
            self.base.advance(now)
            self.ctx.now = now
            self.ctx.values |= {"base.pose": self.base.pose, "base.twist": self.base.twist}
            self.fastest = max(self.fastest, self.base.twist.speed)
            self.wheels.begin(now)
            outcome = take_step(self.run)
            self.wheels.pass_on()
            if outcome is not None:
                return str(outcome)
        return None


@pytest.mark.requirement(39, 79, 129)
@pytest.mark.parametrize("goal", [Pose2(7.0, 5.0, 1.2), Pose2(2.5, 2.0, -3.0), START])
def test_a_drive_arrives_at_place_and_yaw_and_stands(
    site: Site, context: Any, take_step: Any, goal: Pose2
) -> None:
    drive = Drive(site, context, goal)

    assert drive.until_end(take_step, 15) == "arrived"

    assert drive.base.pose.distance_to(goal) <= site.navigation.chase.tolerance
    assert drive.base.pose.yaw == pytest.approx(goal.yaw, abs=site.navigation.chase.yaw_tolerance)
    assert drive.fastest <= 1.5 + 1e-6


@pytest.mark.requirement(51, 52)
def test_a_drive_goes_round_the_user(site: Site, context: Any, take_step: Any) -> None:
    drive = Drive(site, context, Pose2(8.0, 2.0, 0.0), "haptic")
    user = UserPose(Pose2(5.0, 2.3, 0.0), 0.0)
    drive.ctx.values["user.pose"] = user
    nearest = []
    for _ in range(300):
        outcome = drive.until_end(take_step, 1 / HZ)
        nearest.append(drive.base.pose.distance_to(user.body))
        if outcome is not None:
            break
        drive.base._now = 0  # the next tick begins at 0 again

    assert min(nearest) >= site.navigation.haptic.user_radius - 0.01


@pytest.mark.requirement(101)
def test_a_goal_in_a_wall_s_inflation_has_no_path(site: Site, context: Any, take_step: Any) -> None:
    drive = Drive(site, context, Pose2(0.9, 4.0, 0.0))

    assert drive.until_end(take_step, 1) == "no_path"


@pytest.mark.requirement(101)
def test_a_robot_that_does_not_move_is_stuck(site: Site, context: Any, take_step: Any) -> None:
    drive = Drive(site, context, Pose2(7.0, 5.0, 0.0))
    drive.base.braked = True

    assert drive.until_end(take_step, 3.2) == "stuck"


def test_without_a_pose_of_the_base_the_drive_is_lost(
    site: Site, context: Any, take_step: Any
) -> None:
    drive = Drive(site, context, Pose2(7.0, 5.0, 0.0))
    take_step(drive.run)
    drive.ctx.values["base.pose"] = None

    assert take_step(drive.run) == "lost"


@pytest.mark.requirement(42, 71)
def test_whatever_ends_a_drive_stops_the_base(site: Site, context: Any, take_step: Any) -> None:
    drive = Drive(site, context, Pose2(7.0, 5.0, 0.0))
    drive.until_end(take_step, 1)
    assert drive.base.twist.speed > 0.3

    drive.run.close()
    drive.wheels.pass_on()
    drive.base.advance(4 * 10**9)

    assert drive.base.twist.speed == 0.0


@pytest.mark.requirement(35)
def test_each_subsystem_drives_with_its_own_values(
    site: Site, context: Any, take_step: Any
) -> None:
    speeds = {}
    names: tuple[SubsystemName, ...] = ("chase", "escape")
    for name in names:
        drive = Drive(site, context, Pose2(8.0, 6.0, 0.0), name)
        drive.until_end(take_step, 15)
        speeds[name] = drive.fastest

    assert speeds["chase"] == pytest.approx(1.5, abs=0.01)
    assert 2.0 < speeds["escape"] <= 2.5
