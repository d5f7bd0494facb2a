"""The world around fakes: bodies follow what the devices report, and people wait for the run."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import pytest
from hypothesis import given, strategies as st

from hw.connection.connection import HostedScene
from hw.geometry import STILL, Pose2, Pose3, Twist2
from hw.model.robot import MotionLimits, load_robot
from hw.model.sensor_errors import SensorErrors
from hw.samples import BumperHit, UserPose
from hw.scene.scene import load_scene
from hw.sim.external_base import SILENT_NS, HostedArm, HostedBase, twist_of
from hw.sim.external_world import DRIVES, EVALUATOR, SCANNERS, STEP_NS, VR, HostedWorld

ROBOT = load_robot("rbkairos_ur10")
SCENE = load_scene("lab_a")
MOTION = MotionLimits()
NO_SLIP = replace(SensorErrors(), slip=None)
SPEEDS = st.floats(-3.0, 3.0)


def rates_of(twist):
    """The wheels of a Mecanum base, written out on their own."""
    base = ROBOT.base
    lever = base.half_wheelbase + base.half_track
    signs = ((-1, -1), (1, 1), (1, -1), (-1, 1))  # of vy and wz: fl, fr, rl, rr
    return tuple((twist.vx + a * twist.vy + b * lever * twist.wz) / base.wheel_radius
                 for a, b in signs)  # fmt: skip


def hosted(user="cornering", requests=1, sensing=NO_SLIP):
    return HostedWorld(HostedScene(SCENE, user, sensing, requests=requests), ROBOT, MOTION)


def step(world, count=1, twist=None):
    told = []
    for _ in range(count):
        if twist is not None:
            world.on_message(DRIVES, "wheels", world.now_ns, rates_of(twist))
        told += world.step()
    return told


def values(told, name):
    return [one.value for one in told if one.name == name]


# ---- wheels and body


@given(SPEEDS, SPEEDS, SPEEDS)
def test_wheel_rates_are_a_velocity(vx, vy, wz):
    found = twist_of(rates_of(Twist2(vx, vy, wz)), ROBOT.base)
    assert (found.vx, found.vy, found.wz) == pytest.approx((vx, vy, wz), abs=1e-12)


@pytest.mark.parametrize("twist", [Twist2(0.4), Twist2(0.0, 0.3), Twist2(0.2, -0.1, 0.5)])
def test_where_nothing_slips_the_body_goes_as_the_wheels_say(twist):
    base = HostedBase(ROBOT, MOTION, Pose2(3.0, 4.0, 0.7))
    now = 0
    for _ in range(200):
        base.turn(now, rates_of(twist))
        now += STEP_NS
        base.advance(now)
    for _ in range(20):
        base.turn(now, rates_of(STILL))
        now += STEP_NS
        base.advance(now)
    chord = 2.0 if twist.wz == 0.0 else math.sin(twist.wz) / (0.5 * twist.wz)
    way = Twist2(twist.vx, twist.vy).rotated(0.7 + twist.wz)
    assert base.pose.x == pytest.approx(3.0 + chord * way.vx, abs=1e-4)
    assert base.pose.y == pytest.approx(4.0 + chord * way.vy, abs=1e-4)
    assert base.pose.yaw == pytest.approx(0.7 + 2.0 * twist.wz, abs=1e-6)
    assert base.twist == STILL


def test_wheels_that_are_not_heard_of_any_more_stand():
    world = hosted()
    step(world, 20, Twist2(0.3))
    assert world.base.twist.vx == pytest.approx(0.3)
    step(world, SILENT_NS // STEP_NS + 1)
    there = world.base.pose
    assert world.base.twist == STILL
    step(world, 20)
    assert world.base.pose == there


def test_the_floor_slips_as_the_profile_has_it():
    world = hosted(sensing=SensorErrors())
    start = world.base.pose
    step(world, 100, Twist2(0.0, 0.5))
    step(world, 20, STILL)
    way = start.distance_to(world.base.pose)
    assert 0.01 < abs(way - 0.5) < 0.1


def test_a_wall_holds_the_body_for_as_long_as_the_wheels_push():
    world = hosted()
    told = step(world, 200, Twist2(-1.0))
    against = world.base.pose
    assert SCENE.room.is_free(against.x, against.y)
    assert world.truth.wall_hits == 1
    hits = [hit for hit in values(told, "bumper") if hit is not None]
    assert [type(hit) for hit in hits] == [BumperHit]
    assert abs(hits[0].bearing) == pytest.approx(math.pi, abs=0.01)
    assert None not in values(step(world, 50, Twist2(-1.0)), "bumper")
    assert world.base.pose == against
    told = step(world, 50, Twist2(0.4))
    assert world.base.pose.distance_to(against) > 0.15
    assert None in values(told, "bumper")


@pytest.mark.parametrize("rates", [(1.0, 2.0), (0.0, 0.0, 0.0, math.nan), (0.0,) * 5])
def test_rates_of_no_four_wheels_are_refused_and_change_nothing(rates):
    world = hosted()
    with pytest.raises(ValueError, match="wheels"):
        world.on_message(DRIVES, "wheels", 0, rates)
    step(world)
    assert world.base.twist == STILL


def test_what_nobody_knows_is_refused():
    with pytest.raises(ValueError, match="'lights' of 'cb3'"):
        hosted().on_message("cb3", "lights", 0, True)


# ---- arm


def test_an_arm_is_where_its_controller_says_and_moves_while_that_changes():
    arm = HostedArm((0.0,) * 6)
    arm.on_joints(8_000_000, (0.008,) + (0.0,) * 5)
    assert arm.state.joints[0] == 0.008
    assert arm.state.velocities[0] == pytest.approx(1.0)
    assert arm.state.moving
    arm.on_joints(16_000_000, (0.008,) + (0.0,) * 5)
    assert not arm.state.moving
    arm.on_joints(9_000_000, (0.5,) * 6)  # overtaken on its way
    assert arm.state.joints[0] == 0.008
    with pytest.raises(ValueError, match="joints"):
        arm.on_joints(24_000_000, (0.0,) * 5)


def test_the_truth_has_the_arm_of_the_controller():
    world = hosted()
    joints = tuple(angle + 0.1 for angle in ROBOT.parked)
    world.on_message("cb3", "joints", 1, joints)
    step(world)
    assert world.truth.joints == joints


# ---- person


def test_a_person_stands_tracked_until_the_run_begins_and_finishes_after_it():
    world = hosted()
    told = step(world, 300)
    assert len(values(told, "user.pose")) > 280
    assert set(values(told, "finished")) == {None}
    assert world.truth.body == world.person.body
    stood = world.truth.body
    world.on_message(EVALUATOR, "begin", 0, None)
    for _ in range(12_000):
        told = step(world)
        if values(told, "finished") == [True]:
            break
    assert values(told, "finished") == [True]
    assert world.truth.body.distance_to(stood) > 0.5


def test_a_request_is_told_on_change_and_again_as_a_level():
    world = hosted("study")
    world.on_message(EVALUATOR, "begin", 0, None)
    told = []
    while not values(told, "vr.release"):
        told += step(world, 100)
    requests = values(told, "vr.haptic_request")
    deep = next(value for value in requests if value is not None)
    assert set(requests) == {None, deep}
    stamps = [one.stamp_ns for one in told if one.name == "vr.haptic_request"]
    assert max(b - a for a, b in itertools.pairwise(stamps)) <= 100_000_000
    assert values(told, "vr.release") == [True]


def test_a_person_who_is_shown_the_robot_says_when_they_are_ready():
    world = hosted()
    world.on_message(VR, "inform", 0, True)
    told = step(world, 100)
    assert values(told, "vr.restart") == [True]
    assert world.truth.informed


def test_a_live_person_is_where_they_are_placed_and_asks_as_told():
    world = hosted("live")
    here, deep = UserPose(Pose2(3.0, 3.0), 0.5), Pose3.from_yaw(3.5, 3.0, 1.4, 0.0)
    world.on_message(EVALUATOR, "place", 0, here)
    step(world, 5)
    world.on_message(EVALUATOR, "begin", 0, None)
    world.on_message(EVALUATOR, "ask", 0, deep)
    told = step(world, 50)
    assert world.truth.body == here.body
    assert len(values(told, "user.pose")) > 45
    assert world.truth.request == deep
    world.on_message(EVALUATOR, "ask", 0, None)
    assert values(step(world, 2), "vr.release") == [True]


def test_nobody_else_is_placed():
    with pytest.raises(ValueError, match="'place'"):
        hosted().on_message(EVALUATOR, "place", 0, UserPose(Pose2(3.0, 3.0), 0.5))


def test_without_a_person_nothing_is_told_of_one():
    world = hosted(user=None)
    names = {one.name for one in step(world, 100)}
    assert names == {"truth", "finished", "base.scan", "rover.tracker", "bumper"}
    assert world.truth.body is None
    assert not world.finished


def test_each_peer_is_told_its_own_and_the_truth_only_the_evaluator():
    told = step(hosted(), 100)
    by_peer = {kind: {one.name for one in told if one.to == kind}
               for kind in (VR, DRIVES, SCANNERS, EVALUATOR)}  # fmt: skip
    assert by_peer == {
        VR: {"user.pose", "rover.tracker", "vr.haptic_request"},
        DRIVES: {"bumper"},
        SCANNERS: {"base.scan"},
        EVALUATOR: {"truth", "finished"},
    }


def test_an_operator_pushes_a_robot_off_the_person_it_touches():
    world = hosted()
    body = world.truth.body
    for _ in range(3000):
        here = world.base.pose
        bearing = here.bearing_to(body)
        step(world, 1, Twist2(0.5, 0.0, 1.0 * bearing))
        if world.truth.contacts:
            break
    assert len(world.truth.contacts) == 1
    step(world, 30, STILL)
    for _ in range(400):
        world.on_message(EVALUATOR, "push_off", 0, None)
        step(world, 1, STILL)
    gap = world.base.pose.distance_to(body)
    assert gap > 0.5 + 0.455 + 0.25
    there = world.base.pose
    step(world, 100, STILL)
    assert world.base.pose == there
