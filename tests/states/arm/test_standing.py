"""Where the base stands by noisy poses, and when it has left a place."""

from __future__ import annotations

import math

import numpy as np
import pytest

from hw.geometry import Pose2, wrap
from hw.samples import EXACT, PoseSigma
from states.arm.standing import WINDOW_NS, Standing

TICK_NS = 33_333_333


def stood(pose: Pose2, noise: float, count: int = 15, seed: int = 1) -> Standing:
    rng, found = np.random.default_rng(seed), Standing()
    for k in range(count):
        x, y, yaw = rng.normal(0.0, noise, 3) * (1.0, 1.0, 0.5)
        found.add_base_pose(k * TICK_NS, Pose2(pose.x + x, pose.y + y, wrap(pose.yaw + yaw)))
    return found


@pytest.mark.requirement(80, 84)
def test_the_mean_is_less_noisy_than_a_pose_also_at_half_a_turn() -> None:
    true = Pose2(3.0, 4.0, math.pi - 1e-4)
    found = stood(true, 0.003)
    mean = found.pose(Pose2(0.0, 0.0))
    assert mean.distance_to(true) < 0.0025
    assert abs(wrap(mean.yaw - true.yaw)) < 0.0015
    assert Standing().pose(true) == true
    off = [stood(true, 0.003, seed=k).pose(true).distance_to(true) for k in range(40)]
    assert np.mean(off) < 0.0015


def test_old_poses_do_not_count() -> None:
    found = stood(Pose2(1.0, 1.0), 0.0)
    later = 20 * TICK_NS + WINDOW_NS
    found.add_base_pose(later, Pose2(2.0, 1.0))
    assert found.pose(Pose2(0.0, 0.0)) == Pose2(2.0, 1.0)


@pytest.mark.requirement(80)
def test_noise_alone_is_no_reason_to_correct_but_an_offset_is() -> None:
    true = Pose2(3.0, 4.0, 0.5)
    shifted, turned = Pose2(3.004, 4.0, 0.5), Pose2(3.0, 4.0, 0.504)
    again = 0
    for seed in range(50):
        found = stood(true, 0.003, seed=seed)
        again += found.has_left(found.pose(true), EXACT)
        assert found.has_left(Pose2(3.02, 4.0, 0.5), PoseSigma(0.003, 0.0015))
    assert again == 0
    exact = stood(true, 0.0)
    assert not exact.has_left(true, EXACT)
    assert exact.has_left(shifted, EXACT)
    assert exact.has_left(turned, EXACT)


def test_an_error_that_lasts_is_not_corrected_by_looking_longer() -> None:
    found = stood(Pose2(3.0, 4.0, 0.5), 0.0)
    assert not found.has_left(Pose2(3.004, 4.0, 0.5), PoseSigma(0.005, 0.005))
    assert found.has_left(Pose2(3.006, 4.0, 0.5), PoseSigma(0.005, 0.005))
