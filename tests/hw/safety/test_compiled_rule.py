"""The compiled rule and the compiled cycles of wheels against plain ones, to the last bit."""

from __future__ import annotations

import dataclasses
import math

import pytest
from hypothesis import given, settings, strategies as st

from hw.geometry import Pose2, Twist2, wrap
from hw.model.robot import MotionLimits, load_robot
from hw.motion.velocity_estimator import KEPT, Motion
from hw.safety.chain import LocalChain
from hw.safety.limits import SafetyLimits
from hw.safety.rule import SafetyRule
from hw.samples import Sample, UserPose
from hw.sim.sim_base import SimBase
from tests.hw.safety.plain_rule import PlainMotion, PlainRule
from tests.hw.sim.plain_wheels import PlainWheels
from tests.repeats import examples

ROBOT = load_robot("rbkairos_ur10")
CAPS = MotionLimits(
    base_acceleration=8.0, base_yaw_acceleration=8.0, base_speed=2.5, base_yaw_rate=1.5
)
LIMITS = SafetyLimits.of(ROBOT, CAPS)
MS = 1_000_000
TICK = 33_333_333

places = st.floats(-2.5, 2.5)
speeds = st.floats(-3.0, 3.0)
wild = st.one_of(places, st.sampled_from([math.nan, math.inf, -1e300, 0.0, -0.0, 0.565]))
twists = st.builds(Twist2, speeds, speeds, speeds)
poses = st.builds(Pose2, places, places, st.floats(-3.1, 3.1))
usual = {
    "dt": st.integers(5 * MS, 20 * MS),
    "command": twists,
    "old": st.integers(0, 60 * MS),
    "pose": st.builds(Pose2, st.floats(-0.3, 0.3), st.floats(-0.3, 0.3), st.floats(-3.1, 3.1)),
    "twist": st.builds(Twist2, st.floats(-1.5, 1.5), st.floats(-1.5, 1.5), st.floats(-1.4, 1.4)),
    "sigma": st.sampled_from([0.0, 0.0, 0.01, 0.1]),
    "user": st.tuples(st.floats(-0.01, 0.01), st.integers(-20, 0)),
    "stop": st.none(),
    "request": st.booleans(),
    "grant": st.one_of(st.none(), poses),
    "holonomic": st.booleans(),
    "reset": st.booleans(),
    "rests": st.just(False),
}
unusual = {
    "dt": st.integers(-MS, 600 * MS),
    "command": st.builds(Twist2, wild, wild, wild),
    "old": st.integers(-40 * MS, 100 * MS),
    "pose": st.one_of(st.none(), st.builds(Pose2, wild, wild, wild)),
    "twist": st.one_of(st.none(), twists, st.builds(Twist2, wild, wild, wild)),
    "sigma": st.sampled_from([math.inf, math.nan]),
    "user": st.one_of(st.none(), st.tuples(st.floats(-2.0, 2.0), st.integers(-160, 30))),
    "stop": st.just("button"),
    "grant": st.builds(Pose2, wild, wild, wild),
    "rests": st.just(True),
}
cycles = st.lists(
    st.one_of(
        st.fixed_dictionaries(usual),
        *(st.fixed_dictionaries({**usual, name: odd}) for name, odd in unusual.items()),
    ),
    min_size=12,
    max_size=40,
)


@pytest.mark.requirement(48, 50, 149)
@settings(deadline=None, max_examples=examples(300))
@given(
    cycles, st.floats(-3.5, 3.5), places, st.sampled_from([True, True, False]),
    st.sampled_from([True, True, False]), st.sampled_from([0.0, 0.4, 1.2]),
)  # fmt: skip
def test_whatever_comes_the_compiled_rule_admits_what_the_plain_one_does(
    script, x, y, governor, watched, walk
):
    limits = dataclasses.replace(LIMITS, governor=governor, watched=watched)
    rule, plain, now = SafetyRule(limits), PlainRule(limits), 0
    reader = rule.cycles.reader()
    for given_ in script:
        now += given_["dt"]
        if given_["user"] is not None:
            off, late = given_["user"]
            seen = (now, now + late * MS, x + walk * now * 1e-9, y + off * (walk > 0.0))
            assert rule.track_user(*seen) is plain.track_user(*seen)
        for one in (rule, plain):
            one.stop_line = given_["stop"]
            one.request(given_["request"])
            one.grant(given_["grant"])
        plain.holonomic = given_["holonomic"]
        if given_["reset"]:
            assert rule.reset(now) is plain.reset(now)
        if given_["rests"]:
            rule.rest(now)
            plain.rest(now)
        else:
            at = (now, given_["command"], now - given_["old"], given_["pose"], given_["twist"])
            admitted = rule.admit(*at, given_["sigma"], given_["holonomic"])
            wanted = plain.admit(*at, given_["sigma"])
            (record,) = reader.read_new()
            assert repr(record) == repr(wanted)
            assert repr(admitted) == repr(wanted.admitted)
            assert (admitted is at[1]) is (wanted.admitted is at[1])
        assert (rule.latched, rule.refused) == (plain.latched, plain.refused)


ticks = st.lists(
    st.fixed_dictionaries(
        {
            "target": st.builds(Twist2, speeds, speeds, st.floats(-2.0, 2.0)),
            "held": st.integers(2, 12),
            "mode": st.sampled_from(["omni", "omni", "omni", "differential"]),
            "user": st.sampled_from([True, True, True, False]),
            "old": st.sampled_from([0, 0, 0, 0, 45 * MS, 70 * MS, 90 * MS]),
            "braked": st.sampled_from([False, False, False, False, False, True]),
            "stop": st.sampled_from([None, None, None, None, None, "button"]),
            "span": st.sampled_from([TICK, TICK, TICK, 7 * MS, 1]),
        }
    ),
    min_size=2,
    max_size=8,
)


@pytest.mark.requirement(48, 50)
@settings(deadline=None, max_examples=examples(150))
@given(ticks, st.floats(1.0, 4.0), st.floats(-0.6, 0.6), st.floats(-3.1, 3.1))
def test_compiled_cycles_move_the_wheels_as_plain_ones_do(script, x, y, yaw):
    start, limits = Pose2(0.0, 0.0, yaw), LIMITS
    base, rule = SimBase(ROBOT, CAPS, start), PlainRule(limits)
    base.chain = chain = LocalChain(limits, measures=False)
    reader, wheels, now = chain.cycles.reader(), PlainWheels(ROBOT, CAPS, start, rule), 0
    for given_ in script:
        for _ in range(given_["held"]):
            if given_["user"]:
                seen = UserPose(Pose2(x, y), 0.0)
                chain.hear(Sample("user.pose", now, seen), now)
                rule.track_user(now, now, x, y)
            chain.hear(Sample("stop.engaged", now, given_["stop"]), now)
            rule.stop_line = given_["stop"]
            base.use(given_["mode"])
            wheels.wanted_mode = given_["mode"]
            stamp = now - given_["old"]
            chain.command(given_["target"], stamp)
            base.braked = wheels.braked = given_["braked"]
            base.drive(given_["target"])
            base.advance(now + given_["span"])
            wheels.advance(given_["target"], now, now + given_["span"], stamp)
            now += given_["span"]
            assert (repr(base.pose), repr(base.twist)) == (repr(wheels.pose), repr(wheels.twist))
            assert (base.distance_m, base.energy_j) == (wheels.distance, wheels.energy)
            assert [repr(r) for r in reader.read_new()] == [repr(r) for r in wheels.taken()]
            assert (chain.latched, chain.refused) == (rule.latched, rule.refused)


@settings(deadline=None, max_examples=examples(100))
@given(
    st.lists(st.tuples(st.integers(-5 * MS, 200 * MS), wild, places, places), max_size=40),
    st.sampled_from([0.1, 0.3, 0.8]),
    st.sampled_from([1, 20]),
)
def test_a_compiled_velocity_is_the_plain_one(steps, window, repeats):
    motion, plain, now = Motion(window), PlainMotion(window), 0
    for dt, x, y, yaw in steps:
        for _ in range(repeats):
            now += dt // repeats
            if not math.isfinite(x):
                x = 0.0
            motion.add_pose(now, x, y, wrap(yaw))
            plain.add_pose(now, x, y, wrap(yaw))
            assert repr(motion.velocity) == repr(plain.velocity)


def test_of_a_trail_longer_than_is_kept_the_newest_half_counts():
    motion = Motion(1e6, gone=1e6)
    for n in range(5 * KEPT):
        motion.add_pose(n * MS, 0.0 if n < 4 * KEPT else (n - 4 * KEPT) * 1e-3, 0.0)
    assert motion.velocity is not None
    assert motion.velocity.vx == pytest.approx(1.0)
