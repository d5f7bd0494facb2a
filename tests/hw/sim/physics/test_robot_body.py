"""The robot in MuJoCo against what can be computed by hand.

The oracles are mechanics from textbooks, the numbers of robot and arm file, and the kinematics of
`hw.drivers.can.mecanum`, which shares no code with the model.
"""

from __future__ import annotations

import math
import re
from dataclasses import replace

import numpy as np
import pytest
from scipy.special import ellipk

from hw.drivers.can.mecanum import Mecanum
from hw.geometry import STILL, Pose2, Twist2
from hw.model.robot import load_robot, robot_names
from hw.model.sensor_errors import Slip
from hw.sim.physics.mechanics import Mechanics, WheelGeometry
from hw.sim.physics.robot_mjcf import robot_mjcf
from tests.hw.sim.physics.arm_oracle import GRAVITY, gravity_torques, shoulder_pendulum

mujoco = pytest.importorskip("mujoco", reason="the extra `reference` is not installed")
from hw.sim.physics.robot_body import RobotBody, wheel_rates  # noqa: E402

ROBOT = load_robot("rbkairos_ur10")
BARE = replace(ROBOT, arm=None, prop=None, parked=None)
GRIP = Mechanics().friction * GRAVITY / math.sqrt(2.0)
"""The greatest deceleration of a base ahead or aside, m/s2: each wheel holds along its rollers."""
DIRECTIONS = pytest.mark.parametrize(
    "twist", [Twist2(1.0), Twist2(0.0, 1.0, 0.0), Twist2(0.0, 0.0, 1.0)], ids=["vx", "vy", "wz"]
)


def standing(robot=BARE, slip=None, mechanics=None):
    """A robot that has sunk into its tyres."""
    body = RobotBody(robot, Pose2(0.0, 0.0), robot.parked or (), slip, mechanics)
    run(body, 0.3, joints=robot.parked or ())
    return body


def run(body, seconds, twist=STILL, joints=()):
    for _ in range(round(seconds * 100)):
        body.move(twist, joints, 0.01)


def speed_up(body, twist, seconds):
    """From standstill evenly to this velocity."""
    for n in range(round(seconds * 100)):
        share = 0.01 * (n + 1) / seconds
        body.move(Twist2(share * twist.vx, share * twist.vy, share * twist.wz), (), 0.01)


def lock(body):
    """Wheels that nothing turns: of an enormous inertia."""
    for n in range(4):
        body.model.dof_armature[body.model.joint(f"hub_{n}").dofadr[0]] = 1e6


def velocity(body):
    """In the base frame."""
    vx, vy, wz = body.data.qvel[[0, 1, 5]]
    return Twist2(vx, vy, wz).rotated(-body.pose.yaw)


# wheels


@DIRECTIONS
def test_a_base_goes_as_its_wheels_turn(twist):
    body = standing()
    speed_up(body, twist, 1.0)
    run(body, 0.5, twist)

    found, inverse = velocity(body), Mecanum.of(BARE.base).rates(twist)
    rates = [body.data.joint(f"hub_{n}").qvel[0] for n in range(4)]
    assert (found.vx, found.vy, found.wz) == pytest.approx((twist.vx, twist.vy, twist.wz), abs=2e-3)
    assert rates == pytest.approx(inverse, abs=0.02)
    assert wheel_rates(twist, BARE.base) == pytest.approx(inverse)


@DIRECTIONS
def test_a_floor_takes_its_shares(twist):
    slip = Slip(along=0.01, across=0.05, turning=0.04)
    body = standing(slip=slip)
    speed_up(body, twist, 1.0)
    run(body, 0.5, twist)

    wanted = twist.vx, twist.vy, twist.wz
    found, left = velocity(body), (1.0 - slip.along, 1.0 - slip.across, 1.0 - slip.turning)
    expected = [share * value for share, value in zip(left, wanted, strict=True)]
    assert (found.vx, found.vy, found.wz) == pytest.approx(expected, abs=2e-3)


@pytest.mark.parametrize("direction", [(1.0, 0.0), (0.0, -1.0)])
def test_locked_wheels_stop_within_the_distance_that_friction_leaves(direction):
    """v^2 / (2 a): each wheel brakes by mu m g / 4 along its rollers, which roll across them."""
    body, speed = standing(), 2.0
    lock(body)
    x, y = direction
    body.data.qvel[:2] = speed * x, speed * y
    for n, sign in enumerate((-1, 1, 1, -1)):  # v + roller x (0, 0, -r) has no part across (1, s)
        across = speed * (sign * x - y) / 2.0 / BARE.base.wheel_radius
        body.data.qvel[body.model.joint(f"roller_{n}").dofadr[0]] = across
    run(body, 1.2)

    way = body.pose.distance_to(Pose2(0.0, 0.0))
    assert way == pytest.approx(speed**2 / (2.0 * GRIP), rel=0.015)
    assert velocity(body).speed < 1e-3


@pytest.mark.parametrize("direction", [0.0, 0.5 * math.pi, math.pi])
def test_locked_wheels_begin_to_slip_where_friction_ends(direction):
    """Of a pull, as on a slope, mu g / sqrt(2) is held; what is more speeds the base up."""
    ways = []
    for share in (0.95, 1.05):
        body = standing()
        lock(body)
        pull = share * GRIP
        body.model.opt.gravity[:2] = pull * math.cos(direction), pull * math.sin(direction)
        run(body, 1.0)
        ways.append(body.pose.distance_to(Pose2(0.0, 0.0)))
    holds, slips = ways
    assert holds < 0.005
    assert slips == pytest.approx(0.5 * 0.05 * GRIP, rel=0.3)


def test_drives_brake_as_told_until_the_floor_lets_go():
    """At 3 m/s2, the robot's brakes, the way is v^2 / (2 a) and the lag; at 6 that of the grip."""
    ways = {}
    for brakes in (3.0, 6.0):
        body, speed = standing(mechanics=Mechanics(wheel_power=2000.0)), 2.0
        speed_up(body, Twist2(speed), 1.0)
        run(body, 0.3, Twist2(speed))
        before = body.pose
        for n in range(150):
            body.move(Twist2(max(0.0, speed - 0.01 * (n + 1) * brakes)), (), 0.01)
        ways[brakes] = body.pose.distance_to(before)
    lag = 1.0 / (2.0 * math.pi * Mechanics().drive_bandwidth)
    assert ways[3.0] == pytest.approx(speed**2 / 6.0, abs=speed * lag)
    assert speed**2 / (2.0 * GRIP) < ways[6.0] < 1.2 * speed**2 / (2.0 * GRIP)


def test_torques_are_limited():
    """Two of 21 Nm can do no more than 4 * 21 Nm / r, less what rolling takes."""
    body = standing(mechanics=Mechanics(friction=2.0))
    torque = 500.0 / BARE.base.max_wheel_rate
    run(body, 0.2, Twist2(3.0))
    force = 4.0 * torque / BARE.base.wheel_radius - 0.05 * BARE.mass * GRAVITY
    mass = BARE.mass + 4.0 * Mechanics().wheel_inertia / BARE.base.wheel_radius**2
    assert velocity(body).vx == pytest.approx(0.2 * force / mass, rel=0.03)


def test_a_finer_step_changes_a_drive_by_less_than_a_millimetre():
    """Ahead, aside and turning, for 2 s."""
    poses = []
    for step in (0.002, 0.0005):
        body = standing(mechanics=Mechanics(step=step))
        for n in range(200):
            t = 0.01 * n
            twist = Twist2(min(1.0, t), 0.5 * math.sin(2.0 * t), 0.6 * math.sin(1.5 * t))
            body.move(twist, (), 0.01)
        poses.append(body.pose)
    assert poses[0].is_near(poses[1], 0.001, 0.001)


@pytest.mark.parametrize("name", robot_names())
def test_every_shipped_robot_stands(name):
    robot = load_robot(name)
    body = standing(robot)
    assert body.data.qpos[:3] == pytest.approx((0.0, 0.0, 0.0), abs=1e-3)
    assert sum(body.model.body_mass) == pytest.approx(robot.mass)


# arm


def test_the_arm_is_held_by_the_torques_of_gravity():
    joints = (0.3, -1.0, 1.2, -0.4, 0.7, 0.2)
    body = RobotBody(ROBOT, Pose2(0.0, 0.0), joints)
    run(body, 0.6, joints=joints)
    torques = [body.data.joint(f"joint_{n}").qfrc_actuator[0] for n in range(6)]
    assert torques == pytest.approx(gravity_torques(ROBOT, joints), abs=0.2)
    assert max(map(abs, torques)) > 50.0


def pendulum(step):
    """The arm of a robot that is bolted down, stiff but for its shoulder lift, without drives."""
    text = robot_mjcf(ROBOT, Mechanics(step=step), WheelGeometry.on(ROBOT.base, None))
    for pattern in (
        '<freejoint name="rover"/>',
        r"<actuator>.*</actuator>",
        r"<contact>.*</contact>",
        r'<joint name="joint_[^1]"[^>]*/>',
    ):
        text = re.sub(pattern, "", text, flags=re.DOTALL)
    model = mujoco.MjModel.from_xml_string(text)
    return model, mujoco.MjData(model), model.joint("joint_1")


@pytest.mark.parametrize("amplitude", [0.05, 1.0, 2.8])
def test_a_locked_arm_swings_with_the_period_of_a_pendulum(amplitude):
    """4 sqrt(I / (m g d)) K(sin(a / 2)), with the complete elliptic integral."""
    inertia, moment, hangs = shoulder_pendulum(ROBOT)
    inertia += Mechanics().rotor_inertia
    model, data, joint = pendulum(0.002)
    data.qpos[joint.qposadr[0]] = hangs + amplitude
    angles = []
    for _ in range(6000):
        mujoco.mj_step(model, data)
        angles.append(data.qpos[joint.qposadr[0]] - hangs)
    swings = np.array(angles)
    down = np.flatnonzero((swings[:-1] > 0.0) & (swings[1:] <= 0.0))
    times = 0.002 * (down + swings[down] / (swings[down] - swings[down + 1]))
    period = 4.0 * math.sqrt(inertia / (moment * GRAVITY)) * ellipk(math.sin(amplitude / 2.0) ** 2)
    assert len(times) >= 3
    assert np.diff(times) == pytest.approx(period, rel=1e-3)


def energy_error(step):
    """The largest relative change of energy of a wide swing within 5 s."""
    inertia, moment, hangs = shoulder_pendulum(ROBOT)
    inertia += Mechanics().rotor_inertia
    model, data, joint = pendulum(step)
    data.qpos[joint.qposadr[0]] = hangs + 2.0
    weight, found = moment * GRAVITY, []
    for _ in range(round(5.0 / step)):
        mujoco.mj_step(model, data)
        angle = data.qpos[joint.qposadr[0]] - hangs
        rate = data.qvel[joint.dofadr[0]]
        found.append(0.5 * inertia * rate**2 - weight * math.cos(angle))
    start = -weight * math.cos(2.0)
    return float(np.abs(np.array(found) - start).max()) / (2.0 * weight)


def test_energy_is_kept_as_well_as_the_step_allows():
    """Semi-implicit Euler neither gains nor loses: its error is in proportion to the step."""
    errors = {step: energy_error(step) for step in (0.004, 0.002, 0.001)}
    assert errors[0.002] < 0.01
    assert errors[0.004] / errors[0.002] == pytest.approx(2.0, rel=0.1)
    assert errors[0.002] / errors[0.001] == pytest.approx(2.0, rel=0.1)
