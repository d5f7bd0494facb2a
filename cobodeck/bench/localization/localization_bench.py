"""Benchmark of localization: run time against error, of particles, matching, filters, frames.

A shipped robot drives through `lab_a` in the full simulation: two scanners, slipping wheels, an
inertial sensor, no trackers. Errors are taken over one minute, after the first two seconds;
matching and particles are given the start pose. Times are of one scan.
"""

from __future__ import annotations

import math
import statistics
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property, partial
from types import MappingProxyType

import numpy as np

from cobodeck.bench.harness import ROUNDS, BenchRow, TimedPoint, Work, timed, times
from cobodeck.bench.localization.localization_peers import Correlation
from cobodeck.bench.localization.localization_steps import step_rows
from hw import Odometry, Pose2, Sample, Scan, Twist2
from hw.model import MotionLimits, RobotModel, SensorErrors, SensorModel, Tracking, load_robot
from hw.motion import PoseHistory
from hw.scene import load_scene
from hw.sim import World
from states.localization import Localizer
from states.localization.matching import (
    Amcl,
    AmclValues,
    Cloud,
    TrackerValues,
    cloud_of,
    match,
    middle_ns,
    span_ns,
)
from states.localization.wheels import Trail
from states.maps import Field, map_field, room_field, room_map

NAME = "localization"
SCENE, ROBOT = "lab_a", "rbkairos_ur10"
SECONDS, SETTLED = 60.0, 2.0
SPEED, TURN, ACCELERATION = 1.2, 0.6, 1.0
STOPS = ((2.0, 8.0), (2.0, 2.0), (5.0, 3.74), (8.5, 3.74), (9.5, 8.0), (8.5, 6.56), (5.0, 6.56))
"""Stops of the drive, m: past both sides of the column, with free straight lines between."""
PERIOD_NS = 20_000_000
START = np.diag([0.1**2, 0.1**2, 0.05**2])
PREDICTED = np.diag([0.05**2, 0.05**2, 0.03**2])

PARTICLES = (50, 100, 500, 2000, 5000)
BEAMS = (15, 30, 60, 120)
SIGMAS = (0.2, 0.1, 0.05)
RESOLUTIONS = (0.025, 0.05, 0.1, 0.2)
MATCHED_BEAMS = (15, 30, 60, 180, 541)
SCALES = (0.05, 0.1, 0.25)
MOST_ROUNDS = 5
TRUTH = "the simulated pose"


SeenCloud = tuple[Cloud, Pose2, Pose2]


@dataclass(frozen=True)
class Ride:
    """The samples of a drive, and the true poses of the base by stamps, in order."""

    samples: tuple[Sample, ...]
    stamps: tuple[int, ...]
    poses: tuple[Pose2, ...]

    @cached_property
    def truth(self) -> PoseHistory[Pose2]:
        """The true poses."""
        return PoseHistory(Pose2.between, poses=zip(self.stamps, self.poses, strict=True))


def rows(rounds: int = ROUNDS) -> Iterator[BenchRow]:
    """All rows of the benchmark."""
    drawn = room_field(load_scene(SCENE).room)
    some = min(rounds, MOST_ROUNDS)
    yield from timed(list(particle_points(drawn)), some)
    yield from timed(list(match_points(drawn)), some)
    yield from timed([localizer_point(drawn)], some)
    yield from step_rows(rounds)


def robot_with(beams: int | None = None) -> RobotModel:
    """The robot; with so many beams of each scanner."""
    robot = load_robot(ROBOT)
    if beams is None:
        return robot
    lidars = {name: replace(one, beams=beams) for name, one in robot.sensing.lidars.items()}
    return replace(robot, sensing=replace(robot.sensing, lidars=MappingProxyType(lidars)))


def ride(seconds: float = SECONDS, seed: int = 0, beams: int | None = None) -> Ride:
    """One drive from stop to stop, turning all the while."""
    scene = replace(load_scene(SCENE), robot_start=Pose2(*STOPS[0], -1.571))
    robot, limits = robot_with(beams), MotionLimits(SPEED, ACCELERATION)
    model = SensorModel(seed=seed)
    world = World(scene, robot, None, limits, sensing=SensorErrors(), sensors=model)
    samples: list[Sample] = []
    poses, goal = [], 1
    stamps = range(0, round(seconds * 1e9), PERIOD_NS)
    for now in stamps:
        world.advance(now)
        pose = world.base.pose
        poses.append(pose)
        for part in ("odometry", "imu", "lidar"):
            samples.extend(world.parts[part].samples(now))
        if math.dist((pose.x, pose.y), STOPS[goal]) < 0.1:
            goal = (goal + 1) % len(STOPS)
        world.base.drive(_towards(pose, STOPS[goal], now * 1e-9))
    return Ride(tuple(samples), tuple(stamps), tuple(poses))


def _towards(pose: Pose2, stop: tuple[float, float], time: float) -> Twist2:
    away = math.dist((pose.x, pose.y), stop)
    speed = min(SPEED, math.sqrt(ACCELERATION * away)) / max(away, 1e-9)
    ahead = Twist2((stop[0] - pose.x) * speed, (stop[1] - pose.y) * speed)
    turned = ahead.rotated(-pose.yaw)
    return Twist2(turned.vx, turned.vy, TURN * math.sin(0.5 * time))


@cache
def _ride() -> Ride:
    return ride()


@cache
def clouds(beams: int) -> tuple[SeenCloud, ...]:
    """Each scan as points, with the odometry pose and the true pose at its stamp."""
    return tuple(_clouds(beams))


def _clouds(beams: int) -> Iterator[SeenCloud]:
    sensing, trail, found = load_robot(ROBOT).sensing, Trail(), _ride()
    for _, stamp, value in found.samples:
        if isinstance(value, Odometry):
            trail.add_odometry(stamp, value.pose)
        if isinstance(value, Scan):
            cloud = cloud_of(
                value, stamp, sensing, beams, trail.velocity(stamp, stamp + span_ns(value))
            )
            wheels = trail.at(middle_ns(value, stamp))
            if wheels is not None:
                yield cloud, wheels, found.truth.extended(cloud.stamp_ns)


# particles


def particle_points(field: Field) -> Iterator[TimedPoint]:
    """Particle filters, one parameter varied at a time; and the usual one, of varying size."""
    usual = AmclValues(min_particles=500, max_particles=500)
    for count in PARTICLES:
        values = replace(usual, min_particles=count, max_particles=count)
        yield _particle_point("particles", count, field, values)
    for beams in BEAMS:
        yield _particle_point("beams", beams, field, replace(usual, laser_max_beams=beams))
    for sigma in SIGMAS:
        yield _particle_point("sigma_hit", sigma, field, replace(usual, sigma_hit=sigma))
    for resolution in RESOLUTIONS:
        values = replace(usual, resolution=resolution)
        yield _particle_point("resolution", resolution, field, values)
    yield _particle_point(None, None, field, AmclValues())


def _particle_point(
    knob: str | None, value: float | None, field: Field, values: AmclValues
) -> TimedPoint:
    seen = clouds(values.laser_max_beams)
    follow = partial(_by_particles, field, values, seen)
    row = _row("particle filter", "adaptive" if knob is None else "cobodeck", knob, value, follow())
    goal = {0.2: 6.0, 0.05: 3.0}.get(values.sigma_hit)
    return replace(row, goal=goal, default=knob is None), Work(times(follow), items=len(seen))


def _by_particles(field: Field, values: AmclValues, seen: tuple[SeenCloud, ...]) -> list[float]:
    """Follow the drive; returns the error at each scan, m."""
    particles, errors = Amcl(field, values), []
    particles.start(seen[0][2], START)
    for cloud, wheels, true in seen:
        particles.update(wheels, cloud.points)
        errors.append(particles.estimate(wheels).map_from_base.distance_to(true))
    return errors


# matching


def match_points(drawn: Field) -> Iterator[TimedPoint]:
    """Scan matching on a drawn field and on fields of cells; beside it correlative matching."""
    usual = TrackerValues()
    for beams in MATCHED_BEAMS:
        point = _match_point("beams", beams, drawn, replace(usual, beams=beams))
        yield replace(point[0], default=beams == usual.beams), point[1]
    for scale in SCALES:
        yield _match_point("scale", scale, drawn, replace(usual, scale=scale))
    room = load_scene(SCENE).room
    for resolution in RESOLUTIONS:
        cells = map_field(room_map(room.outer, room.obstacles, resolution))
        row, work = _match_point("resolution", resolution, cells, usual)
        yield replace(row, goal=None), work
    for resolution in RESOLUTIONS:
        seen = clouds(AmclValues().laser_max_beams)
        follow = partial(_by_correlation, Correlation(drawn, resolution), seen)
        row = _row("scan matching", "correlative", "cell", resolution, follow())
        yield replace(row, peer=True), Work(times(follow), items=len(seen))


def _match_point(knob: str, value: float, field: Field, values: TrackerValues) -> TimedPoint:
    seen = clouds(values.beams)
    follow = partial(_by_matching, field, values, seen)
    row = _row("scan matching", "cobodeck", knob, value, follow())
    return replace(row, goal=1.5), Work(times(follow), items=len(seen))


def _by_matching(field: Field, values: TrackerValues, seen: tuple[SeenCloud, ...]) -> list[float]:
    """Follow the drive; returns the error at each scan, m."""
    pose, before, errors = seen[0][2], seen[0][1], []
    for cloud, wheels, true in seen:
        predicted = pose @ (before.inverse() @ wheels)
        pose, before = (
            match(field, cloud.points, predicted, PREDICTED, values).map_from_base,
            wheels,
        )
        errors.append(pose.distance_to(true))
    return errors


def _by_correlation(matcher: Correlation, seen: tuple[SeenCloud, ...]) -> list[float]:
    """Follow the drive; returns the error at each scan, m."""
    pose, before, errors = seen[0][2], seen[0][1], []
    for cloud, wheels, true in seen:
        pose, before = matcher.match(pose, before.inverse() @ wheels, cloud.points), wheels
        errors.append(pose.distance_to(true))
    return errors


def localizer_point(field: Field) -> TimedPoint:
    """The whole localizer: computing time per second of the drive, error of the published pose."""
    found = _ride()
    follow = partial(by_localizer, field, found)
    row = _row("localizer", "cobodeck", None, None, follow())
    return replace(row, goal=3.0), Work(times(follow), items=round(found.stamps[-1] * 1e-9))


def by_localizer(field: Field, found: Ride, beams: int | None = None) -> list[float]:
    """Follow the drive of a robot with so many beams; returns the error after each sample, m."""
    sensing, errors = robot_with(beams).sensing, []
    localizer = Localizer(field, sensing, Tracking.of(sensing), found.poses[0])
    for sample in found.samples:
        localizer.update(*sample)
        if localizer.pose is not None and localizer.stamp_ns is not None:
            true = found.truth.extended(localizer.stamp_ns)
            errors.append(localizer.pose.distance_to(true))
    return errors


def _row(
    name: str, variant: str, knob: str | None, value: float | None, errors: list[float]
) -> BenchRow:
    return BenchRow(
        NAME, name, variant, knob, value, error=rmse_cm(errors),
        error_unit="cm rmse", reference=TRUTH,
    )  # fmt: skip


def rmse_cm(errors: Sequence[float], seconds: float = SECONDS) -> float:
    """Root mean square of errors, m, of a drive of so many seconds, once settled; cm."""
    settled = errors[round(len(errors) * SETTLED / seconds) :]
    return round(100.0 * math.sqrt(statistics.fmean(error**2 for error in settled)), 3)


# single steps
