"""Scans laid onto walls: exact, honest about how sure, and open about what they do not know."""

import math

import numpy as np
import pytest

from hw.geometry import Pose2, wrap
from hw.scene.room import Room
from states.localization.matching.scan_tracker import TrackerValues, _normal_equations, match
from states.localization.matching.scans import cloud_of, middle_ns
from states.maps.cells import room_map
from states.maps.field import distance_at, map_field, room_field
from states.maps.occupancy import OccupancyMap
from tests.repeats import fewer
from tests.states.localization.world import ROOM, World, random_drive, standing

FIELD = room_field(ROOM)
VALUES = TrackerValues()
HERE = Pose2(5.0, 3.0, 0.7)
UNSURE = np.diag([0.1**2, 0.1**2, 0.05**2])


def points_at(pose, seed=0, **about):
    world = World(standing(pose, 1.0), seed, **{"walker": False, **about})
    start, scan = world.scan("front_laser", 0)
    return cloud_of(scan, round(start * 1e9), world.sensing, 180).points


def error(found, true):
    return np.array([found.x - true.x, found.y - true.y, wrap(found.yaw - true.yaw)])


def test_a_clean_scan_is_laid_onto_the_walls_exactly():
    points = points_at(HERE, noise=0.0, outliers=0.0)
    found = match(FIELD, points, Pose2(5.15, 2.9, 0.8), UNSURE * 9.0)
    assert np.abs(error(found.map_from_base, HERE)).max() < 5e-4
    assert found.share == 1.0
    assert found.is_healthy(VALUES)


def test_a_noisy_scan_is_better_than_a_centimetre_whoever_walks_by():
    people = ((6.0, 3.5, 0.5), (4.0, 2.0, 0.5))
    for seed in range(20):
        points = points_at(HERE, seed, discs=people)
        found = match(FIELD, points, Pose2(5.05, 2.95, 0.72), UNSURE)
        assert np.abs(error(found.map_from_base, HERE)).max() < 0.015


def test_the_gradient_is_that_of_the_robust_loss():
    rng = np.random.default_rng(3)
    points = points_at(HERE)[::3]
    scale, corner = 0.1, FIELD.map_from_corner

    def loss(x, y, yaw):
        total = 0.0
        for px, py in points:
            place = Pose2(x, y, yaw).transform(px, py)
            d, _, _ = distance_at(*place, FIELD.table)
            total += 0.5 * d * d / (1.0 + d * d / scale**2)
        return total

    for _ in range(5):
        at = np.array([5.0 - corner.x, 3.0 - corner.y, 0.7]) + rng.normal(0.0, 0.03, 3)
        information, gradient = np.zeros((3, 3)), np.zeros(3)
        _normal_equations(
            points, tuple(at), FIELD.table, (scale, scale, 0.0, 0.0, 0.1), information, gradient
        )
        for i in range(3):
            step = np.zeros(3)
            step[i] = 1e-6
            slope = (loss(*(at + step)) - loss(*(at - step))) / 2e-6
            assert slope == pytest.approx(-gradient[i], rel=1e-5, abs=1e-6)


def test_along_a_corridor_the_prediction_stays_and_nothing_is_claimed():
    corridor = Room(((-50.0, -1.0), (50.0, -1.0), (50.0, 1.0), (-50.0, 1.0)))
    world = World(standing(Pose2(0.0, 0.2, 0.1), 1.0), 1, room=corridor, walker=False)
    points = cloud_of(world.scan("front_laser", 0)[1], 0, world.sensing, 180).points
    found = match(room_field(corridor), points, Pose2(0.3, 0.1, 0.05), UNSURE)
    assert found.map_from_base.x == pytest.approx(0.3, abs=0.02)
    assert found.map_from_base.y == pytest.approx(0.2, abs=0.01)
    assert found.map_from_base.yaw == pytest.approx(0.1, abs=0.005)
    along, across = found.information[0, 0], found.information[1, 1]
    assert along < 1e-3 * across


@pytest.mark.parametrize(("beams", "known"), [(2, False), (3, False), (6, True), (12, True)])
def test_few_beams_show_no_direction(beams, known):
    corridor = Room(((-50.0, -1.0), (9.0, -1.0), (9.0, 1.0), (-50.0, 1.0)))
    beside = np.linspace(-4.0, 4.0, 80)
    sides = np.stack([np.append(beside, beside), np.repeat([-1.0, 1.0], 80)], axis=1)
    ahead = np.stack([np.full(beams, 9.0), np.linspace(-0.1, 0.1, beams)], axis=1)
    near = np.diag([0.3**2, 0.05**2, 0.02**2])
    found = match(room_field(corridor), np.concatenate((sides, ahead)), Pose2(0.0, 0.0), near)
    assert bool(found.information[0, 0] > 1e3) is known
    assert found.information[1, 1] > 1e4


@pytest.mark.parametrize("points", [np.empty((0, 2)), np.full((20, 2), 900.0)])
def test_without_a_wall_the_prediction_comes_back_unhealthy(points):
    found = match(FIELD, points, HERE, UNSURE)
    np.testing.assert_allclose(error(found.map_from_base, HERE), 0.0, atol=1e-12)
    assert not found.information.any()
    assert not found.is_healthy(VALUES)


def test_a_scan_of_another_place_is_not_healthy():
    points = points_at(Pose2(9.5, 8.0, -1.0))
    assert not match(FIELD, points, Pose2(2.0, 4.0, 1.0), UNSURE).is_healthy(VALUES)


def test_what_a_match_claims_is_honest():
    """The squared error in terms of the information is chi2 with 3 degrees, mean 3 (95 % band)."""
    squared = []
    rng = np.random.default_rng(11)
    for seed in range(120):
        pose = Pose2(*rng.uniform((4.6, 1.0), (6.5, 4.0)), rng.uniform(-3.0, 3.0))
        start = pose @ Pose2(*rng.normal(0.0, (0.03, 0.03, 0.01)))
        found = match(FIELD, points_at(pose, seed), start, UNSURE)
        off = error(found.map_from_base, pose)
        squared.append(off @ found.information @ off)
    assert 2.0 < np.mean(squared) < 4.0


@pytest.mark.parametrize("turn", [0.0, 1.1])
def test_map_and_poses_moved_together_give_the_same_match(turn):
    by = Pose2(1e6, -1e6, turn)
    drawn = room_map(ROOM.outer, ROOM.obstacles, 0.05)
    far = OccupancyMap(drawn.values, 0.05, by @ drawn.map_from_corner)
    points, start = points_at(HERE), Pose2(5.1, 2.95, 0.75)
    c, s = math.cos(turn), math.sin(turn)
    turned = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    unsure = np.array([[0.04, 0.01, 0.0], [0.01, 0.01, 0.0], [0.0, 0.0, 0.01]])
    near = match(map_field(drawn), points, start, unsure)
    away = match(map_field(far), points, by @ start, turned @ unsure @ turned.T)
    back = by.inverse() @ away.map_from_base
    np.testing.assert_allclose(error(back, near.map_from_base), 0.0, atol=1e-6)
    expected = turned @ near.information @ turned.T
    np.testing.assert_allclose(away.information, expected, rtol=1e-3, atol=1.0)


def test_yaw_may_be_counted_over_whole_turns():
    points = points_at(HERE)
    found = match(FIELD, points, Pose2(5.05, 3.0, 0.7), UNSURE)
    for turns in (-2, 1, 5):
        other = match(FIELD, points, Pose2(5.05, 3.0, 0.7 + turns * 2.0 * math.pi), UNSURE)
        np.testing.assert_allclose(error(other.map_from_base, found.map_from_base), 0.0, atol=1e-9)


def follow(seed, field, seconds):
    """Errors of the matches alone along a drive, (n, 3); the odometry slips."""
    world = World(random_drive(seed, seconds), seed)
    odometry = world.odometry()
    stamps = np.array([stamp for stamp, _ in odometry])

    def way(stamp):
        i = int(np.clip(np.searchsorted(stamps, stamp), 1, len(stamps) - 1))
        part = (stamp - stamps[i - 1]) / (stamps[i] - stamps[i - 1])
        return odometry[i - 1][1].pose.between(odometry[i][1].pose, float(part)), odometry[i][1]

    pose, before, errors = world.drive.pose(0.0), 0, []
    for sample in world.samples("base.scan"):
        middle = middle_ns(sample.value, sample.stamp_ns)
        now, twist = way(middle)
        predicted = pose @ (way(before)[0].inverse() @ now)
        cloud = cloud_of(sample.value, sample.stamp_ns, world.sensing, 180, twist.twist)
        pose = match(
            field, cloud.points, predicted, np.diag([0.05**2, 0.05**2, 0.03**2])
        ).map_from_base
        errors.append(error(pose, world.drive.pose(middle * 1e-9)))
        before = middle
    return np.array(errors)


def rmse(errors):
    return math.sqrt(np.mean(errors[:, 0] ** 2 + errors[:, 1] ** 2))


def test_a_drive_is_followed_to_a_centimetre():
    errors = follow(20, FIELD, 10.0)
    assert rmse(errors) < 0.01
    assert np.abs(errors[:, 2]).max() < 0.01


@pytest.mark.slow
@pytest.mark.parametrize("seed", fewer(range(20, 28)))
def test_a_minute_is_followed_to_one_and_a_half_centimetres(seed):
    errors = follow(seed, FIELD, 60.0)
    assert rmse(errors) < 0.015
    assert np.hypot(errors[:, 0], errors[:, 1]).max() < 0.05


def test_on_a_scanned_map_it_is_half_a_cell():
    errors = follow(20, map_field(room_map(ROOM.outer, ROOM.obstacles, 0.05)), 10.0)
    assert rmse(errors) < 0.025
