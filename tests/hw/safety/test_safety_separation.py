"""Gaps and closing speeds against shapely and against two bodies moved step by step."""

import dataclasses
import math
import random

import pytest
from hypothesis import assume, given, settings, strategies as st
from shapely import affinity
from shapely.geometry import Point, box

from hw.geometry import Twist2
from hw.model.robot import MotionLimits, load_robot
from hw.safety.limits import SafetyLimits, Stopping
from hw.safety.rule import SafetyRule
from hw.safety.separation import Nearness, allowed_speed, nearness, needed_separation
from hw.safety.user_track import age_of
from tests.repeats import examples

LENGTH, WIDTH, RADIUS = 0.565, 0.455, 0.5
OUTLINE = box(-LENGTH, -WIDTH, LENGTH, WIDTH)
MS = 1_000_000

places = st.floats(-4.0, 4.0)
speeds = st.floats(-3.0, 3.0)
directions = st.floats(-math.pi, math.pi)


def near(x, y):
    return nearness(LENGTH, WIDTH, x, y, RADIUS)


def true_gap(x, y, moved=(0.0, 0.0), turned=0.0):
    """The gap after the base has moved and turned."""
    outline = affinity.rotate(OUTLINE, turned, origin=(0, 0), use_radians=True)
    return affinity.translate(outline, *moved).distance(Point(x, y)) - RADIUS


# ---- nearness


@pytest.mark.requirement(52)
@settings(deadline=None, max_examples=examples(200))
@given(places, places)
def test_the_gap_is_the_distance_of_outline_and_cylinder(x, y):
    inside = OUTLINE.exterior.distance(Point(x, y)) if OUTLINE.contains(Point(x, y)) else 0.0
    assert near(x, y).gap == pytest.approx(true_gap(x, y) - inside, abs=1e-12)


@settings(deadline=None, max_examples=examples(300))
@given(places, places, speeds, speeds, st.floats(-2.0, 2.0))
def test_velocity_and_turn_close_the_gap_as_fast_as_nearness_says(x, y, vx, vy, wz):
    assume(not OUTLINE.buffer(0.01).contains(Point(x, y)))
    found, step = near(x, y), 1e-6
    moved = (true_gap(x, y, moved=(-vx * step, -vy * step)) - true_gap(x, y)) / step
    turned = (true_gap(x, y, turned=-wz * step) - true_gap(x, y)) / step
    assert found.nx * vx + found.ny * vy == pytest.approx(moved, abs=1e-3)
    assert found.lever * wz == pytest.approx(turned, abs=1e-3)


@pytest.mark.parametrize(
    ("x", "y"),
    [(0.0, 0.0), (-0.0, -0.0), (LENGTH, 0.0), (0.0, WIDTH), (LENGTH, WIDTH), (5e-324, 0.0),
     (LENGTH + 5e-324, WIDTH + 5e-324), (LENGTH + 1e-13, -WIDTH - 1e-13), (0.5, 0.0)],
)  # fmt: skip
def test_the_direction_is_a_unit_vector_wherever_the_user_stands(x, y):
    found = near(x, y)
    assert math.hypot(found.nx, found.ny) == pytest.approx(1.0, abs=1e-12)
    assert found.gap <= -RADIUS + 1e-9


# ---- holding back


@settings(deadline=None, max_examples=examples(300))
@given(places, places, speeds, speeds, speeds, st.floats(0.0, 3.0), st.booleans())
def test_what_is_held_back_is_a_share_of_what_closes_and_nothing_else(
    x, y, vx, vy, wz, allowed, holonomic
):
    found, command = near(x, y), Twist2(vx, vy if holonomic else 0.0, wz)
    held = found.held_back(command, allowed, holonomic)
    before = found.nx * command.vx + found.ny * command.vy
    after = found.nx * held.vx + found.ny * held.vy
    across = found.nx * command.vy - found.ny * command.vx
    across_after = found.nx * held.vy - found.ny * held.vx
    assert held.speed <= command.speed + 1e-12
    assert abs(held.wz) <= abs(command.wz)
    assert held.wz * command.wz >= 0.0
    assert min(before, 0.0) - 1e-12 <= after <= before + 1e-12
    if holonomic:
        assert across_after == pytest.approx(across, abs=1e-12)
    else:
        assert held.vy == 0.0
        assert held.vx * command.vx >= 0.0
    turning, turning_after = found.lever * command.wz, found.lever * held.wz
    assert max(0.0, after) + max(0.0, turning_after) <= max(allowed, 0.0) + 1e-9
    if before <= 0.0:
        assert (held.vx, held.vy) == (command.vx, command.vy)
    if turning <= 0.0:
        assert held.wz == command.wz


def test_a_turn_cannot_make_up_for_driving_at_the_user():
    ahead = near(1.5, 0.3)
    assert ahead.lever < 0.0
    held = ahead.held_back(Twist2(1.0, 0.0, 3.0), 0.0)
    assert held == Twist2(0.0, 0.0, 3.0)


def test_velocity_and_turn_are_shortened_by_the_same_share():
    ahead = Nearness(1.0, 1.0, 0.0, 0.5)
    held = ahead.held_back(Twist2(1.0, 0.7, 2.0), 1.0)
    assert (held.vx, held.vy, held.wz) == pytest.approx((0.5, 0.7, 1.0))


# ---- stopping


def needed(stopping, closing, user_speed, age):
    return needed_separation(closing, user_speed, age, dataclasses.astuple(stopping))


def allowed_at(stopping, gap, user_speed, age):
    return allowed_speed(gap, user_speed, age, dataclasses.astuple(stopping))


def least_gap(stopping, start, closing, user_speed, age):
    """The gap that is left, by moving both in small steps: the user comes all the time."""
    dt = 1e-4
    gap, v, t = start - user_speed * age, closing, 0.0
    while v > 0.0:
        if t >= stopping.reaction:
            v = max(0.0, v - stopping.deceleration * dt)
        gap -= (user_speed + v) * dt
        t += dt
    return gap


@pytest.mark.requirement(50, 52)
@settings(deadline=None, max_examples=40)
@given(
    st.floats(0.05, 2.5), st.floats(0.0, 2.0), st.floats(0.0, 0.15), st.floats(0.6, 4.0),
    st.floats(0.0, 0.3), st.floats(0.0, 1.0),
)  # fmt: skip
def test_from_the_needed_separation_both_stop_with_the_clearance_between_them(
    closing, user_speed, age, deceleration, reaction, clearance
):
    stopping = Stopping(deceleration, reaction, clearance)
    start = needed(stopping, closing, user_speed, age)
    assert least_gap(stopping, start, closing, user_speed, age) == pytest.approx(
        clearance, abs=2e-3
    )


@settings(deadline=None, max_examples=examples(200))
@given(
    st.floats(-1.0, 8.0), st.floats(0.0, 3.0), st.floats(0.0, 0.15), st.floats(0.2, 6.0),
    st.floats(0.0, 0.5), st.floats(0.0, 1.0),
)  # fmt: skip
def test_the_allowed_speed_is_the_largest_whose_separation_is_there(
    gap, user_speed, age, deceleration, reaction, clearance
):
    stopping = Stopping(deceleration, reaction, clearance)
    allowed = allowed_at(stopping, gap, user_speed, age)
    assert allowed >= 0.0
    if allowed > 1e-6:
        assert needed(stopping, allowed, user_speed, age) == pytest.approx(gap, abs=1e-9)
    assert needed(stopping, allowed + 1e-3, user_speed, age) > gap


def test_figures_of_the_norm_by_hand():
    # v_h = 1.6 m/s, T = 0.1 s, C = 0.35 m: 1.6 * (0.1 + 0.75) + 0.15 + 0.5625 + 0.35
    assert needed(Stopping(2.0, 0.1, 0.35), 1.5, 1.6, 0.0) == pytest.approx(2.4225)
    assert needed(Stopping(3.0, 0.1, 0.35), 2.5, 1.6, 0.0) == pytest.approx(3.135, abs=1e-3)
    allowed = [
        allowed_at(Stopping(2.0, 0.1, 0.35), gap, 1.6, 0.0) for gap in (0.5, 1.0, 1.5, 2.0, 2.5)
    ]
    assert allowed == pytest.approx([0.0, 0.48, 0.88, 1.23, 1.55], abs=6e-3)


def test_a_robot_that_comes_no_nearer_needs_no_separation():
    assert needed(Stopping(3.0, 0.1, 0.35), 0.0, 1.6, 0.1) == 0.0


@pytest.mark.parametrize(
    "values", [(0.0, 0.1, 0.3), (-1.0, 0.1, 0.3), (math.nan, 0.1, 0.3), (3.0, -0.1, 0.3),
               (3.0, math.inf, 0.3), (3.0, 0.1, math.nan)],
)  # fmt: skip
def test_brakes_that_cannot_be_are_refused(values):
    with pytest.raises(ValueError, match="stopping:"):
        Stopping(*values)


# ---- the user's track


class UserTrack:
    """The track of a rule's user, with None for what is not known."""

    def __init__(self):
        self.rule = SafetyRule(SafetyLimits.of(load_robot("rbkairos_ur10"), MotionLimits()))
        self.user = self.rule.state["user"][0]
        self.add_position = self.rule.track_user

    x = property(lambda self: self.user.x)
    stamp_ns = property(lambda self: int(self.user.stamp_ns) if self.user.seen else None)
    speed = property(lambda self: self.user.speed if self.user.speed_known else None)
    steady = property(lambda self: self.user.steady if self.user.steady_known else None)

    def age_s(self, now):
        return age_of(self.user, now)


def walked(speed, stamps):
    track = UserTrack()
    for stamp in stamps:
        assert track.add_position(stamp, stamp, speed * stamp / 1e9, 1.0)
    return track


@settings(deadline=None, max_examples=60)
@given(st.floats(0.0, 3.0), st.sampled_from([11, 16, 33, 50, 100]))
def test_the_speed_of_an_even_walk_is_exact_at_any_rate(speed, period):
    track = walked(speed, range(0, 600 * MS, period * MS))
    assert track.speed == pytest.approx(speed, abs=1e-9)


def test_the_speed_is_that_of_the_last_tenth_of_a_second():
    track = UserTrack()
    for n in range(20):
        track.add_position(n * 33 * MS, n * 33 * MS, 0.0, 0.0)
    for n in range(20, 24):
        track.add_position(n * 33 * MS, n * 33 * MS, 1.5 * (n - 19) * 0.033, 0.0)
    assert track.speed == pytest.approx(1.5, abs=1e-9)


def test_nothing_is_known_of_the_speed_at_first_and_after_a_silence():
    track = walked(1.0, [0, 33 * MS])
    assert track.speed is None
    track = walked(1.0, range(0, 300 * MS, 33 * MS))
    assert track.speed is not None
    last = track.stamp_ns
    assert track.add_position(last + 151 * MS, last + 151 * MS, 0.0, 0.0)
    assert (track.speed, track.steady) == (None, None)


@pytest.mark.requirement(149)
def test_poses_from_nowhere_from_the_past_and_from_the_future_are_refused():
    track = walked(1.0, range(0, 300 * MS, 33 * MS))
    newest, x = track.stamp_ns, track.x
    now = newest + 10 * MS
    for stamp, px in (
        (newest, 0.0),
        (newest - 1, 0.0),
        (-(10**30), 0.0),
        (10**30, 0.0),
        (now + 21 * MS, 0.0),
        (now, math.nan),
        (now, math.inf),
        (now, 1e300),
    ):
        assert not track.add_position(now, stamp, px, 0.0)
    assert (track.stamp_ns, track.x) == (newest, x)
    assert track.add_position(now, now + 5 * MS, 3.0, 0.0)
    assert track.age_s(now) == 0.0


def test_a_track_without_a_pose_is_infinitely_old():
    assert UserTrack().age_s(0) == math.inf


def test_of_a_user_whose_tracking_jumps_nothing_is_known_for_a_moment():
    track = walked(0.0, range(0, 600 * MS, 33 * MS))
    since = track.stamp_ns
    found = []
    for n in range(1, 6):
        track.add_position(since + n * 33 * MS, since + n * 33 * MS, 3.0, 1.0)
        found.append((track.speed, track.steady))
    assert found[:2] == [(None, None)] * 2
    assert found[2:] == [(0.0, 0.0)] * 3


def test_a_leap_that_a_person_could_make_is_a_high_speed_and_not_a_long_one():
    track = walked(0.0, range(0, 600 * MS, 33 * MS))
    since = track.stamp_ns
    speeds = []
    for n in range(1, 6):
        track.add_position(since + n * 33 * MS, since + n * 33 * MS, 0.3, 1.0)
        speeds.append(track.speed)
    assert speeds[0] > 2.5
    assert speeds[-1] < 1.5


def test_a_user_who_stands_seen_with_noise_stands_and_may_be_as_fast_as_the_noise():
    chance, track = random.Random(1), UserTrack()
    steady, speeds = [], []
    for n in range(900):
        stamp = n * 33 * MS
        track.add_position(stamp, stamp, chance.gauss(0.0, 0.01), chance.gauss(0.0, 0.01))
        if n > 10:
            steady.append(track.steady)
            speeds.append(track.speed)
            assert track.speed >= track.steady
    assert sum(speed >= 0.1 for speed in steady) < 0.03 * len(steady)
    assert max(speeds) < 0.6


def test_who_sets_off_is_noticed_within_a_tenth_of_a_second():
    track = walked(0.0, range(0, 600 * MS, 33 * MS))
    since = track.stamp_ns
    for n in range(1, 4):
        track.add_position(since + n * 33 * MS, since + n * 33 * MS, 1.2 * n * 0.033, 1.0)
    assert track.speed > 1.1
    assert track.steady > 0.3
