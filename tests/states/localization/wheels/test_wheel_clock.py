"""A clock offset of the wheels: found, as sure as it says, open where nothing shows it."""

import math

import numpy as np
import pytest

from hw.geometry import Pose2
from states.localization.wheels.trail import Trail
from states.localization.wheels.wheel_clock import WheelClock
from tests.repeats import fewer
from tests.states.localization.test_localizer import WHEELS_AND_SCANS, localizer
from tests.states.localization.world import World, random_drive

S = 1_000_000_000


def turning(rng, strength=1.0):
    """yaw of a base by time, rad: sums of random swings of 1.5 to 8 s."""
    periods = rng.uniform(1.5, 8.0, 6)
    sizes, phases = strength * rng.normal(0.0, 0.15, 6) * periods / 3.0, rng.uniform(0.0, 6.3, 6)
    return lambda t: float((sizes * np.sin(2.0 * math.pi * t / periods + phases)).sum())


def watched(yaw, late, rng, seconds=60.0, noise=0.004, factor=1.0):
    """A clock that has seen wheels at 20 Hz, `late` s late, and matches at 10 Hz, with noise."""
    clock, trail, slipped, last = WheelClock(), Trail(), 0.0, yaw(-1.0)
    floor = 1.0
    for k in range(round(20.0 * seconds)):
        time = k / 20.0
        floor = factor * (1.0 + rng.normal(0.0, 0.1)) if k % 12 == 0 else floor
        turn = yaw(time - late) - last
        last += turn
        slipped += floor * turn + abs(turn) ** 0.5 * rng.normal(0.0, 0.01)
        trail.add_odometry(k * S // 20, Pose2(0.0, 0.0, math.remainder(slipped, 2.0 * math.pi)))
        if k % 2 == 0:
            seen = yaw(time) + 1.0 + rng.normal(0.0, noise)
            clock.add_yaw(k * S // 20, math.remainder(seen, 2.0 * math.pi), trail)
    return clock


@pytest.mark.parametrize("late", [-0.3, -0.2, -0.05, 0.0, 0.1, 0.2, 0.35])
def test_the_offset_is_found_though_the_wheels_turn_too_little(late):
    rng = np.random.default_rng(round(100 * late) + 50)
    clock = watched(turning(rng), late, rng, factor=0.9)
    assert clock.sure == pytest.approx(late, abs=0.03)


@pytest.mark.slow
def test_it_is_as_sure_as_it_says():
    """Errors in standard deviations: their root mean square is near 1."""
    errors = []
    for seed in fewer(range(60)):
        rng = np.random.default_rng(seed)
        late = rng.uniform(-0.3, 0.3)
        found = watched(turning(rng, 0.5), late, rng, 30.0, noise=0.01).estimate
        errors += [] if found is None else [(found[0] - late) / found[1]]
    assert len(errors) > 5
    assert 0.4 < math.sqrt(np.mean(np.square(errors))) < 1.5


@pytest.mark.parametrize("rate", [0.0, 0.4])
def test_a_steady_turn_shows_no_offset(rate):
    rng = np.random.default_rng(7)
    assert watched(lambda time: rate * time, 0.2, rng).sure is None


def test_a_turn_of_a_wrong_match_counts_for_nothing():
    rng = np.random.default_rng(9)
    yaw = turning(rng)
    clock = watched(yaw, 0.2, rng)
    before, trail = clock.estimate, Trail()
    for k in range(100):
        trail.add_odometry(70 * S + k * S // 20, Pose2(0.0, 0.0, yaw(k / 20.0)))
    clock.forget()
    clock._waiting.clear()
    clock.add_yaw(72 * S, 0.0, trail)
    clock.add_yaw(72 * S + S // 5, 2.5, trail)
    assert not clock._waiting
    assert clock.estimate == before


@pytest.mark.parametrize("late", [-0.2, 0.2])
def test_wheels_with_another_clock_are_named_and_not_called_wrong(late):
    world = World(random_drive(61, 25.0), 61)
    found, statuses = localizer(world, world.drive.pose(0.0)), set()
    samples = [
        one._replace(stamp_ns=one.stamp_ns + round(late * S))
        if one.name == "base.odometry"
        else one
        for one in world.samples(*WHEELS_AND_SCANS)
    ]
    for sample in sorted(
        (one for one in samples if one.stamp_ns >= 0), key=lambda one: one.stamp_ns
    ):
        found.update(*sample)
        statuses.add(found.status)
    assert found.clock_offset == pytest.approx(late, abs=0.05)
    assert "odometry wrong" not in statuses
