"""Subjects of `behaviors` and of the judge of Escapes: a robot and somebody who walks by."""

from __future__ import annotations

import math
from functools import cache

import numpy as np

from behaviors import haptic
from behaviors.chase import beside, chase_states as chase, make_room, refuge
from behaviors.chase.waiting_place import chase_cell, chase_place, free_cells
from behaviors.escape import danger, escape_candidates, escape_poses, pursuit, zones
from behaviors.person.band import cornered, haste, off_the_band
from behaviors.person.drives import roll_out
from behaviors.person.lines import predict_user
from behaviors.person.margin import Clearing, is_met_braking, lacking, time_aside
from behaviors.person.touch import evaluate, pursued
from behaviors.person.waiting import risks, way_risks
from behaviors.profile.profile import Profile, load_profile
from behaviors.situation.chase_cells import timed_cells, weighted_cells
from behaviors.situation.chase_ring import ChaseRing
from behaviors.situation.present_situation import Situation
from cobodeck.avoidable.motion_search import Question, RobotLimits, RobotState, Walk, best_motion
from hw.geometry import Pose2, Pose3, Twist2
from hw.samples import UserPose
from hw.scene.room import Room
from tests.behaviors.straight import command_towards
from tests.stress.bodies import ROBOT
from tests.stress.elsewhere import Elsewhere

HALL = Room(
    ((0.0, 0.0), (14.0, 0.0), (14.0, 12.0), (0.0, 12.0)),
    columns=(((4.0, 8.6), (4.4, 8.6), (4.4, 9.2), (4.0, 9.2)),),
)


@cache
def profile(name: str) -> Profile:
    return load_profile(name)


def situation(at: Elsewhere, name: str = "tuned") -> Situation:
    """Somebody walks by the robot, from the left, and bends towards it."""
    told = profile(name)
    environment = told.environment(at.room(HALL), ROBOT)
    body = at.pose(4.1, 5.2, 0.1)
    velocity = at.twist(0.9, 0.12, 0.3)
    user = UserPose(body, at.yaw(0.25))
    robot, twist = at.pose(6.3, 5.6, 2.9), Twist2(0.2, 0.1, 0.1)
    planners = environment.static_planners
    return Situation(environment, told.settings, robot, twist, user, velocity, planners)


def rollouts(at: Elsewhere) -> list[float]:
    now = situation(at)
    places = at.points([(7.0, 4.0), (8.0, 6.0), (5.0, 7.0), (6.3, 3.0)])
    drives = roll_out(now, places, 1.5)
    predictions = predict_user(now, ("constant_velocity", "fading_turn", "comes", "turns_left"))
    found = evaluate(now, drives, predictions)
    walls, body = now.environment.walls, now.user.body
    costs = (
        off_the_band(drives.trajectories, predictions, 2.9, 4.0, 4.0, 1.0, 2.0),
        lacking(drives.trajectories, predictions, 0.4, Clearing(1.2, 0.4, 1.0, 3.0))[0],
        haste(drives.trajectories, (body.x, body.y), 2.9, 1.0),
        cornered(places, walls, 2.5),
        pursued(now, drives),
    )
    ends = [v for x, y in drives.trajectories[:, -1].tolist() for v in at.home_point(x, y)]
    views = [v for x, y, yaw in predictions[:, -1].tolist() for v in at.home_pose(Pose2(x, y, yaw))]
    kept = [drives.keeps_off(i, now.planners["escape"]) for i in range(4)]
    return [
        *ends, *views, *kept, *found.safe_after, *found.gap, *found.gap_soon, *found.touch_after,
        *np.concatenate(costs),
    ]  # fmt: skip


def chase_places(at: Elsewhere) -> list[float]:
    found = []
    for name in ("paper", "tuned"):
        now = situation(at, name)
        ring, rules = ChaseRing.of(now.settings.chase), now.settings.chase
        if name == "paper":
            free = free_cells(now, weighted_cells(ring, rules.best_angle, rules.best_radius))
            best = chase_cell(now, ring, rules.best_angle, rules.best_radius)
        else:
            free = free_cells(now, timed_cells(now.environment, now.settings, ring))
            best = chase_place(now, ring)
        assert best is not None
        yaw = chase.tangent_yaw(now.user.body, best, now.pose.yaw)
        found += [len(free), *at.home_pose(Pose2(*best, yaw))]
        for ahead in (0.0, 0.7):
            found.append(chase.distance_soon(now, ahead))
    return found


def escape_choices(at: Elsewhere) -> list[float]:
    found = []
    for name in ("paper", "tuned"):
        now = situation(at, name)
        told = (now.environment, now.settings, now.planners["escape"], now.user, now.pose)
        for velocity in (now.velocity, at.twist(1.4, -0.2), at.twist(-0.5, 0.1)):
            found.append(danger.is_required(*told, velocity, now.twist))
            found.append(danger.is_safe(*told, velocity, now.twist))
        free = escape_poses.poses(now.settings, now.planners["escape"], now.user, now.pose)
        found += [len(free), *(v for pose in free for v in at.home_pose(pose))]
        seen = escape_candidates.candidates(now, free)
        goal, touch = seen.better_than(None, 0.2, 0.05), seen.touch_after
        found += [touch, pursuit.is_caught(now, free), *(at.home_pose(goal) if goal else ())]
        found += [make_room.is_crowded(now, 3.0, 1.0, 0.2)]
    return found


def haptic_choices(at: Elsewhere) -> list[float]:
    now, found = situation(at), []
    deep = Pose3.from_yaw(*at.point(4.95, 5.3), 1.3, at.yaw(0.1))
    free = haptic.poses(now.settings, now.planners["haptic"], deep)
    times = haptic.reachable(now, "haptic", free)
    best = haptic.soonest_pose(now, times, deep)
    assert best is not None
    for pose in free:
        found += at.home_pose(pose)
    return [*found, *times.values(), *at.home_pose(best), haptic.is_blocked(now, deep)]


def drives_straight(at: Elsewhere) -> list[float]:
    now, found = situation(at), []
    for goal in ((8.0, 6.0), (6.3, 3.0), (13.4, 5.6)):
        command = command_towards(now, at.point(*goal), "escape")
        found += [command.vx, command.vy, command.wz]
    return found


def lines_of_walk(at: Elsewhere) -> list[float]:
    now = situation(at)
    body, robot = now.user.body, now.pose
    apart = (robot.x - body.x, robot.y - body.y)
    motion = now.twist.rotated(robot.yaw)
    walks, drives = (now.velocity.vx, now.velocity.vy), (motion.vx, motion.vy)
    return [
        is_met_braking(apart, walks, drives, 0.9, 0.3, 1.0), time_aside(0.3, 0.1, 1.2, 1.0),
        zones.in_zone(now.settings.escape, now.user, robot, 0.1), now.rest.distance_to(body),
    ]  # fmt: skip


def waiting_risks(at: Elsewhere) -> list[float]:
    """Directions of walk are the map's: every ten degrees."""
    now = situation(at)
    places = at.points([(6.0, 3.4), (7.1, 6.3), (3.1, 3.3), (5.0, 8.1)])
    times = np.array([0.5, 1.0, 1.5, 2.0])
    return [*risks(now, places), *way_risks(now, places, 1.2, times)]


def refuges(at: Elsewhere) -> list[float]:
    """Places round the person and the robot are the map's: every 22.5 and every 15 degrees."""
    now, found = situation(at), []
    out, place = refuge.way_out(now), beside.place_with_room(now, (2.9, 4.0), None)[0]
    for point in (out, refuge.refuge(now), place):
        found += [math.nan, math.nan] if point is None else at.home_point(*point)
    return found


def avoidable(at: Elsewhere) -> list[float]:
    limits = RobotLimits(1.0, 3.0, 2.5, 0.565, 0.455)
    robot = RobotState(*at.point(6.0, 5.0), at.yaw(2.9), *at.vector(0.3, 0.1), 0.0)
    ends = [(*at.point(3.0, 5.2), at.yaw(0.1)), (*at.point(9.0, 5.2), at.yaw(0.1))]
    walk = Walk(np.array([0.0, 5.0]), np.array(ends))
    edges = np.array(at.room(HALL).segments)
    best = best_motion(Question(robot, limits, walk, horizon_s=1.5, walls=edges))
    assert best is not None
    return [best.gap]
