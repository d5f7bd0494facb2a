"""Subjects of `states.localization`, `states.maps` and `states.signals`."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache
from typing import NamedTuple

import numpy as np

from hw.geometry import Pose2, Pose3, Twist2, wrap
from hw.model.tracking import Tracking
from hw.samples import Odometry, PoseSigma, Sample, Scan, TrackerPose, UserPose
from states.localization.calibration.tracker_calibration import (
    BaseReading,
    Calibration,
    TrackerReading,
    calibrate,
)
from states.localization.filter.filter_kernels import Array
from states.localization.filter.fusion import Fusion, sigma_of
from states.localization.filter.measurement_sources import (
    FilterConfig,
    Measurement,
    MeasurementSource,
    ProcessNoise,
)
from states.localization.filter.planar import SLIPPING, PlanarFilter, planar_config
from states.localization.filter.spatial import SpatialFilter
from states.localization.frames.transforms import NoTransform, TransformBuffer
from states.localization.localizer import Localizer
from states.localization.matching.amcl import Amcl, AmclValues
from states.localization.matching.beyond import is_leaving
from states.localization.matching.correlative import Window, correlated
from states.localization.matching.scan_tracker import match
from states.localization.matching.scans import cloud_of
from states.localization.particle_localizer import ParticleLocalizer
from states.localization.slam.pose_graph import PoseEdge, solved
from states.localization.wheels.drift import DriftWatch
from states.localization.wheels.tracker_feed import TrackerFeed
from states.localization.wheels.wheel_motion import WheelMotion
from states.maps.cells import room_map
from states.maps.field import Field, map_field, room_field
from states.maps.occupancy import OccupancyMap
from states.signals.prediction import PREDICTORS, time_to_contact
from states.signals.user_motion import StillnessEstimator, VelocityEstimator
from tests.states.localization.world import ROOM, World, random_drive, sensing, standing
from tests.stress.bodies import ROBOT
from tests.stress.elsewhere import Elsewhere

HERE = Pose2(5.0, 3.0, 3.1)
UNSURE = np.diag([0.04, 0.01, 0.01])


def drawn(at: Elsewhere) -> Field:
    """The map of the room on cells, placed elsewhere as a whole; its axes turn with it."""
    map_ = room_map(ROOM.outer, ROOM.obstacles, 0.05)
    corner = map_.map_from_corner
    return map_field(OccupancyMap(map_.values, 0.05, at.pose(corner.x, corner.y, corner.yaw)))


@cache
def scanned() -> Array:
    """Ends of beams seen from `HERE`, (n, 2)."""
    world = World(standing(HERE, 1.0), 0, walker=False)
    return cloud_of(world.scan("front_laser", 0)[1], 0, world.sensing, 180).points


def elsewhere(covariance: Array, at: Elsewhere) -> Array:
    c, s = math.cos(at.turn), math.sin(at.turn)
    turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    return np.asarray(turn @ covariance @ turn.T)


class _Stamped(NamedTuple):
    value: object
    stamp: int


def planar_filter(at: Elsewhere) -> list[float]:
    """A drive through half a turn: wheels, gyroscope and poses, with an outlier and a late one."""
    pose, found = ("x", "y", "yaw"), []
    filter_ = PlanarFilter(
        planar_config(
            MeasurementSource("wheels", ("vx", "vy", "wz")), MeasurementSource("scan", pose)
        )
    )
    for k in range(60):
        t = 0.05 * k
        filter_.correct(Measurement(at.ns(t), "wheels", (1.0, 0.1, 0.8), (4e-4,) * 3))
        late = t - 0.12
        if k % 4 == 0 and late > 0.0:
            there = at.pose(2.0 + 0.3 * late + (k == 40), 3.0 + 0.1 * late, 2.6 + 0.8 * late)
            values = (there.x, there.y, there.yaw)
            covariance = elsewhere(np.diag([4e-4, 1e-4, 1e-4]), at)
            filter_.correct(Measurement(at.ns(late), "scan", values, covariance))
        if k > 10:
            found += [*at.home_pose(filter_.pose), *at.home_covariance(filter_.covariance[:3, :3])]
            found += filter_.mean[3:].tolist()
    return found


def spatial_filter(at: Elsewhere) -> list[float]:
    axes = ("x", "y", "z", "roll", "pitch", "yaw")
    filter_ = SpatialFilter(
        FilterConfig(
            (
                MeasurementSource("pose", axes, gate=None),
                MeasurementSource("rates", ("vx", "wx", "wy", "wz")),
            ),
            ProcessNoise((1e-3,) * 15, (0.0,) * 15, (0.0,) * 15),
            (1e6,) * 3 + (1e3,) * 3 + (1.0,) * 9,
        )
    )
    found = []
    for k in range(40):
        t = 0.05 * k
        if k % 3 == 0:
            there = at.pose(2.0 + 0.5 * t, 3.0, 2.8 + 0.6 * t)
            values = (there.x, there.y, 1.0, 0.1, 0.3 + 0.2 * t, there.yaw)
            filter_.correct(Measurement(at.ns(t), "pose", values, (1e-4,) * 6))
        filter_.correct(Measurement(at.ns(t), "rates", (0.5, 0.0, 0.2, 0.6), (1e-3,) * 4))
        if k > 5:
            found += [*at.home_pose(filter_.pose.flat()), *filter_.pose.roll_pitch_yaw[:2]]
            found += filter_.mean[6:].tolist()
    return found


def fusion(at: Elsewhere) -> list[float]:
    fused, found = Fusion(gyro=True, rough_map=True), []
    fused.begin(at.ns(0.0), at.pose(2.0, 3.0, 2.9), elsewhere(UNSURE, at), Twist2(0.5, 0.0, 0.5))
    for k in range(1, 60):
        t = 0.02 * k
        body = at.pose(2.0 - 0.5 * t, 3.0, 2.9 + 0.5 * t)
        fused.wheels(at.ns(t), Twist2(0.5, 0.0, 0.5), standing=False, rate=0.5)
        if k % 4 == 0:
            information = elsewhere(np.diag([1e4, 10.0, 1e5]), at)
            fused.scan(at.ns(t - 0.03), body, information, gated=k % 8 == 0)
        if k % 5 == 0:
            fused.trackers(at.ns(t - 0.01), body, PoseSigma(0.01, 0.01))
        known = fused.at(at.ns(t + 0.005))
        assert known is not None
        found += [*at.home_pose(known[0]), *at.home_covariance(known[1])]
        found += [sigma_of(known[1]).position]
    return found


def wheel_motion(at: Elsewhere) -> list[float]:
    """Dead reckoning, trail, gyroscope, watch and clock of wheels, through several turns."""
    wheels, found = WheelMotion(SLIPPING), []
    for k in range(400):
        t = 0.02 * k
        yaw = 2.0 * math.sin(0.9 * t) + 3.0
        body = Pose2(3.0 + 0.5 * math.sin(0.5 * t), 2.0 + 0.2 * t, yaw)
        odom = at.pose(body.x, body.y, body.yaw)
        rate = 1.8 * math.cos(0.9 * t)
        wheels.gyro.add_reading(at.ns(t - 0.005), rate + 0.01, standing=False)
        wheels.add_odometry(at.ns(t), odom)
        if k % 5 == 3:
            seen = t - 0.004
            there = wheels.trail.at(at.ns(seen))
            assert there is not None
            by_scan = at.pose(2.0, 1.0, 0.3) @ (at.pose(0.0, 0.0, 0.0).inverse() @ there)
            wheels.saw_scan(at.ns(seen))
            wheels.corrected(at.ns(seen), by_scan, elsewhere(UNSURE, at), None)
            wheels.compare(at.ns(seen), by_scan)
        carried, moving = wheels.carried_on(at.ns(t + 0.003)), wheels.velocity_at(at.ns(t))
        if k > 10 and carried is not None and moving is not None:
            found += [*at.home_pose(carried[0]), moving.vx, moving.vy, moving.wz]
            found += [*at.home_covariance(carried[1]), wheels.watch.wrong, wheels.still]
    clock = wheels.clock.estimate
    return [*found, *(clock or ())]


def drift_watch(at: Elsewhere) -> list[float]:
    watch, found = DriftWatch(), []
    for k in range(80):
        t = 0.1 * k
        one = at.pose(2.0 + (0.03 if t > 4.0 else 0.0), 3.0, 3.1 + 0.01 * k)
        drift = watch.update(at.ns(t), one, at.pose(2.0, 3.0, 3.1 + 0.01 * k))
        if drift is not None:
            found += [drift.offset, drift.turn, drift.kind == "jump"]
            found += [(drift.since_ns - at.since_ns) * 1e-9]
    assert found
    return found


def tracker_feed(at: Elsewhere) -> list[float]:
    feed, found = TrackerFeed(Tracking.of(ROBOT.sensing)), []
    for k in range(40):
        for name, model in ROBOT.sensing.trackers.items():
            there = at.pose(2.0 + 0.02 * k, 3.0, 2.7 + 0.03 * k).upright() @ model.mount.pose
            pose = feed.add_tracker_pose(at.ns(0.02 * k), TrackerPose(name, there), 0.05)
            if pose is not None:
                found += at.home_pose(pose)
    return found


def scan_match(at: Elsewhere) -> list[float]:
    found = match(drawn(at), scanned(), at.pose(5.1, 2.95, 3.15), elsewhere(UNSURE, at))
    information = at.home_covariance(found.information)
    return [*at.home_pose(found.map_from_base), found.share, *(1e-4 * v for v in information)]


def window_search(at: Elsewhere) -> list[float]:
    window = Window(at.pose(5.3, 2.8, 3.3), elsewhere(UNSURE, at), 0.6, 0.4)
    poses = correlated(drawn(at), scanned(), window)
    leaving = is_leaving(drawn(at), scanned(), poses[0], 0.1)
    return [*(value for pose in poses for value in at.home_pose(pose)), leaving]


def distance_field(at: Elsewhere) -> list[float]:
    """The exact field of a drawn room, which may stand askew, from a pose in it."""
    points = np.array([(0.5 * k, 0.3 * j) for k in range(-6, 7) for j in range(-6, 7)])
    return room_field(at.room(ROOM)).distances(at.pose(5.0, 3.0, 3.1), points).tolist()


def particles(at: Elsewhere) -> list[float]:
    amcl = Amcl(drawn(at), AmclValues(min_particles=200, max_particles=200), seed=3)
    amcl.start(at.pose(5.02, 3.01, 3.1), elsewhere(np.eye(3) * 1e-3, at))
    found = []
    for _ in range(3):
        amcl.update(at.pose(0.0, 0.0, 3.1), scanned(), force=True)
        estimate = amcl.estimate()
        found += [*at.home_pose(estimate.map_from_base), estimate.weight]
    return found


def localized(
    make: Callable[[Field, Pose2], Localizer | ParticleLocalizer], at: Elsewhere, name: str
) -> list[float]:
    """A drive of two seconds by all sensors; the room is moved as a whole."""
    found = []
    localizer = make(drawn(at), at.pose(*_start()))
    for sample in _samples():
        localizer.update(sample.name, at.since_ns + sample.stamp_ns, _told(sample.value, at))
        if sample.name == name and localizer.pose is not None:
            found += [*at.home_pose(localizer.pose), localizer.sigma.position]
    return found


def localizer(at: Elsewhere) -> list[float]:
    tracking = Tracking.of(sensing())
    return localized(
        lambda field, start: Localizer(field, sensing(), tracking, start, 0), at, "base.odometry"
    )


def particle_localizer(at: Elsewhere) -> list[float]:
    tracking = Tracking.of(sensing())
    return localized(
        lambda field, start: ParticleLocalizer(field, sensing(), tracking, start, 0),
        at,
        "base.scan",
    )


@cache
def _world() -> World:
    return World(random_drive(20, 2.0), 20)


def _start() -> tuple[float, float, float]:
    x, y, yaw = _world().drive.at(0.0)
    return float(x), float(y), float(yaw)


@cache
def _samples() -> tuple[Sample, ...]:
    return tuple(_world().samples("base.odometry", "base.imu", "base.scan", "rover.tracker"))


def _told(value: object, at: Elsewhere) -> object:
    if isinstance(value, TrackerPose):
        there = at.pose(0.0, 0.0, 0.0).upright() @ value.pose
        return TrackerPose(value.tracker, there)
    if isinstance(value, Odometry) and at.windings:
        pose = value.pose
        wound = Pose2(pose.x, pose.y, pose.yaw + 2.0 * math.pi * at.windings)
        return Odometry(wound, value.twist)
    if isinstance(value, Scan) and at.single:
        return Scan(
            value.sensor, value.start, value.step,
            tuple(at.number(r) for r in value.ranges), value.beam_time,
        )  # fmt: skip
    return value


def pose_graph(at: Elsewhere) -> list[float]:
    rng = np.random.default_rng(3)
    true = [Pose2(2.0, 3.0, 2.5)]
    for _ in range(19):
        true.append(true[-1] @ Pose2(0.5, 0.0, float(rng.normal(0.2, 0.4))))
    pairs = [*((n, n + 1) for n in range(19)), (0, 12), (3, 19), (5, 17)]
    edges = []
    for i, j in pairs:
        x, y, yaw = rng.normal(0.0, 0.01, 3)
        edge = true[i].inverse() @ true[j] @ Pose2(x, y, yaw)
        edges.append(PoseEdge(i, j, edge, np.diag([1e4, 1e4, 1e4]), j - i > 1))
    begun = [at.pose(pose.x, pose.y, pose.yaw) for pose in true]
    found = solved(begun, edges)
    assert all(found.kept)
    return [value for pose in found.poses for value in at.home_pose(pose)]


def calibration(at: Elsewhere) -> list[float]:
    """The map is elsewhere, the tracking system stays."""
    vive_from_map = Pose3.from_yaw(3.0, -2.0, 0.1, 1.1).inverse()
    mount = Pose3.from_angles(0.45, 0.3, 0.62, (0.1, -0.4, 0.7))
    trackers, bases = [], []
    for k in range(500):
        t = 0.06 * k
        x, y = 5 + 2.5 * math.sin(0.23 * t), 4 + 2 * math.sin(0.31 * t + 1)
        yaw = wrap(3.0 + 2.5 * math.sin(0.17 * t))
        seen = vive_from_map @ Pose3.from_yaw(x, y, 0.0, yaw) @ mount
        trackers.append(TrackerReading(at.ns(t), "one", seen))
        there = at.pose(x + 2e-3 * math.sin(7.0 * t), y, yaw)
        bases.append(BaseReading(at.ns(t), there))
    result = calibrate(trackers, bases)
    assert isinstance(result, Calibration), result
    found = result.mounts["one"]
    return [
        *at.home_pose(result.map_from_vive.flat()), result.clock_offset, result.position_rms,
        *(found.x, found.y, found.z, *found.roll_pitch_yaw),
    ]  # fmt: skip


def frames(at: Elsewhere) -> list[float]:
    buffer = TransformBuffer()
    buffer.fix("base", "scanner", Pose3.from_angles(0.3, 0.2, 0.4, (0.1, 0.2, 0.3)))
    for k in range(10):
        t = 0.05 * k
        moving = at.pose(2.0 + 0.4 * t, 3.0, 2.9 + 0.8 * t)
        buffer.set_transform("map", "base", at.ns(t), moving.upright())
    found = []
    for t in (0.0, 0.12, 0.31, 0.449):
        pose = buffer.lookup("map", "scanner", at.ns(t))
        assert not isinstance(pose, NoTransform), pose
        found += [*at.home_pose(pose.flat()), *pose.roll_pitch_yaw[:2], pose.z]
    return found


def user_velocity(at: Elsewhere) -> list[float]:
    estimator, still, found = VelocityEstimator(0.3), StillnessEstimator(0.1, 0.3), []
    for k in range(90):
        t = k / 30.0
        walked = min(t, 1.5)
        body = at.pose(2.0 + 0.8 * walked, 3.0, 3.0 + 0.3 * walked)
        estimator.update("user.pose", _Stamped(UserPose(body, body.yaw), at.ns(t)))
        value = estimator.value()
        if value is not None:
            still.update("user.velocity", _Stamped(value, at.ns(t)))
            found += at.home_twist(value)
        since = still.value()
        found.append(-1.0 if since is None else (since - at.since_ns) * 1e-9)
    return found


def predicted_user(at: Elsewhere) -> list[float]:
    body, robot = at.pose(2.0, 3.0, 3.1), at.pose(4.0, 3.5, 0.2)
    found = []
    for predictor in PREDICTORS.values():
        for ahead in (0.0, 0.3, 2.0):
            soon = predictor.at(body, at.twist(0.9, 0.4, 0.6), ahead, robot)
            found += at.home_pose(soon)
    relative = (robot.x - body.x, robot.y - body.y)
    return [*found, time_to_contact(relative, at.vector(1.0, 0.3), 0.6)]
