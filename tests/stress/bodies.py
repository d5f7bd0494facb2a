"""Subjects of `hw`: poses, motion, the safety chain, rooms, sensors."""

from __future__ import annotations

import math

import numpy as np

from hw.geometry import STILL, Outline, Pose2, Pose3, Twist2, displacement_of, velocity_of
from hw.model.robot import MotionLimits, load_robot
from hw.model.tracking import Tracking
from hw.motion.pose_history import PoseHistory, along_arc, wrapped
from hw.motion.reckoner import Reckoner
from hw.motion.velocity_estimator import Motion
from hw.safety.limits import SafetyLimits
from hw.safety.ramps import Ramps, twist_after
from hw.safety.rule import SafetyRule
from hw.samples import Odometry, PoseSigma, TrackerPose
from hw.scene.room import Room, foot
from hw.se3 import between
from hw.sim.sensors.rays import beams, cast, cast_discs
from hw.sim.sensors.track import Track, knots
from tests.stress.elsewhere import Elsewhere

ROOM = Room(
    ((0.0, 0.0), (12.0, 0.0), (12.0, 10.0), (0.0, 10.0)),
    walls=(((7.0, 0.0), (7.2, 0.0), (7.2, 2.5), (7.0, 2.5)),),
    columns=(((4.0, 4.6), (4.4, 4.6), (4.4, 5.2), (4.0, 5.2)),),
)
ROBOT = load_robot("rbkairos_ur10")
LIMITS = MotionLimits(1.0, 2.0, base_speed=2.5, base_yaw_rate=1.5)


def planar_poses(at: Elsewhere) -> list[float]:
    a, b, way = at.pose(2.0, 3.0, 3.1), at.pose(5.0, 1.0, -3.0), Pose2(0.4, -0.2, 0.3)
    seen = a.inverse() @ b
    return [
        *at.home_pose(a @ way),
        *at.home_pose(a @ seen),
        *at.home_pose(a.between(b, 0.3)),
        *at.home_pose(a.moved(at.twist(0.4, 0.1, 0.8), 0.7)),
        *at.home_pose(a.upright().flat()),
        *at.home_pose(a @ displacement_of(velocity_of(seen, 2.0), 2.0)),
        *(seen.x, seen.y, math.cos(seen.yaw), a.distance_to(b), a.bearing_to(b)),
        *at.home_twist(Twist2(0.3, 0.4, 0.5).rotated(a.yaw)),
    ]


def spatial_poses(at: Elsewhere) -> list[float]:
    a = at.pose(2.0, 3.0, 3.1).upright() @ Pose3.from_angles(0.1, 0.2, 0.9, (0.3, -0.4, 0.5))
    b = at.pose(5.0, 1.0, -3.0).upright() @ Pose3.from_angles(0.0, 0.1, 1.1, (-0.2, 0.6, 0.1))
    middle = Pose3(*between(a.as_motion(), b.as_motion(), 0.3))
    around = (a.inverse() @ b).as_motion()
    sign = math.copysign(1.0, around[6])  # q and -q are the same rotation
    found = [at.home_pose(pose.flat()) + list(pose.roll_pitch_yaw[:2]) for pose in (a, b, middle)]
    turns = [*around[:3], *(sign * q for q in around[3:]), a.angle_to(b), a.distance_to(b)]
    return [*(value for row in found for value in row), *turns]


def velocity(at: Elsewhere) -> list[float]:
    """Of somebody who turns through half a turn as they walk."""
    motion, found = Motion(0.3), []
    for k in range(60):
        t = k / 30.0
        body = at.pose(2.0 + 0.8 * t, 3.0 + 0.3 * t, 2.8 + 0.7 * t)
        motion.add_pose(at.ns(t), body.x, body.y, body.yaw)
        if motion.velocity is not None:
            found += at.home_twist(motion.velocity)
    return found


def reckoned(at: Elsewhere) -> list[float]:
    """By odometry, a tracker and an estimate, through half a turn."""
    reckoner, odom_from_home, found = Reckoner(Tracking.of(ROBOT.sensing)), Pose2(1.0, 2.0, 0.5), []
    name = next(iter(ROBOT.sensing.trackers))
    mount = ROBOT.sensing.trackers[name].mount
    for k in range(50):
        t = 0.02 * k
        body = Pose2(2.0 + 0.5 * t, 3.0, 2.8 + 0.7 * t)
        moving = Twist2(0.5, 0.0, 0.7).rotated(-body.yaw)
        odom = odom_from_home @ body
        wound = Pose2(odom.x, odom.y, odom.yaw + 2.0 * math.pi * at.windings)
        reckoner.move(at.ns(t), Odometry(wound, Twist2(moving.vx, moving.vy, 0.7)))
        if k % 3 == 0:
            tracker = at.pose(body.x, body.y, body.yaw).upright() @ mount.pose
            reckoner.track(at.ns(t), TrackerPose(name, tracker))
        if k % 5 == 0:
            there = at.pose(body.x + 0.01, body.y, body.yaw)
            reckoner.estimate(at.ns(t), there, PoseSigma(0.02, 0.01))
        located = reckoner.at(at.ns(t + 0.01))
        assert located is not None
        found += [*at.home_pose(located.pose), located.sigma]
    return found


def pose_histories(at: Elsewhere) -> list[float]:
    rows = [(at.ns(0.1 * k), at.pose(0.3 * k, 0.1 * k * k, 2.5 + 0.3 * k)) for k in range(6)]
    found = []
    for way in (wrapped, along_arc):
        history = PoseHistory(way, 1_000_000_000, rows)
        for t in (0.03, 0.1, 0.27, 0.499):
            pose = history.at(at.ns(t))
            assert pose is not None
            found += at.home_pose(pose)
        found += at.home_pose(history.extended(at.ns(0.55)))
    return found


def ramps(at: Elsewhere) -> list[float]:
    found = []
    for mode in ("omni", "differential"):
        limits, place, twist = Ramps(ROBOT.base, LIMITS), at.pose(1.0, 2.0, 2.9), STILL
        for k in range(60):
            command = limits.limited(Twist2(1.2 - 0.04 * k, 0.3, 0.8), mode)
            now = twist.rotated(place.yaw)
            motion = limits.toward(place.yaw, (now.vx, now.vy, now.wz), command, 0.01, mode, False)
            twist = twist_after(place.yaw, motion, mode)
            place = Pose2(place.x + motion[0], place.y + motion[1], place.yaw + motion[2])
            found += [*at.home_pose(place), twist.vx, twist.vy, twist.wz]
    return found


def safety_rule(at: Elsewhere) -> list[float]:
    """The robot drives at somebody who comes from the side."""
    rule = SafetyRule(SafetyLimits.of(ROBOT, LIMITS))
    command, found = Twist2(1.0, 0.2, 0.3), []
    for k in range(60):
        t = 0.01 * k
        if k % 3 == 0:
            x, y = at.point(4.2, 3.6 - 0.8 * t)
            rule.track_user(at.ns(t), at.ns(t), x, y)
        place = at.pose(2.0 + t, 3.0, 0.4 * t)
        admitted = rule.admit(at.ns(t), command, at.ns(t), place, command)
        found += [admitted.vx, admitted.vy, admitted.wz]
    return found


def rooms(at: Elsewhere) -> list[float]:
    room, found = at.room(ROOM), []
    for x, y in ((1.0, 1.0), (6.5, 2.0), (4.2, 5.6), (8.0, 3.0), (-1.0, 2.0)):
        place = at.point(x, y)
        found += [room.is_free(*place), room.clearance(*place), room.sees(*place, *at.point(9, 9))]
        found += [room.way_clearance(*place, *at.point(3.0, 3.0))]
        found += at.home_point(*foot(*place, room.segments[0]))
    disc = room.largest_free_disc
    return [*found, round(disc.radius, 2), room.free_space.area]


def rays(at: Elsewhere) -> list[float]:
    """A sweep from a base that turns and drives, against walls and somebody who walks."""
    track = Track(at.pose(3.0, 2.0, 2.9))
    for k in range(12):
        track.note(k * 10_000_000, at.pose(3.0 + 0.01 * k, 2.0, 2.9 + 0.03 * k))
    mount, start, step = np.array([0.28, -0.2, -0.7]), -2.2, math.radians(1.5)
    sweep = beams(knots(track.past, 20_000_000, 80_000_000), mount, start, step, 3.4e-4, 180)
    segments = np.array(at.room(ROOM).segments)
    ranges = cast(sweep, segments, start, step)
    cast_discs(ranges, sweep, np.array([[*at.point(5.0, 3.0), *at.point(5.1, 3.0), 0.5]]))
    held = track.held(35_000_000)
    return [*ranges.tolist(), *at.home_pose(Pose2(*held))]


def outlines(at: Elsewhere) -> list[float]:
    place, outline = at.pose(2.0, 3.0, 3.0), Outline(0.6, 0.5, 0.4, 0.45)
    seen = [place.inverse().transform(*at.point(x, y)) for x, y in ((4.0, 3.1), (2.1, 3.0))]
    return [outline.distance(*point) for point in seen]
