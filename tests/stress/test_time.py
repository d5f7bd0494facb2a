"""Stamps that repeat or run backwards, a day of simulated time, 292 years of nanoseconds."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import example, given, strategies as st

from cobodeck.run.simulation import simulate
from cobodeck.setup.options import Options
from engine.clock import TickGrid
from hw.geometry import Pose2
from hw.motion.pose_history import PoseHistory, wrapped
from hw.motion.velocity_estimator import EVER_NS, Motion
from states.localization.filter.measurement_sources import Measurement, MeasurementSource
from states.localization.filter.planar import SLIPPING, PlanarFilter, planar_config
from states.localization.wheels.trail import Trail
from states.localization.wheels.wheel_motion import WheelMotion
from tests.repeats import SHORT
from tests.stress.places import WALL_CLOCK_NS
from tests.stress.runs import opened
from tests.stress.subjects import DAY_NS

YEAR_NS = 365 * DAY_NS
stamps = st.integers(0, 292 * YEAR_NS)


@given(stamps, st.integers(1, 1000))
@example(292 * YEAR_NS, 30)
def test_ticks_fall_on_their_instants_for_292_years(at: int, hz: int) -> None:
    grid = TickGrid(hz)
    number = grid.last(at)

    assert grid.instant(number) <= at < grid.instant(number + 1)
    assert grid.instant(grid.first(at)) >= at
    assert grid.instant(number) == number * 10**9 // hz


@given(stamps, st.lists(st.integers(-40_000_000, 40_000_000), min_size=1, max_size=40))
def test_wheels_take_stamps_that_repeat_and_run_backwards(since: int, spans: list[int]) -> None:
    """Nanoseconds apart at the time of a wall clock: float64 would not tell them apart."""
    trail, wheels, now = Trail(), WheelMotion(SLIPPING), since
    newest = -1
    for k, span in enumerate(spans):
        now = max(0, now + span)
        pose = Pose2(0.01 * k, 0.0, 3.1 + 0.01 * k)
        assert trail.add_odometry(now, pose) is (now > newest)
        wheels.add_odometry(now, pose)
        newest = max(newest, now)
        assert trail.stamp_ns == newest
        for moving in (trail.last_velocity(), trail.velocity(newest - 50_000_000, newest)):
            assert all(map(math.isfinite, (moving.vx, moving.vy, moving.wz)))
            assert moving.speed <= 20.0
        found = trail.at(newest)
        assert found is not None


@pytest.mark.parametrize("apart", [1, 2, 70, 255, 256, 1000])
def test_stamps_some_nanoseconds_apart_are_two(apart: int) -> None:
    near, far = Trail(), Trail()
    for since, trail in ((0, near), (WALL_CLOCK_NS, far)):
        for k in range(20):
            trail.add_odometry(since + k * 20_000_000, Pose2(0.02 * k, 0.0))
        trail.add_odometry(since + 19 * 20_000_000 + apart, Pose2(0.38 + 1e-9 * apart, 0.0))

    assert near.last_velocity() == far.last_velocity()
    assert near.at(19 * 20_000_000 + apart // 2) == far.at(
        WALL_CLOCK_NS + 19 * 20_000_000 + apart // 2
    )


@given(st.lists(st.integers(0, 300_000_000), min_size=2, max_size=30), st.integers(0, 2**32))
def test_whatever_the_order_of_arrival_a_history_is_the_same(at: list[int], seed: int) -> None:
    rng = np.random.default_rng(seed)
    rows = {stamp: Pose2(float(stamp) * 1e-9, 0.0, 3.0) for stamp in at}
    order = [(int(stamp), rows[int(stamp)]) for stamp in rng.permutation(at)]
    one, other = PoseHistory(wrapped, poses=sorted(rows.items())), PoseHistory(wrapped, poses=order)

    for stamp in (min(at), max(at), sum(at) // len(at)):
        assert one.at(stamp) == other.at(stamp)


@given(st.integers(-(1 << 63), (1 << 63) - 1))
def test_a_stamp_that_is_no_time_is_no_pose_of_a_person(stamp: int) -> None:
    motion = Motion(0.3)
    for k in range(12):
        motion.add_pose(k * 30_000_000, 0.03 * k, 0.0)
    before = motion.velocity
    motion.add_pose(stamp, 5.0, 5.0)
    if not -EVER_NS < stamp < EVER_NS:
        assert motion.velocity == before
    motion.add_pose(12 * 30_000_000, 0.36, 0.0)
    assert motion.velocity is None or math.isfinite(motion.velocity.vx)


def test_after_a_year_of_silence_a_filter_knows_nothing_but_is_sound() -> None:
    filter_ = PlanarFilter(planar_config(MeasurementSource("pose", ("x", "y", "yaw"), gate=None)))
    filter_.correct(Measurement(0, "pose", (1.0, 2.0, 3.1), (1e-4,) * 3))
    for years in (1, 10, 100, 290):
        known = filter_.at(years * YEAR_NS)
        assert known is not None
        mean, covariance = known
        assert np.isfinite(mean).all()
        assert np.isfinite(covariance).all()
        assert np.linalg.eigvalsh(covariance / np.abs(covariance).max()).min() >= -1e-12
    filter_.correct(Measurement(290 * YEAR_NS, "pose", (4.0, 5.0, -3.1), (1e-4,) * 3))
    assert filter_.pose.is_near(Pose2(4.0, 5.0, -3.1), 1e-6, 1e-6)


@pytest.mark.few(1)
@pytest.mark.parametrize("hours", [0.5, 4.0])
def test_hours_of_circles_are_reckoned_with_no_more_than_linear_error(hours: float) -> None:
    """A displacement is composed 50 times a second."""
    step = Pose2(0.02, 0.001, 0.011)
    count, pose = round(hours * 3600.0 * 50), Pose2(0.0, 0.0)
    for _ in range(count):
        pose = pose @ step
    turn = complex(math.cos(0.011), math.sin(0.011))
    exact = complex(0.02, 0.001) * (1.0 - turn**count) / (1.0 - turn)

    assert math.hypot(pose.x - exact.real, pose.y - exact.imag) < 1e-14 * count
    assert abs(math.remainder(pose.yaw - 0.011 * count, math.tau)) < 1e-15 * count


def test_a_day_of_standing_still_leaves_the_reckoning_alone() -> None:
    """Wheels at 1 Hz for a day, after a drive: neither pose nor covariance creeps."""
    wheels = WheelMotion(SLIPPING)
    wheels.add_odometry(0, Pose2(0.0, 0.0, 3.0))
    wheels.corrected(0, Pose2(1.0, 1.0, 3.1), np.diag([1e-6, 1e-6, 1e-8]))
    for k in range(1, 8_640):
        wheels.add_odometry(k * 10_000_000_000, Pose2(0.0, 0.0, 3.0))
    known = wheels.carried_on(8_639 * 10_000_000_000)

    assert known is not None
    assert known[0] == Pose2(1.0, 1.0, 3.1)
    assert np.trace(known[1]) < 1e-4


@pytest.mark.few(1)
@pytest.mark.parametrize("hours", [1, 6 if SHORT else 24])
def test_hours_of_a_chart_that_waits_have_all_their_ticks(hours: int) -> None:
    result = simulate(opened(), Options(tier=0, duration_s=3600.0 * hours))

    assert result.figures["missed"] == 0
    assert not result.figures["errors"]
    assert result.figures["sim_s"] == 3600.0 * hours
    assert result.figures["ticks"] == 3600 * hours * 30 + 1


def test_samples_of_one_instant_are_one_whatever_they_say() -> None:
    filters = [
        PlanarFilter(planar_config(MeasurementSource("wheels", ("vx", "vy", "wz")))) for _ in "ab"
    ]
    for k in range(20):
        told = Measurement(WALL_CLOCK_NS + k * 10_000_000, "wheels", (1.0, 0.0, 0.5), (1e-4,) * 3)
        filters[0].correct(told)
        filters[1].correct(told)
        assert filters[1].correct(told._replace(values=(9.0, 9.0, 9.0))).outcome == "duplicate"
    np.testing.assert_array_equal(filters[0].mean, filters[1].mean)


@pytest.mark.parametrize("begins", [Pose2(0.0, 0.0), Pose2(1e3, -2e3, 3.0)])
def test_where_odometry_begins_says_nothing_of_the_pace(begins: Pose2) -> None:
    """After a gap the covariance grows by the pace before, not by the way to the first sample."""
    wheels = WheelMotion(SLIPPING)
    for k in range(50):
        wheels.add_odometry(k * 20_000_000, begins @ Pose2(0.01 * k, 0.0))
        if k == 5:
            wheels.corrected(k * 20_000_000, Pose2(1.0, 1.0), np.diag([1e-6, 1e-6, 1e-8]))
    wheels.add_odometry(3_000_000_000, begins @ Pose2(0.6, 0.0))
    known = wheels.carried_on(3_000_000_000)

    assert known is not None
    assert np.sqrt(np.trace(known[1])) < 0.1
