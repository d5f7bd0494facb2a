"""The safety chain, cycle by cycle: what it lets pass, and what not."""

import dataclasses
import inspect
import itertools
import math
import re

import pytest
from hypothesis import assume, given, settings, strategies as st

from hw.geometry import STILL, Pose2, Twist2
from hw.model.robot import MotionLimits, load_robot
from hw.safety import (
    chain as safety_chain,
    checks,
    cycle_record as safety_record,
    guarded,
    limits as safety_limits,
    rule as safety_rule,
    separation,
)
from hw.safety.cycle_log import KEPT
from hw.safety.limits import SafetyLimits, Stopping
from hw.safety.rule import SafetyRule
from tests.repeats import examples

ROBOT = load_robot("rbkairos_ur10")
LIMITS = SafetyLimits.of(ROBOT, MotionLimits(1.0, 2.0, base_speed=2.5, base_yaw_rate=1.5))
EARLY = dataclasses.replace(LIMITS, ahead=0.05)
HERE = Pose2(0.0, 0.0, 0.0)
AHEAD = Twist2(1.0, 0.0, 0.0)
BACK = Twist2(-1.0, 0.0, 0.0)
MS = 1_000_000
FOREVER = 10**18


class Rule(SafetyRule):
    """A rule that returns the record of each cycle, with the velocities as they are."""

    def __init__(self, limits):
        super().__init__(limits)
        self.holonomic = True
        self._reader = self.cycles.reader()

    def admit(self, now, command, stamp, pose, twist, sigma=0.0):
        admitted = super().admit(now, command, stamp, pose, twist, sigma, self.holonomic)
        (record,) = self._reader.read_new()
        return record._replace(command=command, admitted=admitted)


class Rig:
    """A chain at 100 Hz; the user is seen every 30 ms, `distance` ahead from centre to centre."""

    def __init__(self, distance=20.0, speed=0.0, limits=LIMITS):
        self.chain = Rule(limits)
        self.now = 0
        self.distance = distance
        self.speed = speed
        self.watch(300)

    def watch(self, ms, command=STILL, measured=None, seen=True, pose=HERE):
        """Let time pass; the last cycle."""
        for _ in range(ms // 10):
            self.now += 10 * MS
            if self.now % (30 * MS) == 0 and seen:
                self.chain.track_user(self.now, self.now, self.distance, 0.0)
            self.distance -= self.speed * 0.01
            record = self.admit(command, measured=measured, pose=pose)
        return record

    def admit(self, command, age_ms=0, measured=None, pose=HERE):
        twist = command if measured is None else measured
        return self.chain.admit(self.now, command, self.now - age_ms * MS, pose, twist)


def at(gap, **options):
    """A user who stands so far from the foam ahead."""
    return Rig(gap + 0.565 + 0.5, **options)


# ---- every cycle, whatever comes in

wild = st.one_of(
    st.floats(-4.0, 4.0), st.floats(), st.sampled_from([math.nan, math.inf, -math.inf, 1e300, 0.0])
)
usual = st.floats(-4.0, 4.0)
twists = st.one_of(
    st.builds(Twist2, usual, usual, usual),
    st.builds(Twist2, wild, wild, wild),
)
poses = st.one_of(st.builds(Pose2, usual, usual, usual), st.builds(Pose2, wild, wild, wild))
cycles = st.lists(
    st.fixed_dictionaries(
        {
            "dt": st.one_of(st.integers(0, 40 * MS), st.integers(-6000 * MS, 6000 * MS)),
            "command": twists,
            "old": st.one_of(st.integers(-50 * MS, 200 * MS), st.integers(-FOREVER, FOREVER)),
            "pose": poses,
            "twist": twists,
            "user": st.one_of(st.none(), st.tuples(wild, wild, st.integers(-100, 100))),
            "stop": st.sampled_from([None, None, None, "button"]),
            "request": st.booleans(),
            "grant": st.one_of(st.none(), poses),
            "holonomic": st.booleans(),
        }
    ),
    max_size=12,
)


@pytest.mark.requirement(48, 50)
@settings(deadline=None, max_examples=examples(300))
@given(cycles, st.booleans(), st.booleans())
def test_whatever_comes_in_the_chain_only_slows_down_or_stops(script, governor, watched):
    limits = dataclasses.replace(LIMITS, governor=governor, watched=watched)
    chain, now, latest, was_latched = Rule(limits), 0, -math.inf, False
    chain.track_user(0, 0, 2.0, 0.3)
    for cycle in script:
        now += cycle["dt"]
        chain.stop_line, chain.holonomic = cycle["stop"], cycle["holonomic"]
        chain.request(cycle["request"])
        chain.grant(cycle["grant"])
        if cycle["user"] is not None:
            x, y, ms = cycle["user"]
            chain.track_user(now, now + ms * MS, x, y)
        command = cycle["command"]
        record = chain.admit(now, command, now - cycle["old"], cycle["pose"], cycle["twist"])
        admitted = record.admitted
        assert math.isfinite(admitted.vx)
        assert math.isfinite(admitted.vy)
        assert math.isfinite(admitted.wz)
        assert admitted.speed <= 2.5 + 1e-9
        assert abs(admitted.wz) <= 1.5 + 1e-9
        for value in (record.needed, record.allowed, record.user_speed, record.user_age):
            assert value is None or math.isfinite(value)
        if record.reasons == ():
            assert admitted is command
        if now < latest or was_latched or chain.stop_line or chain.refused:
            assert admitted == STILL
        if not -20 * MS <= cycle["old"] <= 80 * MS:
            assert admitted == STILL
        latest, was_latched = now, chain.latched is not None
        if admitted == STILL:
            continue
        assert admitted.speed <= command.speed + 1e-12
        assert abs(admitted.wz) <= abs(command.wz)
        assert admitted.wz * command.wz >= 0.0
        # as a whole it never goes back against the command
        assert admitted.vx * command.vx + admitted.vy * command.vy >= -1e-12
        if not cycle["holonomic"]:
            assert abs(admitted.vx * command.vy - admitted.vy * command.vx) <= 1e-9


@pytest.mark.requirement(104)
@settings(deadline=None, max_examples=examples(300))
@given(
    st.floats(-3.0, 3.0), st.floats(-3.0, 3.0), st.floats(-math.pi, math.pi),
    st.floats(-math.pi, math.pi), st.floats(0.0, 2.5), st.floats(0.0, 3.0),
)  # fmt: skip
def test_motions_that_open_the_gap_pass_unchanged_however_near_and_fast_the_user_is(
    x, y, yaw, direction, speed, user_speed
):
    chain = Rule(LIMITS)
    for n in range(8):
        chain.track_user(n * 30 * MS, n * 30 * MS, x + user_speed * (n - 7) * 0.03, y)
    pose = Pose2(0.0, 0.0, yaw)
    near = separation.nearness(0.565, 0.455, *pose.inverse().transform(x, y), 0.5)
    assume(near.gap > -0.5)
    command = Twist2(speed * math.cos(direction), speed * math.sin(direction), 0.0)
    if near.nx * command.vx + near.ny * command.vy > 0.0:
        command = Twist2(-command.vx, -command.vy, 0.0)
    record = chain.admit(210 * MS, command, 210 * MS, pose, command)
    assert record.admitted is command
    assert record.reasons == ()


@pytest.mark.parametrize(
    ("x", "y", "out", "stays"),
    [(0.5, 0.1, Twist2(-1, 0.3, 0), Twist2(1, 0, 0)), (-0.5, 0, Twist2(1, 0, 0), Twist2(-1, 0, 0)),
     (0.1, 0.3, Twist2(0.4, -1, 0), Twist2(0, 1, 0)), (0, -0.2, Twist2(0, 1, 0), Twist2(0, -1, 0))],
)  # fmt: skip
def test_a_base_that_stands_in_the_user_gets_out_by_the_nearest_side(x, y, out, stays):
    chain = Rule(LIMITS)
    for n in range(8):
        chain.track_user(n * 30 * MS, n * 30 * MS, x, y)
    assert chain.admit(210 * MS, out, 210 * MS, HERE, STILL).admitted is out
    assert chain.admit(210 * MS, stays, 210 * MS, HERE, STILL).admitted == STILL


@pytest.mark.parametrize("wz", [1.5, -1.5])
def test_a_turn_that_takes_the_nearest_corner_away_is_free_and_the_other_one_is_not(wz):
    chain = Rule(LIMITS)
    for n in range(8):
        chain.track_user(n * 30 * MS, n * 30 * MS, 1.0, 0.75)
    command = Twist2(0.0, 0.0, wz)
    record = chain.admit(210 * MS, command, 210 * MS, HERE, command)
    opening = separation.nearness(0.565, 0.455, 1.0, 0.75, 0.5).lever * wz < 0.0
    assert record.admitted.wz == (wz if opening else 0.0)


# ---- stop line, latches, ages


@pytest.mark.requirement(48)
def test_a_pulled_stop_line_admits_nothing_not_even_the_way_out():
    rig = at(3.0)
    rig.chain.stop_line = "button"
    record = rig.admit(BACK)
    assert (record.admitted, record.reasons) == (STILL, ("stop line",))
    rig.chain.stop_line = None
    assert rig.admit(BACK).admitted == BACK


@pytest.mark.requirement(42, 48)
@pytest.mark.parametrize(("age_ms", "passes"), [(0, True), (40, True), (81, False)])
def test_a_command_counts_whole_for_forty_milliseconds_and_not_at_all_after_eighty(age_ms, passes):
    record = at(3.0).admit(BACK, age_ms=age_ms)
    assert record.admitted == (BACK if passes else STILL)
    assert record.reasons == (() if passes else ("command is old",))


@pytest.mark.requirement(149)
@pytest.mark.parametrize(
    ("silence_ms", "speed"),
    [(0, 2.5), (30, 2.5), (50, 2.5), (60, 2.25), (100, 1.25), (140, 0.25), (150, 0.0), (160, 0.0)],
)
def test_the_older_the_pose_of_the_user_the_slower_the_base_until_it_stops(silence_ms, speed):
    rig = at(9.0)
    rig.chain.track_user(rig.now, rig.now, rig.distance, 0.0)
    rig.now += silence_ms * MS
    record = rig.admit(Twist2(-2.5, 0.0, 0.0))
    assert record.admitted.speed == pytest.approx(speed, abs=1e-9)
    reason = "pose of the user is late" if silence_ms <= 150 else "pose of the user is old"
    assert record.reasons == ((reason,) if silence_ms > 50 else ())
    assert record.user_age == silence_ms / 1000


@pytest.mark.requirement(149)
@pytest.mark.parametrize(("silence_ms", "turn"), [(50, 1.5), (75, 1.125), (100, 0.75), (150, 0.0)])
@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_turns_are_slower_by_late_poses_too(silence_ms, turn, direction):
    rig = at(9.0)
    rig.chain.track_user(rig.now, rig.now, rig.distance, 0.0)
    rig.now += silence_ms * MS
    record = rig.admit(Twist2(0.0, 0.0, 1.5 * direction))
    assert record.admitted.wz == pytest.approx(turn * direction, abs=1e-9)


@pytest.mark.requirement(149)
def test_a_late_pose_is_taken_for_a_user_who_walks():
    rig = at(3.0)
    assert rig.admit(AHEAD).user_speed == LIMITS.uncertainty
    rig.now += 60 * MS
    late = rig.admit(AHEAD)
    assert late.user_speed == 1.6
    assert late.allowed < separation.allowed_speed(
        3.0, 1.6, 0.0, dataclasses.astuple(LIMITS.stopping)
    )


@pytest.mark.requirement(149)
def test_a_short_loss_of_tracking_ends_by_itself():
    rig = at(3.0)
    assert rig.watch(450, BACK, seen=False).reasons == ("pose of the user is old",)
    rig.watch(30)
    assert rig.chain.latched is None
    assert rig.admit(BACK).admitted == BACK


@pytest.mark.requirement(49, 149)
def test_a_long_loss_of_tracking_latches_until_the_operator_resets_it_with_the_user_back():
    rig = at(3.0)
    rig.watch(500, BACK, STILL, seen=False)
    assert rig.chain.latched is None
    assert rig.watch(10, BACK, STILL, seen=False).reasons == ("latched",)
    assert rig.chain.latched == "tracking of the user is lost"
    assert not rig.chain.reset(rig.now)
    assert rig.watch(300, BACK, STILL).admitted == STILL
    assert rig.chain.reset(rig.now)
    assert rig.admit(BACK).admitted == BACK


def test_before_the_first_pose_nothing_moves_and_nothing_latches():
    chain = Rule(LIMITS)
    for now in range(0, 2000 * MS, 10 * MS):
        record = chain.admit(now, BACK, now, HERE, STILL)
        assert (record.admitted, record.separation) == (STILL, None)
        assert record.reasons == ("no pose of the user yet",)
    assert chain.latched is None
    assert chain.reset(2000 * MS)


@pytest.mark.requirement(50)
@pytest.mark.parametrize("measured", [Twist2(2.0, 1.95, 0.0), Twist2(0.0, 0.0, -1.7)])
def test_a_base_faster_than_its_limit_is_stopped_and_latches(measured):
    rig = at(9.0)
    assert rig.admit(BACK, measured=Twist2(2.5, 0.0, 1.5)).reasons == ()
    assert rig.admit(BACK, measured=measured).reasons == ("latched",)
    assert rig.chain.latched == "the base is faster than its limit"
    assert not rig.chain.reset(rig.now)
    rig.admit(STILL, measured=STILL)
    assert rig.chain.reset(rig.now)


@pytest.mark.requirement(48)
def test_a_stop_that_does_not_stop_the_base_latches():
    rig = at(9.0)
    rig.chain.stop_line = "button"
    going = Twist2(1.5, 0.0, 0.0)
    rig.watch(800, going, going)
    assert rig.chain.latched is None
    rig.watch(100, going, going)
    assert rig.chain.latched == "the base does not stop"


@pytest.mark.requirement(48)
def test_a_base_that_runs_on_while_its_place_is_not_known_latches():
    rig = at(9.0)
    going = Twist2(1.5, 0.0, 0.0)
    rig.watch(800, going, going, pose=None)
    assert rig.chain.latched is None
    rig.watch(100, going, going, pose=None)
    assert rig.chain.latched == "the base does not stop"
    assert rig.chain.refused == ("pose or velocity of the base is not known",)
    assert rig.admit(BACK).reasons == ("latched",)


@pytest.mark.requirement(48)
def test_a_stop_in_which_the_base_stands_in_time_does_not_latch():
    rig = at(9.0)
    rig.chain.stop_line = "button"
    rig.watch(600, AHEAD, AHEAD)
    rig.watch(5000, AHEAD, STILL)
    rig.chain.stop_line = None
    rig.watch(3000, BACK)
    assert rig.chain.latched is None


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf, 1e12])
@pytest.mark.parametrize("what", ["command", "pose", "twist"])
def test_one_value_that_is_no_number_stops_the_base(what, bad):
    rig = at(9.0)
    values = {"command": BACK, "pose": HERE, "twist": BACK}
    values[what] = Pose2(0.0, bad, 0.0) if what == "pose" else Twist2(0.0, bad, 0.0)
    record = rig.chain.admit(rig.now, values["command"], rig.now, values["pose"], values["twist"])
    assert (record.admitted, record.reasons) == (STILL, ("a value is not finite",))
    assert rig.admit(BACK).admitted == BACK


# ---- time


@pytest.mark.requirement(48, 149)
@pytest.mark.parametrize(("ahead_ms", "passes"), [(20, True), (21, False), (2000, False)])
def test_a_command_stamped_ahead_of_the_clock_moves_nothing(ahead_ms, passes):
    record = at(3.0).admit(BACK, age_ms=-ahead_ms)
    assert record.admitted == (BACK if passes else STILL)
    assert record.reasons == (() if passes else ("command is stamped ahead of the clock",))


@pytest.mark.requirement(149)
@pytest.mark.parametrize(("limits", "ahead_ms"), [(LIMITS, 20), (EARLY, 50)])
def test_a_pose_of_the_user_may_be_as_far_ahead_as_is_declared(limits, ahead_ms):
    rig = at(3.0, limits=limits)
    rig.now += 10 * MS
    soon = rig.now + (ahead_ms + 1) * MS
    assert not rig.chain.track_user(rig.now, soon, rig.distance, 0.0)
    assert rig.chain.track_user(rig.now, soon - MS, rig.distance, 0.0)
    assert rig.admit(BACK).user_age == 0.0


@pytest.mark.requirement(149)
def test_a_pose_heard_by_a_clock_that_is_ahead_is_not_fresh():
    rig = at(3.0)
    rig.chain.track_user(rig.now + 5000 * MS, rig.now + 5000 * MS, rig.distance, 0.0)
    record = rig.admit(BACK)
    assert record.admitted == STILL
    assert record.reasons == ("pose of the user is stamped ahead of the clock",)
    assert record.user_age == 0.0
    rig.now += 5000 * MS
    assert rig.admit(BACK).admitted == BACK


@pytest.mark.requirement(48, 49, 149)
@pytest.mark.parametrize("back_ms", [10, 5000])
def test_time_that_runs_backwards_latches_and_what_was_before_it_is_forgotten(back_ms):
    rig = at(3.0)
    rig.watch(5100, BACK)
    rig.now -= back_ms * MS
    for _ in range(480):
        assert rig.admit(BACK, measured=STILL).admitted == STILL
        rig.now += 10 * MS
    assert rig.chain.latched == "time runs backwards"
    assert rig.chain.reset(rig.now)
    assert rig.admit(BACK).reasons == ("no pose of the user yet",)
    rig.watch(100)
    assert rig.admit(BACK).admitted == BACK


@pytest.mark.requirement(149)
def test_time_that_runs_backwards_is_noticed_by_a_standing_base_too():
    rig = at(3.0)
    rig.chain.rest(rig.now)
    rig.chain.rest(rig.now)
    assert rig.chain.latched is None
    rig.chain.rest(rig.now - 1)
    assert rig.chain.latched == "time runs backwards"


# ---- without a governor, without a person, without a place


@pytest.mark.requirement(48, 50, 149)
def test_without_the_governor_all_but_the_separation_is_kept():
    rig = at(0.1, limits=dataclasses.replace(LIMITS, governor=False))
    record = rig.admit(AHEAD)
    assert (record.admitted, record.reasons) == (AHEAD, ())
    assert (record.separation, record.allowed) == (pytest.approx(0.1), 0.0)
    assert record.needed > 0.35
    assert rig.admit(Twist2(5.0, 0.0, 0.0), measured=STILL).admitted == Twist2(2.5, 0.0, 0.0)
    assert rig.admit(AHEAD, age_ms=81).reasons == ("command is old",)
    rig.chain.stop_line = "button"
    assert rig.admit(AHEAD).reasons == ("stop line",)
    rig.chain.stop_line = None
    assert rig.watch(200, AHEAD, seen=False).reasons == ("pose of the user is old",)
    assert rig.watch(400, AHEAD, seen=False).reasons == ("latched",)


@pytest.mark.requirement(48, 50)
def test_where_nobody_is_tracked_all_but_the_person_is_watched():
    chain = Rule(dataclasses.replace(LIMITS, watched=False))
    for now in range(0, 2000 * MS, 10 * MS):
        record = chain.admit(now, AHEAD, now, HERE, AHEAD)
        assert (record.admitted, record.reasons, record.separation) == (AHEAD, (), None)
    assert chain.latched is None
    assert chain.admit(now, AHEAD, now - 81 * MS, HERE, AHEAD).reasons == ("command is old",)
    fast = chain.admit(now, Twist2(-3.0, 4.0), now, HERE, STILL)
    assert (fast.admitted, fast.reasons) == (Twist2(-1.5, 2.0), ("speed limit",))
    assert chain.admit(now, AHEAD, now, HERE, Twist2(3.0)).reasons == ("latched",)


def test_a_base_whose_place_or_velocity_is_not_known_does_not_move():
    rig = at(3.0)
    for pose, twist in ((None, STILL), (HERE, None)):
        record = rig.chain.admit(rig.now, BACK, rig.now, pose, twist)
        assert record.admitted == STILL
        assert record.reasons == ("pose or velocity of the base is not known",)
    unwatched = Rule(dataclasses.replace(LIMITS, watched=False))
    unwatched.track_user(0, 0, 1.1, 0.0)
    assert unwatched.admit(0, BACK, 0, None, STILL).admitted == BACK
    assert unwatched.admit(0, AHEAD, 0, HERE, STILL).admitted == AHEAD
    assert unwatched.admit(0, BACK, 0, None, None).admitted == STILL


# ---- limits


@pytest.mark.requirement(50)
@pytest.mark.parametrize(("fast", "turning"), [(2.0, 1.5), (1.5, 2.0), (2.0, 0.5), (0.5, 2.0)])
def test_a_command_beyond_both_limits_is_scaled_by_the_one_that_it_exceeds_more(fast, turning):
    rig = Rig()
    told = Twist2(0.0, -2.5 * fast, 1.5 * turning)
    found = rig.admit(told, measured=STILL).admitted
    scale = 1.0 / max(fast, turning)
    assert (found.vx, found.vy, found.wz) == pytest.approx(
        (0.0, scale * told.vy, scale * told.wz), abs=1e-6
    )


@pytest.mark.requirement(50)
def test_the_speed_limit_is_one_of_the_norm_and_keeps_the_direction():
    record = at(20.0).admit(Twist2(-3.0, 4.0, 1.0), measured=STILL)
    assert record.admitted == Twist2(-1.5, 2.0, 0.5)
    assert record.reasons == ("speed limit",)


@pytest.mark.requirement(50)
def test_a_turn_too_fast_shortens_the_velocity_too():
    assert at(20.0).admit(Twist2(-1.0, 0.0, 3.0), measured=STILL).admitted == Twist2(-0.5, 0.0, 1.5)


# ---- separation


@pytest.mark.requirement(52)
def test_the_speed_towards_the_user_is_that_of_the_formula():
    record = at(1.0).admit(Twist2(2.5, 0.0, 0.0))
    assert record.separation == pytest.approx(1.0)
    # v (0.1 + 0.5 / 3) + v^2 / 6 = 1.0 - 0.35 - 0.05
    v = record.admitted.vx
    assert v * (0.1 + 0.5 / 3) + v * v / 6 == pytest.approx(0.6)
    assert record.allowed == pytest.approx(v)
    assert record.reasons == ("separation",)


def test_only_the_part_of_the_velocity_towards_the_user_is_taken_away():
    record = at(0.3).admit(Twist2(1.0, -0.8, 0.0))
    assert record.admitted == Twist2(0.0, -0.8, 0.0)


def test_a_differential_base_goes_slower_where_it_looks():
    chain = Rule(LIMITS)
    chain.holonomic = False
    for n in range(8):
        chain.track_user(n * 30 * MS, n * 30 * MS, 1.0, 1.0)
    command = Twist2(1.0, 0.0, 0.0)
    record = chain.admit(210 * MS, command, 210 * MS, HERE, command)
    assert record.admitted.vy == 0.0
    assert 0.0 <= record.admitted.vx < 1.0


@pytest.mark.parametrize(("speed", "taken_for"), [(0.0, 0.5), (0.8, 1.3), (1.5, 2.0)])
def test_the_user_is_as_fast_as_measured_and_as_uncertain_as_that_is(speed, taken_for):
    record = Rig(12.0, speed=speed).admit(AHEAD)
    assert record.user_speed == pytest.approx(taken_for, abs=1e-6)


def test_a_user_of_unknown_speed_walks():
    chain = Rule(LIMITS)
    chain.track_user(0, 0, 3.0, 0.0)
    assert chain.admit(0, AHEAD, 0, HERE, AHEAD).user_speed == 1.6


def test_the_needed_separation_is_that_of_the_measured_motion():
    rig = at(2.0)
    assert rig.admit(STILL, measured=AHEAD).needed == pytest.approx(
        0.5 * (0.1 + 1 / 3) + 1.0 * (0.1 + 1 / 6) + 0.35
    )
    assert rig.admit(AHEAD, measured=BACK).needed == 0.0


# ---- granted touches


def asked(gap, **options):
    rig = at(gap, **options)
    rig.chain.request(True)
    return rig


@pytest.mark.requirement(79, 86)
@pytest.mark.parametrize("gap", [0.1, 0.2, 0.35])
def test_a_user_who_has_asked_and_stands_still_may_be_approached_slowly(gap):
    assert at(gap).admit(AHEAD).admitted == STILL
    record = asked(gap).admit(AHEAD)
    assert record.admitted == Twist2(0.25, 0.0, 0.0)
    assert record.reasons == ("granted touch", "separation")


def test_a_grant_does_not_slow_down_who_is_far_enough():
    record = asked(1.0).admit(Twist2(2.5, 0.0, 0.0))
    assert record.admitted.vx > 1.0
    assert "granted touch" not in record.reasons


@pytest.mark.parametrize("speed", [0.12, 0.5])
def test_a_user_who_has_asked_and_moves_is_not_approached(speed):
    rig = asked(0.5, speed=speed)
    while rig.distance > 0.3 + 1.065:
        rig.watch(10)
    assert rig.admit(AHEAD).admitted == STILL


@pytest.mark.requirement(149)
@pytest.mark.parametrize(
    ("age_ms", "speed"), [(50, 0.25), (75, 0.1875), (100, 0.125), (140, 0.025), (150, 0.0)]
)
def test_a_late_pose_slows_a_granted_touch_and_does_not_forbid_it(age_ms, speed):
    rig = asked(0.2)
    rig.chain.track_user(rig.now, rig.now, rig.distance, 0.0)
    rig.now += age_ms * MS
    record = rig.admit(AHEAD)
    assert record.admitted.vx == pytest.approx(speed, abs=1e-9)
    assert (record.reasons[0] == "granted touch") is (speed > 0.0)


@pytest.mark.requirement(149)
def test_the_way_of_a_touch_while_its_user_is_not_seen_never_grows_beyond_two_centimetres():
    rig = asked(0.2)
    rig.chain.track_user(rig.now, rig.now, rig.distance, 0.0)
    unseen = []
    for _ in range(16):
        unseen.append(rig.admit(AHEAD).admitted.vx * rig.admit(AHEAD).user_age)
        rig.now += 10 * MS
    assert 0.012 < max(unseen) < 0.02
    assert unseen[-1] == 0.0


@pytest.mark.requirement(149)
@pytest.mark.parametrize(("speed", "granted"), [(0.08, True), (0.12, False), (0.5, False)])
def test_whether_a_user_stands_still_is_told_from_late_poses_by_their_own_stamps(speed, granted):
    rig = asked(0.3)
    for n in range(8):
        rig.now += 33 * MS
        stamp = rig.now - 80 * MS
        rig.chain.track_user(rig.now, stamp, rig.distance - speed * n * 0.033, 0.0)
    assert ("granted touch" in rig.admit(AHEAD).reasons) is granted


@pytest.mark.parametrize(("gap", "speed"), [(0.031, 0.01), (0.03, 0.0), (0.0, 0.0)])
def test_three_centimetres_are_kept_where_the_pose_is_not_known(gap, speed):
    assert asked(gap).admit(AHEAD).admitted.vx == pytest.approx(speed, abs=1e-3)


@pytest.mark.parametrize(("gap", "passes"), [(0.44, False), (0.46, True)])
def test_a_grant_ends_at_the_gap_of_the_pose_less_its_tolerance(gap, passes):
    rig = asked(gap)
    rig.chain.grant(Pose2(gap - 0.5, 0.0, 0.0))  # from there the gap is 0.5 m, the tolerance 5 cm
    rig.chain.state["limits"]["uncertainty"] = 1.6
    assert (rig.admit(AHEAD).admitted.vx > 0.0) == passes


@pytest.mark.parametrize("bad", [Pose2(math.nan, 0.0), Pose2(0.0, 0.0, math.inf)])
def test_a_grant_that_is_no_pose_is_one_of_no_known_pose(bad):
    rig = asked(0.2)
    rig.chain.grant(bad)
    assert rig.admit(AHEAD).admitted == Twist2(0.25, 0.0, 0.0)


def test_the_end_of_a_request_ends_its_grant():
    rig = asked(0.2)
    rig.chain.grant(Pose2(-0.3, 0.0, 0.0))
    assert rig.admit(AHEAD).admitted == STILL
    rig.chain.request(False)
    assert rig.admit(AHEAD).admitted == STILL
    rig.chain.request(True)
    assert rig.admit(AHEAD).admitted == Twist2(0.25, 0.0, 0.0)


def test_without_a_request_a_grant_is_nothing():
    rig = at(0.2)
    rig.chain.grant(Pose2(0.5, 0.0, 0.0))
    assert rig.admit(AHEAD).admitted == STILL


# ---- where the figures come from


def test_brakes_reaction_and_outline_come_from_the_robot_and_caps_from_the_profile():
    base = dataclasses.replace(ROBOT.base, brake_deceleration=2.0, reaction_time=0.2)
    robot = dataclasses.replace(ROBOT, base=base)
    limits = SafetyLimits.of(robot, MotionLimits(base_speed=0.7, base_yaw_rate=9.0))
    assert limits.stopping == Stopping(2.0, 0.2, 0.35)
    assert (limits.speed, limits.yaw_rate) == (0.7, 3.0)
    assert limits.footprint is ROBOT.footprint


@pytest.mark.parametrize(
    "wrong", [{"uncertainty": -0.1}, {"still": math.nan}, {"speed": math.inf},
              {"late": 0.15}, {"old": 0.6}],
)  # fmt: skip
def test_limits_that_cannot_be_are_refused(wrong):
    with pytest.raises(ValueError, match="safety:"):
        dataclasses.replace(LIMITS, **wrong)


# ---- records


def test_every_cycle_leaves_a_record_that_cannot_be_changed():
    rig = at(2.0)
    reader = rig.chain.cycles.reader()
    reader.read_new()
    record = rig.admit(AHEAD)
    assert reader.read_new() == [record]
    with pytest.raises(AttributeError):
        record.needed = 0.0


def test_several_readers_each_get_every_record():
    rig = at(2.0)
    readers = [rig.chain.cycles.reader() for _ in range(2)]
    before = [len(reader.read_new()) for reader in readers]
    assert before == [30, 30]
    first = [rig.admit(AHEAD) for _ in range(3)]
    assert readers[0].read_new() == first
    second = [rig.admit(BACK)]
    assert readers[0].read_new() == second
    assert readers[1].read_new() == first + second


def test_records_are_bounded():
    rig = at(2.0)
    slow = rig.chain.cycles.reader()
    for _ in range(KEPT + 10):
        rig.admit(AHEAD)
    assert len(slow.read_new()) == KEPT
    assert slow.missed == 40


@pytest.mark.requirement(54)
def test_no_text_of_the_chain_claims_to_be_more_than_a_software_stop():
    modules = (
        guarded, safety_chain, safety_rule, checks, safety_limits, safety_record, separation,
    )  # fmt: skip
    text = "".join(map(inspect.getsource, modules))
    for claim in ("emergency", r"\bsafe\b", "certified", "compliant", "collision-free"):
        assert not re.search(claim, text, re.IGNORECASE), claim
    assert "software stop" in text


# ---- a pose that is an estimate, a command that is late


@pytest.mark.requirement(149)
def test_the_speed_limit_falls_from_a_command_40_ms_old_on_and_is_nothing_at_80():
    rig = Rig()
    speeds = {}
    for age in range(0, 100, 5):
        rig.watch(10)
        speeds[age] = rig.admit(Twist2(2.5), age_ms=age).admitted.speed
    assert {speeds[age] for age in range(0, 45, 5)} == {2.5}
    falling = [speeds[age] for age in range(40, 85, 5)]
    assert all(a - b == pytest.approx(2.5 / 8.0) for a, b in itertools.pairwise(falling))
    assert speeds[80] == speeds[85] == speeds[95] == 0.0


def test_a_late_command_says_so():
    rig = Rig()
    assert rig.admit(Twist2(2.0), age_ms=60).reasons == (safety_record.COMMAND_LATE,)
    assert rig.admit(Twist2(2.0), age_ms=40).reasons == ()
    assert rig.admit(Twist2(0.5), age_ms=60).reasons == ()  # it is slow enough
    assert rig.admit(STILL, age_ms=79).admitted == STILL


def test_an_unsure_pose_needs_more_room():
    """Three standard deviations above what C covers count as if the user were nearer."""
    for sigma in (0.0, 0.025, 0.05, 0.2):
        more = max(0.0, 3.0 * sigma - 0.075)
        sure, unsure = at(0.8), at(0.8 + more)
        for rig in (sure, unsure):
            rig.watch(30)
        args = (AHEAD, sure.now, HERE, AHEAD)
        exact = sure.chain.admit(sure.now, *args)
        found = unsure.chain.admit(unsure.now, *args, sigma)
        assert found.allowed == pytest.approx(exact.allowed, abs=1e-9)
        assert found.needed == pytest.approx(exact.needed + more, abs=1e-9)


def test_a_pose_without_any_idea_how_sure_is_none():
    rig = Rig()
    for sigma in (math.inf, math.nan):
        record = rig.chain.admit(rig.now, AHEAD, rig.now, HERE, STILL, sigma)
        assert record.admitted == STILL
        assert record.reasons == (safety_record.BASE_UNKNOWN,)


def test_commands_get_late_before_they_are_old():
    with pytest.raises(ValueError, match="command_late"):
        dataclasses.replace(LIMITS, command_late=0.08)


@pytest.mark.requirement(79, 86)
def test_a_grant_that_comes_before_its_request_is_kept():
    """Both come by links of their own, in any order; from the pose granted nothing is nearer."""
    rig = at(0.2)
    rig.chain.grant(Pose2(-0.3, 0.0, 0.0))
    for _ in range(2):
        rig.chain.request(True)
        assert rig.admit(AHEAD).admitted == STILL
