"""Base and arm that move by physics, as parts: what they obey, and what they tell."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

import pytest

from hw.geometry import STILL, Pose2, Twist2
from hw.model.robot import MotionLimits, load_robot
from hw.model.sensor_errors import Slip
from hw.sim.sensors.track import Track

pytest.importorskip("mujoco", reason="the extra `reference` is not installed")
from hw.sim.physics.physical_base import physical_robot

ROBOT = load_robot("rbkairos_ur10")
LIMITS = MotionLimits(base_acceleration=1.0, base_yaw_acceleration=2.0)
GOAL = (-1.5, -1.57, 0.0, -1.5, 0.0, 0.0)
START = Pose2(1.0, 2.0, 0.5)


class Ticked:
    """A robot alone, ticked at 30 Hz."""

    def __init__(self, slip=None):
        self.base, self.arm = physical_robot(ROBOT, LIMITS, START, slip)
        self.now, self.poses, self.states = 0, [START], [self.arm.state]

    def ticks(self, count, twist=None):
        for _ in range(count):
            if twist is not None:
                self.base.drive(twist)
            self.now += round(1e9 / 30)
            self.base.advance(self.now)
            self.arm.advance(self.now)
            self.poses.append(self.base.pose)
            self.states.append(self.arm.state)


def swing(seconds):
    """From the folded arm to `GOAL` within so many s, smoothly: 3 s^2 - 2 s^3."""
    shares = [n / 200 for n in range(201)]
    return [
        (
            share * seconds,
            tuple(
                a + (3.0 - 2.0 * share) * share**2 * (b - a)
                for a, b in zip(ROBOT.parked, GOAL, strict=True)
            ),
        )
        for share in shares
    ]


def test_a_robot_that_stands_tells_the_same_pose_and_joints_again():
    robot = Ticked()
    robot.ticks(15)
    pose, state = robot.base.pose, robot.arm.state
    robot.ticks(30)
    assert robot.base.pose is pose
    assert robot.arm.state is state
    assert robot.base.twist is STILL
    assert pose.is_near(START, 1e-4, 1e-4)


def test_equal_commands_give_equal_bits():
    def drive():
        robot = Ticked(Slip())
        robot.arm.follow(swing(1.5))
        robot.ticks(30, Twist2(0.5, -0.3, 0.8))
        return robot.poses, robot.states, robot.base.energy_j

    assert drive() == drive()


def test_the_base_follows_its_ramps_a_drive_behind():
    robot = Ticked()
    robot.ticks(60, Twist2(1.0))
    lag = 1.0 / (2.0 * math.pi * 10.0)
    assert robot.base.twist.vx == pytest.approx(1.0, abs=0.01)
    assert robot.base.distance_m == pytest.approx(1.5 - lag, abs=0.02)
    speeds = [a.distance_to(b) * 30.0 for a, b in pairwise(robot.poses)]
    assert max(speeds) < 1.02


def test_wheels_tell_what_they_turned_and_not_what_the_floor_took():
    slip, robot = Slip(along=0.01, across=0.05, turning=0.04), Ticked(Slip())
    body, wheels = Track(START), Track(START)
    robot.base.watch(body, wheels, None)
    assert robot.base.signals == ("base.twist",)
    robot.ticks(60, Twist2(0.0, 0.8, 0.0))
    robot.ticks(60, STILL)
    x, y, _ = wheels.held(robot.now)
    rolled = START.distance_to(Pose2(x, y))
    assert body.held(robot.now)[:2] == (robot.base.pose.x, robot.base.pose.y)
    assert START.distance_to(robot.base.pose) == pytest.approx((1.0 - slip.across) * rolled, 2e-3)


def test_an_obstacle_holds_the_base_and_its_wheels():
    robot = Ticked()
    robot.ticks(45, Twist2(1.0))
    held = robot.base.pose
    robot.base.block(held)
    robot.ticks(10)
    assert robot.base.pose.is_near(held, 0.002, 0.002)
    robot.ticks(60, Twist2(-0.5))
    assert abs(held.bearing_to(robot.base.pose)) == pytest.approx(math.pi, abs=0.01)


def test_the_arm_trails_by_little_and_pushes_the_base_by_little():
    robot = Ticked()
    robot.arm.follow(swing(1.6))
    robot.ticks(1)
    assert robot.arm.state.moving
    robot.ticks(60)
    state = robot.arm.state
    assert not state.moving
    assert state.joints == pytest.approx(GOAL, abs=1e-3)
    shifts = [pose.distance_to(START) for pose in robot.poses]
    assert 1e-5 < max(shifts) < 0.002


def test_a_pulled_stop_line_brakes_both():
    robot = Ticked()
    robot.arm.follow(swing(1.6))
    robot.ticks(24, Twist2(0.5))
    assert robot.base.twist.speed > 0.4
    robot.base.braked = robot.arm.braked = True
    robot.ticks(18, Twist2(0.5))
    rest = robot.arm.state
    assert robot.base.twist is STILL
    assert (rest.moving, rest.refused) == (False, "the stop line is pulled")
    robot.ticks(6, Twist2(0.5))
    assert robot.arm.state.joints == pytest.approx(rest.joints, abs=1e-3)
    assert robot.poses[-1].is_near(robot.poses[-6], 1e-3, 1e-3)


def test_a_robot_without_an_arm_drives_too():
    base, arm = physical_robot(replace(ROBOT, arm=None, prop=None, parked=None), LIMITS, START)
    assert arm is None
    base.drive(Twist2(0.4))
    base.advance(400_000_000)
    assert START.bearing_to(base.pose) == pytest.approx(0.0, abs=0.01)
