"""Particles follow the base by the parameters of amcl, whatever befalls them."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from hw.geometry import Pose2, wrap
from states.localization.matching.amcl import Amcl, AmclValues
from states.localization.matching.particles import normalise
from states.localization.matching.scans import cloud_of, middle_ns
from states.maps.cells import room_map
from states.maps.field import Field, Table, map_field, room_field
from states.maps.occupancy import OccupancyMap
from tests.repeats import fewer
from tests.states.localization.world import ROOM, World, random_drive, standing

FIELD = room_field(ROOM)
HERE = Pose2(5.0, 3.0, 0.7)
NEAR = np.diag([0.2**2, 0.2**2, 0.1**2])
FIXED = AmclValues(min_particles=500, max_particles=500)


def points_at(pose, seed=0, **about):
    world = World(standing(pose, 1.0), seed, walker=False, **about)
    return cloud_of(world.scan("front_laser", 0)[1], 0, world.sensing, 60).points


def follow(seed, values, seconds, *, field=FIELD):
    """Errors of the estimate along a drive, (n,), m; scans of one scanner."""
    world = World(random_drive(seed, seconds), seed)
    odometry = world.odometry()
    stamps = np.array([stamp for stamp, _ in odometry])
    particles = Amcl(field, values, seed)
    particles.start(world.drive.pose(0.0), NEAR)
    errors = []
    for sample in world.samples("base.scan"):
        if sample.value.sensor != "front_laser":
            continue
        middle = middle_ns(sample.value, sample.stamp_ns)
        i = min(int(np.searchsorted(stamps, middle)), len(stamps) - 1)
        part = float((middle - stamps[i - 1]) / (stamps[i] - stamps[i - 1]))
        wheels = odometry[i - 1][1].pose.between(odometry[i][1].pose, part)
        motion = odometry[i][1].twist
        particles.update(
            wheels, cloud_of(sample.value, sample.stamp_ns, world.sensing, 60, motion).points
        )
        true = world.drive.pose(middle * 1e-9)
        errors.append(particles.estimate(wheels).map_from_base.distance_to(true))
    return np.array(errors)


def rmse(errors):
    return math.sqrt(np.mean(np.square(errors)))


@pytest.mark.parametrize(("sigma", "bound"), [(0.2, 0.06), (0.05, 0.03)])
@pytest.mark.few(1)
def test_500_particles_of_60_beams_follow_a_drive(sigma, bound):
    assert rmse(follow(30, replace(FIXED, sigma_hit=sigma), 10.0)) < bound


@pytest.mark.slow
@pytest.mark.parametrize(("sigma", "bound"), [(0.2, 0.06), (0.05, 0.03)])
def test_500_particles_of_60_beams_follow_for_minutes(sigma, bound):
    errors = [follow(seed, replace(FIXED, sigma_hit=sigma), 60.0) for seed in fewer(range(20, 28))]
    assert rmse(np.concatenate(errors)) < bound


def test_the_number_of_particles_adapts_to_how_sure_the_place_is():
    particles = Amcl(FIELD, AmclValues(selective_resampling=False, likelihood_power=0.01), 1)
    particles.start_anywhere()
    assert len(particles.particles) == 5000
    particles.update(Pose2(0.0, 0.0), points_at(HERE))
    anywhere = len(particles.particles)
    particles.start(HERE, 0.01 * NEAR)
    particles.update(Pose2(0.0, 0.0), points_at(HERE))
    assert len(particles.particles) < 0.1 * anywhere


def test_nothing_is_done_before_the_base_has_moved():
    particles = Amcl(FIELD, FIXED, 0)
    particles.start(HERE, NEAR)
    points = points_at(HERE)
    assert particles.update(Pose2(0.0, 0.0), points)
    before = particles.particles
    assert not particles.update(Pose2(0.05, 0.05, 0.05), points)
    np.testing.assert_array_equal(particles.particles, before)
    assert particles.update(Pose2(0.2, 0.0), points)


def test_the_omni_motion_model_is_the_corrected_one():
    """trans^2 = a3 d^2 + a4 t^2, turn^2 = a1 t^2 + a2 d^2, strafe^2 = a4 t^2 + a5 d^2."""
    alphas = {"odom_alpha1": 0.01, "odom_alpha2": 0.02, "odom_alpha3": 0.03, "odom_alpha4": 0.04}
    values = AmclValues(min_particles=40_000, max_particles=40_000, odom_alpha5=0.05, **alphas)
    particles = Amcl(FIELD, values, 4)
    particles.start(Pose2(5.0, 5.0, 0.0), np.zeros((3, 3)))
    none = np.empty((0, 2))
    particles.update(Pose2(0.0, 0.0, 0.0), none)
    way, turn = 0.8, 0.5
    particles.update(Pose2(0.0, way, turn), none)
    x, y, yaw = particles.particles.T
    assert np.std(y) == pytest.approx(math.sqrt(0.03 * way**2 + 0.04 * turn**2), rel=0.03)
    assert np.std(x) == pytest.approx(math.sqrt(0.04 * turn**2 + 0.05 * way**2), rel=0.03)
    assert np.std(yaw) == pytest.approx(math.sqrt(0.01 * turn**2 + 0.02 * way**2), rel=0.03)
    assert np.mean(y) == pytest.approx(5.0 + way, abs=0.01)


def test_resampling_waits_while_particles_are_worth_their_number():
    values = replace(FIXED, likelihood_power=0.001)
    particles = Amcl(FIELD, values, 0)
    particles.start(HERE, NEAR)
    before = particles.particles
    particles.update(Pose2(0.0, 0.0), points_at(HERE))
    np.testing.assert_array_equal(particles.particles, before)
    assert 250.0 < particles.effective < 499.999
    eager = Amcl(FIELD, replace(values, selective_resampling=False), 0)
    eager.start(HERE, NEAR)
    eager.update(Pose2(0.0, 0.0), points_at(HERE))
    assert eager.effective == pytest.approx(500.0)


def carried(values):
    """A base that stood at one place, and is then at another: is it found?"""
    particles = Amcl(FIELD, values, 2)
    particles.start(HERE, NEAR)
    there = Pose2(9.5, 7.5, -2.0)
    wheels = Pose2(0.0, 0.0)
    for pose, scans in ((HERE, 20), (there, 80)):
        for k in range(scans):
            wheels = wheels @ Pose2(0.0, 0.0, 0.15 * (-1) ** k)
            particles.update(
                wheels, points_at(Pose2(pose.x, pose.y, pose.yaw + wheels.yaw), k), force=True
            )
    found = particles.estimate().map_from_base
    return found.distance_to(there) < 0.2


def test_new_particles_find_a_base_that_was_carried_elsewhere():
    values = AmclValues(min_particles=2000, recovery_alpha_slow=0.01, recovery_alpha_fast=0.5)
    assert carried(values)
    assert not carried(replace(values, recovery_alpha_slow=0.0, recovery_alpha_fast=0.0))


@pytest.mark.parametrize(
    "points",
    [np.empty((0, 2)), np.full((30, 2), 1e4), np.full((1, 2), 0.0)],
    ids=["no beam", "all off the map", "one beam"],
)
def test_scans_that_say_nothing_leave_finite_particles(points):
    particles = Amcl(FIELD, FIXED, 0)
    particles.start(HERE, NEAR)
    for k in range(5):
        particles.update(Pose2(0.2 * k, 0.0), points)
    estimate = particles.estimate()
    assert np.isfinite(particles.particles).all()
    assert np.isfinite(estimate.covariance).all()
    assert 0.0 < estimate.weight <= 1.0 + 1e-9
    assert math.isfinite(particles.effective)


def test_all_particles_off_the_map_keep_equal_weights():
    particles = Amcl(FIELD, FIXED, 0)
    particles.start(Pose2(500.0, 500.0), np.zeros((3, 3)))
    particles.update(Pose2(0.0, 0.0), points_at(HERE))
    assert particles.effective == pytest.approx(500.0)


def test_one_particle_is_enough_to_go_on():
    particles = Amcl(FIELD, AmclValues(min_particles=1, max_particles=1), 0)
    particles.start(HERE, np.zeros((3, 3)))
    for k in range(3):
        particles.update(Pose2(0.2 * k, 0.0), points_at(HERE))
    assert particles.particles.shape == (1, 3)
    assert np.isfinite(particles.estimate().covariance).all()


def test_the_same_seed_gives_the_same_bits():
    values = AmclValues(max_particles=300)
    runs = [follow(3, values, 3.0).tobytes() for _ in range(2)]
    assert runs[0] == runs[1]


@pytest.mark.parametrize("turn", [0.0, 1.1])
def test_a_map_moved_far_away_has_the_same_particles(turn):
    by = Pose2(1e6, -1e6, turn)
    drawn = room_map(ROOM.outer, ROOM.obstacles, 0.05)
    far = OccupancyMap(drawn.values, 0.05, by @ drawn.map_from_corner)
    points = points_at(HERE)
    round_ = np.diag([0.04, 0.04, 0.01])
    poses = []
    for field, start in ((map_field(drawn), HERE), (map_field(far), by @ HERE)):
        particles = Amcl(field, FIXED, 0)
        particles.start(start, round_)
        for k in range(5):
            particles.update(Pose2(0.001 * k, 0.0), points, force=True)
        poses.append(particles.estimate().map_from_base)
    back = by.inverse() @ poses[1]
    assert back.distance_to(poses[0]) < 0.05
    assert abs(wrap(back.yaw - poses[0].yaw)) < 0.02


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (
            {"min_particles": 10, "max_particles": 5},
            "min_particles must not be above max_particles, 5",
        ),
        ({"z_hit": 0.9, "z_rand": 0.3}, "z_hit and z_rand are 1.2 in sum"),
        (
            {"recovery_alpha_slow": 0.2},
            "recovery_alpha_fast must be above recovery_alpha_slow, 0.2",
        ),
    ],
)
def test_values_that_do_not_go_together_are_refused(change, says):
    with pytest.raises(ValueError, match=says):
        Amcl(FIELD, replace(AmclValues(), **change))


def test_a_map_without_floor_has_no_place_for_particles():
    table = FIELD.table
    empty = Field(FIELD.map_from_corner, Table(*table[:-1], np.zeros_like(table.floor)))
    with pytest.raises(ValueError, match="no free cell"):
        Amcl(empty, FIXED).start_anywhere()


@pytest.mark.parametrize("resample_interval", [1, 1000])
def test_weights_stay_representable_however_many_scans_are_taken(resample_interval):
    """The heaviest has the logarithm 0, so that none sinks out of sight with the rest."""
    particles = Amcl(FIELD, replace(FIXED, resample_interval=resample_interval), 1)
    particles.start(HERE, NEAR)
    points = points_at(HERE)
    for _ in range(20):
        particles.update(Pose2(0.0, 0.0), points, force=True)
        assert particles._logs.max() == 0.0
        assert 1.0 <= particles.effective <= 500.0


@given(st.lists(st.floats(-700.0, 0.0), min_size=1, max_size=20), st.floats(-1e6, 1e3))
@settings(deadline=None)
def test_weights_are_the_same_wherever_their_logarithms_are(logs, shift):
    expected = [math.exp(log - max(logs)) for log in logs]

    weights, effective = normalise(np.array(logs) + shift)

    total = math.fsum(expected)
    assert weights == pytest.approx([w / total for w in expected], rel=1e-8, abs=1e-12)
    assert effective == pytest.approx(total**2 / math.fsum(w * w for w in expected), rel=1e-8)


@pytest.mark.parametrize("turn", [1.2, -2.5])
def test_particles_are_spread_along_the_axes_of_the_map_however_its_corner_is_turned(turn):
    by = Pose2(3.0, -2.0, turn)
    told = np.array([[0.04, 0.015, 0.0], [0.015, 0.01, 0.002], [0.0, 0.002, 0.01]])
    size = np.sqrt(np.outer(told.diagonal(), told.diagonal()))
    particles, start = Amcl(Field(by @ FIELD.map_from_corner, FIELD.table), FIXED, 0), by @ HERE
    particles.start(start, told, 4000)

    off = particles.particles - (start.x, start.y, start.yaw)
    off[:, 2] = [wrap(yaw) for yaw in off[:, 2].tolist()]

    assert np.abs(np.mean(off, axis=0)).max() < 0.02
    np.testing.assert_array_less(np.abs(np.cov(off.T) - told), 0.1 * size)
    np.testing.assert_array_less(np.abs(particles.estimate().covariance - told), 0.1 * size)
