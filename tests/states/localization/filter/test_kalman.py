"""Order, gates and broken input of the filter, whatever its motion model."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from states.localization.filter.kalman import KalmanFilter
from states.localization.filter.measurement_sources import (
    FilterConfig,
    Measurement,
    MeasurementSource,
    ProcessNoise,
)
from states.localization.filter.planar import PlanarFilter, planar_config
from states.localization.filter.spatial import AXES, SpatialFilter

MS = 1_000_000
WHEELS = MeasurementSource("wheels", ("vx", "vy", "wz"))
GYRO = MeasurementSource("gyro", ("wz",))
SCAN = MeasurementSource("scan", ("x", "y", "yaw"))
VIVE = MeasurementSource("vive", ("x", "y", "yaw"), yields_to=("scan",))
STEADY = ProcessNoise((1e-6,) * 6, (0.0,) * 6, (0.0,) * 6)


def drive(seed: int, seconds: float = 2.0) -> list[Measurement]:
    """Wheels at 50 Hz, a gyroscope at 100 Hz, scans at 10 Hz, trackers at 5 Hz: by stamps."""
    chance = np.random.default_rng(seed)
    told = []
    for ms in range(0, round(seconds * 1000), 10):
        t = ms / 1000
        pose = (math.sin(t), 1 - math.cos(t), t)
        if ms % 20 == 0:
            told.append(Measurement(ms * MS, "wheels", _near((1, 0, 1), 0.02, chance), (4e-4,) * 3))
        told.append(Measurement(ms * MS, "gyro", _near((1,), 0.01, chance), (1e-4,)))
        if ms % 100 == 50:
            told.append(Measurement(ms * MS, "scan", _near(pose, 0.02, chance), (4e-4,) * 3))
        if ms % 200 == 50:
            told.append(Measurement(ms * MS, "vive", _near(pose, 0.004, chance), (2e-5,) * 3))
    return sorted(told, key=lambda m: m.stamp_ns)


def _near(values: tuple[float, ...], sigma: float, chance: np.random.Generator) -> list[float]:
    return [float(v + sigma * chance.normal()) for v in values]


def make(*sources: MeasurementSource, **changes: object) -> PlanarFilter:
    chosen = sources or (WHEELS, GYRO, SCAN, VIVE)
    return PlanarFilter(replace(planar_config(*chosen), **changes))


def same(one: KalmanFilter, other: KalmanFilter) -> bool:
    return np.array_equal(one.mean, other.mean) and np.array_equal(one.covariance, other.covariance)


@settings(max_examples=25)
@given(st.integers(0, 2**32))
def test_late_measurements_come_out_as_in_their_order(seed: int) -> None:
    """Each up to half a second late: bit for bit the same, outcomes of gates included."""
    chance = np.random.default_rng(seed)
    told = drive(seed)
    for at in chance.choice(len(told), 20, replace=False):  # some that gates will keep out
        m = told[at]
        told[at] = m._replace(values=[v + 3.0 for v in m.values])
    late = sorted(told, key=lambda m: m.stamp_ns + int(chance.integers(0, 500 * MS)))
    late.insert(0, late.pop(late.index(told[0])))  # nothing is older than the first
    one, other = make(), make()
    for m in told:
        one.correct(m)
    for m in late:
        assert other.correct(m).outcome != "too_old"
    assert same(one, other)


@settings(max_examples=25)
@given(st.permutations(range(4)))
def test_the_order_of_simultaneous_measurements_does_not_count(order: list[int]) -> None:
    told = drive(1)
    together = [m for m in told if m.stamp_ns == 1050 * MS]
    together.append(Measurement(1050 * MS, "wheels", (1.1, 0.1, 0.9), (4e-4,) * 3))
    one, other = make(), make()
    for f, last in ((one, together), (other, [together[i] for i in order])):
        for m in [*(m for m in told if m.stamp_ns < 1050 * MS), *last]:
            f.correct(m)
    assert same(one, other)


def test_a_measurement_that_comes_twice_counts_once() -> None:
    told = drive(2)
    once, twice = make(), make()
    for m in told:
        once.correct(m)
        twice.correct(m)
        assert twice.correct(m).outcome == "duplicate"
    assert same(once, twice)
    assert twice.counts["scan", "duplicate"] == once.counts["scan", "accepted"] == 20


def test_what_is_older_than_the_history_is_told_and_dropped() -> None:
    told = drive(3)
    f, reference = make(history=0.3), make(history=0.3)
    for m in told:
        f.correct(m)
        reference.correct(m)
    assert f.stamp_ns == 1990 * MS
    old = Measurement(1600 * MS, "scan", (9.0, 9.0, 0.0), (4e-4,) * 3)
    assert f.correct(old).outcome == "too_old"
    assert f.counts["scan", "too_old"] == 1
    assert same(f, reference)
    recent = old._replace(stamp_ns=1701 * MS, values=(1.0, 1.1, 1.7))
    assert f.correct(recent).outcome != "too_old"
    assert not same(f, reference)


def test_the_history_is_bounded_whatever_the_rate() -> None:
    f = make(GYRO, history=1e9)
    for n in range(6000):
        f.correct(Measurement(n, "gyro", (0.0,), (1.0,)))
    assert f.at(6000 - 4096 - 2) is None
    assert f.at(6000 - 4096 + 1) is not None


@pytest.mark.parametrize("origin", [-(10**18), -1000 * MS, 1_700_000_000 * 10**9])
def test_stamps_may_count_from_anywhere(origin: int) -> None:
    """Before the origin of the clock as after it, and since 1970 to the nanosecond."""
    here, there = make(), make()
    for m in drive(4):
        here.correct(m)
        there.correct(m._replace(stamp_ns=origin + m.stamp_ns))
    assert same(here, there)
    assert there.stamp_ns == origin + 1990 * MS


def test_the_same_measurements_give_the_same_bits() -> None:
    one, other = make(), make()
    for m in drive(5):
        assert one.correct(m) == other.correct(m)
    assert same(one, other)


def test_poses_are_told_at_every_time() -> None:
    """Of the past as it was known with what has come in, of the future by the velocity."""
    f = make()
    assert f.at(0) is None
    on_time = {}
    for m in drive(6):
        f.correct(m)
        on_time[m.stamp_ns] = (f.mean, f.covariance)
    for stamp in (1000 * MS, 1500 * MS, 1990 * MS):
        mean, covariance = f.at(stamp)
        np.testing.assert_array_equal(mean, on_time[stamp][0])
        np.testing.assert_array_equal(covariance, on_time[stamp][1])
    assert f.at(900 * MS) is None
    later, _ = f.at(2490 * MS)
    assert math.dist(later[:2], f.mean[:2]) == pytest.approx(2 * math.sin(0.25), rel=0.05)
    assert f.stamp_ns == 1990 * MS


def standing(f: PlanarFilter, source: str, place: float, times: range) -> list[str]:
    """Poses at (place, 0, 0) every so many ms, by a sensor of 1 cm."""
    return [
        f.correct(Measurement(ms * MS, source, (place, 0.0, 0.0), (1e-4,) * 3)).outcome
        for ms in times
    ]


def test_a_gate_keeps_out_and_re_acquires_after_so_many() -> None:
    """Little process noise, and the truth jumps by 2 m: the classical lock-out."""
    f = make(replace(SCAN, reacquire_after=5), noise=STEADY)
    assert set(standing(f, "scan", 0.0, range(0, 5000, 100))) == {"accepted"}
    outcomes = standing(f, "scan", 2.0, range(5000, 6000, 100))
    assert outcomes == ["rejected"] * 5 + ["reacquired"] + ["accepted"] * 4
    assert f.pose.x == pytest.approx(2.0, abs=2e-3)

    locked = make(replace(SCAN, reacquire_after=10**9), noise=STEADY)
    standing(locked, "scan", 0.0, range(0, 5000, 100))
    assert set(standing(locked, "scan", 2.0, range(5000, 30000, 100))) == {"rejected"}
    assert locked.pose.x == pytest.approx(0.0, abs=1e-9)


def test_single_outliers_do_not_move_the_filter() -> None:
    f = make(SCAN, noise=STEADY)
    for ms in range(0, 10_000, 500):
        standing(f, "scan", 0.0, range(ms, ms + 400, 100))
        assert standing(f, "scan", 0.4, range(ms + 400, ms + 500, 100)) in (["rejected"],)
    assert abs(f.pose.x) < 1e-6


def test_a_jump_of_one_source_does_not_overrule_another_that_fits() -> None:
    """Trackers 47 mm off after a re-acquisition, beside scans; without scans they are believed."""
    f = make(replace(SCAN, gate=None), VIVE, noise=STEADY)
    for ms in range(0, 10_000, 100):
        f.correct(Measurement(ms * MS, "scan", (0.0, 0.0, 0.0), (1e-4,) * 3))
        f.correct(Measurement((ms + 1) * MS, "vive", (0.047, 0.0, 0.0), (2e-5,) * 3))
        if ms > 1000:
            assert abs(f.pose.x) < 0.047
    alone = make(SCAN, VIVE, noise=STEADY)
    standing(alone, "scan", 0.0, range(0, 2000, 100))
    for ms in range(2000, 12_000, 80):
        alone.correct(Measurement(ms * MS, "scan", (0.0, 0.0, 0.0), (1e-4,) * 3))
        assert alone.correct(
            Measurement((ms + 1) * MS, "vive", (0.1, 0.0, 0.0), (2e-5,) * 3)
        ).outcome == "rejected"  # fmt: skip
    assert abs(alone.pose.x) < 1e-3
    outcomes = [
        alone.correct(Measurement(ms * MS, "vive", (0.1, 0.0, 0.0), (2e-5,) * 3)).outcome
        for ms in range(12_000, 14_000, 100)
    ]
    assert "reacquired" in outcomes
    assert alone.pose.x == pytest.approx(0.1, abs=2e-3)


def test_errors_that_stay_alike_do_not_average_away() -> None:
    """AR(1) errors of 0.5 s at 10 Hz: the mean of 20 s of them is as uncertain as it is."""
    chance = np.random.default_rng(9)
    keep = math.exp(-0.1 / 0.5)
    still = ProcessNoise((0.0,) * 6, (0.0,) * 6, (0.0,) * 6)
    unmoved = (1e3, 1e3, 1e3, 0.0, 0.0, 0.0)
    told, honest = 0.0, 0.0
    for source in (replace(SCAN, gate=None), replace(SCAN, gate=None, correlation=0.5)):
        squares = []
        for _ in range(100):
            f = make(source, noise=still, initial=unmoved)
            errors = chance.normal(size=3)
            for n in range(200):
                f.correct(Measurement(n * 100 * MS, "scan", 0.01 * errors, (1e-4,) * 3))
                errors = keep * errors + math.sqrt(1 - keep**2) * chance.normal(size=3)
            squares.append(f.mean[:3] @ np.linalg.solve(f.covariance[:3, :3], f.mean[:3]) / 3)
        told, honest = honest, float(np.mean(squares))
    assert told > 5.0
    assert 0.85 < honest < 1.15


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf, 1.7e308])
def test_what_holds_no_number_is_as_if_it_had_never_come(bad: float) -> None:
    f, reference = make(), make()
    broken = Measurement(-MS, "scan", (bad,) * 3, (4e-4,) * 3)
    assert f.correct(broken).outcome == "empty"
    assert f.stamp_ns is None
    for m in drive(7):
        broken = broken._replace(stamp_ns=m.stamp_ns - 3)
        unused = Measurement(m.stamp_ns, m.source, (0.0,) * len(m.values), (-1.0,) * len(m.values))
        assert f.correct(unused).outcome == "empty"
        f.correct(m)
        assert f.correct(broken).outcome in ("empty", "too_old")
        reference.correct(m)
    assert same(f, reference)


def test_a_yaw_by_other_whole_turns_makes_no_difference() -> None:
    one, other = make(), make()
    for n, m in enumerate(drive(8, seconds=8.0)):
        one.correct(m)
        if m.source in ("scan", "vive"):
            x, y, yaw = m.values
            m = m._replace(values=(x, y, yaw + (n % 7 - 3) * 2 * math.pi))
        other.correct(m)
    np.testing.assert_allclose(other.mean, one.mean, atol=1e-9)
    np.testing.assert_allclose(other.covariance, one.covariance, atol=1e-9)


@pytest.mark.parametrize(("x", "y", "turn"), [(1e6, -1e6, 0.0), (0, 0, 2.5), (1e6, 3.0, -1.0)])
def test_another_origin_of_the_map_moves_and_turns_the_result_alone(x, y, turn) -> None:
    """With noise that is alike in both directions; P0 is alike, too."""
    one, other = make(), make()
    c, s = math.cos(turn), math.sin(turn)
    for m in drive(10):
        one.correct(m)
        if m.source in ("scan", "vive"):
            a, b, yaw = m.values
            m = m._replace(values=(x + c * a - s * b, y + s * a + c * b, yaw + turn))
        other.correct(m)
    a, b, yaw, *body = one.mean
    expected = [x + c * a - s * b, y + s * a + c * b, yaw + turn]
    np.testing.assert_allclose(other.mean[:2], expected[:2], atol=1e-7)
    assert abs(math.remainder(other.mean[2] - expected[2], 2 * math.pi)) < 1e-9
    np.testing.assert_allclose(other.mean[3:], body, atol=1e-8)


def test_a_filter_begins_where_the_first_measurement_says() -> None:
    f = make(SCAN)
    assert f.stamp_ns is None
    verdict = f.correct(Measurement(5, "scan", (12.0, -7.0, 3.0), (1e-4, 4e-4, 1e-4)))
    assert verdict.outcome == "accepted"
    np.testing.assert_allclose(f.mean[:3], (12.0, -7.0, 3.0), atol=1e-8)
    np.testing.assert_allclose(np.diag(f.covariance[:3, :3]), (1e-4, 4e-4, 1e-4), rtol=1e-6)
    f.reset()
    f.correct(Measurement(1, "scan", (0.0, 0.0, 0.0), (1e-4,) * 3))
    np.testing.assert_allclose(f.mean[:3], 0.0, atol=1e-8)


def test_before_a_measurement_the_covariance_is_that_of_the_initial_standard_deviations() -> None:
    f = make(SCAN, initial=(2.0, 3.0, 0.5, 0.1, 0.0, 4.0))
    np.testing.assert_allclose(f.covariance, np.diag((4.0, 9.0, 0.25, 0.01, 0.0, 16.0)))


def test_distances_are_those_of_mahalanobis() -> None:
    f = make(replace(SCAN, gate=None), noise=STEADY, initial=(1.0, 1.0, 1.0, 0.0, 0.0, 0.0))
    verdict = f.correct(Measurement(0, "scan", (3.0, 4.0, 0.0), (3.0, 3.0, 3.0)))
    assert verdict.distance == pytest.approx(2.5)


def test_both_filters_share_their_rules() -> None:
    config = FilterConfig(
        (
            MeasurementSource("imu", ("roll", "pitch", "yaw")),
            MeasurementSource("gps", ("x", "y", "z")),
        ),
        ProcessNoise((1e-4,) * 15, (0.0,) * 15, (0.0,) * 15),
        (1e3,) * 3 + (1.0,) * 12,
    )
    one, other = SpatialFilter(config), SpatialFilter(config)
    told = [
        Measurement(n * 10 * MS, source, (0.1, 0.2, 0.3), (1e-2,) * 3)
        for n in range(50)
        for source in ("imu", "gps")
    ]
    for m in told:
        one.correct(m)
    for m in [told[0], *told[:0:-1]]:
        other.correct(m)
    assert same(one, other)
    assert one.pose.distance_to(other.pose) == 0.0
    assert len(one.mean) == len(AXES)


@pytest.mark.parametrize(
    ("sources", "what"),
    [
        ((), "at least one"),
        ((SCAN, SCAN), "name of its own"),
        ((MeasurementSource("a", ("x", "z")),), "axes"),
        ((MeasurementSource("a", ()),), "axes"),
        ((MeasurementSource("a", ("x", "x")),), "axes"),
        ((MeasurementSource("a", ("x",), gate=1.0),), "gate 1.0"),
        ((MeasurementSource("a", ("x",), gate=math.nan),), "gate nan"),
        ((MeasurementSource("a", ("x",), correlation=-1.0),), "negative"),
        ((MeasurementSource("a", ("x",), reacquire_after=-1),), "negative"),
        ((MeasurementSource("a", ("x",), yields_to=("b",)),), "yields to b"),
    ],
)
def test_mistakes_of_a_configuration_are_told(sources, what) -> None:
    with pytest.raises(ValueError, match=what):
        PlanarFilter(planar_config(*sources))


def test_numbers_that_do_not_fit_the_state_are_told() -> None:
    with pytest.raises(ValueError, match="initial"):
        make(initial=(1.0,) * 5)
    with pytest.raises(ValueError, match="noise per metre"):
        make(noise=ProcessNoise((1.0,) * 6, (-1.0,) * 6, (1.0,) * 6))
    f = make()
    with pytest.raises(ValueError, match="no source 'sonar'; known: wheels, gyro, scan, vive"):
        f.correct(Measurement(0, "sonar", (0.0,), (1.0,)))
    with pytest.raises(ValueError, match="3 values are needed, for x, y, yaw"):
        f.correct(Measurement(0, "scan", (0.0, 0.0), (1.0, 1.0)))
    with pytest.raises(ValueError, match="3 values are needed"):
        f.correct(Measurement(0, "scan", (0.0,) * 3, (1.0, 1.0)))
