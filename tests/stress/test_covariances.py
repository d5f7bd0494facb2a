"""Covariances near singular, at any scale: symmetric, without negative eigenvalues, finite."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, strategies as st

from hw.geometry import Pose2
from hw.samples import PoseSigma
from states.localization.filter.filter_kernels import Array
from states.localization.filter.fusion import covariance_of, sigma_of
from states.localization.filter.measurement_sources import (
    FilterConfig,
    Measurement,
    MeasurementSource,
    ProcessNoise,
)
from states.localization.filter.planar import SLIPPING, PlanarFilter, planar_config
from states.localization.filter.spatial import SpatialFilter
from states.localization.matching.particles import moments, normalise
from states.localization.wheels.dead_reckoning import DeadReckoning
from states.localization.wheels.wheel_motion import WheelMotion

POSE = ("x", "y", "yaw")
exponents = st.floats(-12.0, 6.0)


def check(covariance: Array) -> None:
    """Symmetric, and no eigenvalue below 0 but for the rounding of the check itself."""
    assert np.isfinite(covariance).all()
    np.testing.assert_array_equal(covariance, covariance.T)
    scale = np.sqrt(np.maximum(np.diag(covariance), 1e-300))
    assert np.linalg.eigvalsh(covariance / np.outer(scale, scale)).min() >= -1e-9


def leaning(sigmas: list[float], angle: float) -> Array:
    """Standard deviations along axes that are turned by the angle in the plane."""
    c, s = math.cos(angle), math.sin(angle)
    turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    return np.asarray(turn @ np.diag(np.square(sigmas)) @ turn.T)


steps = st.lists(
    st.tuples(
        st.integers(0, 10**12), st.tuples(exponents, exponents, exponents),
        st.floats(-math.pi, math.pi), st.tuples(*[st.floats(-1e6, 1e6)] * 3),
    ),
    min_size=1, max_size=12,
)  # fmt: skip


@given(steps)
def test_a_planar_filter_keeps_a_covariance_whatever_it_is_told(
    told: list[tuple[int, tuple[float, float, float], float, tuple[float, float, float]]],
) -> None:
    """Standard deviations of 1e-12 to 1e6 beside each other, spans of 0 to 1000 s."""
    filter_, now = PlanarFilter(planar_config(MeasurementSource("any", POSE, gate=None))), 0
    for span, powers, angle, values in told:
        now += span
        covariance = leaning([10.0**p for p in powers], angle)
        filter_.correct(Measurement(now, "any", values, covariance))
        check(filter_.covariance)
        known = filter_.at(now + span)
        assert known is not None
        check(known[1])
        assert abs(filter_.mean[2]) <= math.pi


@pytest.mark.parametrize("off", [0.0, 1e-15, 1e-12, 1e-9, 1e-6])
@pytest.mark.parametrize("kind", ["rank one", "not definite", "large"])
def test_a_measurement_s_covariance_may_be_singular(kind: str, off: float) -> None:
    axis = np.array([1.0, 2.0, -0.5])
    covariance = np.outer(axis, axis) + off * np.eye(3)
    if kind == "not definite":
        covariance -= 2.0 * np.diag([off, 0.0, off]) + np.diag([0.0, 0.5, 0.0])
    covariance *= 1e8 if kind == "large" else 1e-4
    filter_ = PlanarFilter(planar_config(MeasurementSource("any", POSE, gate=None)))
    for k in range(50):
        filter_.correct(Measurement(k * 10_000_000, "any", (1.0, 2.0, 3.1), covariance))
        check(filter_.covariance)
    if kind != "large":  # less than is known of the yaw before
        assert np.abs(filter_.mean[:2] - (1.0, 2.0)).max() < 1e-3


@given(
    st.floats(-0.5 * math.pi, 0.5 * math.pi) | st.just(0.5 * math.pi), exponents, st.floats(-3, 3)
)
def test_a_filter_in_space_keeps_one_straight_up(pitch: float, power: float, rate: float) -> None:
    axes = ("x", "y", "z", "roll", "pitch", "yaw")
    filter_ = SpatialFilter(
        FilterConfig(
            (MeasurementSource("pose", axes, gate=None), MeasurementSource("gyro", ("wx", "wz"))),
            ProcessNoise((1e-3,) * 15, (0.0,) * 15, (0.0,) * 15),
            (1.0,) * 15,
        )
    )
    for k in range(12):
        sigma = 10.0**power if k % 2 else 1e-3
        filter_.correct(Measurement(k * 10**8, "pose", (1, 2, 3, 0, pitch, 3.1), (sigma**2,) * 6))
        filter_.correct(Measurement(k * 10**8, "gyro", (rate, -rate), (1e-4, 1e-4)))
        check(filter_.covariance)
        assert np.isfinite(filter_.mean).all()


@given(st.lists(st.floats(-700.0, 0.0), min_size=2, max_size=30), exponents, st.floats(-4, 4))
def test_particles_on_one_another_have_one(logs: list[float], power: float, yaw: float) -> None:
    rng = np.random.default_rng(len(logs))
    cloud = np.array([2.0, 3.0, yaw]) + 10.0 ** min(power, 0.0) * rng.normal(size=(len(logs), 3))
    weights, effective = normalise(np.array(logs))
    mean, covariance = moments(cloud, weights, np.ones(len(logs), np.bool_))

    assert np.isfinite(mean).all()
    assert 1.0 - 1e-9 <= effective <= len(logs) + 1e-9
    check(covariance[:2, :2])
    assert covariance[2, 2] >= -1e-15


@given(exponents, exponents)
def test_sigmas_lead_there_and_back(position: float, yaw: float) -> None:
    sigma = PoseSigma(10.0**position, 10.0**yaw)
    back = sigma_of(covariance_of(sigma))

    assert back.position == pytest.approx(sigma.position, rel=1e-12)
    assert back.yaw == pytest.approx(sigma.yaw, rel=1e-12)
    assert sigma_of(np.diag([-1e-20, -1e-18, -1e-20])) == PoseSigma(0.0, 0.0)


@given(st.lists(st.tuples(*[st.floats(-2.0, 2.0)] * 3), min_size=1, max_size=30), exponents)
def test_dead_reckoning_keeps_one(steps: list[tuple[float, float, float]], power: float) -> None:
    reckoning, odom = DeadReckoning(SLIPPING), Pose2(0.0, 0.0)
    start = leaning([10.0 ** min(power, 3.0), 1e-6, 1e-9], 0.7)
    reckoning.correct(Pose2(1.0, 2.0, 3.1), start, odom)
    for x, y, yaw in steps:
        odom = odom @ Pose2(x, y, yaw)
        reckoning.move(odom, 0.1, None)
        known = reckoning.at(odom)
        assert known is not None
        covariance = 0.5 * (known[1] + known[1].T)
        np.testing.assert_allclose(known[1], covariance, rtol=1e-9, atol=1e-12)
        check(covariance)
        reckoning.weigh(np.array([x, y, yaw]), known[1] + 1e-6 * np.eye(3))
        assert 1.0 <= reckoning.slip <= 100.0


def test_wheels_that_only_stand_know_all() -> None:
    wheels = WheelMotion(SLIPPING)
    for k in range(200):
        wheels.add_odometry(k * 20_000_000, Pose2(3.0, 2.0, math.pi))
        if k == 5:
            wheels.corrected(k * 20_000_000, Pose2(1.0, 1.0, 3.1), np.diag([1e-6, 1e-6, 1e-8]))
    known = wheels.carried_on(199 * 20_000_000)

    assert known is not None
    assert np.trace(known[1]) < 1e-5
