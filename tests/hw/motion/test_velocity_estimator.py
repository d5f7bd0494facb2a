"""Velocity of a person from noisy poses with gaps, jumps and late stamps."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from hw.geometry import STILL, Twist2, wrap
from hw.motion.velocity_estimator import Motion


def ns(seconds: float) -> int:
    return round(seconds * 1e9)


def feed(motion: Motion, poses: list[tuple[float, float, float, float]]) -> Twist2 | None:
    for t, x, y, yaw in poses:
        motion.add_pose(ns(t), x, y, wrap(yaw))
    return motion.velocity


def walk(
    hz: float, seconds: float, vx: float, vy: float, wz: float = 0.0, since: float = 0.0
) -> list[tuple[float, float, float, float]]:
    times = [since + i / hz for i in range(round(hz * seconds) + 1)]
    return [(t, vx * t, vy * t, wz * t) for t in times]


@given(vx=st.floats(-2, 2), vy=st.floats(-2, 2), wz=st.floats(-3, 3), hz=st.sampled_from([30, 120]))
@settings(deadline=None, max_examples=50)
def test_a_steady_walk_is_found_exactly(vx: float, vy: float, wz: float, hz: float) -> None:
    found = feed(Motion(0.3), walk(hz, 1.0, vx, vy, wz))

    assert found is not None
    assert (found.vx, found.vy, found.wz) == pytest.approx((vx, vy, wz), abs=1e-6)


def test_motion_capture_s_noise_stays_below_the_limit_of_standing_still() -> None:
    rng = np.random.default_rng(1)
    motion, worst = Motion(0.3), 0.0
    for i in range(1200):
        x, y = rng.normal(0.0, 0.001, 2)
        found = feed(motion, [(i / 120, x, y, 0.0)])
        worst = max(worst, found.speed if found is not None else 0.0)

    assert worst < 0.05


def test_there_is_no_velocity_before_fifty_milliseconds_are_seen() -> None:
    motion = Motion(0.3)

    assert feed(motion, walk(100, 0.04, 1.0, 0.0)) is None
    found = feed(motion, walk(100, 0.0, 1.0, 0.0, since=0.05))
    assert found is not None
    assert found.vx == pytest.approx(1.0)


@pytest.mark.requirement(149)
def test_after_a_gap_it_begins_anew() -> None:
    motion = Motion(0.3)
    feed(motion, walk(100, 1.0, 1.0, 0.0))

    assert feed(motion, [(2.0, 5.0, 5.0, 0.0)]) is None
    found = feed(motion, [(2.0 + t, 5.0, 5.0 + t, 0.0) for t in (0.05, 0.1, 0.15)])

    assert found is not None
    assert (found.vx, found.vy) == pytest.approx((0.0, 1.0), abs=1e-6)


@pytest.mark.requirement(149)
@pytest.mark.parametrize(("silence", "known"), [(0.15, True), (0.16, False)])
def test_what_is_older_than_poses_may_be_is_forgotten(silence: float, known: bool) -> None:
    motion = Motion(0.3)
    feed(motion, walk(100, 1.0, 1.0, 0.0))

    found = feed(motion, [(1.0 + silence, 1.0 + silence, 0.0, 0.0)])

    assert (found is not None) is known


def test_a_jump_of_the_tracking_is_no_motion() -> None:
    motion = Motion(0.3)
    feed(motion, walk(100, 1.0, 0.0, 0.0))

    assert feed(motion, [(1.01, 3.0, 0.0, 0.0)]) is None
    found = feed(motion, [(1.01 + i / 100, 3.0, 0.0, 0.0) for i in range(1, 20)])

    assert found is not None
    assert found.speed == pytest.approx(0.0, abs=1e-9)


def test_turning_over_the_seam_at_pi_is_slow() -> None:
    found = feed(Motion(0.3), [(i / 50, 0.0, 0.0, 3.0 + 0.02 * i) for i in range(30)])

    assert found is not None
    assert found.wz == pytest.approx(1.0)


def test_late_samples_change_nothing() -> None:
    motion = Motion(0.3)
    before = feed(motion, walk(100, 1.0, 1.0, 0.0))

    assert feed(motion, [(0.5, 9.0, 9.0, 0.0)]) == before


def test_a_person_who_does_not_move_at_all_has_exactly_the_velocity_still() -> None:
    motion = Motion(0.3)
    for i in range(100):
        found = feed(motion, [(i / 30, 3.1, 4.7, 0.3)])

    assert found is STILL


def test_somebody_who_has_just_stopped_is_not_still_before_the_window_says_so() -> None:
    motion = Motion(0.3)
    feed(motion, walk(100, 1.0, 1.0, 0.0))
    slower = [feed(motion, [(1.0 + i / 100, 1.0, 0.0, 0.0)]) for i in range(1, 32)]

    assert all(found is not STILL and found.vx > 0.0 for found in slower[:29])
    assert slower[-1] is STILL


def test_two_poses_of_one_instant_are_one() -> None:
    once, twice = Motion(0.3), Motion(0.3)
    poses = walk(100, 1.0, 1.0, 0.5)

    for pose in poses:
        feed(once, [pose])
        assert feed(twice, [pose, (pose[0], 9.0, 9.0, 1.0)]) == once.velocity


def test_the_delay_of_the_estimate_is_half_the_window() -> None:
    motion, window = Motion(0.3), 0.3
    for i in range(200):
        t = i / 100
        found = feed(motion, [(t, 0.5 * t * t, 0.0, 0.0)])  # 1 m/s2

    assert found is not None
    assert found.vx == pytest.approx(1.99 - window / 2, abs=0.01)
    assert math.isfinite(found.vy)


@given(start=st.floats(-math.pi, math.pi), wz=st.floats(-3.0, 3.0))
@settings(deadline=None, max_examples=50)
def test_a_turn_through_half_a_turn_goes_on_at_its_rate(start: float, wz: float) -> None:
    found = feed(Motion(0.3), [(t, 1.0, 2.0, start + wz * t) for t, *_ in walk(30, 2.5, 0, 0)])

    assert found is not None
    assert found.wz == pytest.approx(wz, abs=1e-6)


@given(since=st.integers(0, 1 << 61), v=st.tuples(*[st.floats(-2.0, 2.0)] * 3))
@settings(deadline=None, max_examples=20)
def test_when_it_was_seen_changes_no_bit_of_a_velocity(
    since: int, v: tuple[float, float, float]
) -> None:
    """Stamps of a wall clock are 1.7e18 ns: as seconds they have a tenth of a microsecond."""
    now, then = Motion(0.3), Motion(0.3)
    for t, x, y, yaw in walk(60, 0.4, *v):
        now.add_pose(ns(t), x, y, wrap(yaw))
        then.add_pose(since + ns(t), x, y, wrap(yaw))

    assert now.velocity == then.velocity
