"""Requests that were not served, one by one, and how far off a wall a DEEP would have to be."""

from __future__ import annotations

import dataclasses
import math
from collections import Counter
from collections.abc import Iterable
from typing import Any, NamedTuple

from behaviors import all_poses, round_poses
from behaviors.profile import Settings
from cobodeck.evaluate.refusals import WALLED, Unserved, refused
from cobodeck.setup import Setup
from engine.run import ChartRun
from hw import Pose2, Pose3
from hw.scene import foot
from states.environment import Environment

FARTHEST_M = 2.5
STEP_M = 0.01
"""How far off a wall a reachable DEEP is looked for, m, and in which steps."""


class WallBeside(NamedTuple):
    """The point of a wall next to a DEEP, its distance, and the distance that the robot needs; m.

    `needed`: with the same direction of the DEEP; None: more than `FARTHEST_M`, or other walls
    leave no room either.
    """

    x: float
    y: float
    gap: float
    needed: float | None


def refusal_figures(setup: Setup, run: ChartRun, unserved: Iterable[Unserved]) -> dict[str, Any]:
    """The figures of requests that were not served, by their names in JSON."""
    settings, each = setup.profile.settings, []
    for request, why in refused(run, unserved):
        deep, wall = request.deep, None
        if why in WALLED and setup.place is not None:
            wall = wall_beside(setup.environment, settings, deep, request.user)._asdict()
        place = {"x": deep.x, "y": deep.y, "z": deep.z}
        each.append({"at_s": request.begin / 1e9, "why": why, **place, "wall": wall})
    counts = Counter(str(one["why"]) for one in each)
    return {"refusals": dict(counts), "refused_requests": each}


def wall_beside(
    around: Environment, settings: Settings, deep: Pose3, user: Pose2 | None
) -> WallBeside:
    """The wall next to a DEEP of the map, measured on the floor.

    A user who is not known is taken to stand where the profile expects them.
    """
    feet = (foot(deep.x, deep.y, wall) for wall in around.room.segments)
    x, y = min(feet, key=lambda at: math.dist(at, (deep.x, deep.y)))
    gap = math.dist((x, y), (deep.x, deep.y))
    inside = around.room.is_free(deep.x, deep.y)
    asking = (
        Pose2(-settings.haptic.deep_ahead, 0.0) if user is None else deep.flat().inverse() @ user
    )
    away = math.copysign(1.0 / gap, 0.5 - (not inside)) if gap else 0.0
    off = (deep.x - x) * away, (deep.y - y) * away
    for step in range(math.ceil(FARTHEST_M / STEP_M)):
        far = (gap if inside else 0.0) + STEP_M * step
        there = dataclasses.replace(deep, x=x + far * off[0], y=y + far * off[1])
        if _is_reached(around, settings, there, there.flat() @ asking):
            return WallBeside(x, y, gap, far)
    return WallBeside(x, y, gap, None)


def _is_reached(around: Environment, settings: Settings, deep: Pose3, user: Pose2) -> bool:
    """True if the prop reaches the DEEP from a free rover pose of the last choice of Haptic."""
    kept, room, arm = around.navigation.escape, around.room, around.workspace
    haptic, first = settings.haptic, settings.policy == "paper"  # which has no second choice
    tried = all_poses(haptic, deep) if first else round_poses(haptic.close, deep)
    poses = [
        pose
        for pose in tried
        if pose.distance_to(user) >= kept.user_radius
        and room.clearance(pose.x, pose.y) >= kept.inflation
    ]
    if not poses or not arm.reached(poses, deep, walled=True).any():
        return False
    exact = (0.0, 0.0)  # the pose of the rover, not one within a drive's tolerance
    return arm.best(poses, [0.0] * len(poses), deep, user, exact) is not None
