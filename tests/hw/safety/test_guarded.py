"""The base of a run: who drives it, what it hears, and what reaches the wheels."""

import dataclasses
import math
import threading

import pytest
from hypothesis import given, settings, strategies as st

from hw.geometry import STILL, Pose2, Pose3, Twist2
from hw.model.robot import MotionLimits, load_robot
from hw.model.tracking import Tracking
from hw.motion.reckoner import Reckoner
from hw.safety.guarded import FOLDED_RAD, GuardedBase
from hw.safety.limits import SafetyLimits
from hw.samples import ArmState, Odometry, PoseSigma, Sample, UserPose
from hw.sim.mock import MockBase
from hw.sim.sim_base import SimBase
from tests.repeats import examples

ROBOT = load_robot("rbkairos_ur10")
CAPS = MotionLimits(1.0, 2.0, base_speed=2.5, base_yaw_rate=1.5)
LIMITS = SafetyLimits.of(ROBOT, CAPS)
ALONE = dataclasses.replace(LIMITS, watched=False)
PARKED = ROBOT.parked
OUT = (PARKED[0] + 2 * FOLDED_RAD, *PARKED[1:])
MS = 1_000_000
TICK = 33_333_333
FAST, SLOW, BACK = Twist2(1.0, 0.5, 0.1), Twist2(0.2), Twist2(-0.5)
DEEP = Pose3.from_yaw(1.5, 0.0, 1.5, 0.0)


class Wheels:
    """A driver as plain as can be; it remembers what it was told, None for a stop."""

    signals = ("base.pose", "base.twist")
    mode = "omni"

    def __init__(self):
        self.told = []
        self.used = []

    def use(self, mode):
        self.used.append(mode)

    def drive(self, command):
        self.told.append(command)

    def stop(self):
        self.told.append(None)

    def samples(self, now_ns):
        return []


class Rig:
    """A guarded base in ticks of 33 ms with cycles of 8 ms; it does at once what wheels are told.

    The user, if watched, is seen in each tick, far away unless `user` says otherwise.
    """

    def __init__(self, limits=ALONE, parked=None):
        self.wheels, self.pulled = Wheels(), []
        self.base = GuardedBase(self.wheels, limits, parked, self.pulled.append)
        self.user = Pose2(50.0, 0.0)
        self.now = 0
        self.watching()

    def hear(self, name, value, stamp=None):
        self.base.hear(Sample(name, self.now if stamp is None else stamp, value), self.now)

    def measured(self):
        """What base and trackers measure now."""
        told = self.wheels.told[-1] if self.wheels.told else None
        self.hear("base.pose", Pose2(0.0, 0.0))
        self.hear("base.twist", told or STILL)
        if self.user is not None:
            self.hear("user.pose", UserPose(self.user, 0.0))

    def watching(self):
        """Let the chain know how fast the user is."""
        self.tick(count=8)

    def tick(self, *offers, count=1):
        """What the wheels were told last, after so many ticks with these offers in each."""
        for _ in range(count):
            self.measured()
            for source, twist in offers:
                self.base.drive(twist, source)
            self.base.tick(self.now)
            self.cycles(4)
        return self.wheels.told[-1]

    def cycles(self, count):
        for _ in range(count):
            self.base.cycle(self.now)
            self.now += TICK // 4

    def records(self):
        return self.base.chain.cycles.reader().read_new()


# ---- who drives


@pytest.mark.requirement(41, 71)
@pytest.mark.parametrize("last", ["escape", "haptic", "chase", "own"])
def test_escape_drives_in_the_tick_in_which_it_speaks_whoever_speaks_last(last):
    rig = Rig()
    rig.tick(("chase", SLOW), ("haptic", BACK), count=3)
    offers = {"chase": SLOW, "haptic": BACK, "escape": FAST, "own": SLOW}
    words = [*((s, t) for s, t in offers.items() if s != last), (last, offers[last])]
    assert rig.tick(*words) == FAST
    assert rig.base.selected.source == "escape"


@pytest.mark.requirement(42)
def test_after_a_release_the_next_source_drives_in_the_same_tick():
    rig = Rig()
    rig.tick(("escape", FAST), ("chase", SLOW))
    rig.base.release("escape")
    assert rig.tick() == SLOW


@pytest.mark.requirement(42)
def test_a_source_that_falls_silent_is_a_stop_after_its_time_out():
    rig = Rig()
    rig.tick(("chase", FAST))
    assert rig.tick(count=15) == FAST
    assert rig.tick() is None
    assert rig.base.selected == (STILL, None, None)


@pytest.mark.requirement(42, 71)
def test_what_the_engine_calls_between_two_users_forgets_all_offers():
    rig = Rig()
    rig.tick(("haptic", FAST), ("chase", SLOW))
    rig.base.stop()
    assert rig.tick() is None
    assert rig.tick(("chase", SLOW)) == SLOW


def test_a_source_that_is_not_known_or_a_velocity_that_is_no_number_is_refused():
    rig = Rig()
    with pytest.raises(KeyError):
        rig.base.drive(FAST, "pad")
    with pytest.raises(ValueError, match="velocity"):
        rig.base.drive(Twist2(math.nan), "chase")
    assert rig.tick() is None


def test_states_of_ones_own_drive_as_the_weakest_source():
    rig = Rig()
    rig.base.drive(FAST)
    rig.tick()
    assert rig.base.selected.source == "own"
    assert rig.tick(("chase", SLOW)) == SLOW


# ---- the stamp of the tick


@pytest.mark.requirement(41, 149)
def test_the_live_offer_is_repeated_in_each_tick_with_the_stamp_of_the_tick():
    rig = Rig()
    rig.tick(("chase", SLOW))
    assert rig.tick(count=14) == SLOW
    assert {record.reasons for record in rig.records()} == {()}


@pytest.mark.requirement(48, 149)
def test_without_ticks_the_wheels_are_stopped_within_a_tenth_of_a_second():
    rig = Rig()
    rig.tick(("chase", FAST), count=3)
    last = rig.now - 4 * (TICK // 4)
    rig.measured()
    rig.cycles(12)
    stopped = [record for record in rig.records() if record.admitted == STILL]
    assert stopped[0].reasons == ("command is old",)
    assert 80 * MS < stopped[0].stamp_ns - last <= 100 * MS
    assert rig.wheels.told[-1] is None


def test_a_stop_that_was_told_is_no_old_command():
    rig = Rig()
    rig.tick(("chase", FAST))
    rig.base.stop()
    rig.measured()
    rig.base.tick(rig.now)
    rig.hear("base.twist", SLOW)  # it has not come to rest yet
    rig.cycles(14)
    assert rig.records()[-1].reasons == ()


@pytest.mark.requirement(48, 149)
def test_a_tick_stamped_ahead_of_the_cycles_moves_nothing():
    rig = Rig()
    rig.base.drive(SLOW)
    rig.base.tick(rig.now + 2000 * MS)
    rig.cycles(4)
    assert rig.wheels.told[-4:] == [None] * 4
    assert rig.records()[-1].reasons == ("command is stamped ahead of the clock",)
    assert rig.tick(("own", SLOW)) == SLOW


@pytest.mark.requirement(48, 49, 149)
def test_after_a_leap_back_in_time_nothing_moves_until_the_operator_has_reset_it():
    rig = Rig(LIMITS)
    assert rig.tick(("own", BACK), count=200) == BACK
    rig.now -= 5000 * MS
    before = len(rig.wheels.told)
    rig.tick(("own", BACK), count=100)
    assert set(rig.wheels.told[before:]) == {None}
    assert set(rig.pulled) == {"time runs backwards"}
    assert rig.base.chain.reset(rig.now)
    assert rig.tick(("own", BACK), count=8) == BACK


# ---- what is heard: stop line and arm


@pytest.mark.requirement(41, 48)
def test_while_the_stop_line_is_pulled_nobody_drives():
    rig = Rig()
    assert rig.tick(("escape", FAST)) == FAST
    rig.hear("stop.engaged", "button")
    assert rig.tick(("escape", FAST)) is None
    assert rig.base.selected.lock == "stop"
    assert rig.base.refusal == "the stop line is pulled"
    rig.hear("stop.engaged", None)
    assert rig.tick(("escape", FAST)) == FAST


@pytest.mark.requirement(48)
def test_a_pulled_stop_line_stops_the_wheels_before_the_next_tick():
    rig = Rig()
    rig.tick(("escape", FAST))
    rig.hear("stop.engaged", "button")
    rig.cycles(1)
    assert rig.wheels.told[-1] is None
    assert rig.records()[-1].reasons == ("stop line",)


@pytest.mark.requirement(46)
def test_while_the_arm_is_not_folded_only_escape_drives():
    rig = Rig(parked=PARKED)
    rig.hear("arm.joints", ArmState(PARKED, (0.0,) * 6))
    assert rig.tick(("chase", SLOW)) == SLOW
    rig.hear("arm.joints", ArmState(OUT, (0.0,) * 6))
    assert rig.tick(("chase", SLOW), ("haptic", SLOW), ("own", SLOW)) is None
    assert rig.base.refusal == "the arm is not folded"
    assert rig.tick(("chase", SLOW), ("escape", FAST)) == FAST
    assert rig.base.refusal is None


@pytest.mark.requirement(46)
def test_an_arm_that_has_not_reported_is_not_folded_and_no_arm_is_none_that_is_out():
    silent = Rig(parked=PARKED)
    assert silent.tick(("chase", SLOW)) is None
    assert silent.tick(("escape", FAST)) == FAST
    assert "arm.joints" in silent.base.hears
    without = Rig()
    assert without.tick(("chase", SLOW)) == SLOW
    assert "arm.joints" not in without.base.hears


@pytest.mark.requirement(46)
@pytest.mark.parametrize("away", [-0.021, -0.019, 0.019, 0.021])
def test_an_arm_is_folded_while_no_joint_is_more_than_a_fiftieth_off_in_either_direction(away):
    for joint in range(6):
        rig = Rig(parked=PARKED)
        joints = tuple(q + away * (k == joint) for k, q in enumerate(PARKED))
        rig.hear("arm.joints", ArmState(joints, (0.0,) * 6))
        assert rig.tick(("chase", SLOW)) == (SLOW if abs(away) < 0.02 else None)


@pytest.mark.requirement(46)
def test_an_arm_of_another_kind_is_not_folded():
    rig = Rig(parked=PARKED)
    rig.hear("arm.joints", ArmState(PARKED[:5], (0.0,) * 5))
    assert rig.tick(("chase", SLOW)) is None


@pytest.mark.requirement(46)
@pytest.mark.parametrize(("overlap", "left", "drives"), [(0.5, 0.5, True), (0.5, 0.51, False),
                                                         (0.0, 0.0, False)])  # fmt: skip
def test_a_haptic_drive_may_end_while_the_arm_unfolds_if_the_limits_say_so(overlap, left, drives):
    rig = Rig(dataclasses.replace(ALONE, overlap=overlap), PARKED)
    rig.hear("arm.joints", ArmState(OUT, (0.0,) * 6))
    rig.base.drive(SLOW, "haptic", left)
    rig.base.drive(FAST, "chase", left)
    rig.tick()
    assert rig.base.selected.source == ("docking" if drives else None)
    rig.base.drive(SLOW, "haptic", 1.0)  # the way has got longer
    assert rig.tick() is None
    rig.base.drive(SLOW, "haptic", left)
    rig.base.release("haptic")
    assert rig.tick() is None


# ---- what is heard: the person


@pytest.mark.requirement(52)
def test_a_base_keeps_its_distance_to_the_user_it_hears_of():
    rig = Rig(LIMITS)
    rig.user = Pose2(0.565 + 0.5 + 0.3, 0.0)
    rig.watching()
    assert rig.tick(("own", SLOW)) is None
    assert rig.tick(("own", BACK)) == BACK


@pytest.mark.requirement(79, 86)
def test_a_request_and_a_grant_reach_the_chain_and_end_with_the_request():
    rig = Rig(LIMITS)
    rig.user = Pose2(0.565 + 0.5 + 0.3, 0.0)
    rig.watching()
    rig.hear("vr.haptic_request", DEEP)
    assert rig.tick(("own", FAST)).vx == pytest.approx(0.25)
    rig.base.grant(Pose2(-0.2, 0.0))  # from there the gap is 0.5 m
    assert rig.tick(("own", Twist2(1.0))) is None
    rig.hear("vr.haptic_request", None)
    assert rig.tick(("own", Twist2(1.0))) is None
    rig.hear("vr.haptic_request", DEEP)
    assert rig.tick(("own", Twist2(1.0))).vx == pytest.approx(0.25)


@pytest.mark.requirement(149)
def test_a_user_who_is_not_seen_any_more_is_lost_and_the_stop_line_is_pulled():
    rig = Rig(LIMITS)
    rig.user = None
    rig.tick(("own", BACK), count=6)
    assert rig.base.refusal == "pose of the user is old"
    assert rig.pulled == []
    rig.tick(("own", BACK), count=12)
    assert set(rig.pulled) == {"tracking of the user is lost"}
    assert rig.base.refusal == "tracking of the user is lost"
    rig.user = Pose2(50.0, 0.0)
    rig.tick(count=8)
    assert rig.base.chain.reset(rig.now)
    assert rig.tick(("own", BACK)) == BACK


@pytest.mark.requirement(149)
def test_a_lost_user_pulls_the_line_of_a_standing_base_too():
    rig = Rig(LIMITS)
    rig.user = None
    rig.tick(count=18)
    assert set(rig.pulled) == {"tracking of the user is lost"}


def test_a_user_who_was_never_seen_keeps_the_base_standing_and_it_says_so():
    rig = Rig.__new__(Rig)
    rig.watching = lambda: None
    rig.__init__(LIMITS)
    rig.user = None
    assert rig.tick(("own", BACK)) is None
    assert rig.base.refusal == "no pose of the user yet"


def test_where_nobody_is_watched_nobody_is_heard_of():
    rig = Rig()
    assert "user.pose" not in rig.base.hears
    assert "user.pose" in Rig(LIMITS).base.hears
    rig.user = Pose2(0.6, 0.0)
    assert rig.tick(("own", SLOW)) == SLOW


def test_samples_that_do_not_concern_the_base_are_passed_over():
    rig = Rig()
    rig.hear("gripper.state", None)
    assert rig.tick(("own", SLOW)) == SLOW


# ---- what is told: mode, refusal, and what is left of a command


def test_what_is_told_are_samples_given_at_the_start_and_on_change():
    rig = Rig()

    def told():
        return [(sample.name, sample.value) for sample in rig.base.samples(rig.now)]

    assert rig.base.signals[2:] == ("base.mode", "base.refusal", "base.admitted")
    assert told() == [("base.mode", "omni"), ("base.refusal", None), ("base.admitted", None)]
    assert told() == []
    rig.hear("stop.engaged", "button")
    rig.tick()
    assert told() == [("base.refusal", "the stop line is pulled")]
    rig.wheels.mode = "differential"
    rig.hear("stop.engaged", None)
    rig.tick()
    assert told() == [("base.mode", "differential"), ("base.refusal", None)]
    rig.base.use("omni")
    assert rig.wheels.used == ["omni"]


@pytest.mark.requirement(50)
def test_what_the_chain_takes_away_is_told_until_it_lets_all_pass_for_a_tick():
    rig = Rig()
    limit = rig.base.chain.limits.speed
    too_fast = Twist2(2.0 * limit, 0.0)
    rig.tick(("own", SLOW))
    assert rig.base.chain.admitted is None
    passed = rig.tick(("own", too_fast))
    assert passed.vx == pytest.approx(limit)
    assert [s.value for s in rig.base.samples(rig.now) if s.name == "base.admitted"] == [passed]
    rig.base.tick(rig.now)
    assert rig.base.chain.admitted is None
    rig.tick(("own", SLOW))
    assert rig.base.chain.admitted is None


# ---- the owner's side


@pytest.mark.requirement(149)
def test_plain_wheels_whose_own_measurements_are_missing_or_old_stand():
    rig = Rig(LIMITS)
    rig.base.drive(BACK)
    rig.base.tick(rig.now)
    rig.now += 160 * MS
    rig.hear("user.pose", UserPose(rig.user, 0.0))
    rig.base.tick(rig.now)
    rig.cycles(1)
    assert rig.records()[-1].reasons == ("pose or velocity of the base is not known",)
    rig.hear("base.pose", Pose2(0.0, 0.0))
    rig.hear("base.twist", STILL, stamp=rig.now + 30 * MS)
    rig.cycles(1)
    assert rig.wheels.told[-1] is None
    rig.hear("base.twist", STILL)
    rig.cycles(1)
    assert rig.wheels.told[-1] == BACK


def test_plain_wheels_that_stand_and_are_to_stand_leave_no_records():
    rig = Rig()
    rig.tick(count=10)
    assert rig.records() == []
    rig.tick(("own", SLOW))
    assert len(rig.records()) == 4


def test_wheels_with_ramps_ask_behind_them_and_are_told_in_the_tick():
    wheels = SimBase(ROBOT, CAPS, Pose2(0.0, 0.0))
    base = GuardedBase(wheels, ALONE)
    assert wheels.chain is base.chain
    assert not {"base.pose", "base.twist"} & set(base.hears)
    for n in range(1, 31):
        base.drive(FAST)
        base.tick((n - 1) * TICK)
        wheels.advance(n * TICK)
    commands = [record.command.vx for record in base.chain.cycles.reader().read_new()]
    assert commands == sorted(commands)
    assert wheels.twist.vx == pytest.approx(commands[-1])
    assert 0.7 < commands[-1] < 1.0


@pytest.mark.parametrize("make", [MockBase, lambda *at: SimBase(ROBOT, CAPS, at[1])])
def test_a_command_that_times_out_between_two_instants_stops_the_wheels_and_latches_nothing(make):
    wheels = make(ROBOT, Pose2(0.0, 0.0))
    base = GuardedBase(wheels, ALONE)
    base.drive(SLOW)
    base.tick(0)
    for n in range(1, 20):
        wheels.advance(n * 40 * MS)  # the time-out, 0.5 s, is between two
    assert wheels.twist == STILL
    assert wheels.pose.x > 0.0
    assert base.chain.latched is None


class Silent(Wheels):
    """Wheels that do not say how they drive."""

    @property
    def mode(self):
        raise AttributeError("mode")


@pytest.mark.parametrize(("wheels", "mode"), [(Silent, "differential"), (Wheels, "omni")])
def test_on_a_robot_that_cannot_go_sideways_no_wheels_are_told_to(wheels, mode):
    base = GuardedBase(wheels(), ALONE, modes=("differential",))
    with pytest.raises(ValueError, match=r"0\.1 m/s sideways"):
        base.drive(Twist2(0.0, 0.1, 0.0))
    base.drive(SLOW)
    assert base.mode == mode


def test_wheels_that_are_guarded_again_get_a_chain_of_the_new_limits():
    wheels = SimBase(ROBOT, CAPS, Pose2(0.0, 0.0))
    GuardedBase(wheels, ALONE)
    slower = dataclasses.replace(ALONE, speed=0.3)
    again = GuardedBase(wheels, slower)
    assert wheels.chain is again.chain
    assert again.chain.limits is slower
    for n in range(1, 31):
        again.drive(FAST)
        again.tick((n - 1) * TICK)
        wheels.advance(n * TICK)
    assert 0.25 < wheels.twist.speed < 0.3 + 1e-9


@pytest.mark.requirement(48)
def test_cycles_samples_and_ticks_may_come_from_different_threads():
    """An exception in a thread fails a test, whichever thread it is."""
    rig, stop = Rig(LIMITS), threading.Event()
    reader, read = rig.base.chain.cycles.reader(), []

    def cycle():
        while not stop.is_set():
            rig.base.cycle(rig.now)

    def follow():
        while not stop.is_set():
            read.extend(reader.read_new())

    threads = [threading.Thread(target=cycle), threading.Thread(target=follow)]
    for thread in threads:
        thread.start()
    cycles = rig.base.chain.cycles
    while cycles.written < 500 and threads[0].is_alive():
        rig.now += 1000  # so little that no age depends on how the threads share the machine
        rig.measured()
        rig.base.drive(BACK)
        rig.base.tick(rig.now)
    stop.set()
    for thread in threads:
        thread.join()
    read += reader.read_new()
    assert len(read) + reader.missed == cycles.written >= 500
    assert rig.base.chain.latched is None
    assert rig.tick(("own", BACK)) == BACK


# ---- whatever comes

numbers = st.one_of(st.floats(-4.0, 4.0), st.sampled_from([math.nan, math.inf, -math.inf]))
instants = st.one_of(st.integers(-60, 60), st.integers(-6000, 6000)).map(MS.__mul__)
poses = st.builds(Pose2, numbers, numbers, numbers)
events = st.one_of(
    st.tuples(st.just("user.pose"), st.builds(UserPose, poses, numbers), instants),
    st.tuples(st.just("vr.haptic_request"), st.sampled_from([None, DEEP]), instants),
    st.tuples(st.just("stop.engaged"), st.sampled_from([None, None, "button"]), instants),
    st.tuples(st.just("arm.joints"), st.sampled_from([PARKED, OUT, PARKED[:2]])
              .map(lambda joints: ArmState(joints, ())), instants),
    st.tuples(st.just("base.pose"), poses, instants),
    st.tuples(st.just("base.twist"), st.builds(Twist2, numbers, numbers, numbers), instants),
    st.tuples(st.just("grant"), st.one_of(st.none(), poses), instants),
    st.tuples(st.just("tick"), st.none(), instants),
    st.tuples(st.just("pass"), st.none(), instants),
)  # fmt: skip
finite = st.floats(-4.0, 4.0)
commands = st.builds(Twist2, finite, finite, finite)


@pytest.mark.requirement(46, 48, 50, 149)
@settings(deadline=None, max_examples=examples(200))
@given(
    st.lists(st.tuples(st.sampled_from(["escape", "chase", "own"]), commands, events), max_size=12),
    st.booleans(), st.booleans(),
)  # fmt: skip
def test_whatever_is_fed_nothing_is_faster_than_told_or_allowed_or_moves_after_a_refusal(
    script, governor, watched
):
    rig = Rig(dataclasses.replace(LIMITS, governor=governor, watched=watched), PARKED)
    rig.hear("arm.joints", ArmState(PARKED, ()))
    for source, command, (what, value, leap) in script:
        rig.base.drive(command, source)
        if what == "tick":
            rig.base.tick(rig.now + leap)
        elif what == "pass":
            rig.now += leap
        elif what == "grant":
            rig.base.grant(value)
        else:
            rig.hear(what, value, rig.now + leap)
        refused = rig.base.chain.latched or rig.base.chain.rule.stop_line
        rig.cycles(1)
        told, selected = rig.wheels.told[-1] or STILL, rig.base.selected
        assert told.speed <= min(selected.twist.speed, 2.5) + 1e-9
        assert abs(told.wz) <= min(abs(selected.twist.wz), 1.5) + 1e-9
        if refused or selected.source is None or rig.base.chain.refused:
            assert told == STILL


# ---- a base that does not know where it is


def reckoned(limits=LIMITS):
    """A guarded base that was made just now, and its wheels."""
    wheels = Wheels()
    base = GuardedBase(wheels, limits)
    base.chain.locate_by(Reckoner(Tracking()))
    return base, wheels


def gap_of(base):
    return base.chain.cycles.reader().read_new()[-1].separation


def wheels_at(x, stamp_ns, speed=0.0):
    return Sample("base.odometry", stamp_ns, Odometry(Pose2(x, 0.0), Twist2(speed)))


def test_who_is_told_where_it_is_drives_by_that_and_by_the_wheels():
    """The user stands 2 m before the base, in the map; the wheels count from somewhere else."""
    base, _ = reckoned()
    base.hear(Sample("user.pose", 0, UserPose(Pose2(2.0, 0.0), 0.0)), 0)
    base.hear(wheels_at(100.0, 0), 0)
    assert base.chain.admit(0, FAST, None, FAST) == STILL  # nobody knows where it is
    base.chain.locate(0, Pose2(0.0, 0.0), PoseSigma(0.01, 0.01))
    base.chain.admit(0, SLOW, None, SLOW)
    gap = gap_of(base)
    assert gap == pytest.approx(2.0 - 0.565 - 0.5)
    base.hear(wheels_at(100.3, 10 * MS), 10 * MS)
    base.chain.admit(10 * MS, SLOW, None, SLOW)
    assert gap_of(base) == pytest.approx(gap - 0.3)
    base.chain.locate(0, None, None)
    assert base.chain.admit(10 * MS, SLOW, None, SLOW) == STILL


def test_wheels_without_a_loop_of_their_own_are_reckoned_too():
    base, wheels = reckoned(ALONE)
    base.hear(wheels_at(0.0, 0), 0)
    base.chain.locate(0, Pose2(1.0, 0.0), PoseSigma(0.01, 0.01))
    base.drive(SLOW)
    base.tick(0)
    base.cycle(0)
    assert wheels.told[-1] == SLOW
    base.drive(SLOW)
    base.tick(200 * MS)
    base.cycle(200 * MS)  # no word from the wheels for longer than they may be silent
    assert wheels.told[-1] is None


def test_what_it_goes_by_is_heard_for():
    assert {"base.odometry", "rover.tracker"} <= set(reckoned()[0].hears)
    assert not {"base.odometry", "rover.tracker"} & set(Rig().base.hears)
