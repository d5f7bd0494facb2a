"""The simulated base with the safety chain in its loop."""

import dataclasses
import math
from dataclasses import replace
from itertools import pairwise as pairs

import pytest
from hypothesis import given, settings, strategies as st

from hw.geometry import STILL, Pose2, Pose3, Twist2
from hw.model.robot import MotionLimits, load_robot
from hw.people.live import LivePerson
from hw.people.user import open_user
from hw.safety.limits import SafetyLimits
from hw.samples import UserPose
from hw.scene.scene import load_scene
from hw.sim.mock import mock_world
from hw.sim.world import World

ROBOT = load_robot("rbkairos_ur10")
HALL = load_scene("hall")
CAPS = MotionLimits(1.0, 2.0, 5.0, base_speed=2.5, base_yaw_rate=1.5)
SAFETY = SafetyLimits.of(ROBOT, CAPS)
FREE = dataclasses.replace(SAFETY, governor=False)
CLEARANCE = SAFETY.stopping.clearance
DEEP = Pose3.from_yaw(6.0, 7.0, 1.5, 0.0)
AWAY = (30.0, 30.0)


def gap_of(pose, place):
    x, y = pose.inverse().transform(*place)
    return math.hypot(max(0.0, abs(x) - 0.565), max(0.0, abs(y) - 0.455)) - 0.5


def hear(world):
    """What the guard hears of what the parts measure."""
    for part in world.parts.values():
        for sample in part.samples(world.now_ns):
            world.guard.hear(sample, world.now_ns)


class Rig:
    """A world in a hall with a live person, ticked at 30 Hz; every record of the chain.

    `base` is what states have, `wheels` what moves.
    """

    def __init__(self, person=AWAY, safety=SAFETY, caps=CAPS):
        self.person = LivePerson(Pose2(*person))
        self.world = World(HALL, ROBOT, self.person, caps, safety=safety)
        self.base, self.wheels = self.world.guard, self.world.base
        self.cycles = self.base.chain.cycles.reader()
        self.place = person
        self.records = []
        self.n = 0
        self.ticks(10)

    def ticks(self, count, command=None, walk=(0.0, 0.0), tracked=True, each=None):
        for _ in range(count):
            now = self.n * 10**9 // 30
            self.place = (self.place[0] + walk[0] / 30, self.place[1] + walk[1] / 30)
            if tracked and self.n:
                self.person.push(now, UserPose(Pose2(*self.place), 0.0))
            if command is not None:
                self.base.drive(command(self) if callable(command) else command)
                self.base.tick(self.world.now_ns)
            self.world.advance(now)
            hear(self.world)
            self.n += 1
            self.records += self.cycles.read_new()
            if each is not None:
                each()

    @property
    def gap(self):
        return gap_of(self.wheels.pose, self.place)

    def towards(self, speed):
        """The command that goes straight to the person."""
        pose = self.wheels.pose
        look = math.atan2(self.place[1] - pose.y, self.place[0] - pose.x) - pose.yaw
        return Twist2(speed * math.cos(look), speed * math.sin(look), 0.0)


START = HALL.robot_start


def ahead(distance, side=0.0):
    """A place so far ahead of where the robot starts."""
    return START.transform(distance, side)


# ---- the loop


def test_the_chain_runs_at_least_a_hundred_times_a_second_while_the_base_moves():
    rig = Rig()
    rig.records.clear()
    rig.ticks(60, Twist2(0.5, 0.2, 0.8))
    stamps = [record.stamp_ns for record in rig.records]
    assert max(b - a for a, b in pairs(stamps)) <= 10_000_000
    assert stamps == sorted(set(stamps))


def test_a_standing_base_leaves_no_records():
    rig = Rig()
    rig.ticks(30)
    assert rig.records == []
    rig.ticks(3, Twist2(0.1, 0.0, 0.0))
    assert len(rig.records) == 12


@pytest.mark.requirement(149)
def test_a_user_lost_by_a_standing_base_latches_too():
    rig = Rig()
    rig.ticks(15, tracked=False)
    assert rig.world.parts["stop_line"].reason is None
    rig.ticks(2, tracked=False)
    assert rig.world.parts["stop_line"].reason == "tracking of the user is lost"


@pytest.mark.requirement(149)
def test_a_user_lost_by_a_standing_mock_latches_too():
    person = LivePerson(Pose2(*AWAY))
    world = mock_world(HALL, ROBOT, person, SAFETY)
    for n in range(1, 25):
        if n < 5:
            person.push(n * 33_000_000, UserPose(Pose2(*AWAY), 0.0))
        world.advance(n * 33_000_000)
        hear(world)
        world.guard.tick(world.now_ns)
    assert world.parts["stop_line"].reason == "tracking of the user is lost"
    assert world.base.pose == HALL.robot_start


def test_far_from_everybody_the_chain_changes_nothing():
    worlds = [Rig(safety=SAFETY), Rig(safety=FREE)]
    for rig in worlds:
        rig.ticks(60, Twist2(1.0, 0.4, 0.0))
        rig.ticks(90, STILL)
    guarded, free = (rig.wheels.pose for rig in worlds)
    assert guarded.distance_to(free) < 1e-9
    assert not [record for record in worlds[0].records if record.reasons and record.user_age]


@pytest.mark.requirement(50)
def test_what_the_chain_admits_is_what_the_wheels_do():
    rig = Rig(ahead(4.0))
    rig.records.clear()
    rig.ticks(200, lambda r: r.towards(1.5))
    slowed = [record for record in rig.records if record.admitted is not record.command]
    assert slowed
    for before, after in pairs(rig.records):
        speed = max(before.admitted.speed, before.command.speed - 3.0 / 100)
        assert after.command.speed <= speed + 1.0 / 100 + 1e-6


def test_a_world_has_a_chain_whether_it_is_given_limits_or_not():
    assert Rig().base.chain.limits is SAFETY
    world = World(HALL, ROBOT, LivePerson(Pose2(*AWAY)), CAPS)
    assert world.guard.chain.limits == SAFETY
    assert world.parts["base"] is world.guard
    assert world.base.chain is world.guard.chain


@pytest.mark.requirement(48, 50, 149)
@pytest.mark.parametrize("governor", [True, False])
def test_the_mock_does_exactly_as_the_chain_lets_it(governor):
    place = Pose2(*ahead(1.2)) if governor else Pose2(*AWAY)
    person = LivePerson(place)
    safety = dataclasses.replace(SAFETY, governor=governor)
    world = mock_world(HALL, ROBOT, person, safety)
    cycles = world.guard.chain.cycles.reader()
    speeds, start = [], world.base.pose
    for n in range(1, 14):
        if n < 8:
            person.push(n * 33_000_000, UserPose(place, 0.0))
        world.advance(n * 33_000_000)
        hear(world)
        world.guard.drive(Twist2(0.1 if n < 4 else 3.5, 0.0, 0.0))
        world.guard.tick(world.now_ns)
        speeds.append(round(world.base.twist.vx, 6))
        if n == 3:
            way = start.distance_to(world.base.pose)
            assert way == pytest.approx(2 * 0.033 * 0.1 * (not governor))
    if governor:
        assert set(speeds) == {0.0}
        return
    assert speeds[:7] == [0.0, 0.1, 0.1, 0.1, 2.5, 2.5, 2.5]  # the limit
    assert speeds[-2:] == [0.0, 0.0]  # the user is lost
    assert cycles.read_new()[-1].reasons == ("pose of the user is old",)


# ---- separation


@pytest.mark.requirement(50, 52)
@pytest.mark.parametrize("speed", [0.5, 1.5, 2.5])
@pytest.mark.parametrize("side", [0.0, 0.6, -1.2])
def test_a_base_driven_at_a_standing_user_stops_before_the_clearance(speed, side):
    rig = Rig(ahead(5.0, side))
    rig.ticks(300, lambda r: r.towards(speed))
    before = rig.gap
    assert CLEARANCE <= before < CLEARANCE + 0.12
    rig.ticks(30, lambda r: r.towards(speed))
    assert rig.gap == pytest.approx(before, abs=0.01)
    assert rig.world.collisions.contacts == ()


def test_without_the_chain_it_would_have_hit_them():
    rig = Rig(ahead(5.0), safety=FREE)
    rig.ticks(300, lambda r: r.towards(1.5))
    assert rig.world.collisions.contacts


@pytest.mark.requirement(50, 52)
@pytest.mark.parametrize(("turning", "excess"), [(0.0, 0.02), (1.0, 0.3)])
@settings(deadline=None, max_examples=15)
@given(
    st.floats(4.0, 6.0), st.floats(-2.0, 2.0), st.floats(0.0, 1.6), st.floats(-0.6, 0.6),
    st.lists(
        st.tuples(st.floats(0, 2.5), st.floats(-1, 1), st.floats(-1.5, 1.5), st.integers(3, 40)),
        min_size=1, max_size=5,
    ),
)  # fmt: skip
def test_however_it_is_driven_the_base_closes_the_gap_no_faster_than_the_gap_allows(
    turning, excess, x, y, pace, aim, script
):
    """By true motion, at a user who walks evenly; swinging corners are seen late."""
    rig = Rig(ahead(x, y))
    angle = math.atan2(START.y - rig.place[1], START.x - rig.place[0]) + aim
    walk = (pace * math.cos(angle), pace * math.sin(angle))
    rig.ticks(5, STILL, walk=walk)
    for speed, aside, turn, ticks in script:
        for _ in range(ticks):
            there, before = rig.place, rig.wheels.pose
            to = rig.towards(speed)
            command = Twist2(to.vx - aside * to.vy, to.vy + aside * to.vx, turning * turn)
            rig.ticks(1, command, walk=walk)
            gap = gap_of(before, there)
            closing = 30 * (gap - gap_of(rig.wheels.pose, there)) - excess
            needed = (pace + 0.5) * (0.1 + closing / 3) + closing * (0.1 + closing / 6) + 0.35
            if gap <= 0.0:
                return  # they walked into it
            assert closing <= 0.0 or gap > needed


@pytest.mark.requirement(52, 104)
def test_a_user_who_walks_up_finds_the_base_standing():
    rig = Rig(ahead(5.0))
    back = START.transform(4.0, 0.0)
    walk = (1.5 * (START.x - back[0]) / 4.0, 1.5 * (START.y - back[1]) / 4.0)
    speeds = []

    def look():
        speeds.append((rig.gap, rig.towards(1.0), rig.wheels.twist))

    rig.ticks(60, lambda r: r.towards(1.5), walk=walk, each=look)
    near = [to.vx * v.vx + to.vy * v.vy for gap, to, v in speeds if gap < CLEARANCE]
    assert near
    assert max(near) < 0.02


@pytest.mark.requirement(104, 111)
def test_a_pursuing_user_never_has_the_way_out_blocked():
    place = ahead(4.0)
    ways = []
    for safety in (SAFETY, FREE):
        rig = Rig(place, safety=safety)
        out = Twist2(-1.5, 2.0, 0.0)
        back = START.transform(1.0, 0.0)
        walk = (1.5 * (START.x - back[0]), 1.5 * (START.y - back[1]))
        rig.records.clear()
        rig.ticks(45, out, walk=walk)
        ways.append(rig.wheels.pose)
        assert all(record.admitted is record.command for record in rig.records)
    assert ways[0].distance_to(ways[1]) < 1e-9


@pytest.mark.requirement(2)
def test_a_differential_base_is_slowed_down_along_its_heading():
    rig = Rig(ahead(3.0, 0.9))
    rig.base.use("differential")
    rig.ticks(200, Twist2(1.0, 0.0, 0.0))
    assert all(record.admitted.vy == 0.0 for record in rig.records)
    assert rig.gap >= CLEARANCE
    assert START.inverse().transform(rig.wheels.pose.x, rig.wheels.pose.y)[1] == pytest.approx(0.0)


# ---- granted touches


@pytest.mark.requirement(79, 86)
def test_a_touch_that_was_asked_for_is_served_at_the_gap_of_its_pose():
    rig = Rig(ahead(3.0))
    rig.person.ask(DEEP)
    goal = Pose2(*ahead(3.0 - 0.5 - 0.565 - 0.2), START.yaw)
    rig.ticks(1)
    rig.base.grant(goal)
    speeds = []

    def approach(r):
        left = math.dist((goal.x, goal.y), (r.wheels.pose.x, r.wheels.pose.y))
        return r.towards(min(1.5, left)) if left > 0.005 else STILL

    rig.ticks(300, approach, each=lambda: speeds.append((rig.gap, rig.wheels.twist.speed)))
    assert rig.gap == pytest.approx(0.2, abs=0.01)
    # within the reach of a hand no faster than a touch may be
    assert max(speed for gap, speed in speeds if gap < CLEARANCE) <= 0.25 + 1e-9
    rig.ticks(200, lambda r: r.towards(0.5))
    assert rig.gap == pytest.approx(0.15, abs=0.01)


@pytest.mark.requirement(86)
def test_once_the_user_lets_go_the_base_comes_no_nearer():
    rig = Rig(ahead(3.0))
    rig.person.ask(DEEP)
    rig.ticks(120, lambda r: r.towards(0.5))
    assert rig.gap < CLEARANCE
    rig.person.let_go()
    rig.ticks(4, STILL)
    before = rig.gap
    rig.ticks(60, lambda r: r.towards(0.5))
    assert rig.gap == pytest.approx(before, abs=0.01)


# ---- stop line and tracking


@pytest.mark.requirement(48, 49)
def test_the_stop_line_stops_through_the_chain_too():
    rig = Rig()
    rig.ticks(60, Twist2(1.5, 0.0, 0.0))
    rig.world.parts["stop_line"].pull("button")
    rig.records.clear()
    rig.ticks(20, Twist2(1.5, 0.0, 0.0))
    assert rig.wheels.twist == STILL
    # the line brakes the wheels at once, the chain hears of it with the next sample
    brakes = [before.command.vx - after.command.vx for before, after in pairs(rig.records[:9])]
    assert brakes == pytest.approx([3.0 / 120] * 8)
    assert {record.reasons for record in rig.records[4:9]} == {("stop line",)}


@pytest.mark.requirement(149)
def test_a_base_whose_user_is_lost_stops_in_half_a_second_and_waits_for_the_operator():
    rig = Rig()
    rig.ticks(60, Twist2(1.0, 0.0, 0.0))
    line, found = rig.world.parts["stop_line"], []

    def look():
        found.append((line.reason, rig.wheels.twist))

    rig.ticks(100, Twist2(1.0, 0.0, 0.0), tracked=False, each=look)
    assert found[13] == (None, STILL)
    assert set(found[16:]) == {("tracking of the user is lost", STILL)}
    rig.ticks(45)
    assert line.reason is None
    rig.ticks(30, Twist2(1.0, 0.0, 0.0))
    assert rig.wheels.twist.speed > 0.5


@pytest.mark.requirement(6, 149)
def test_outside_the_tracked_area_the_chain_sees_nobody_either():
    lab = replace(load_scene("lab_a"), tracking="area")
    world = World(lab, ROBOT, LivePerson(Pose2(9.0, 5.0)), CAPS, safety=SAFETY)
    for n in range(1, 30):
        world.person.push(n * 10**9 // 30, UserPose(Pose2(9.0, 3.0), 0.0))
        world.advance(n * 10**9 // 30)
        hear(world)
        world.guard.drive(Twist2(0.3, 0.0, 0.0))
        world.guard.tick(world.now_ns)
    assert world.base.twist == STILL
    last = world.guard.chain.cycles.reader().read_new()[-1]
    assert last.reasons == ("no pose of the user yet",)


@pytest.mark.requirement(48)
def test_a_base_of_a_dead_planner_brakes_after_a_tenth_of_a_second():
    rig = Rig()
    rig.ticks(90, Twist2(1.5, 0.0, 0.0))
    rig.ticks(1)
    assert rig.wheels.twist.speed > 1.4
    rig.ticks(20)
    assert rig.wheels.twist == STILL
    assert any(record.reasons == ("command is old",) for record in rig.records)


def test_a_stop_that_was_told_is_gentle_and_no_old_command():
    rig = Rig()
    rig.ticks(60, Twist2(1.0, 0.0, 0.0))
    rig.base.stop()
    rig.base.tick(rig.world.now_ns)
    rig.records.clear()
    rig.ticks(20)
    assert rig.wheels.twist.speed == pytest.approx(1.0 - 20 / 30, abs=0.05)
    assert {record.reasons for record in rig.records} == {()}


# ---- a whole run


@pytest.mark.requirement(56, 67)
def test_the_same_run_gives_the_same_records():
    def run():
        scene = load_scene("lab_a")
        world = World(scene, ROBOT, open_user("cornering", scene), CAPS, safety=SAFETY)
        cycles = world.guard.chain.cycles.reader()
        for n in range(600):
            world.advance(n * 10**9 // 30)
            hear(world)
            world.guard.drive(Twist2(0.3, 0.05 * math.sin(n / 20), 0.2))
            world.guard.tick(world.now_ns)
        return cycles.read_new()

    first = run()
    assert len(first) > 2000
    assert first == run()
