"""The cycle of the chain in front of real wheels: what it hears, when it stops, how it resets."""

import dataclasses
import math

import pytest
from hypothesis import given, settings, strategies as st

from hw.drivers.chain.chain_settings import ChainSettings, ObserverSettings
from hw.drivers.chain.cycle import ChainCycle
from hw.geometry import STILL, Pose2, Pose3, Twist2
from hw.ipc.datagrams import Datagram, Door
from hw.model.robot import MotionLimits, load_robot
from hw.model.tracking import Tracking
from hw.safety.limits import SafetyLimits
from hw.samples import PoseSigma, TrackerPose, UserPose
from tests.hw.drivers.wheels import READY_AFTER, Wheels

MS = 1_000_000
ROBOT = load_robot("rbkairos_ur10")
TRACKING = Tracking.of(ROBOT.sensing)
MOUNT = TRACKING.mounts["front_tracker"]
MOTION = MotionLimits(1.0, 2.0, base_speed=2.5, base_yaw_rate=1.5)
LIMITS = SafetyLimits.of(ROBOT, MOTION)
CYCLE = 10 * MS
AHEAD = Twist2(0.5, 0.0, 0.0)
SIGMA = PoseSigma(0.01, 0.01)
DEEP = Pose3(0.0, 0.0, 1.0)


class Sent:
    """Keeps what would be sent."""

    def __init__(self):
        self.all = []

    def send(self, name, stamp_ns, value=None):
        self.all.append((name, value))

    def values(self, name):
        return [value for n, value in self.all if n == name]


class Rig:
    """A chain in cycles of 10 ms; who speaks is said by `speaks`, each as often as agreed."""

    def __init__(self, arm=True, observer=True, limits=LIMITS, base=ROBOT.base):
        self.speaks = {"engine", "estimate", "arm", "observer", "vr", "user"}
        settings = ChainSettings(
            address=("127.0.0.1", 0),
            secret=b"",
            engine=Door("127.0.0.1", 0, ""),
            hardware=("", "", {}),
            model=base,
            motion=MOTION,
            safety=limits,
            tracking=TRACKING,
            arm=arm,
            observer=ObserverSettings(("127.0.0.1", 0), b"") if observer else None,
        )
        self.wheels, self.sent = Wheels(ROBOT.base), Sent()
        self.chain = ChainCycle(settings, self.wheels, self.sent)
        self.command = AHEAD
        self.user = Pose2(40.0, 0.0)
        self.asked = None
        self.now, self.count, self.numbers = 10**12, 0, 0

    def tell(self, source, name, value=None, stamp=None):
        self.numbers += 1
        stamp = self.now if stamp is None else stamp
        self.chain.receive(Datagram(source, self.numbers, name, stamp, value), self.now)

    def order(self, name, value):
        self.chain.order(self.now, name, value)

    def speak(self):
        n, odometry = self.count, self.wheels.odometry
        if "engine" in self.speaks and n % 3 == 0:
            self.tell("engine", "command", self.command)
        if "estimate" in self.speaks and n % 3 == 0 and odometry is not None:
            self.tell("engine", "estimate", (odometry[1].pose, SIGMA), odometry[0])
        if "arm" in self.speaks and n % 2 == 0:
            self.tell("arm", "arm.link", None)
        if "observer" in self.speaks and n % 10 == 0:
            self.tell("observer", "observer.here", True)
        if "vr" in self.speaks and n % 10 == 0:
            self.tell("vr", "vr.link", "up")
            self.tell("vr", "vr.haptic_request", self.asked)
        if "user" in self.speaks:
            self.tell("vr", "user.pose", UserPose(self.user, 0.0))

    def go(self, cycles=1):
        for _ in range(cycles):
            self.now += CYCLE
            self.speak()
            self.chain.cycle(self.now)
            self.count += 1
        return self

    def until_stopped(self, most=300):
        """So many cycles until it has stopped for good."""
        for cycle in range(1, most + 1):
            if self.go().chain.stopped is not None:
                return cycle
        raise AssertionError("it goes on and on")

    def reset(self, most=60):
        """Why it stays stopped; None: it does not."""
        before = len(self.sent.values("chain.reset"))
        self.order("reset", 7)
        for _ in range(most):
            answers = self.sent.values("chain.reset")[before:]
            if answers:
                ((token, why),) = answers
                assert token == 7
                return why
            self.go()
        raise AssertionError("no answer")

    def records(self):
        return self.chain.chain.cycles.reader().read_new()


@pytest.fixture
def rig():
    return Rig().go(120)


def stays_stopped(rig, reason, cycles=200):
    """It stands, and nothing that it is told moves it."""
    rig.go(40)
    where = rig.wheels.odometry[1].pose
    rig.go(cycles)
    assert rig.chain.stopped == reason
    assert rig.wheels.told == STILL
    assert rig.wheels.odometry[1].pose == where


def test_it_drives_as_it_is_told_within_ramps():
    rig = Rig().go(20)
    assert 0.0 < rig.wheels.told.vx < AHEAD.vx
    rig.go(100)
    assert rig.wheels.told == AHEAD
    rises = [b.command.vx - a.command.vx for a, b in zip(rig.records(), rig.records()[1:])]  # noqa: B905
    assert max(rises) <= MOTION.base_acceleration * 0.01 * 1.001


def test_a_standing_base_has_no_records(rig):
    rig.command = None
    rig.go(100)
    count = rig.chain.chain.cycles.written
    rig.go(50)
    assert rig.chain.chain.cycles.written == count
    assert rig.chain.stopped is None


# -- who has to be heard


@pytest.mark.parametrize("who", ["arm", "observer"])
def test_nothing_moves_before_everybody_was_heard_and_nothing_latches(who):
    rig = Rig()
    rig.speaks.remove(who)
    rig.go(200)
    assert rig.wheels.told == STILL
    assert rig.chain.stopped is None
    assert "has not been heard" in rig.chain.awaited
    rig.speaks.add(who)
    rig.go(100)
    assert rig.wheels.told == AHEAD


@pytest.mark.requirement(55)
@pytest.mark.parametrize(
    ("who", "gate_ms", "every_ms", "reason"),
    [
        ("arm", 50, 20, "the link to the arm is silent"),
        ("observer", 500, 100, "the observer is silent"),
    ],
)
def test_who_falls_silent_stops_the_base_for_good(rig, who, gate_ms, every_ms, reason):
    rig.speaks.remove(who)
    cycles = rig.until_stopped()
    assert gate_ms - every_ms <= cycles * 10 <= gate_ms + 20
    assert rig.chain.stopped == reason
    assert rig.wheels.stopped
    stays_stopped(rig, reason)
    assert rig.reset() == reason
    rig.speaks.add(who)
    rig.go(10)
    stays_stopped(rig, reason)
    assert rig.reset() is None
    rig.go(100)
    assert rig.wheels.told == AHEAD


def test_a_connection_without_arm_or_observer_needs_none():
    rig = Rig(arm=False, observer=False)
    rig.speaks -= {"arm", "observer"}
    rig.go(120)
    assert rig.wheels.told == AHEAD


def test_a_fault_of_the_arm_stops_the_base_in_the_next_cycle(rig):
    rig.tell("arm", "arm.link", "protective stop")
    rig.speaks.remove("arm")
    assert rig.until_stopped() == 1
    assert rig.chain.stopped == "arm: protective stop"


def test_an_arm_that_is_not_ready_yet_is_awaited():
    rig = Rig()
    rig.speaks.remove("arm")
    for _ in range(100):
        rig.tell("arm", "arm.link", "it is switched off")
        rig.go()
    assert rig.wheels.told == STILL
    assert rig.chain.stopped is None
    assert rig.chain.awaited == "arm: it is switched off"
    rig.speaks.add("arm")
    rig.go(100)
    assert rig.wheels.told == AHEAD


def test_wheels_that_are_not_ready_yet_are_awaited_and_begin_with_their_ramp():
    rig = Rig()
    rig.wheels.stopped = True
    rig.go(100)
    assert rig.wheels.told == STILL
    assert rig.chain.stopped is None
    assert rig.chain.awaited == "the wheels are not ready"
    rig.wheels.stopped = False
    rig.go(2)
    assert 0.0 < rig.wheels.told.vx <= 0.021


def test_a_word_of_the_arm_with_an_old_stamp_does_not_count(rig):
    rig.speaks.remove("arm")
    for _ in range(8):
        rig.tell("arm", "arm.link", None, rig.now - 60 * MS)
        rig.go()
    assert rig.chain.stopped == "the link to the arm is silent"


@pytest.mark.requirement(41, 149)
def test_commands_that_get_old_slow_the_base_down_and_stop_it_within_a_tenth_of_a_second(rig):
    rig.speaks.remove("engine")
    start = rig.now
    rig.go(12)
    refused = [r for r in rig.records() if "command is old" in r.reasons]
    assert 60 * MS <= refused[0].stamp_ns - start <= 100 * MS
    rig.go(40)
    assert rig.wheels.told == STILL
    assert rig.chain.stopped is None
    rig.speaks.add("engine")
    rig.go(100)
    assert rig.wheels.told == AHEAD


def test_a_command_ahead_of_the_clock_moves_nothing():
    rig = Rig()
    rig.speaks.remove("engine")
    for _ in range(100):
        rig.tell("engine", "command", AHEAD, rig.now + 2000 * MS)
        rig.go()
    assert rig.wheels.told == STILL


@pytest.mark.parametrize("value", [Twist2(math.nan), Twist2(math.inf), (0.5, 0.0, 0.0), "go", 3.0])
def test_a_command_that_is_no_velocity_is_left_out(value):
    rig = Rig()
    rig.command = value
    rig.go(60)
    assert rig.wheels.told == STILL
    assert rig.chain.stopped is None


def test_a_command_that_is_no_velocity_does_not_take_the_place_of_one(rig):
    rig.speaks.remove("engine")
    rig.tell("engine", "command", Twist2(math.nan))
    rig.go()
    assert rig.wheels.told == AHEAD


@pytest.mark.parametrize("source", ["vr", "arm", "observer", "world", "chain"])
def test_only_the_engine_commands_and_resets(source):
    rig = Rig()
    rig.speaks.remove("engine")
    for _ in range(60):
        rig.tell(source, "command", AHEAD)
        rig.go()
    assert rig.wheels.told == STILL
    rig.order("pull", "console")
    for name in (source, "engine"):  # not even the engine, other than by the pipe
        rig.tell(name, "reset", 7)
    rig.go(60)
    assert rig.chain.stopped == "console"


def test_a_grant_that_is_nowhere_is_none(rig, monkeypatch):
    granted = []
    monkeypatch.setattr(rig.chain.chain, "grant", granted.append)
    for pose in (Pose2(math.nan, 0.0), Pose2(0.0, math.inf), Twist2(0.1, 0.0, 0.0), 1, "x", ()):
        rig.tell("engine", "grant", pose)
    rig.tell("engine", "grant", Pose2(1.0, 2.0))
    assert granted == [Pose2(1.0, 2.0)]


def test_a_mistake_in_taking_a_datagram_stops_the_wheels_and_ends_nothing(rig, monkeypatch):
    def mistaken(pose):
        raise AttributeError("no pose")

    monkeypatch.setattr(rig.chain.chain, "grant", mistaken)
    rig.go(60)
    rig.tell("engine", "grant", Pose2(0.0, 0.0))
    assert rig.chain.stopped == "engine grant: AttributeError: no pose"
    stays_stopped(rig, rig.chain.stopped)
    assert rig.reset() is None


# -- the person


@pytest.mark.requirement(48, 149)
def test_poses_of_the_user_that_get_late_slow_down_then_stop_then_latch(rig):
    rig.speaks.remove("user")
    cycles = rig.until_stopped()
    assert 48 <= cycles <= 52
    assert rig.chain.stopped == "tracking of the user is lost"
    records = [r for r in rig.records() if (r.user_age or 0.0) > 0.05]
    late = [r for r in records if r.user_age <= 0.15]
    old = [r for r in records if r.user_age > 0.15 and r.reasons != ("latched",)]
    assert len(late) >= 9
    assert len(old) >= 30
    assert {r.reasons for r in old} == {("pose of the user is old",)}
    assert all(r.admitted == STILL for r in old)
    stays_stopped(rig, rig.chain.stopped)
    assert rig.reset() == "tracking of the user is lost"
    rig.speaks.add("user")
    rig.go(2)
    assert rig.reset() is None


@pytest.mark.parametrize(
    "pose", [UserPose(Pose2(math.nan, 0.0), 0.0), Pose2(1.0, 0.0), None, "there"]
)
def test_a_pose_of_the_user_that_is_none_does_not_count(rig, pose):
    rig.speaks.remove("user")
    for _ in range(20):
        rig.tell("vr", "user.pose", pose)
        rig.go()
    assert "pose of the user is old" in rig.records()[-1].reasons


def test_the_age_of_a_pose_counts_from_its_stamp(rig):
    rig.speaks.remove("user")
    for _ in range(30):
        rig.tell("vr", "user.pose", UserPose(rig.user, 0.0), rig.now - 200 * MS)
        rig.go()
    assert rig.records()[-1].reasons == ("pose of the user is old",)


def test_a_tracker_that_is_nowhere_does_not_count(rig):
    seen = TrackerPose("front_tracker", Pose3(math.nan, 0.0, 0.0))
    rig.tell("vr", "rover.tracker", seen)
    rig.go()
    assert rig.wheels.told == AHEAD


def near_the_user(**given):
    rig = Rig(**given)
    rig.user = Pose2(1.3, 0.0)
    rig.command = Twist2(0.2, 0.0, 0.0)
    rig.asked = DEEP
    return rig


def granted(rig):
    return any("granted touch" in record.reasons for record in rig.records()[-20:])


def test_a_touch_that_is_asked_for_is_let_through():
    assert granted(near_the_user().go(100))


@pytest.mark.parametrize("deep", [None, Pose3(math.nan, 0.0, 1.0), "here", True])
def test_what_is_no_pose_asks_for_nothing(deep):
    rig = near_the_user()
    rig.asked = deep
    assert not granted(rig.go(100))


@pytest.mark.parametrize("how", ["silent", "down", "no request"])
def test_without_a_link_to_the_virtual_world_no_touch_is_let_through(how):
    rig = near_the_user().go(60)
    assert granted(rig)
    rig.speaks.remove("vr")
    for _ in range(70):
        if how == "down" and rig.count % 10 == 0:
            rig.tell("vr", "vr.link", "no client")
            rig.tell("vr", "vr.haptic_request", DEEP)
        if how == "no request" and rig.count % 10 == 0:
            rig.tell("vr", "vr.link", "up")
        rig.go()
    assert not granted(rig)


def test_the_grant_says_how_near():
    rig = near_the_user()
    rig.tell("engine", "grant", Pose2(0.1, 0.0))
    rig.go(300)
    with_grant = rig.wheels.odometry[1].pose.x
    assert with_grant < near_the_user().go(300).wheels.odometry[1].pose.x - 0.02


def test_who_does_not_know_where_the_base_is_moves_nothing(rig):
    rig.speaks.remove("estimate")
    rig.tell("engine", "estimate", None)
    rig.go(40)
    assert rig.wheels.told == STILL
    assert rig.records()[-1].reasons == ("pose or velocity of the base is not known",)


@pytest.mark.requirement(8)
@pytest.mark.parametrize("tracker", ["front_tracker", "nobody's"])
def test_a_tracker_on_the_rover_says_where_the_base_is(tracker):
    rig = Rig()
    rig.speaks.remove("estimate")
    for _ in range(100):
        rig.go()
        pose = rig.wheels.odometry[1].pose
        seen = Pose3.from_yaw(pose.x, pose.y, 0.0, pose.yaw) @ MOUNT
        rig.tell("vr", "rover.tracker", TrackerPose(tracker, seen))
    assert (rig.wheels.told == AHEAD) is (tracker == "front_tracker")


# -- the wheels


@pytest.mark.requirement(4, 5)
def test_a_touch_of_the_foam_stops_the_wheels_within_two_cycles(rig):
    rig.wheels.order("hit", 0.3)
    assert rig.until_stopped() <= 2
    assert rig.wheels.stopped
    assert rig.wheels.told == STILL
    assert [hit.bearing for hit in rig.sent.values("bumper.hit")] == [0.3]
    stays_stopped(rig, "bumper")


def test_a_fault_of_a_drive_stops_the_wheels_and_stays_until_its_cause_is_gone(rig):
    rig.wheels.order("fault", "drive 3: EMCY 0x7500")
    assert rig.until_stopped() <= 2
    assert rig.wheels.told == STILL
    stays_stopped(rig, "drive 3: EMCY 0x7500")
    assert rig.reset() == "drive 3: EMCY 0x7500"
    rig.wheels.order("fault", None)
    rig.go(50)
    stays_stopped(rig, "drive 3: EMCY 0x7500")
    assert rig.reset() is None
    rig.go(100)
    assert rig.wheels.told == AHEAD


def test_wheels_that_tell_nothing_are_told_to_stand(rig):
    rig.wheels.order("mute", True)
    rig.go(20)
    assert rig.records()[-1].admitted == STILL
    rig.go(30)
    assert rig.wheels.told == STILL


def test_wheels_that_run_on_are_stopped_for_good(rig):
    rig.wheels.order("runs_on", True)
    rig.speaks.remove("engine")
    rig.until_stopped()
    assert rig.chain.stopped == "the base does not stop"
    assert rig.wheels.stopped
    rig.go(100)
    assert rig.reset() == "the base does not stop"


def test_a_driver_that_raises_stops_the_wheels_and_the_cycles_go_on(rig):
    rig.wheels.order("raises", True)
    assert rig.until_stopped() == 1
    count = rig.wheels.cycles
    rig.go(10)
    assert rig.wheels.cycles == count + 10
    assert rig.chain.stopped == "wheels: OSError: bus off"


def test_wheels_that_refuse_to_stop_end_neither_chain_nor_reset(rig):
    def refuse():
        raise OSError("bus off")

    rig.order("pull", "console")
    rig.go(50)
    rig.wheels.order("stop", refuse)
    rig.order("reset", 7)
    rig.order("pull", "observer")
    assert rig.sent.values("chain.reset") == [(7, "observer")]
    stays_stopped(rig, "console")


# -- stops and resets


@pytest.mark.requirement(48, 49)
@pytest.mark.parametrize("source", ["engine", "observer"])
def test_who_pulls_stops_it_and_the_first_reason_is_kept(rig, source):
    if source == "engine":
        rig.order("pull", "console")
    else:
        rig.tell(source, "pull", "console")
    rig.order("pull", "another")
    rig.go()
    assert rig.wheels.told == STILL
    assert rig.wheels.stopped
    stays_stopped(rig, "console")
    assert rig.reset() is None


def test_a_reset_waits_for_the_drives_and_moves_nothing_by_itself(rig):
    rig.order("pull", "console")
    rig.go(60)
    rig.order("reset", 1)
    for _ in range(READY_AFTER):
        rig.go()
        assert rig.chain.stopped == "console"
        assert rig.wheels.told == STILL
    rig.command = None
    rig.go(3)
    assert rig.chain.stopped is None
    rig.go(100)
    assert rig.wheels.told == STILL


def test_a_base_that_moves_is_not_reset(rig):
    rig.order("pull", "console")
    rig.go()
    assert rig.reset() == "the base moves"
    stays_stopped(rig, "console")


def test_drives_that_do_not_get_ready_keep_the_stop(rig):
    rig.order("pull", "console")
    rig.go(60)
    rig.wheels.order("held", True)
    assert rig.reset() == "the wheels are not ready"
    assert rig.wheels.stopped
    stays_stopped(rig, "console")


def test_who_pulls_during_a_reset_keeps_the_stop(rig):
    rig.order("pull", "console")
    rig.go(60)
    rig.order("reset", 7)
    rig.go(2)
    rig.tell("observer", "pull", "no!")
    rig.go(30)
    assert rig.sent.values("chain.reset") == [(7, "no!")]
    assert rig.wheels.stopped
    stays_stopped(rig, "console")


def test_a_reset_without_a_stop_is_at_once(rig):
    rig.order("reset", 7)
    assert rig.sent.values("chain.reset") == [(7, None)]
    rig.go(3)
    assert not rig.wheels.stopped
    assert rig.wheels.told == AHEAD


# -- modes


@pytest.mark.requirement(2)
def test_the_way_of_driving_changes_once_the_base_stands(rig):
    rig.command = Twist2(0.2, 0.3, 0.0)
    rig.go(200)
    assert rig.wheels.told == rig.command
    rig.tell("engine", "mode", "differential")
    rig.tell("engine", "mode", "sideways")
    seen = []
    for _ in range(100):
        rig.go()
        seen.append((rig.chain.mode, rig.wheels.told.vy))
    assert all(vy == 0.0 for mode, vy in seen if mode == "differential")
    assert seen[0][0] == "omni"
    assert seen[-1] == ("differential", 0.0)
    assert rig.wheels.told.vx == pytest.approx(0.2)


def test_a_sideways_command_to_wheels_that_only_roll_stops_them():
    """The engine's own guard refuses it; one that lets it pass is wrong, and may be elsewhere."""
    base = dataclasses.replace(ROBOT.base, modes=("differential",), max_yaw_rate=2.0)
    rig = Rig(base=base)
    rig.command = Twist2(0.2, 0.0, 0.1)
    rig.go(200)
    assert rig.wheels.told.vx == pytest.approx(0.2)
    assert rig.chain.stopped is None
    rig.command = Twist2(0.2, 0.3, 0.1)
    assert rig.until_stopped(5) <= 2
    assert "0.3 m/s sideways" in rig.chain.stopped


# -- whatever is heard

VALUES = st.one_of(
    st.none(), st.booleans(), st.integers(), st.floats(), st.text(max_size=3),
    st.just("differential"), st.just("omni"), st.just("up"),
    st.builds(Twist2, *[st.floats(-9.0, 9.0)] * 3), st.just(Twist2(math.nan, 0.0, 0.0)),
    st.builds(Pose2, *[st.floats(-9.0, 9.0)] * 3), st.just(DEEP),
    st.just(Pose3(math.inf, 0.0, 0.0)),
    st.builds(lambda x, y: UserPose(Pose2(x, y), 0.0), st.floats(-9.0, 9.0), st.floats(-9.0, 9.0)),
    st.tuples(st.just(Pose2(0.0, 0.0)), st.just(SIGMA)), st.tuples(st.none(), st.none()),
)  # fmt: skip
NAMES = (
    "command", "mode", "grant", "estimate", "pull", "reset", "observer.here", "arm.link", "vr.link",
    "vr.haptic_request", "user.pose", "rover.tracker", "chain.status",
)  # fmt: skip
WORDS = st.tuples(
    st.sampled_from(("engine", "vr", "arm", "observer", "nobody")),
    st.sampled_from(NAMES),
    VALUES,
    st.sampled_from((0, -30, -200, 40, 5000)),
)
BREAKS = st.tuples(
    st.sampled_from(("fault", "hit", "mute", "runs_on", "held", "raises")),
    st.sampled_from((None, True, False)),
)


@settings(max_examples=40)
@given(st.lists(st.one_of(WORDS, BREAKS, st.integers(1, 40)), max_size=40))
def test_whatever_is_heard_what_is_stopped_is_told_to_stand_and_nothing_leaps(script):
    rig = Rig().go(40)
    for step in script:
        match step:
            case int(cycles):
                for _ in range(cycles):
                    go_and_look(rig)
            case ("engine", "pull" | "reset" as name, value, _):
                rig.order(name, 7 if name == "reset" else str(value))
            case (source, name, value, late):
                rig.tell(source, name, value, rig.now + late * MS)
            case ("fault", value):
                rig.wheels.order("fault", "gone" if value else None)
            case ("hit", _):
                rig.wheels.order("hit", 0.1)
            case (name, value):
                rig.wheels.order(name, bool(value))


def go_and_look(rig):
    before, was_stopped = rig.wheels.told, rig.chain.stopped is not None
    rig.go()
    told, is_stopped = rig.wheels.told, rig.chain.stopped is not None
    assert told.speed <= MOTION.base_speed + 1e-9
    if rig.wheels.raises:
        assert is_stopped
    elif was_stopped and is_stopped:
        assert told == STILL
    elif told != STILL:
        leap = math.hypot(told.vx - before.vx, told.vy - before.vy)
        assert leap <= ROBOT.base.brake_deceleration * 0.02 + 1e-9
