"""Discs around the user, and places beside them, for drives of the base."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

from hw import Pose2, Twist2, UserPose
from hw.scene import Disc, Point
from states.subsystems import Subsystem

if TYPE_CHECKING:
    from states.navigation.planner_interfaces import GlobalPlanner

SLOW = 0.1
"""Speed below which the robot counts as standing, m/s."""


def is_there(pose: Pose2, twist: Twist2, goal: Pose2, subsystem: Subsystem) -> bool:
    """True within the tolerance of the goal's position, and standing."""
    return pose.distance_to(goal) <= subsystem.tolerance and twist.speed < SLOW


def user_disc(user: UserPose | None, subsystem: Subsystem) -> Disc | None:
    """The disc around the user that the robot's centre keeps out of."""
    if user is None:
        return None
    return Disc(user.body.x, user.body.y, subsystem.user_radius)


def wide_disc(user: UserPose, own: Subsystem, least: Subsystem, goal: Pose2) -> Disc:
    """The disc of a drive that may come nearer to the user than its own subsystem does.

    As wide as that of its `own`, but not over the goal, and never smaller than that of the `least`:
    past a user the safety chain admits a drive no nearer than its goal.
    """
    away = user.body.distance_to(goal)
    radius = max(least.user_radius, min(own.user_radius, away))
    return Disc(user.body.x, user.body.y, radius)


def comes_in(pose: Pose2, user: UserPose, goal: Pose2) -> bool:
    """True if the straight line from here to the goal comes no nearer to the user than the goal."""
    body = user.body
    outwards = (goal.x - body.x, goal.y - body.y)
    return (pose.x - goal.x) * outwards[0] + (pose.y - goal.y) * outwards[1] >= 0.0


def way_in(user: UserPose, goal: Pose2, radius: float) -> Pose2:
    """The place outside of a disc around the user from which a goal within it lies straight ahead.

    It has the goal's yaw; a goal outside of the disc is this place itself.
    """
    body, away = user.body, user.body.distance_to(goal)
    if away >= radius or away == 0.0:
        return goal
    stretch = radius / away
    x, y = body.x + stretch * (goal.x - body.x), body.y + stretch * (goal.y - body.y)
    return Pose2(x, y, goal.yaw)


def place_near(planner: GlobalPlanner, here: Point, user: Point, near: float) -> Point | None:
    """The first place within `near`, m, of a user on the path to them; None without a path."""
    end = user if planner.is_free(user) else planner.nearest_free(user)
    path = None if end is None else planner.plan(here, end)
    return None if path is None else place_at(path.points, user, near)


def place_at(path: Sequence[Point], user: Point, near: float) -> Point:
    """The first point of a path within `near`, m, of the user; without one, the path's end.

    With d the segment and f from the user to its start, |f + share d| = near is a quadratic in
    `share`; the smaller root is where the path enters the circle.
    """
    for start, end in itertools.pairwise(path):
        if math.dist(end, user) > near:
            continue
        dx, dy = end[0] - start[0], end[1] - start[1]
        fx, fy = start[0] - user[0], start[1] - user[1]
        square, along = dx * dx + dy * dy, fx * dx + fy * dy
        outside = fx * fx + fy * fy - near * near
        root = math.sqrt(max(0.0, along * along - square * outside))
        share = min(1.0, max(0.0, (-along - root) / square)) if square > 0.0 else 0.0
        return start[0] + share * dx, start[1] + share * dy
    return path[-1]
