"""Reckoned poses: exact where nothing is wrong, smooth under noise, back at once after a push."""

from __future__ import annotations

import math
import random

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from hw.geometry import STILL, Pose2, Twist2, wrap
from states.navigation.local.reckoning import (
    BAND,
    DELAY,
    estimate_delay,
    lose_track,
    reckon_place,
    reckon_pose,
    track_of,
)
from tests.states.navigation.local import plain_reckoning

DT = 1.0 / 30.0
speeds = st.floats(-1.5, 1.5)


class ReckonedPose:
    """A robot's track."""

    def __init__(self, delay: float) -> None:
        self.track = track_of(delay)

    @property
    def delay(self) -> float:
        return float(self.track[DELAY])

    def update(
        self, measured: Pose2, twist: Twist2, sent: Twist2, dt: float, *, lost: bool = False
    ) -> Pose2:
        if lost:
            lose_track(self.track)
        triples = (
            (float(measured.x), float(measured.y), float(measured.yaw)),
            *((float(v.vx), float(v.vy), float(v.wz)) for v in (twist, sent)),
        )
        return Pose2(*reckon_pose(self.track, *triples, dt))


class ReckonedPlace:
    """A user's place."""

    def __init__(self) -> None:
        self.place = np.zeros(3)

    def update(self, measured: tuple[float, float], velocity: tuple[float, float], dt: float):
        return reckon_place(self.place, measured, velocity, dt)


poses = st.builds(Pose2, st.floats(-5.0, 5.0), st.floats(-5.0, 5.0), st.floats(-math.pi, math.pi))
twists = st.builds(Twist2, speeds, speeds, speeds)


@settings(deadline=None, max_examples=50)
@given(
    delay=st.floats(0.0, 0.3),
    cycles=st.lists(st.tuples(poses, twists, twists, st.booleans()), min_size=1, max_size=20),
)
def test_a_robot_is_where_the_plain_rule_has_it_to_the_last_bit(delay, cycles) -> None:
    found, plain = ReckonedPose(delay), plain_reckoning.ReckonedPose(delay)
    for pose, twist, sent, lost in cycles:
        expected = plain.update(pose, twist, sent, DT, lost=lost)
        assert found.update(pose, twist, sent, DT, lost=lost) == expected
        assert found.delay == plain.delay


@settings(deadline=None, max_examples=50)
@given(cycles=st.lists(st.tuples(poses, twists), min_size=1, max_size=20))
def test_a_user_is_where_the_plain_rule_has_them_to_the_last_bit(cycles) -> None:
    found, plain = ReckonedPlace(), plain_reckoning.ReckonedPlace()
    for pose, twist in cycles:
        seen = (pose.x, pose.y), (twist.vx, twist.vy), DT
        assert found.update(*seen) == plain.update(*seen)


def evenly(pose: Pose2, before: Twist2, after: Twist2) -> Pose2:
    """Where a base comes whose velocity changes evenly within a cycle."""
    return Pose2(
        pose.x + 0.5 * DT * (before.vx + after.vx),
        pose.y + 0.5 * DT * (before.vy + after.vy),
        wrap(pose.yaw + 0.5 * DT * (before.wz + after.wz)),
    )


@settings(deadline=None, max_examples=50)
@given(sent=st.lists(st.tuples(speeds, speeds, speeds), min_size=2, max_size=40))
def test_a_base_that_goes_as_it_is_sent_is_where_it_is_measured(
    sent: list[tuple[float, float, float]],
) -> None:
    reckoned, pose, before = ReckonedPose(0.0), Pose2(3.0, -2.0, 3.0), STILL
    for velocity in (Twist2(*values) for values in sent):
        pose = evenly(pose, before, velocity)
        # the first velocity is that at the start
        found = reckoned.update(pose, velocity, velocity, DT)
        before = velocity
        assert math.dist((found.x, found.y), (pose.x, pose.y)) <= 1e-9
        assert abs(wrap(found.yaw - pose.yaw)) <= 1e-9
    assert reckoned.delay == pytest.approx(0.0, abs=1e-9)


def test_noise_of_a_standing_robot_is_averaged() -> None:
    chance, reckoned = random.Random(1), ReckonedPose(0.0)
    found = []
    for _ in range(12000):
        seen = Pose2(chance.gauss(0.0, 0.01), chance.gauss(0.0, 0.01), chance.gauss(0.0, 0.005))
        found.append(reckoned.update(seen, STILL, STILL, DT))
    # of an average with 0.1 the standard deviation is the root of 0.1 / 1.9 of the noise's
    spread = math.sqrt(sum(pose.x**2 for pose in found[60:]) / len(found[60:]))
    assert spread == pytest.approx(0.01 * math.sqrt(0.1 / 1.9), rel=0.2)
    assert max(abs(pose.yaw) for pose in found[30:]) < 0.005


def test_the_first_poses_are_averaged_with_equal_weights() -> None:
    reckoned = ReckonedPose(0.0)
    for x, mean in ((0.01, 0.01), (0.03, 0.02), (0.02, 0.02), (0.06, 0.03)):
        assert reckoned.update(Pose2(x, 0.0), STILL, STILL, DT).x == pytest.approx(mean)


@pytest.mark.parametrize(("x", "yaw"), [(2.0, 0.0), (0.0, 1.5), (0.1, 3.0)])
def test_a_robot_that_was_pushed_is_never_farther_off_than_the_band(x: float, yaw: float) -> None:
    reckoned = ReckonedPose(0.0)
    for _ in range(60):
        reckoned.update(Pose2(0.0, 0.0), STILL, STILL, DT)
    found = reckoned.update(Pose2(x, 0.0, yaw), STILL, STILL, DT)
    assert x - found.x <= BAND + 1e-9
    assert abs(wrap(yaw - found.yaw)) <= BAND + 1e-9


def followed(lag: float, delay: int, seed: int = 0, noise: float = 0.0, told: float = 0.0) -> float:
    """The delay found on wheels with a time constant, s, and commands some cycles late."""
    chance, reckoned = random.Random(seed), ReckonedPose(told)
    x = v = speed = 0.0
    late = [0.0] * (delay + 1)
    for cycle in range(240):
        speed = 0.75 + 0.75 * math.sin(DT * cycle)
        reckoned.update(Pose2(x + chance.gauss(0.0, noise), 0.0), Twist2(v), Twist2(late[-1]), DT)
        late = [*late[1:], speed]
        for _ in range(20):
            h = DT / 20.0
            target = late[0]
            rise = (1.0 - math.exp(-h / lag)) * (target - v) if lag else target - v
            x, v = x + h * (v + 0.5 * rise), v + rise
    return reckoned.delay


@pytest.mark.parametrize("noise", [0.0, 0.01])
@pytest.mark.parametrize(("lag", "delay"), [(0.1, 0), (0.2, 0), (0.1, 1)])
def test_delay_and_lag_of_the_wheels_are_found(lag: float, delay: int, noise: float) -> None:
    # that velocities change evenly within a cycle has half a cycle of it in already
    expected = lag + (delay - 0.5) * DT
    assert followed(lag, delay, noise=noise) == pytest.approx(expected, abs=0.02)


def test_what_was_told_counts_until_something_else_is_found() -> None:
    track = track_of(0.05)
    estimate_delay(track, (0.0, 0.0), (0.0, 0.0), DT)
    assert track[DELAY] == pytest.approx(0.05)
    assert followed(0.1, 0, told=0.25) == pytest.approx(0.083, abs=0.02)


def test_a_base_that_stands_though_it_is_sent_is_not_taken_for_a_late_one() -> None:
    reckoned, sent = ReckonedPose(0.02), STILL
    for _ in range(12):
        reckoned.update(Pose2(0.0, 0.0), STILL, sent, DT)
        sent = Twist2(sent.vx + 0.03)
    assert reckoned.delay > 0.05
    found = reckoned.update(Pose2(0.0, 0.0), STILL, STILL, DT, lost=True)
    assert reckoned.delay == 0.02
    assert found == Pose2(0.0, 0.0)


def test_a_walker_whose_velocity_is_known_is_reckoned_exactly_and_a_wrong_one_within_the_band() -> (
    None
):
    right, wrong = ReckonedPlace(), ReckonedPlace()
    for cycle in range(90):
        place = (1.2 * DT * cycle, 0.5)
        assert right.update(place, (1.2, 0.0), DT) == pytest.approx(place)
        assert math.dist(wrong.update(place, (0.0, 0.0), DT), place) <= BAND + 1e-9
