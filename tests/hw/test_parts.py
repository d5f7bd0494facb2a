"""One suite for the parts of every world: simulated, mocked, physical, drivers on their fakes.

Drivers take real time and processes of their own: these runs are slow. What only a computed world
can keep, to the last bit or without devices, is `COMPUTED`.
"""

import math
from dataclasses import replace

import pytest

from hw.geometry import STILL, Pose2, Pose3, Twist2
from hw.model.robot import MotionLimits, load_robot
from hw.people.live import LivePerson
from hw.safety.limits import SafetyLimits
from hw.samples import ArmState, BumperHit, GripperState, UserPose, WrenchReading
from hw.scene.scene import load_scene
from hw.sim.mock import mock_world
from hw.sim.world import World
from tests.hw.fakes_rig import FakesRig, heard

ROBOT = load_robot("rbkairos_ur10", prop="gripped")
SCENE = load_scene("hall")
DEEP = Pose3.from_yaw(6.0, 7.0, 1.5, 0.0)
SOMEWHERE = (0.1, -1.0, 1.2, 0.3, -0.2, 0.5)


MOTION = MotionLimits(2.0, 2.0, 5.0)
NOBODY_WATCHED = replace(SafetyLimits.of(ROBOT, MOTION), watched=False)


def simulated(person, robot=ROBOT):
    return World(SCENE, robot, person, MOTION, safety=NOBODY_WATCHED)


def mocked(person, robot=ROBOT):
    return mock_world(SCENE, robot, person, NOBODY_WATCHED)


def course(goal, seconds, count=40, start=ROBOT.parked):
    """Points to a goal at even speed, from the parked arm if nothing else is said."""
    shares = [k / count for k in range(count + 1)]
    return [
        (s * seconds, tuple(a + s * (b - a) for a, b in zip(start, goal, strict=True)))
        for s in shares
    ]


class Rig:
    """A world with a live person, ticked at 30 Hz, and every sample it gave.

    Nobody tells the base about the person, so that its parts are tried and not its distance.
    """

    near, lag, by_hand = 1e-9, 0, 0

    def __init__(self, make):
        self.person = LivePerson(Pose2(7.0, 7.0))
        self.world = make(self.person)
        self.parts = self.world.parts
        self.n = 0
        self.got = []
        self.ticks(1)

    def ticks(self, count, each=None):
        for _ in range(count):
            if self.n:
                self.parts["base"].tick(self.world.now_ns)
            now = self.n * 10**9 // 30
            self.world.advance(now)
            self.got += heard(self.parts, now)
            self.n += 1
            if each is not None:
                each()
        self.parts["base"].tick(self.world.now_ns)

    def place(self, x, y, yaw=0.0):
        self.person.push(self.world.now_ns + 1, UserPose(Pose2(x, y, yaw), yaw))

    def values(self, name):
        return [sample.value for sample in self.got if sample.name == name]

    def drive(self, twist, ticks):
        self.parts["base"].drive(twist)
        self.ticks(ticks, lambda: self.parts["base"].drive(twist))

    def close(self):
        """Nothing is open."""


def until(rig, wanted, ticks=90):
    """Tick until `wanted`: in real time a busy machine may see only the last of what comes fast."""
    for _ in range(ticks):
        if wanted():
            return
        rig.ticks(1)
    assert wanted()


class PhysicalRig(Rig):
    """The same, moved by physics: it trails, and what stops swings a little."""

    near, lag = 0.01, 2

    def __init__(self):
        physics = pytest.importorskip("hw.sim.physics.physical_base", reason="needs `reference`")
        base, arm = physics.physical_robot(ROBOT, MOTION, SCENE.robot_start)
        super().__init__(
            lambda person: World(SCENE, ROBOT, person, MOTION, base, arm, safety=NOBODY_WATCHED)
        )


def on_fakes():
    return FakesRig(ROBOT, SCENE, MOTION, NOBODY_WATCHED)


ALL = [
    simulated,
    mocked,
    PhysicalRig,
    pytest.param(on_fakes, marks=(pytest.mark.slow, pytest.mark.realtime)),
]
COMPUTED = pytest.mark.parametrize("rig", [simulated, mocked], indirect=True)


@pytest.fixture(params=ALL)
def rig(request):
    whole = (on_fakes, PhysicalRig)
    made = request.param() if request.param in whole else Rig(request.param)
    yield made
    made.close()


# ---- every part


@COMPUTED
def test_samples_are_given_once(rig):
    for part in rig.parts.values():
        assert list(part.samples(rig.world.now_ns)) == []


def test_stamps_of_a_signal_never_fall(rig):
    rig.drive(Twist2(0.2, 0.0, 0.1), 20)
    rig.parts["arm"].follow(course(SOMEWHERE, 3.0))
    rig.place(5.0, 5.0)
    rig.ticks(30)
    for name in {sample.name for sample in rig.got}:
        stamps = [sample.stamp_ns for sample in rig.got if sample.name == name]
        assert stamps == sorted(stamps)


def test_no_name_is_given_by_two_parts(rig):
    names = [name for part in rig.parts.values() for name in part.signals]
    assert len(names) == len(set(names))


@COMPUTED
def test_levels_are_told_once_at_the_start(rig):
    assert rig.values("base.mode") == ["omni"]
    assert rig.values("base.refusal") == [None]
    assert rig.values("vr.haptic_request") == [None]
    assert rig.values("stop.engaged") == [None]


@COMPUTED
def test_the_same_commands_give_the_same_samples(rig, request):
    make = request.node.callspec.params["rig"]

    def story():
        other = Rig(make)
        other.drive(Twist2(0.5, 0.2, 0.3), 40)
        other.parts["arm"].follow(course(SOMEWHERE, 3.0))
        other.ticks(40)
        return other.got

    assert story() == story()


# ---- base


def test_a_base_goes_where_it_is_driven_and_reports_it(rig):
    start = rig.values("base.pose")[-1]
    rig.drive(Twist2(0.5, 0.0, 0.0), 60)
    pose, twist = rig.values("base.pose")[-1], rig.values("base.twist")[-1]
    assert twist.vx == pytest.approx(0.5, abs=rig.near)
    assert start.bearing_to(pose) == pytest.approx(0.0, abs=rig.near)
    assert 0.8 < start.distance_to(pose) <= 1.0 + rig.near


@COMPUTED
def test_a_command_takes_effect_at_the_next_tick(rig):
    rig.drive(Twist2(0.5, 0.0, 0.0), 1)
    assert rig.values("base.twist")[-1].vx > 0.0


def test_a_stopped_base_comes_to_rest(rig):
    rig.drive(Twist2(0.5, 0.3, 0.4), 30)
    rig.parts["base"].stop()
    rig.ticks(30)
    assert rig.values("base.twist")[-1] == STILL


@pytest.mark.requirement(42)
def test_a_base_without_new_commands_stops_by_itself(rig):
    rig.parts["base"].drive(Twist2(0.5, 0.0, 0.0))
    rig.ticks(5)
    assert rig.values("base.twist")[-1].vx > 0.0
    rig.ticks(30)
    assert rig.values("base.twist")[-1] == STILL


@pytest.mark.requirement(2)
def test_a_differential_base_refuses_a_sideways_command_and_does_not_slide(rig):
    rig.parts["base"].use("differential")
    with pytest.raises(ValueError, match=r"0\.4 m/s sideways; in the mode differential"):
        rig.drive(Twist2(0.3, 0.4, 0.0), 30)
    rig.drive(Twist2(0.3, 0.0, 0.0), 30)
    assert rig.values("base.mode")[-1] == "differential"
    most = rig.near if isinstance(rig, PhysicalRig) else 0.0  # wheels that give way
    assert all(abs(twist.vy) <= most for twist in rig.values("base.twist"))


@COMPUTED
@pytest.mark.parametrize("bad", [Twist2(math.nan), Twist2(0.0, math.inf), Twist2(0, 0, math.nan)])
def test_a_velocity_that_is_no_number_is_a_bug_of_the_caller(rig, bad):
    with pytest.raises(ValueError, match="finite"):
        rig.parts["base"].drive(bad)


# ---- arm


def test_an_arm_arrives_and_reports_it(rig):
    number = rig.parts["arm"].follow(course(SOMEWHERE, 3.0))
    rig.ticks(85)
    state = rig.values("arm.joints")[-1]
    assert (state.moving, state.course, state.refused) == (True, number, None)
    rig.ticks(35)
    state = rig.values("arm.joints")[-1]
    assert (state.moving, state.course, state.refused) == (False, number, None)
    assert state.velocities == pytest.approx((0.0,) * 6, abs=0.1 * rig.near)
    assert state.joints == pytest.approx(SOMEWHERE, abs=0.1 * rig.near)


@pytest.mark.requirement(45)
def test_a_stopped_arm_rests_within_a_fifth_of_a_second_and_stays(rig):
    rig.parts["arm"].follow(course(SOMEWHERE, 3.0))
    rig.ticks(20)
    rig.parts["arm"].stop()
    rig.ticks(6 + rig.lag)
    rest = rig.values("arm.joints")[-1]
    rig.ticks(60)
    assert rig.values("arm.joints")[-1].joints == pytest.approx(rest.joints, abs=0.1 * rig.near)
    assert not rest.moving


@COMPUTED
@pytest.mark.requirement(45)
def test_an_arm_is_where_its_course_says_at_every_tick(rig):
    points = course(SOMEWHERE, 4.0)
    begin = rig.world.now_ns
    number = rig.parts["arm"].follow(points)
    for _ in range(110):
        rig.ticks(1)
        share = (rig.world.now_ns - begin) * 1e-9 / 4.0
        wanted = [a + share * (b - a) for a, b in zip(points[0][1], SOMEWHERE, strict=True)]
        assert rig.values("arm.joints")[-1].joints == pytest.approx(wanted, abs=1e-9)
        assert rig.values("arm.joints")[-1].moving
    rig.ticks(20)
    assert rig.values("arm.joints")[-1] == ArmState(points[-1][1], (0.0,) * 6, course=number)


@pytest.mark.requirement(45)
def test_an_arm_stopped_on_its_course_rests_within_a_fifth_of_a_second_on_it(rig):
    points = course(SOMEWHERE, 3.0)
    rig.parts["arm"].follow(points)
    rig.ticks(40)
    rig.parts["arm"].stop()
    rig.ticks(6 + rig.lag)
    rest = rig.values("arm.joints")[-1]
    rig.ticks(60)
    assert rig.values("arm.joints")[-1].joints == pytest.approx(rest.joints, abs=0.1 * rig.near)
    assert not rest.moving
    start = points[0][1]
    share = (rest.joints[0] - start[0]) / (SOMEWHERE[0] - start[0])
    on_it = [a + share * (b - a) for a, b in zip(start, SOMEWHERE, strict=True)]
    assert rest.joints == pytest.approx(on_it, abs=rig.near)
    assert 0.4 < share < 0.55


@pytest.mark.requirement(45, 51)
def test_a_paced_arm_follows_its_course_more_slowly_and_at_full_speed_again(rig):
    points = course(SOMEWHERE, 3.0)
    start = points[0][1]

    def share():
        at = rig.values("arm.joints")[-1].joints
        return (at[0] - start[0]) / (SOMEWHERE[0] - start[0])

    arm = rig.parts["arm"]
    number = arm.follow(points)
    rig.ticks(15 + rig.lag)
    arm.pace(0.25, 0.4, 0.3)
    rig.ticks(9 + rig.lag)  # it has slowed down
    slow = share()
    rig.ticks(30)
    slowly = share() - slow
    assert rig.values("arm.joints")[-1].scaling == pytest.approx(0.25, abs=0.02)
    arm.pace(1.0)
    rig.ticks(9 + rig.lag)
    fast = share()
    rig.ticks(15)
    assert slowly == pytest.approx(0.25 / 3.0, rel=0.1)
    assert share() - fast == pytest.approx(0.5 / 3.0, rel=0.1)
    on_it = [a + share() * (b - a) for a, b in zip(start, SOMEWHERE, strict=True)]
    assert rig.values("arm.joints")[-1].joints == pytest.approx(on_it, abs=rig.near)
    rig.ticks(75 + rig.lag)
    state = rig.values("arm.joints")[-1]
    assert (state.moving, state.course, state.refused, state.scaling) == (False, number, None, 1.0)
    assert state.joints == pytest.approx(SOMEWHERE, abs=0.1 * rig.near)


@pytest.mark.requirement(45)
def test_a_paced_arm_stops_as_fast_and_the_next_course_has_its_full_speed(rig):
    arm = rig.parts["arm"]
    arm.follow(course(SOMEWHERE, 3.0))
    rig.ticks(15 + rig.lag)
    arm.pace(0.5)
    rig.ticks(3)
    arm.stop()
    arm.pace(1.0)  # a stop stays a stop
    rig.ticks(6 + rig.lag)
    rest = rig.values("arm.joints")[-1]
    rig.ticks(20)
    assert not rest.moving
    assert rig.values("arm.joints")[-1].joints == pytest.approx(rest.joints, abs=0.1 * rig.near)
    number = arm.follow(course(SOMEWHERE, 3.0, start=rest.joints))
    rig.ticks(100 + 2 * rig.lag)
    state = rig.values("arm.joints")[-1]
    assert (state.moving, state.course) == (False, number)
    assert state.joints == pytest.approx(SOMEWHERE, abs=0.1 * rig.near)


@pytest.mark.parametrize("share", [-0.1, 1.1, math.nan])
def test_a_pace_that_is_none_is_a_bug_of_the_caller(rig, share):
    with pytest.raises(ValueError, match="between 0 and 1"):
        rig.parts["arm"].pace(share)


def test_an_arm_that_moves_or_stands_elsewhere_does_not_follow(rig):
    elsewhere = [(0.0, SOMEWHERE), (1.0, ROBOT.parked)]
    with_slack = [(0.0, SOMEWHERE), (9.0, ROBOT.parked)]
    with pytest.raises(ValueError, match="rad/s"):
        rig.parts["arm"].follow(elsewhere)
    number = rig.parts["arm"].follow(with_slack)
    rig.ticks(10)
    state = rig.values("arm.joints")[-1]
    assert state.joints == pytest.approx(ROBOT.parked, abs=0.1 * rig.near)
    assert not state.moving
    assert state.course == number
    assert "stands" in state.refused
    assert rig.parts["arm"].follow(course(SOMEWHERE, 4.0)) == number + 1
    rig.ticks(10)
    assert rig.values("arm.joints")[-1].refused is None
    assert rig.parts["arm"].follow(course(SOMEWHERE, 4.0)) == number + 2
    rig.ticks(10)
    rest = rig.values("arm.joints")[-1]
    assert (rest.moving, rest.course, rest.refused) == (False, number + 2, "the arm moves")
    assert rest.joints != pytest.approx(SOMEWHERE, abs=0.1)


@COMPUTED
@pytest.mark.parametrize(
    "points",
    [
        [],
        [(0.1, SOMEWHERE)],
        [(0.0, SOMEWHERE), (0.0, SOMEWHERE)],
        [(0.0, SOMEWHERE), (math.nan, SOMEWHERE)],
        [(0.0, SOMEWHERE), (1.0, (0.0,) * 5)],
        [(0.0, (0.0, 0.0, 4.0, 0.0, 0.0, 0.0))],
        [(0.0, (math.nan,) * 6)],
        [(0.0, (0.0,) * 6), (0.1, (0.0, 1.0, 0.0, 0.0, 0.0, 0.0))],
    ],
)
def test_a_course_no_arm_can_follow_is_a_bug_of_the_caller(rig, points):
    with pytest.raises(ValueError, match="arm:"):
        rig.parts["arm"].follow(points)


# ---- gripper and wrench


@COMPUTED
@pytest.mark.requirement(150)
def test_a_robot_has_the_fingers_and_the_sensor_of_its_prop(rig, request):
    bare = load_robot("rbkairos_ur10")
    make = request.node.callspec.params["rig"]
    parts = make(LivePerson(Pose2(7.0, 7.0)), bare).parts
    assert not {"gripper", "wrench"} & set(parts)
    assert rig.values("gripper.state")[-1] == GripperState(0.05, holding=True)
    assert rig.values("wrench.reading")[-1] == WrenchReading((0, 0, 0), (0, 0, 0))


@COMPUTED
@pytest.mark.requirement(150)
def test_fingers_open_let_go_and_close_on_what_is_between_them(rig):
    gripper = rig.parts["gripper"]
    gripper.open_to(0.08)
    rig.ticks(20)
    assert rig.values("gripper.state")[-1] == GripperState(0.08, holding=False)
    gripper.open_to(0.0)
    rig.ticks(30)
    assert rig.values("gripper.state")[-1] == GripperState(0.05, holding=True)
    gripper.open_to(0.085)
    rig.ticks(20)
    gripper.between = None
    gripper.open_to(0.0)
    rig.ticks(30)
    assert rig.values("gripper.state")[-1] == GripperState(0.0, holding=False)


@COMPUTED
@pytest.mark.requirement(150)
def test_fingers_open_as_wide_as_they_go_and_say_once_they_rest(rig):
    rig.parts["gripper"].open_to(None)
    seen = len(rig.values("gripper.state"))
    rig.ticks(20)
    told = rig.values("gripper.state")[seen:]
    assert told[-1] == GripperState(0.085)
    rested = next(n for n, state in enumerate(told) if not state.moving)
    assert all(state == told[-1] for state in told[rested:])


@COMPUTED
@pytest.mark.requirement(48, 150)
def test_stopped_fingers_stay_and_a_pulled_stop_line_stops_them(rig):
    rig.parts["gripper"].open_to(0.085)
    rig.parts["gripper"].stop()
    rig.ticks(20)
    assert rig.values("gripper.state")[-1].opening == 0.05
    rig.parts["stop_line"].pull("button")
    rig.ticks(1)
    rig.parts["gripper"].open_to(0.085)
    rig.ticks(20)
    assert rig.values("gripper.state")[-1] == GripperState(0.05, holding=True)


@pytest.mark.requirement(48, 150)
def test_fingers_on_their_way_stop_with_the_stop_line():
    rig = Rig(simulated)
    rig.parts["gripper"].open_to(0.085)
    rig.ticks(3)
    rig.parts["stop_line"].pull("button")
    rig.ticks(2)
    stopped = rig.values("gripper.state")[-1]
    rig.ticks(20)
    assert 0.05 < stopped.opening < 0.08
    assert rig.values("gripper.state")[-1] == stopped


@COMPUTED
@pytest.mark.parametrize("opening", [-0.01, 0.09, math.nan])
def test_an_opening_that_fingers_cannot_have_is_a_bug_of_the_caller(rig, opening):
    with pytest.raises(ValueError, match="gripper: an opening"):
        rig.parts["gripper"].open_to(opening)


@COMPUTED
@pytest.mark.requirement(150)
def test_the_sensor_reads_what_presses_less_what_it_was_zeroed_at(rig):
    wrench = rig.parts["wrench"]
    wrench.press(WrenchReading((0.0, 0.0, 17.0), (0.5, 0.0, 0.0)))
    rig.ticks(1)
    assert rig.values("wrench.reading")[-1] == WrenchReading((0.0, 0.0, 17.0), (0.5, 0.0, 0.0))
    wrench.zero()
    wrench.press(WrenchReading((0.0, 3.0, 20.0), (0.5, 0.0, 0.25)))
    rig.ticks(1)
    assert rig.values("wrench.reading")[-1] == WrenchReading((0.0, 3.0, 3.0), (0.0, 0.0, 0.25))
    with pytest.raises(ValueError, match="finite"):
        wrench.press(WrenchReading((math.nan, 0.0, 0.0), (0.0, 0.0, 0.0)))


# ---- person and virtual reality


@COMPUTED
@pytest.mark.requirement(12, 24)
def test_tracking_hands_on_each_pose_once_and_is_silent_without(rig):
    rig.ticks(5)
    assert rig.values("user.pose") == []
    rig.place(5.0, 5.0)
    rig.ticks(5)
    assert [pose.body for pose in rig.values("user.pose")] == [Pose2(5.0, 5.0)]


@pytest.mark.requirement(15)
def test_a_request_is_a_level_and_its_end_a_release(rig):
    rig.person.ask(DEEP)
    until(rig, lambda: rig.values("vr.haptic_request")[-1] is not None)
    rig.person.let_go()
    until(rig, lambda: rig.values("vr.release"))
    rig.ticks(10)
    assert rig.values("vr.haptic_request") == [None, DEEP, None]
    assert rig.values("vr.release") == [True]


@pytest.mark.requirement(114, 115)
def test_a_person_who_is_shown_the_robot_is_ready_after_each_half_second_of_standing(rig):
    rig.ticks(30)
    assert rig.values("vr.restart") == []
    rig.parts["vr"].inform(True)
    rig.ticks(14)
    assert rig.values("vr.restart") == []
    rig.ticks(8 + rig.lag)
    assert rig.values("vr.restart") == [True]
    rig.ticks(15)
    assert rig.values("vr.restart") == [True, True]


def test_the_stop_sign_is_hidden_no_sooner_than_it_was_to_be_shown_for(rig):
    rig.parts["vr"].inform(True, least=2.0)
    rig.ticks(3)
    rig.parts["vr"].inform(False)
    rig.ticks(40)
    before = len(rig.values("vr.restart"))
    assert before > 0
    rig.ticks(60 + rig.lag)
    after = len(rig.values("vr.restart"))
    rig.ticks(40)
    assert len(rig.values("vr.restart")) == after


def test_a_person_who_walks_on_is_not_ready(rig):
    rig.parts["vr"].inform(True)
    for i in range(60):
        rig.place(7.0 + 0.02 * i, 7.0)
        rig.ticks(1)
    assert rig.values("vr.restart") == []


@COMPUTED
@pytest.mark.requirement(7, 14)
def test_head_and_hands_are_handed_on_with_the_body(rig):
    hand = Pose3.from_yaw(5.3, 5.0, 1.2, 0.0)
    pose = UserPose(Pose2(5.0, 5.0), 0.4, Pose3.from_yaw(5.0, 5.0, 1.7, 0.4), hand, hand)
    rig.person.push(rig.world.now_ns + 1, pose)
    rig.ticks(1)
    assert rig.values("user.pose") == [pose]


# ---- stop line, bumper, operator


@pytest.mark.requirement(48)
def test_a_pulled_stop_line_stops_everything_and_takes_no_commands(rig):
    rig.drive(Twist2(1.0, 0.0, 0.5), 30)
    number = rig.parts["arm"].follow(course(SOMEWHERE, 5.0))
    rig.ticks(10)
    rig.parts["stop_line"].pull("button")
    rig.parts["stop_line"].pull("another")
    rig.ticks(1 + rig.lag)
    assert rig.values("arm.joints")[-1].course == number
    assert "stop line" in rig.values("arm.joints")[-1].refused
    moving_for = 0
    for _ in range(22):
        rig.parts["base"].drive(Twist2(1.0, 0.0, 0.0))
        rig.ticks(1)
        here = rig.values("arm.joints")[-1].joints
        rig.parts["arm"].follow([(0.0, here), (9.0, SOMEWHERE)])
        moving_for += rig.values("base.twist")[-1] != STILL
    assert moving_for <= 15
    assert rig.values("stop.engaged") == [None, "button"]
    assert rig.values("base.refusal")[-1] == "the stop line is pulled"
    state = rig.values("arm.joints")[-1]
    assert (state.moving, state.course) == (False, number + 21)
    assert "stop line" in state.refused
    assert state.joints != pytest.approx(SOMEWHERE, abs=0.1)


def test_the_operator_acknowledges_after_a_second_and_nothing_moves_before_a_command(rig):
    rig.parts["stop_line"].pull("button")
    rig.ticks(29)
    assert rig.values("operator.acknowledge") == []
    rig.ticks(30)
    assert rig.values("operator.acknowledge") == [True]
    assert rig.values("stop.engaged") == [None, "button", None]
    assert rig.values("base.twist")[-1] == STILL


def test_the_operator_acknowledges_a_reported_fault(rig):
    rig.parts["operator"].report("state raised")
    rig.ticks(60)
    assert rig.values("operator.acknowledge") == [True]


@pytest.mark.requirement(4, 5, 49)
def test_a_touch_of_the_foam_is_an_event_stops_the_base_and_stays_latched_while_it_lasts(rig):
    start = rig.values("base.pose")[-1]
    x, y = start.transform(1.6, 0.0)
    rig.place(x, y)
    rig.drive(Twist2(0.8, 0.0, 0.0), 45)
    hits = rig.values("bumper.hit")
    assert hits == [BumperHit(pytest.approx(0.0, abs=0.05))]
    assert len(rig.world.collisions.contacts) == 1
    rig.ticks(120)
    assert rig.values("operator.acknowledge") == []
    assert rig.values("stop.engaged")[-1].startswith("bumper")
    assert rig.values("base.twist")[-1] == STILL
    rig.place(12.0, 2.0)
    rig.ticks(60 + rig.by_hand)
    assert rig.values("stop.engaged")[-1] is None
    assert rig.values("bumper.hit") == hits


@pytest.mark.requirement(4)
def test_a_wall_touches_the_foam_too_and_is_not_driven_through(rig):
    rig.parts["base"].drive(STILL)
    rig.place(12.0, 2.0)
    turned = rig.values("base.pose")[-1].yaw
    toward_wall = Twist2(-1.0, 0.0, 0.0).rotated(-turned)
    rig.drive(toward_wall, 80)
    assert rig.world.collisions.wall_hits >= 1
    assert rig.values("bumper.hit")
    for pose in rig.values("base.pose"):
        corners = [pose.transform(a, b) for a in (-0.565, 0.565) for b in (-0.455, 0.455)]
        assert all(SCENE.room.is_free(*corner) for corner in corners)


@COMPUTED
def test_while_nothing_changes_parts_give_the_same_values_again(rig):
    still = Twist2(0.0, 0.0, 0.0)
    rig.ticks(30, lambda: rig.parts["base"].drive(still))
    seen = {}
    for sample in rig.got:
        seen.setdefault(sample.name, []).append(sample.value)
    assert {"base.pose", "base.twist", "arm.joints", "gripper.state", "wrench.reading"} <= set(seen)
    for name, values in seen.items():
        assert all(value is values[0] for value in values), name
