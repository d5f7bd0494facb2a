"""The spaces of the behaviours, by their own functions: Chase cells, Escape and Haptic poses."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import compress

import numpy as np

from behaviors import haptic
from behaviors.chase import free_cells
from behaviors.escape import escape_candidates, escape_poses, paper_escape
from behaviors.profile import Settings
from behaviors.situation import ChaseRing, Situation, timed_cells, weighted_cells
from cobodeck.shapes.shape import Layer, MapShape, arc, arrow, flat
from hw import Joints, Pose2, Pose3
from hw.model import Footprint
from hw.scene import Point, contains
from states.maps import Array
from states.navigation import GlobalPlanner

ESCAPE_ARROW_M, RING_M = 0.42, 0.3
DROPPED = "dropped", "… not free"
"""Style of poses where the robot cannot be, and what legends say of them."""


def chase_shapes(now: Situation, side: float | None = None) -> list[MapShape]:
    """The free Chase cells with their weights (R93-R100); arrows show the robot's yaw there.

    `side` is that of the cells, m; None: the profile's.
    """
    chase, body = now.settings.chase, now.user.body
    side = side or chase.cell
    free = free_cells(now, _weighted(now, replace(ChaseRing.of(chase), cell=side)))
    if not len(free):
        return []
    cells = MapShape(
        "chase", "cells", "chase", tuple(free[:, :2].ravel().tolist()),
        "Chase cell: weight low to high", weights=tuple(free[:, 2].tolist()), yaw=body.yaw,
        cell=side,
    )  # fmt: skip
    return [cells, *_tangents(body, free, 0.5 * (chase.inner + chase.outer), side)]


def _weighted(now: Situation, ring: ChaseRing) -> Array:
    """The cells of the policy's space, (n, 3): x, y, and weight from 0 to 1, for the best one."""
    chase = now.settings.chase
    if now.settings.policy == "paper":
        cells = weighted_cells(ring, chase.best_angle, chase.best_radius)
        worth = cells[:, 2]
    else:
        cells = timed_cells(now.environment, now.settings, ring)
        worth = 1.0 / cells[:, 2]
    span = float(np.ptp(worth)) if len(worth) else 0.0
    weights = (worth - worth.min()) / span if span > 0.0 else np.ones(len(worth))
    return np.column_stack((cells[:, :2], weights))


def _tangents(centre: Pose2, free: Array, radius: float, cell: float) -> list[MapShape]:
    """Arrows along the middle circle of the space, where it is free (R99)."""
    bearings = [math.radians(degrees) for degrees in range(-180, 180, 15)]
    poses = [
        centre @ Pose2(radius * math.cos(b), radius * math.sin(b), b + 0.5 * math.pi)
        for b in bearings
    ]
    x, y = np.ascontiguousarray(free[:, :2].T)
    near = (((x - pose.x) ** 2 + (y - pose.y) ** 2).min() <= cell**2 for pose in poses)
    return [arrow("chase", "chase", pose, 0.3) for pose in compress(poses, near)]


def escape_shapes(now: Situation, joints: Joints | None) -> list[MapShape]:
    """The Escape poses in the room as arrows along the robot's yaw, numbered in order (R106-R110).

    A ring marks the one that a robot with its arm at `joints`, rad, would drive to now by the
    states of its policy.
    """
    escape, outer = now.settings.escape, now.environment.room.outer
    free = escape_poses.poses(now.settings, now.planners["escape"], now.user, now.pose)
    best = _driven_to(now, free, joints)
    is_free, found = set(free), []
    for number, pose in enumerate(escape_poses.all_poses(escape, now.user, now.pose), 1):
        if not contains(outer, pose.x, pose.y):
            continue
        text = "" if pose == best else str(number)  # the ring has it
        style, about = ("escape", "Escape pose, in order") if pose in is_free else DROPPED
        found.append(arrow("escape", style, pose, ESCAPE_ARROW_M, about=about, text=text))
        if pose not in is_free:
            found += _cross("escape", pose, 0.1)
        if pose == best:
            at, about = (pose.x, pose.y), "… driven to if raised now"
            found.append(MapShape("escape", "disc", "escape", at, about, str(number), RING_M))
    return found


def _driven_to(now: Situation, free: tuple[Pose2, ...], joints: Joints | None) -> Pose2 | None:
    if now.settings.policy == "paper":
        return paper_escape.first_in_reach(now, free)
    return escape_candidates.candidates(now, free, now.environment.outline(joints)).goal


def haptic_shapes(
    settings: Settings, planner: GlobalPlanner, deep: Pose3, robot: Pose2 | None, shape: Footprint
) -> list[MapShape]:
    """The rover poses on their half circle, numbered in order (R75-R77).

    Numbers that would be written over a robot with this outline are left out.
    """
    values, free = settings.haptic, set(haptic.poses(settings, planner, deep))
    half = max((abs(angle) for angle in values.angles), default=0.0)
    circle = arc(Pose2(deep.x, deep.y, deep.yaw), values.radius, -half, half)
    found = [MapShape("haptic", "line", "haptic", flat(circle))]
    for number, pose in enumerate(haptic.all_poses(values, deep), 1):
        style, about = ("haptic", "Haptic pose, in order") if pose in free else DROPPED
        ahead, at = pose @ Pose2(0.17, 0.0), (pose.x, pose.y)
        found.append(arrow("haptic", style, ahead, 0.34, about=about))
        found.append(MapShape("haptic", "disc", style, at, radius=0.09, fill=True))
        behind = pose.transform(-0.23, 0.0)
        if robot is None or not _covers(robot, shape, behind):
            found.append(MapShape("haptic", "text", style, behind, text=str(number)))
        if pose not in free:
            found += _cross("haptic", pose, 0.15)
    return found


def _covers(robot: Pose2, shape: Footprint, place: Point) -> bool:
    """True if a number at this place would be written over the robot."""
    x, y = robot.inverse().transform(*place)
    return abs(x) < shape.half_length + 0.1 and abs(y) < shape.half_width + 0.1


def _cross(layer: Layer, pose: Pose2, size: float) -> list[MapShape]:
    x, y = pose.x, pose.y
    strokes = ((x - size, y + sign * size, x + size, y - sign * size) for sign in (-1, 1))
    return [MapShape(layer, "line", DROPPED[0], stroke) for stroke in strokes]
