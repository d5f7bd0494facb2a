"""Logs of drives through a room that is known: in the product's types, and as CARMEN's text."""

import math
from dataclasses import replace
from pathlib import Path

from cobodeck.logs.formats.drive_log import ReferencePose, SensorLog
from hw.geometry import Pose3
from hw.model.sensing import Mount
from hw.samples import Odometry, Sample, Scan, TrackerPose
from tests.states.localization.world import World, random_drive, sensing


def world(seed=3, seconds=20.0, rate=5.0, speed=0.6):
    return World(random_drive(seed, seconds, speed), seed, sensing(beams=181, rate=rate))


def world_of_one(seed=3, seconds=16.0):
    """With one scanner in the middle of the base, as logs of corrected poses mean it."""
    both = sensing(beams=361, rate=5.0)
    middle = replace(both.lidars["front_laser"], mount=Mount(0.0, 0.0))
    alone = replace(both, lidars={"front_laser": middle})
    return World(random_drive(seed, seconds, 0.6), seed, alone)


def log_of(world_, *names, reference=True, form="record"):
    """A log of these samples with the truth as reference."""
    samples = sorted(world_.samples(*names), key=lambda one: one.stamp_ns)
    stamps = range(0, round(world_.drive.times[-1] * 1e9), 20_000_000)
    poses = [ReferencePose(at, world_.drive.pose(at * 1e-9)) for at in stamps] if reference else []
    return SensorLog(
        Path("drive.mcap"), form, tuple(samples), world_.sensing, tuple(poses), room=world_.room
    )


def tracked(world_, vive_from_map, noise, rng):
    """What a tracking system without jumps, whose frame is elsewhere, tells of both trackers."""
    found = []
    for number in range(int(world_.drive.times[-1] * 30)):
        time = number / 30.0
        base = world_.drive.pose(time)
        for name, model in world_.sensing.trackers.items():
            at = Pose3.from_yaw(base.x, base.y, 0.0, base.yaw) @ model.mount.pose
            seen = vive_from_map @ at
            dx, dy, dz = rng.normal(0.0, noise, 3).tolist()
            pose = replace(seen, x=seen.x + dx, y=seen.y + dy, z=seen.z + dz)
            found.append(Sample("rover.tracker", round(time * 1e9), TrackerPose(name, pose)))
    return found


def carmen(world_, corrected=False):
    """The front scanner and the wheels as text; with the truth as corrected poses."""
    lines, odom = [], None
    for sample in world_.samples("base.odometry", "base.scan"):
        at, value = sample.stamp_ns * 1e-9, sample.value
        if isinstance(value, Odometry):
            odom = value.pose
            told = f"{odom.x:.6f} {odom.y:.6f} {odom.yaw:.6f} 0 0 0"
            lines.append(f"ODOM {told} {at:.6f} host {at:.6f}")
        elif isinstance(value, Scan) and value.sensor == "front_laser" and odom is not None:
            lines.append(_robotlaser(world_, value, odom, at, corrected))
    return "\n".join(lines) + "\n"


def _robotlaser(world_, scan, odom, at, corrected):
    lidar = world_.sensing.lidars[scan.sensor]
    ranges = " ".join(f"{r:.3f}" if math.isfinite(r) else "99" for r in scan.ranges)
    head = f"ROBOTLASER1 0 {scan.start:.8f} {lidar.field_of_view:.8f} {scan.step:.8f} 30 0.01 0"
    seen = odom @ lidar.mount.flat
    if corrected:
        seen = world_.drive.pose(at)
    poses = f"{seen.x:.6f} {seen.y:.6f} {seen.yaw:.6f} {odom.x:.6f} {odom.y:.6f} {odom.yaw:.6f}"
    return f"{head} {len(scan.ranges)} {ranges} 0 {poses} 0 0 0 0 0 {at:.6f} host {at:.6f}"


def values(log, name):
    return [sample.value for sample in log.samples if sample.name == name]
