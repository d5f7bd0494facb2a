"""Rays against shapely and the roots of circles; the sensor drives and turns as it sweeps."""

from __future__ import annotations

import math

import numpy as np
import pytest
from shapely import LineString, Point, union_all

from hw.scene.scene import load_scene
from hw.sim.sensors.rays import beams, cast, cast_discs, measured, nothing_kept, scan

FAR = 100.0


def oracle(knots, mount, start, step, spacing, count, segments, discs):
    """Ranges by shapely, one beam after the other."""
    walls = union_all([LineString([s[:2], s[2:]]) for s in segments])
    found = []
    for n in range(count):
        x, y, yaw = (np.interp(n * spacing, knots[:, 0], knots[:, k]) for k in (1, 2, 3))
        place = complex(x, y) + complex(*mount[:2]) * np.exp(1j * yaw)
        way = FAR * np.exp(1j * (yaw + mount[2] + start + n * step))
        ray = LineString([(z.real, z.imag) for z in (place, place + way)])
        origin, hit = Point(place.real, place.imag), walls.intersection(ray)
        ways = [math.inf if hit.is_empty else origin.distance(hit)]
        for x1, y1, x2, y2, radius in discs:
            share = n / (count - 1)
            centre = complex(x1 + share * (x2 - x1), y1 + share * (y2 - y1)) - place
            # where the distance to the centre is the radius
            roots = np.roots([1.0, -2.0 * (centre / way * FAR).real, abs(centre) ** 2 - radius**2])
            if abs(centre) > radius and not np.iscomplex(roots).any():
                ways += [root.real for root in roots if root > 0.0]
        found.append(min(ways))
    return np.array(found)


def course(rng, spread, turn, duration):
    """A course through random knots."""
    times = np.sort([0.0, *rng.uniform(0.0, duration, 4), duration])
    middle = rng.uniform((1.0, 1.0, -4.0), (5.5, 9.0, 4.0))
    return np.column_stack([times, middle + rng.uniform(-1, 1, (6, 3)) * (spread, spread, turn)])


@pytest.mark.requirement(22, 23, 25)
@pytest.mark.parametrize(("spread", "turn"), [(0.0, 0.0), (0.05, 0.1), (0.4, 1.5)])
@pytest.mark.parametrize("field", [1.5 * math.pi, 2.0 * math.pi, 0.5])
def test_rays_meet_what_shapely_says_they_meet(spread: float, turn: float, field: float) -> None:
    segments = np.array(load_scene("lab_a").room.segments)
    rng = np.random.default_rng([7, round(100 * spread), round(100 * field)])
    for _ in range(2):
        count, duration = 101, 0.06
        knots, mount = course(rng, spread, turn, duration), np.array([0.29, -0.21, -0.7])
        start, step = -0.5 * field, field / (count - 1)
        discs = np.column_stack([
            rng.uniform((0, 0), (11, 10), (4, 2)), rng.uniform((0, 0), (11, 10), (4, 2)),
            rng.uniform(0.1, 0.6, 4),
        ])  # fmt: skip
        discs[1:, 2:4] = discs[1:, :2] + rng.uniform(-0.1, 0.1, (3, 2))
        spacing = duration / (count - 1)
        rays = beams(knots, mount, start, step, spacing, count)
        found = cast(rays, segments, start, step)
        cast_discs(found, rays, discs)
        expected = oracle(knots, mount, start, step, spacing, count, segments, discs)
        assert found == pytest.approx(expected, abs=1e-7)


def test_no_ray_slips_through_corners_or_along_walls() -> None:
    corners = [(1.0, 1.0), (4.0, 1.0), (4.0, 3.0), (1.0, 3.0)]
    segments = np.array([(*a, *b) for a, b in zip(corners, corners[1:] + corners[:1], strict=True)])
    for x, y in [(2.0, 2.0), (1.0 + 1e-9, 2.0), (3.5, 1.5)]:
        bearings = [math.atan2(cy - y, cx - x) for cx, cy in corners]
        for bearing in (*bearings, 0.0, 0.5 * math.pi):
            knots = np.array([[0.0, x, y, bearing], [1.0, x, y, bearing]])
            rays = beams(knots, np.zeros(3), 0.0, 0.1, 0.0, 60)
            assert np.isfinite(cast(rays, segments, 0.0, 0.1)).all()


def test_in_the_open_nothing_comes_back() -> None:
    rays = beams(np.zeros((2, 4)), np.zeros(3), -1.0, 0.1, 0.0, 21)
    assert np.isinf(cast(rays, np.empty((0, 4)), -1.0, 0.1)).all()


def test_noise_has_its_size_and_ranges_their_limits() -> None:
    rng = np.random.default_rng(3)
    n = 40_000
    exact = np.full(n, 5.0)
    limits, noise, lots = np.array([0.1, 8.0]), rng.standard_normal(n), rng.random(n)
    found = measured(exact, noise, lots, limits, 0.02, 0.0)
    assert np.std(found - 5.0) == pytest.approx(0.02, rel=0.02)
    assert (found * 1024.0 == np.round(found * 1024.0)).all()
    for outside in (0.05, 8.1, math.inf):
        assert np.isinf(measured(np.full(n, outside), noise, lots, limits, 0.0, 0.0)).all()
    mixed = measured(exact, noise, lots, limits, 0.0, 0.1)
    assert np.mean(np.isinf(mixed)) == pytest.approx(0.05, abs=0.005)
    short = mixed[mixed < 4.9]
    assert len(short) / n == pytest.approx(0.05, abs=0.005)
    assert np.min(short) >= 0.1
    assert np.mean(short) == pytest.approx(2.55, abs=0.15)


def test_what_a_scanner_keeps_while_the_base_stands_changes_no_scan() -> None:
    rng, segments = np.random.default_rng(3), np.array(load_scene("lab_a").room.segments)
    places = np.array([(3.0, 4.0, 0.3)] * 5 + [(3.0, 4.0, 0.4)] * 3 + [(3.1, 4.0, 0.4)] * 4)
    past = np.column_stack([np.arange(12.0) * 5e7, places]), 0, 12
    turns, limits = (-2.0, 0.04, 6e-4), (np.array([0.05, 30.0]), 0.01, 0.02)
    kept = nothing_kept(101)
    for stamp in range(0, 600_000_000, 20_000_000):
        disc = np.array([[*rng.uniform(2.0, 6.0, 4), 0.4]])
        normal, lots = rng.standard_normal(101), rng.random(101)
        chances = normal.copy(), lots
        span, mount = (stamp, stamp + 60_000_000), np.array([0.3, 0.2, 0.8])
        scan(past, span, mount, turns, (segments, disc), (normal, lots), limits, kept)
        scan(past, span, mount, turns, (segments, disc), chances, limits, nothing_kept(101))
        assert (normal == chances[0]).all()
