import math
from dataclasses import replace

import pytest

from engine.files.finding import FileError
from hw.geometry import Pose2, Twist2
from hw.model.robot import MotionLimits, load_robot
from hw.people.live import LivePerson
from hw.people.user import open_user
from hw.safety.limits import SafetyLimits
from hw.samples import Sample, UserPose
from hw.scene.scene import load_scene
from hw.sim.scripted_samples import ScriptedSignals
from hw.sim.world import World
from tests.hw.conftest import tick

ROBOT = load_robot("rbkairos_ur10")
LAB = load_scene("lab_a")


def test_time_does_not_run_backwards():
    world = World(LAB, ROBOT, open_user("cornering", LAB))
    world.advance(10**9)
    with pytest.raises(ValueError, match="already"):
        world.advance(10**9 - 1)


def test_a_long_step_is_the_same_as_many_short_ones_of_the_longest_kind():
    worlds = [World(LAB, ROBOT, open_user("cornering", LAB)) for _ in range(2)]
    worlds[0].advance(20 * 10**9)
    for n in range(601):
        worlds[1].advance(min(n * 33_333_334, 20 * 10**9))
    assert worlds[0].person.body == worlds[1].person.body
    assert worlds[0].collisions.min_gap == worlds[1].collisions.min_gap


def test_a_robot_that_starts_in_a_wall_or_a_person_is_refused(tmp_path):
    text = (
        "scene: tight\nroom: lab_a\nrobot: {start: {x: 0.4, y: 0.4}}\n"
        "user: {start: {x: 3.0, y: 3.0}}\n"
    )
    path = tmp_path / "tight.yaml"
    path.write_text(text)
    scene = load_scene(path)
    with pytest.raises(FileError, match="would touch a wall"):
        World(scene, ROBOT, open_user("live", scene))
    path.write_text(text.replace("x: 0.4, y: 0.4", "x: 3.5, y: 3.0"))
    scene = load_scene(path)
    with pytest.raises(FileError, match="would touch the person"):
        World(scene, ROBOT, open_user("live", scene))


@pytest.mark.requirement(56)
def test_the_least_gap_is_that_of_a_dense_record():
    safety = replace(SafetyLimits.of(ROBOT, MotionLimits(1.0)), watched=False)
    world = World(LAB, ROBOT, open_user("cornering", LAB), MotionLimits(1.0), safety=safety)
    gaps = []
    for n in range(1500):
        for part in world.parts.values():
            for sample in part.samples(world.now_ns):
                world.guard.hear(sample, world.now_ns)
        world.guard.drive(Twist2(0.4, 0.1 * math.sin(n / 30), 0.3))
        world.guard.tick(world.now_ns)
        world.advance(tick(n))
        body = world.person.body
        x, y = world.base.pose.inverse().transform(body.x, body.y)
        outside = max(abs(x) - 0.565, 0.0), max(abs(y) - 0.455, 0.0)
        gaps.append(math.hypot(*outside) - 0.5)
    assert min(gaps) - 0.05 <= world.collisions.min_gap <= min(gaps) + 1e-9


def test_a_person_who_walks_through_the_robot_is_one_contact():
    person = LivePerson(Pose2(4.0, 8.4))
    world = World(LAB, ROBOT, person)
    for n in range(1, 200):
        person.push(tick(n), UserPose(Pose2(4.0 - 1.5 * n / 30, 8.4), 0.0))
        world.advance(tick(n))
        if world.person.body.x < 0.5:
            break
    assert len(world.collisions.contacts) == 1
    assert world.collisions.min_gap == pytest.approx(-0.5)


def test_a_leap_through_the_robot_is_a_contact_though_both_ends_are_far():
    person = LivePerson(Pose2(LAB.robot_start.x + 1.5, 8.4))
    world = World(LAB, ROBOT, person)
    for n, x in enumerate((2.3, -2.3), start=1):
        person.push(tick(n), UserPose(Pose2(LAB.robot_start.x + x, 8.4), 0.0))
        world.advance(tick(n))
    assert len(world.collisions.contacts) == 1


def test_the_demo_person_stops_when_shown_the_robot():
    world = World(LAB, ROBOT, open_user("cornering", LAB))
    for n in range(60):
        world.advance(tick(n))
    world.parts["vr"].inform(True)
    assert world.informed
    for n in range(60, 76):
        world.advance(tick(n))
    assert world.person.speed == 0.0


@pytest.mark.requirement(6)
@pytest.mark.parametrize("area_only", [False, True])
def test_outside_the_tracked_area_tracking_can_be_made_silent(area_only):
    person = LivePerson(Pose2(9.0, 5.0))
    scene = replace(LAB, tracking="area" if area_only else "everywhere")
    world = World(scene, ROBOT, person)
    seen = []
    for n, x in enumerate((9.0, 6.0), start=1):
        person.push(tick(n), UserPose(Pose2(x, 3.0), 0.0))
        world.advance(tick(n))
        seen += [s.value.body.x for s in world.parts["trackers"].samples(tick(n))]
    assert seen == ([6.0] if area_only else [9.0, 6.0])


def test_scripted_signals_come_at_their_time_and_once():
    part = ScriptedSignals([Sample("a", 0, 1), Sample("b", 40_000_000, 2), Sample("a", tick(3), 3)])
    assert part.signals == ("a", "b")
    assert [s.value for s in part.samples(0)] == [1]
    assert [s.value for s in part.samples(tick(1))] == []
    assert [s.value for s in part.samples(tick(3))] == [2, 3]
    assert part.finished
    with pytest.raises(ValueError, match="sort them by time"):
        ScriptedSignals([Sample("a", 5, 1), Sample("a", 4, 1)])


@pytest.mark.parametrize("robot", [(3.0, 5.0, 0.0), (0.6, 5.0, 0.0), (0.8, 1.6, 1.5)])
def test_a_robot_that_a_person_leans_on_is_pushed_off_and_can_be_reset(tmp_path, robot):
    x, y, yaw = robot
    path = tmp_path / "leaning.yaml"
    path.write_text(
        f"scene: leaning\nroom: lab_a\nrobot: {{start: {{x: {x}, y: {y}, yaw: {yaw}}}}}\n"
        "user: {start: {x: 5.0, y: 8.0}}\n"
    )
    scene = load_scene(path)
    person = LivePerson(scene.user_start)
    world = World(scene, ROBOT, person)
    there = Pose2(x + 0.7, y + 0.6)
    reasons = []
    for n in range(1, 30 * 12):
        person.push(tick(n), UserPose(there, 0.0))
        world.advance(tick(n))
        reasons.append(world.parts["stop_line"].reason)
    assert reasons[0] == "bumper: person"
    assert all(reason == "bumper: person" for reason in reasons[: 30 * 5])
    assert reasons[-1] is None
    assert not world.collisions.touching
    assert (len(world.collisions.contacts), world.collisions.wall_hits) == (1, 0)
    moved = Pose2(x, y).distance_to(world.base.pose)
    assert 0.0 < moved < 0.7


def test_a_robot_that_is_pushed_off_towards_a_wall_is_left_where_it_can_drive_off(tmp_path):
    path = tmp_path / "leaning.yaml"
    path.write_text(
        "scene: leaning\nroom: lab_a\nrobot: {start: {x: 0.8, y: 1.6, yaw: 1.5}}\n"
        "user: {start: {x: 5.0, y: 8.0}}\n"
    )
    scene = load_scene(path)
    person = LivePerson(scene.user_start)
    world = World(scene, ROBOT, person)
    for n in range(1, 30 * 12):
        person.push(tick(n), UserPose(Pose2(1.5, 2.2), 0.0))
        world.advance(tick(n))
    assert len(world.collisions.contacts) == 1
    assert world.parts["stop_line"].reason is None
    ends = world.base.pose
    assert Pose2(0.8, 1.6).distance_to(ends) > 0.1
    assert min(ends.x, ends.y) >= ROBOT.footprint.half_diagonal


def test_a_touch_that_is_over_and_reset_is_not_pushed_off_any_more():
    person = LivePerson(LAB.user_start)
    world = World(LAB, ROBOT, person)
    start = world.base.pose

    def stand(n, away):
        person.push(tick(n), UserPose(Pose2(start.x + away, start.y), 0.0))
        world.advance(tick(n))

    for n in range(1, 60):
        stand(n, 0.9 if n < 10 else 1.2)
    assert world.parts["stop_line"].reason is None  # touched, free again, reset
    assert len(world.collisions.contacts) == 1
    world.push_off()

    assert world.base.pose == start


def test_nobody_pushes_a_robot_that_is_not_touched():
    person = LivePerson(Pose2(3.0, 8.4))
    world = World(LAB, ROBOT, person)
    world.parts["stop_line"].pull("somebody pulled it")
    start = world.base.pose
    for n in range(1, 300):
        person.push(tick(n), UserPose(Pose2(3.0, 8.4), 0.0))
        world.advance(tick(n))
    assert world.base.pose == start


class OwnWheels:
    """A base of one's own, as short as can be."""

    signals = ("base.pose", "base.twist")

    def __init__(self):
        self.pose, self.twist, self.now = Pose2(0.0, 0.0), Twist2(0.0), 0

    def drive(self, command):
        self.twist = command

    def stop(self):
        self.twist = Twist2(0.0)

    def advance(self, until_ns):
        way = self.twist.vx * (until_ns - self.now) / 1e9
        self.pose, self.now = Pose2(self.pose.x + way, 0.0), until_ns

    def samples(self, now_ns):
        return [Sample("base.pose", now_ns, self.pose), Sample("base.twist", now_ns, self.twist)]


@pytest.mark.requirement(48)
def test_a_base_of_ones_own_is_guarded_too():
    world, wheels = World(None, ROBOT, None), OwnWheels()
    world.add({"base": wheels})
    cycles = world.guard.chain.cycles.reader()
    assert world.parts["base"] is world.guard
    for n in range(31):
        world.advance(tick(n))
        for part in world.parts.values():
            for sample in part.samples(world.now_ns):
                world.guard.hear(sample, world.now_ns)
        world.guard.drive(Twist2(9.0, 0.0, 0.0))
        world.guard.tick(world.now_ns)
    assert wheels.pose.x == pytest.approx(3.0)  # the robot's 3 m/s
    assert len(cycles.read_new()) >= 100
    for n in range(31, 36):
        world.advance(tick(n))
    assert wheels.twist == Twist2(0.0)
    assert cycles.read_new()[-1].reasons in {
        ("command is old",),
        ("pose or velocity of the base is not known",),
    }
