"""A pose carried on by the wheels: the covariance is that of many noisy drives."""

import math

import numpy as np
import pytest

from hw.geometry import Pose2
from states.localization.filter.planar import SLIPPING
from states.localization.wheels.dead_reckoning import SCALE, USUAL, WORST, DeadReckoning

STEPS = [Pose2(0.05, 0.01, 0.02)] * 40 + [Pose2(0.03, -0.02, -0.05)] * 40


def carried_on(steps, start=None):
    reckoning = DeadReckoning(SLIPPING)
    reckoning.slip = 1.0
    odom = Pose2(3.0, -1.0, 2.0)
    reckoning.correct(Pose2(1.0, 2.0, 0.5), np.zeros((3, 3)) if start is None else start, odom)
    for step in steps:
        odom = odom @ step
        reckoning.move(odom, 0.05, None)
    pose, covariance = reckoning.at(odom)
    return pose, covariance - reckoning.by_scale


def test_the_covariance_is_that_of_many_drives():
    rng = np.random.default_rng(3)
    start = np.array([[0.02, 0.005, 0.001], [0.005, 0.01, -0.002], [0.001, -0.002, 0.003]])
    pose, covariance = carried_on(STEPS, start)
    ends = []
    for _ in range(4000):
        x, y, yaw = np.array([1.0, 2.0, 0.5]) + rng.multivariate_normal(np.zeros(3), start)
        for step in STEPS:
            length, turn = math.hypot(step.x, step.y), abs(step.yaw)
            metre, radian = SLIPPING.per_metre, SLIPPING.per_radian
            place = rng.normal(0.0, math.sqrt(metre[0] * length + radian[0] * turn), 2)
            c, s = math.cos(yaw), math.sin(yaw)
            x += c * (step.x + place[0]) - s * (step.y + place[1])
            y += s * (step.x + place[0]) + c * (step.y + place[1])
            yaw += step.yaw + rng.normal(0.0, math.sqrt(metre[2] * length + radian[2] * turn))
        ends.append((x, y, yaw))
    seen = np.cov(np.array(ends).T)
    assert np.mean(ends, axis=0) == pytest.approx([pose.x, pose.y, pose.yaw], abs=0.05)
    assert covariance == pytest.approx(seen, rel=0.1, abs=0.003)


def test_a_way_out_and_back_counts_twice():
    out = carried_on([Pose2(0.1, 0.0)] * 20)[1]
    back = carried_on([Pose2(0.1, 0.0)] * 20 + [Pose2(-0.1, 0.0)] * 20)
    assert (back[0].x, back[0].y) == pytest.approx((1.0, 2.0))
    assert back[1][2, 2] == pytest.approx(2.0 * out[2, 2])


def along(metres, information=None):
    """After so many metres straight ahead in the map's x, matched at the end."""
    reckoning, odom = DeadReckoning(SLIPPING), Pose2(0.0, 0.0)
    reckoning.slip = 1.0
    reckoning.correct(odom, np.zeros((3, 3)), odom)
    for _ in range(round(10 * metres)):
        odom = odom @ Pose2(0.1, 0.0)
        reckoning.move(odom, 0.05, None)
    pose, covariance = reckoning.at(odom)
    if information is not None:
        reckoning.correct(pose, covariance - reckoning.by_scale, odom, np.diag(information))
    return covariance, reckoning.by_scale


def test_an_error_of_the_scale_adds_up_with_the_way():
    covariance, _ = along(60.0)
    assert math.sqrt(covariance[0, 0]) == pytest.approx(60.0 * SCALE, rel=0.01)
    assert along(0.3)[1] == pytest.approx(np.zeros((3, 3)))


def test_of_the_scale_a_match_takes_away_what_it_shows():
    assert along(60.0, (1e4, 1e4, 1e4))[1] == pytest.approx(np.zeros((3, 3)))
    beside = along(60.0, (0.0, 1e4, 1e4))[1]
    assert beside[0, 0] == pytest.approx(along(60.0)[1][0, 0], rel=1e-6)


def test_a_gyroscope_replaces_the_wheels_turn():
    reckoning = DeadReckoning(SLIPPING)
    reckoning.correct(Pose2(0.0, 0.0), np.zeros((3, 3)), Pose2(0.0, 0.0))
    reckoning.move(Pose2(1.0, 0.0, 0.3), 1.0, 0.1)
    assert reckoning.at(Pose2(1.0, 0.0, 0.3))[0].yaw == pytest.approx(0.1)


@pytest.mark.parametrize("times", [1.0, 3.0, 8.0])
def test_how_much_wheels_slip_is_learnt_from_matches(times):
    rng = np.random.default_rng(0)
    reckoning, found = DeadReckoning(SLIPPING), []
    for k in range(2000):
        assert 1.0 <= reckoning.slip <= WORST
        reckoning.correct(Pose2(0.0, 0.0), np.zeros((3, 3)), Pose2(0.0, 0.0))
        covariance = reckoning.at(Pose2(0.5, 0.0))[1]
        off = rng.multivariate_normal(np.zeros(3), times**2 * covariance / reckoning.slip)
        reckoning.weigh(off, covariance)
        found += [reckoning.slip] if k > 200 else []
    assert np.mean(found) == pytest.approx(max(1.0, times**2), rel=0.4)


def test_a_single_wrong_match_is_no_slip():
    reckoning = DeadReckoning(SLIPPING)
    reckoning.weigh(np.array([50.0, 0.0, 0.0]), np.eye(3))
    assert reckoning.slip < 4.0 * USUAL


def paced(speed, gap):
    """Reckoning after a steady way and then one step of no length over a gap, s: what it adds."""
    reckoning, odom = DeadReckoning(SLIPPING), Pose2(0.0, 0.0)
    reckoning.slip = 1.0
    for _ in range(4000):
        odom = odom @ Pose2(0.05 * speed, 0.0)
        reckoning.move(odom, 0.05, None)
    reckoning.correct(Pose2(0.0, 0.0), np.zeros((3, 3)), odom)
    reckoning.move(odom, gap, None)
    return reckoning.at(odom)[1]


def test_a_way_out_and_back_in_a_gap_is_as_uncertain_as_many_of_them():
    speed, gap, rng, ends = 0.8, 20.0, np.random.default_rng(1), []
    covariance = paced(speed, gap)
    step = 0.1
    for _ in range(700):
        x = y = yaw = 0.0
        for k in range(round(speed * gap / step)):
            turned = math.pi * (k >= 0.5 * speed * gap / step)
            yaw += rng.normal(0.0, math.sqrt(SLIPPING.per_metre[2] * step))
            noise = rng.normal(0.0, math.sqrt(SLIPPING.per_metre[0] * step), 2)
            x += step * math.cos(yaw + turned) + noise[0]
            y += step * math.sin(yaw + turned) + noise[1]
        ends.append((x, y, yaw))
    seen = np.cov(np.array(ends).T)
    assert covariance[1, 1] == pytest.approx(seen[1, 1], rel=0.2)
    assert covariance[2, 2] == pytest.approx(seen[2, 2], rel=0.2)
    assert covariance[0, 0] >= seen[0, 0]


def test_a_gap_of_a_base_that_stands_adds_nothing():
    assert not paced(0.0, 20.0).any()


def test_samples_without_a_gap_add_only_their_step():
    assert not paced(0.8, 0.5).any()
