"""One step of a filter against textbook matrices, exact fractions and numerical derivatives."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from states.localization.filter import filter_kernels as kernels
from states.localization.filter.filter_kernels import News

Array = np.ndarray

PLANAR = (6, kernels.planar_step, kernels.planar_motion, (2,))
SPATIAL = (15, kernels.spatial_step, kernels.spatial_motion, (3, 4, 5))
BOTH = pytest.mark.parametrize(("n", "step", "motion", "angles"), [PLANAR, SPATIAL])
QUIET = {6: np.zeros((3, 6)), 15: np.zeros((3, 15))}


def covariance_of(state: np.ndarray) -> np.ndarray:
    whole = np.empty((state.shape[1], state.shape[1]))
    kernels.write_covariance(state, whole)
    return whole


def news(axes: list[int], values: Array, covariance: Array, n: int, **extra: object) -> News:
    told: dict[str, object] = {"gates": np.full(n + 1, np.inf), "factor": 1.0, "trusted": False}
    return News(np.array(axes, np.int64), values=values, covariance=covariance, **(told | extra))


def nothing(n: int) -> News:
    return news([], np.empty(0), np.empty((0, 0)), n)


def state_of(mean: Array, variances: Array) -> Array:
    return np.vstack((mean, np.diag(variances)))


def random_mean(n: int, chance: np.random.Generator) -> Array:
    mean = chance.normal(size=n)
    mean[3:6] *= 0.4 if n == 15 else 1.0
    return mean


def moved(motion: Callable[..., None], mean: Array, dt: float) -> tuple[Array, Array]:
    after, transition = np.empty(len(mean)), np.eye(len(mean))
    motion(mean, dt, after, transition)
    return after, transition


@BOTH
@pytest.mark.parametrize("dt", [1e-6, 1e-3, 0.02, 0.5, 2.0])
@pytest.mark.parametrize("turning", [0.0, 1e-7, 4e-4, 1.0])
def test_jacobians_are_the_numerical_derivatives(n, step, motion, angles, dt, turning) -> None:
    chance = np.random.default_rng(7)
    for _ in range(20):
        mean = random_mean(n, chance)
        mean[5 if n == 6 else slice(9, 12)] *= turning
        _, transition = moved(motion, mean, dt)
        numerical = np.empty((n, n))
        h = 1e-3
        for j in range(n):
            # differences at four places: an error of h^4
            weights = {-2: 1 / 12, -1: -2 / 3, 1: 2 / 3, 2: -1 / 12}
            column = np.zeros(n)
            for at, weight in weights.items():
                there = mean.copy()
                there[j] += at * h
                change = moved(motion, there, dt)[0] - mean
                for angle in angles:
                    change[angle] = np.angle(np.exp(1j * change[angle]))
                column += weight / h * change
            numerical[:, j] = column
        np.testing.assert_allclose(transition, numerical, rtol=1e-6, atol=1e-6)


@pytest.mark.parametrize("dt", [0.0, 1e-6, 1e-4, 0.02, 0.1, 1.0, 10.0])
@pytest.mark.parametrize("rate", [0.0, 1e-9, 9.99e-4, 1.001e-3, 1.0, -3.0])
def test_a_steady_velocity_goes_along_its_circle_at_every_step_width(dt, rate) -> None:
    """By complex numbers: the way is v times the integral of exp(i w t)."""
    v, yaw, span = complex(1.5, -0.4), 0.7, 10.0
    steps = 1 if dt == 0.0 else max(min(round(span / dt), 2000), 1)
    state = state_of(np.array([3.0, -2.0, yaw, v.real, v.imag, rate]), np.zeros(6))
    for _ in range(steps):
        before, state = state, np.empty_like(state)
        kernels.planar_step(before, dt, QUIET[6], nothing(6), state)
    t = steps * dt
    turn = rate * t
    way = t * v * (np.expm1(1j * turn) / (1j * turn) if abs(turn) > 1e-12 else 1.0)
    place = complex(3.0, -2.0) + np.exp(1j * yaw) * way
    assert abs(complex(state[0, 0], state[0, 1]) - place) <= 2e-12 * max(1.0, abs(way))
    assert abs(np.angle(np.exp(1j * (state[0, 2] - yaw - turn)))) <= 1e-12 * max(1.0, abs(turn))


@BOTH
@settings(max_examples=40)
@given(st.integers(0, 2**32))
def test_a_step_is_that_of_the_textbook(n, step, motion, angles, seed) -> None:
    """Predict and correct by full matrices, correlated measurements included."""
    chance = np.random.default_rng(seed)
    mean = random_mean(n, chance)
    state = state_of(mean, chance.uniform(0.1, 2.0, n))
    before = np.empty_like(state)
    kernels_noise = chance.uniform(0.0, 0.1, (3, n))
    step(state, 0.3, kernels_noise, nothing(n), before)  # makes P full
    m = int(chance.integers(1, 7))
    axes = sorted(int(i) for i in chance.permutation(n)[:m])
    root = chance.normal(size=(m, m))
    spread = root @ root.T + 0.01 * np.eye(m)
    values = before[0, axes] + 0.3 * chance.normal(size=m)
    after = np.empty_like(state)
    square, used = step(
        before, 0.0, kernels_noise, news(axes, values, spread, n, factor=2.0), after
    )

    p, h = covariance_of(before), np.eye(n)[axes]
    missed = values - before[0, axes]
    s = h @ p @ h.T + 2.0 * spread
    gain = np.linalg.solve(s, h @ p).T
    left = np.eye(n) - gain @ h
    expected = before[0] + gain @ missed
    for angle in angles:
        expected[angle] = np.angle(np.exp(1j * expected[angle]))
    np.testing.assert_allclose(after[0], expected, atol=1e-10)
    joseph = left @ p @ left.T + 2.0 * gain @ spread @ gain.T
    np.testing.assert_allclose(covariance_of(after), joseph, atol=1e-10)
    assert used == m
    assert square == pytest.approx(missed @ np.linalg.solve(s, missed), rel=1e-9)


@pytest.mark.parametrize(("speed", "yaw"), [(1.2, 0.0), (0.0, 1.0)])
def test_planar_noise_is_that_of_white_acceleration_and_of_slip(speed, yaw) -> None:
    """Against the covariance that thin slices of the same motion add up to."""
    mean = np.array([0.0, 0.0, 0.4, speed, 0.0, 0.0])
    noise = np.array(
        [[0.01, 0.02, yaw * 0.03, 0.5, 0.6, yaw * 0.7], [0.1, 0.02, 0, 0, 0, 0], [0.0] * 6]
    )
    dt, slices = 0.2, 2000
    out = np.empty((7, 6))
    kernels.planar_step(state_of(mean, np.zeros(6)), dt, noise, nothing(6), out)

    thin, whole = dt / slices, np.zeros((6, 6))
    _, transition = moved(kernels.planar_motion, mean, thin)
    turn = np.eye(6)
    turn[:2, :2] = [[np.cos(0.4), -np.sin(0.4)], [np.sin(0.4), np.cos(0.4)]]
    added = turn @ np.diag(thin * (noise[0] + speed * noise[1])) @ turn.T
    for _ in range(slices):
        whole = transition @ whole @ transition.T + added
    np.testing.assert_allclose(covariance_of(out), whole, rtol=2e-3, atol=1e-6)


@pytest.mark.parametrize("ratio", [1e6, 1e16, 1e22, 1e30])
def test_a_variance_of_nearly_all_ratios_is_exact(ratio: float) -> None:
    """Two positions give a velocity: the difference of huge numbers, here against fractions.

    Without factors P loses the velocity's variance from a ratio of 1e16 on, in Joseph's form, too.
    """
    r, dt = Fraction(1, 2**20), Fraction(1, 64)
    prior = Fraction(ratio) * r
    p = [[prior, Fraction(0)], [Fraction(0), prior]]
    for _ in range(2):
        p = [
            [p[0][0] + 2 * dt * p[0][1] + dt * dt * p[1][1], p[0][1] + dt * p[1][1]],
            [p[0][1] + dt * p[1][1], p[1][1]],
        ]
        s = p[0][0] + r
        p = [
            [p[0][0] * r / s, p[0][1] * r / s],
            [p[0][1] * r / s, p[1][1] - p[0][1] * p[0][1] / s],
        ]
    state = state_of(np.zeros(6), np.array([float(prior), 0, 0, float(prior), 0, 0]))
    for _ in range(2):
        before, state = state, np.empty_like(state)
        told = news([0], np.zeros(1), np.full((1, 1), float(r)), 6)
        kernels.planar_step(before, float(dt), QUIET[6], told, state)
    whole = covariance_of(state)
    assert whole[0, 0] == pytest.approx(float(p[0][0]), rel=1e-9)
    assert whole[3, 3] == pytest.approx(float(p[1][1]), rel=1e-9)


def least_over_greatest(state: Array) -> float:
    whole = covariance_of(state)
    assert np.array_equal(whole, whole.T)
    eigenvalues = np.linalg.eigvalsh(whole)
    return float(eigenvalues[0] / eigenvalues[-1])


@BOTH
@settings(max_examples=30)
@given(st.integers(0, 2**32))
def test_no_eigenvalue_is_negative_whatever_the_numbers(n, step, motion, angles, seed) -> None:
    chance = np.random.default_rng(seed)
    state = state_of(random_mean(n, chance), 10.0 ** chance.uniform(-12, 21, n))
    noise = 10.0 ** chance.uniform(-12, 0, (3, n))
    for _ in range(40):
        m = int(chance.integers(0, n))
        axes = [int(i) for i in chance.permutation(n)[:m]]
        told = news(
            axes, state[0, axes], np.diag(10.0 ** chance.uniform(-15, 9, m)), n,
            trusted=bool(chance.integers(2)),
        )  # fmt: skip
        before, state = state, np.empty_like(state)
        step(before, float(chance.choice([0.0, 1e-6, 0.02, 1.0, 10.0])), noise, told, state)
        assert np.isfinite(state).all()
        assert least_over_greatest(state) >= -1e-12


def long_run(n: int, step: Callable[..., tuple[float, int]], steps: int) -> None:
    """Random widths of steps and measurements whose variances go from 1e-15 to 1e9."""
    chance = np.random.default_rng(11)
    noise = np.full((3, n), 1e-6)
    state, other = state_of(np.zeros(n), np.full(n, 1e3)), np.empty((n + 1, n))
    told = [
        news(
            [int(i) for i in chance.permutation(n)[:3]],
            chance.normal(size=3),
            np.diag(10.0 ** chance.choice([-15.0, -6.0, 0.0, 9.0], 3)),
            n,
        )
        for _ in range(64)
    ]
    widths = chance.choice([0.0, 1e-6, 1e-3, 0.02, 0.1], 64)
    for at in range(steps):
        step(state, widths[at * 7 % 64], noise, told[at % 64], other)
        state, other = other, state
    assert np.isfinite(state).all()
    assert least_over_greatest(state) >= -1e-12
    assert (np.diag(covariance_of(state)) > 0.0).all()


@BOTH
def test_many_steps_keep_the_covariance(n, step, motion, angles) -> None:
    long_run(n, step, 5_000)


@pytest.mark.slow
def test_a_million_steps_keep_the_covariance() -> None:
    long_run(6, kernels.planar_step, 1_000_000)


@pytest.mark.parametrize("turns", [-3, -1, 0, 1, 2])
@pytest.mark.parametrize("off", [-1e-9, 0.0, 1e-9])
@pytest.mark.parametrize("yaw", [0.0, 1.0, np.pi, -np.pi])
def test_whole_turns_of_a_measured_yaw_do_not_count(turns, off, yaw) -> None:
    state = state_of(np.array([0, 0, yaw, 0, 0, 0.0]), np.ones(6))
    out = np.empty_like(state)
    told = news([2], np.array([yaw + turns * 2 * np.pi + off]), np.ones((1, 1)), 6)
    square, _ = kernels.planar_step(state, 0.0, QUIET[6], told, out)
    assert square <= 1e-17
    assert abs(out[0, 2]) <= np.pi
    assert abs(np.angle(np.exp(1j * (out[0, 2] - yaw)))) <= 1e-9


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf, 1.7e308, -1.7e308])
@pytest.mark.parametrize("spoiled", [0, 1, 2])
@pytest.mark.parametrize("what", ["value", "variance", "both"])
def test_an_axis_that_was_not_measured_is_left_out(bad, spoiled, what) -> None:
    """Same as a measurement of the others alone."""
    state = state_of(np.array([1, 2, 3, 0.1, 0.2, 0.3]), np.arange(1.0, 7.0))
    values, spread = np.array([1.1, 2.2, -3.1]), np.diag([0.1, 0.2, 0.3]) + 0.01
    others = [axis for axis in range(3) if axis != spoiled]
    alone, out = np.empty_like(state), np.empty_like(state)
    few = news(others, values[others], spread[np.ix_(others, others)], 6)
    kernels.planar_step(state, 0.1, QUIET[6], few, alone)
    if what != "variance":
        values[spoiled] = bad
    if what != "value":
        spread[spoiled, spoiled] = bad
    _, used = kernels.planar_step(state, 0.1, QUIET[6], news([0, 1, 2], values, spread, 6), out)
    assert used == 2
    np.testing.assert_array_equal(out, alone)


@pytest.mark.parametrize(("told", "taken"), [(0.0, 1e-9), (1e-15, 1e-9), (1e12, 1e9), (1e99, 1e9)])
def test_variances_are_brought_into_their_range(told, taken) -> None:
    state = state_of(np.zeros(6), np.full(6, 1e4))
    one, other = np.empty_like(state), np.empty_like(state)
    for variance, out in ((told, one), (taken, other)):
        kernels.planar_step(
            state, 0.0, QUIET[6], news([0], np.ones(1), np.full((1, 1), variance), 6), out
        )
    np.testing.assert_array_equal(one, other)


@pytest.mark.parametrize("shared", [1.0, 2.0, -1.0, np.nan, np.inf])
def test_a_covariance_that_is_none_is_taken_by_its_diagonal(shared) -> None:
    state = state_of(np.zeros(6), np.ones(6))
    one, other = np.empty_like(state), np.empty_like(state)
    for off_diagonal, out in ((shared, one), (0.0, other)):
        spread = np.array([[1.0, off_diagonal], [off_diagonal, 1.0]])
        told = news([0, 1], np.ones(2), spread, 6)
        kernels.planar_step(state, 0.0, QUIET[6], told, out)
    np.testing.assert_array_equal(one, other)


def test_a_pitch_of_ninety_degrees_is_survived() -> None:
    mean = np.zeros(15)
    mean[4], mean[9:12] = np.pi / 2, (0.3, 0.2, 0.1)
    state = state_of(mean, np.ones(15))
    for _ in range(200):
        before, state = state, np.empty_like(state)
        told = news([3, 4, 5], np.array([0.0, np.pi / 2, 0.0]), 1e-2 * np.eye(3), 15)
        kernels.spatial_step(before, 0.02, np.full((3, 15), 1e-3), told, state)
    assert np.isfinite(state).all()
    assert least_over_greatest(state) >= -1e-12
