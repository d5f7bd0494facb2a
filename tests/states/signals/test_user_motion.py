"""Velocity and stillness of a person: noise is no walk."""

from __future__ import annotations

import numpy as np
import pytest

from engine.state import Stamped
from hw.geometry import STILL, Pose2, Twist2, wrap
from hw.samples import UserPose
from states.signals.user_motion import StillnessEstimator, VelocityEstimator


def ns(seconds: float) -> int:
    return round(seconds * 1e9)


def feed(
    estimator: VelocityEstimator, poses: list[tuple[float, float, float, float]]
) -> Twist2 | None:
    for t, x, y, yaw in poses:
        pose = UserPose(Pose2(x, y, wrap(yaw)), wrap(yaw))
        estimator.update("user.pose", Stamped(pose, ns(t)))
    return estimator.value()


def walked(speeds: list[float], wz: float = 0.0) -> list[Twist2]:
    """The velocities found while somebody walks with these speeds, each for half a second."""
    estimator, found, x = VelocityEstimator(0.3), [], 0.0
    for i in range(50 * len(speeds)):
        x += 0.01 * speeds[i // 50]
        velocity = feed(estimator, [(0.01 * i, x, 0.0, 0.01 * wz * i)])
        if i % 50 == 49:
            assert velocity is not None
            found.append(velocity)
    return found


def test_a_walk_is_told_as_it_is_and_a_gap_as_not_known() -> None:
    estimator = VelocityEstimator(0.3)

    found = feed(estimator, [(0.01 * i, 0.008 * i, 0.005 * i, 0.01 * i) for i in range(60)])
    assert (found.vx, found.vy, found.wz) == pytest.approx((0.8, 0.5, 1.0))
    assert feed(estimator, [(0.9, 0.72, 0.45, 0.9)]) is None


@pytest.mark.requirement(149)
@pytest.mark.parametrize("gap", [0.16, 0.2, 0.29])
def test_a_gap_within_the_window_is_bridged_unless_the_person_jumped(gap: float) -> None:
    estimator = VelocityEstimator(0.3)
    feed(estimator, [(0.01 * i, 0.008 * i, 0.0, 0.01 * i) for i in range(61)])

    at = 0.6 + gap
    found = feed(estimator, [(at, 0.8 * at, 0.0, at)])
    assert (found.vx, found.wz) == pytest.approx((0.8, 1.0))
    assert feed(estimator, [(at + 0.2, 4.0, 0.0, at)]) is None


def test_who_is_slower_than_a_walk_stands_and_may_turn() -> None:
    found = walked([0.0, 0.15, 0.25, 0.15, 0.08, 0.15], wz=0.5)

    assert [velocity.vx for velocity in found] == pytest.approx([0.0, 0.0, 0.25, 0.15, 0.0, 0.0])
    assert [velocity.wz for velocity in found] == pytest.approx([0.5] * 6)


def test_noise_of_one_centimetre_is_no_walk() -> None:
    rng, estimator = np.random.default_rng(1), VelocityEstimator(0.3)
    speeds = []
    for i in range(3000):
        x, y = rng.normal(0.0, 0.01, 2)
        found = feed(estimator, [(i / 30, x, y, 0.0)])
        speeds.append(found.speed if found is not None else 0.0)

    assert max(speeds[10:]) == 0.0


def test_a_person_who_does_not_move_at_all_has_exactly_the_velocity_still() -> None:
    estimator = VelocityEstimator(0.3)
    for i in range(100):
        found = feed(estimator, [(i / 30, 3.1, 4.7, 0.3)])

    assert found is STILL


def still_since(velocities: list[tuple[float, Twist2]]) -> int | None:
    estimator = StillnessEstimator(0.1, 0.3)
    for t, velocity in velocities:
        estimator.update("user.velocity", Stamped(velocity, ns(t)))
    return estimator.value()


@pytest.mark.requirement(89)
def test_a_person_is_still_since_both_limits_are_kept() -> None:
    slow, fast = Twist2(0.09, 0.0, 0.29), Twist2(0.11)

    assert still_since([]) is None
    assert still_since([(0.0, fast)]) is None
    assert still_since([(0.0, fast), (1.0, slow), (1.5, slow)]) == ns(1.0)
    assert still_since([(0.0, slow), (1.0, Twist2(0.0, 0.0, 0.31)), (1.1, slow)]) == ns(1.1)


@pytest.mark.requirement(89)
@pytest.mark.parametrize("limit", [Twist2(0.1), Twist2(0.0, 0.0, -0.3)])
def test_at_the_limit_one_is_not_still(limit: Twist2) -> None:
    assert still_since([(0.0, limit), (1.0, limit)]) is None
