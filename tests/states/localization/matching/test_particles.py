"""The steps of Monte Carlo localization, against closed forms and plain Python."""

import math

import numpy as np
import pytest
from hypothesis import given, strategies as st
from scipy import stats
from scipy.special import logsumexp

from states.localization.matching.particles import (
    BIN_M,
    clusters,
    drawn,
    kld_count,
    log_likelihoods,
    moments,
    move,
    normalise,
    weigh,
)
from states.maps.field import room_field
from tests.states.localization.world import ROOM

FIELD = room_field(ROOM)


def test_particles_move_the_way_of_the_base_each_in_its_own_direction():
    particles = np.array([[0.0, 0.0, 0.0], [1.0, 2.0, 0.5 * math.pi]])
    move(particles, np.array([2.0, 0.5 * math.pi, 0.1]), np.zeros(3), np.zeros((2, 3)))
    np.testing.assert_allclose(particles[0], (0.0, 2.0, 0.1), atol=1e-12)
    np.testing.assert_allclose(particles[1], (-1.0, 2.0, 0.5 * math.pi + 0.1), atol=1e-12)


def test_spreads_are_standard_deviations_along_across_and_of_the_turn():
    """The first omni model of amcl took variances for them."""
    particles = np.zeros((50_000, 3))
    normals = np.random.default_rng(0).standard_normal(particles.shape)
    move(particles, np.array([1.0, 0.7, 0.2]), np.array([0.3, 0.1, 0.05]), normals)
    c, s = math.cos(0.7), math.sin(0.7)
    along = c * particles[:, 0] + s * particles[:, 1]
    across = -s * particles[:, 0] + c * particles[:, 1]
    for values, mean, spread in (
        (along, 1.0, 0.3),
        (across, 0.0, 0.1),
        (particles[:, 2], 0.2, 0.05),
    ):
        assert np.mean(values) == pytest.approx(mean, abs=0.01)
        assert np.std(values) == pytest.approx(spread, rel=0.02)


@pytest.mark.parametrize("yaw", [math.pi - 1e-9, -math.pi + 1e-9, 3.0])
def test_yaw_stays_within_a_turn(yaw):
    particles = np.array([[0.0, 0.0, yaw]])
    for _ in range(50):
        move(particles, np.array([0.0, 0.0, 1.0]), np.zeros(3), np.zeros((1, 3)))
        assert abs(particles[0, 2]) <= math.pi
    assert math.cos(particles[0, 2]) == pytest.approx(math.cos(yaw + 50.0))


def test_weights_are_sums_of_the_logarithms_of_beams():
    cell, sigma = 0.05, 0.1
    table = log_likelihoods(FIELD.table, cell, sigma, 2.0, 0.95, 0.001)
    rng = np.random.default_rng(5)
    points = rng.uniform(-4.0, 4.0, (60, 2))
    corner = FIELD.map_from_corner
    poses = np.column_stack(
        [rng.uniform(3.0, 13.0, 20), rng.uniform(3.0, 11.0, 20), rng.uniform(-3, 3, 20)]
    )
    found = np.empty(20)
    weigh(poses, points, table, cell, found)
    for (x, y, yaw), log in zip(poses, found, strict=True):
        total = 0.0
        for px, py in points:
            u = x + math.cos(yaw) * px - math.sin(yaw) * py
            v = y + math.sin(yaw) * px + math.cos(yaw) * py
            middle = (math.floor(u / cell) + 0.5) * cell, (math.floor(v / cell) + 0.5) * cell
            edge = (middle[0] + corner.x, middle[1] + corner.y)
            d = 2.0
            for x1, y1, x2, y2 in ROOM.segments:
                ex, ey = x2 - x1, y2 - y1
                part = ((edge[0] - x1) * ex + (edge[1] - y1) * ey) / (ex * ex + ey * ey)
                part = min(1.0, max(0.0, part))
                d = min(d, math.dist(edge, (x1 + part * ex, y1 + part * ey)))
            inside = 0.0 <= u < table.shape[1] * cell and 0.0 <= v < table.shape[0] * cell
            d = d if inside else 2.0
            total += math.log(0.95 * math.exp(-0.5 * (d / sigma) ** 2) + 0.001)
        assert log == pytest.approx(total, abs=1e-6)


@given(st.lists(st.floats(-1e5, 0.0), min_size=1, max_size=50))
def test_weights_of_any_logarithms_add_up_to_one(logs):
    weights, effective = normalise(np.array(logs))
    np.testing.assert_allclose(weights, np.exp(np.array(logs) - logsumexp(logs)), atol=1e-12)
    assert 1.0 - 1e-9 <= effective <= len(logs) + 1e-9


def test_a_likelihood_below_the_least_float_is_still_a_weight():
    """180 beams of 1e-3 are 1e-540: the product itself is zero in float64."""
    weights, effective = normalise(np.array([-180 * 6.9, -180 * 6.9 - 1.0]))
    assert weights[0] == pytest.approx(1.0 / (1.0 + math.exp(-1.0)))
    assert math.isfinite(effective)


@given(
    st.lists(st.floats(0.0, 1.0), min_size=1, max_size=40),
    st.floats(0.0, 0.999),
    st.integers(1, 200),
)
def test_a_systematic_draw_takes_each_its_share_to_within_one(shares, offset, count):
    weights = np.array(shares) + 1e-9
    weights /= weights.sum()
    chosen = drawn(weights, count, offset)
    taken = np.bincount(chosen, minlength=len(weights))
    assert taken.sum() == count
    assert (np.abs(taken - count * weights) < 1.0 + 1e-6).all()


def test_kld_counts_by_the_quantile_of_chi_squared():
    """With 2.33 for 99 %; amcl's default of 0.99 for this quantile stands for 84 %."""
    for bins in (2, 5, 20, 200):
        exact = stats.chi2.ppf(0.99, bins - 1) / (2.0 * 0.05)
        assert kld_count(bins, 0.05, stats.norm.ppf(0.99)) == pytest.approx(exact, rel=0.03)
        assert kld_count(bins, 0.05, 0.99) < 0.95 * exact
    assert kld_count(0, 0.05, 2.33) == kld_count(1, 0.05, 2.33) == 0.0


def test_bins_that_touch_are_one_cluster_across_the_turn_too():
    near_pi = math.pi - 0.01
    particles = np.array(
        [
            [0.1, 0.1, near_pi],
            [0.1 + BIN_M, 0.1 + BIN_M, -near_pi],
            [0.1 + 3 * BIN_M, 0.1, near_pi],
            [0.1, 0.1, 1.0],
            [0.2, 0.2, 1.0],
        ]
    )
    a, b, c, d, e = clusters(particles)
    assert a == b
    assert d == e
    assert len({a, c, d}) == 3


def test_mean_and_covariance_are_those_of_the_chosen():
    rng = np.random.default_rng(3)
    spread = np.array([[0.2, 0.0, 0.0], [0.1, 0.1, 0.0], [0.02, 0.0, 0.05]])
    particles = np.array([2.0, 3.0, math.pi]) + rng.standard_normal((20_000, 3)) @ spread.T
    particles[:, 2] = np.mod(particles[:, 2] + math.pi, 2.0 * math.pi) - math.pi
    weights = np.full(len(particles), 1.0 / len(particles))
    mean, covariance = moments(particles, weights, np.ones(len(particles), bool))
    np.testing.assert_allclose(mean[:2], (2.0, 3.0), atol=0.01)
    assert abs(abs(mean[2]) - math.pi) < 0.01
    np.testing.assert_allclose(covariance, spread @ spread.T, atol=1e-3)


def test_directions_that_cancel_have_an_endless_variance():
    particles = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, math.pi]])
    _, covariance = moments(particles, np.array([0.5, 0.5]), np.ones(2, bool))
    assert covariance[2, 2] == math.inf
