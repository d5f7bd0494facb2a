"""Benchmark of localization: run time against error, of particles, matching, filters, frames.

A shipped robot drives through `lab_a` in the full simulation: two scanners, slipping wheels, an
inertial sensor, no trackers. Errors are taken over one minute, after the first two seconds;
matching and particles are given the start pose. Times are medians, ratios are to the budget.
"""

from __future__ import annotations

import math
import statistics
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from functools import cache, cached_property
from time import perf_counter
from typing import Any

import numpy as np

from cobodeck.bench.harness import ROUNDS, BenchRow, Work, seconds_of
from hw import Odometry, Pose2, Pose3, Sample, Scan, Twist2
from hw.model import MotionLimits, SensorErrors, SensorModel, Tracking, load_robot
from hw.motion import PoseHistory
from hw.scene import load_scene
from hw.sim import World
from states.localization import Localizer
from states.localization.filter import (
    AXES,
    POSE,
    FilterConfig,
    Measurement,
    MeasurementSource,
    PlanarFilter,
    ProcessNoise,
    SpatialFilter,
    planar_config,
)
from states.localization.frames import TransformBuffer
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

PARTICLES = (100, 500, 2000, 5000)
BEAMS = (15, 30, 60, 120)
SIGMAS = (0.2, 0.1, 0.05)
RESOLUTIONS = (0.025, 0.05, 0.1)
MATCHED_BEAMS = (30, 60, 180, 541)
SCALES = (0.05, 0.1, 0.25)
MOST_US = {"match": 100.0, "particles": 300.0, "planar": 10.0, "spatial": 40.0, "lookup": 25.0}
"""Budgets of one step, µs."""


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
    yield from particle_rows(drawn)
    yield from match_rows(drawn)
    yield localizer_row(drawn)
    yield from step_rows(rounds)


@cache
def ride(seconds: float = SECONDS, seed: int = 0) -> Ride:
    """One drive from stop to stop, turning all the while."""
    scene = replace(load_scene(SCENE), robot_start=Pose2(*STOPS[0], -1.571))
    robot, limits = load_robot(ROBOT), MotionLimits(SPEED, ACCELERATION)
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


def clouds(beams: int) -> Iterator[tuple[Cloud, Pose2, Pose2]]:
    """Each scan as points, with the odometry pose and the true pose at its stamp."""
    sensing, trail, found = load_robot(ROBOT).sensing, Trail(), ride()
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


def particle_rows(field: Field) -> Iterator[BenchRow]:
    """Particle filter rows, one parameter varied at a time."""
    usual = AmclValues(min_particles=500, max_particles=500)
    for count in PARTICLES:
        values = replace(usual, min_particles=count, max_particles=count)
        yield _particle_row("particles", count, field, values)
    for beams in BEAMS:
        yield _particle_row("beams", beams, field, replace(usual, laser_max_beams=beams))
    for sigma in SIGMAS:
        yield _particle_row("sigma_hit", sigma, field, replace(usual, sigma_hit=sigma))
    for resolution in RESOLUTIONS:
        yield _particle_row("resolution", resolution, field, replace(usual, resolution=resolution))


def _particle_row(knob: str, value: float, field: Field, values: AmclValues) -> BenchRow:
    particles = Amcl(field, values)
    took, errors = [], []
    for number, (cloud, wheels, true) in enumerate(clouds(values.laser_max_beams)):
        if number == 0:
            particles.start(true, START)
        begin = perf_counter()
        if particles.update(wheels, cloud.points):
            took.append(perf_counter() - begin)
        errors.append(particles.estimate(wheels).map_from_base.distance_to(true))
    goal = {0.2: 6.0, 0.05: 3.0}.get(values.sigma_hit)
    return _compared(_timed("amcl", took, "particles"), knob, value, _rmse(errors), goal)


# matching


def match_rows(drawn: Field) -> Iterator[BenchRow]:
    """Scan matching rows, on a drawn field and on fields of cells."""
    usual = TrackerValues()
    for beams in MATCHED_BEAMS:
        yield _match_row("beams", beams, drawn, replace(usual, beams=beams), 1.5)
    for scale in SCALES:
        yield _match_row("scale", scale, drawn, replace(usual, scale=scale), 1.5)
    room = load_scene(SCENE).room
    for resolution in RESOLUTIONS:
        cells = map_field(room_map(room.outer, room.obstacles, resolution))
        yield _match_row("resolution", resolution, cells, usual, None)


def _match_row(
    knob: str, value: float, field: Field, values: TrackerValues, goal: float | None
) -> BenchRow:
    took, errors = [], []
    pose: Pose2 | None = None
    before = Pose2(0.0, 0.0)
    for cloud, wheels, true in clouds(values.beams):
        predicted = true if pose is None else pose @ (before.inverse() @ wheels)
        begin = perf_counter()
        pose = match(field, cloud.points, predicted, PREDICTED, values).map_from_base
        took.append(perf_counter() - begin)
        errors.append(pose.distance_to(true))
        before = wheels
    return _compared(_timed("match", took, "match"), knob, value, _rmse(errors), goal)


def localizer_row(field: Field) -> BenchRow:
    """The whole localizer: computing time per second of the drive, error of the published pose."""
    robot, found = load_robot(ROBOT), ride()
    localizer = Localizer(field, robot.sensing, Tracking.of(robot.sensing), found.poses[0])
    errors, took = [], 0.0
    for sample in found.samples:
        begin = perf_counter()
        localizer.update(*sample)
        took += perf_counter() - begin
        if localizer.pose is not None and localizer.stamp_ns is not None:
            true = found.truth.extended(localizer.stamp_ns)
            errors.append(localizer.pose.distance_to(true))
    seconds = found.stamps[-1] * 1e-9
    return BenchRow(
        NAME, "localizer", "cobodeck", time_us=took / seconds * 1e6, ratio=took / seconds,
        ratio_to="real time", error=round(100.0 * _rmse(errors), 3), error_unit="cm rmse", goal=3.0,
    )  # fmt: skip


# single steps


def step_rows(rounds: int) -> Iterator[BenchRow]:
    """One prediction with one correction, and one transform look-up over five edges."""
    planar = PlanarFilter(
        planar_config(
            MeasurementSource("wheels", ("vx", "vy", "wz"), gate=None),
            MeasurementSource("scan", POSE),
        )
    )
    yield _step_row("filter planar", "planar", _filtering(planar, "scan", 3), rounds)
    axes = ("x", "y", "z", "roll", "pitch", "yaw")
    none, some = (0.0,) * len(AXES), (1e-3,) * len(AXES)
    noise = ProcessNoise(some, none, none)
    spatial = SpatialFilter(
        FilterConfig((MeasurementSource("pose", axes),), noise, (1.0,) * len(AXES))
    )
    yield _step_row("filter 15 states", "spatial", _filtering(spatial, "pose", 6), rounds)
    for cache_s in (10.0, 1000.0):
        row = _step_row("lookup 5 edges", "lookup", _looking(cache_s), rounds)
        yield replace(row, knob="cache", value=cache_s)


def _filtering(filter_: Any, source: str, axes: int) -> Callable[[], object]:
    stamp = 0
    values, variances = (0.0,) * axes, (1e-4,) * axes

    def step() -> object:
        nonlocal stamp
        stamp += PERIOD_NS
        return filter_.correct(Measurement(stamp, source, values, variances))

    return step


def _looking(cache_s: float) -> Callable[[], object]:
    buffer = TransformBuffer(cache_s)
    for k in range(round(100 * cache_s)):
        moved = Pose3.from_yaw(0.01 * k, 0.0, 0.0, 0.001 * k)
        for parent, child in (("map", "odom"), ("odom", "base"), ("base", "arm")):
            buffer.set_transform(parent, child, k * 10_000_000, moved)
    buffer.fix("arm", "flange", Pose3(0.0, 0.0, 1.0))
    buffer.fix("flange", "tool", Pose3(0.1, 0.0, 0.0))
    at = round(0.5 * cache_s * 1e9) + 5_000_000
    return lambda: buffer.lookup("map", "tool", at)


def _step_row(name: str, most: str, step: Callable[[], object], rounds: int) -> BenchRow:
    work = Work(times(step))
    seconds_of(work, 100)
    took = [seconds_of(work, 500) / 500 for _ in range(rounds)]
    return _timed(name, took, most)


def _timed(name: str, took: Iterable[float], most: str) -> BenchRow:
    time = statistics.median(took) * 1e6
    limit = MOST_US[most]
    return BenchRow(
        NAME, name, "cobodeck", time_us=time, ratio=time / limit, ratio_to=f"{limit:g} µs"
    )


def _compared(
    timed: BenchRow, knob: str, value: float, rmse: float, goal: float | None
) -> BenchRow:
    error = round(100.0 * rmse, 3)
    return replace(timed, knob=knob, value=value, error=error, error_unit="cm rmse", goal=goal)


def _rmse(errors: list[float]) -> float:
    settled = errors[round(len(errors) * SETTLED / SECONDS) :]
    return math.sqrt(statistics.fmean(error**2 for error in settled))
