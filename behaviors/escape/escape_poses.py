"""The Escape poses: where the robot may flee to (paper 4.4.3, R105-R108)."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

from behaviors.profile import EscapeSettings, Settings
from hw import Pose2, UserPose

if TYPE_CHECKING:
    from states.navigation import GlobalPlanner


def all_poses(escape: EscapeSettings, user: UserPose, base: Pose2) -> Iterator[Pose2]:
    """All Escape poses in order: away from the user, yaw kept (R106, R107, R110)."""
    away = math.atan2(base.y - user.body.y, base.x - user.body.x)
    for distance in escape.distances:
        for angle in escape.angles:
            x = base.x + distance * math.cos(away + angle)
            y = base.y + distance * math.sin(away + angle)
            yield Pose2(x, y, base.yaw)


def poses(
    settings: Settings, planner: GlobalPlanner, user: UserPose, base: Pose2
) -> tuple[Pose2, ...]:
    """The Escape poses that are free by Escape's own planner, in order (R105, R108)."""
    return tuple(free_poses(settings, planner, user, base))


def free_poses(
    settings: Settings, planner: GlobalPlanner, user: UserPose, base: Pose2
) -> Iterator[Pose2]:
    """As `poses`, but nothing is computed before the first of them is asked for."""
    import numpy as np

    found = tuple(all_poses(settings.escape, user, base))
    free = planner.are_free(np.array([(pose.x, pose.y) for pose in found])).tolist()
    yield from (pose for pose, is_free in zip(found, free, strict=True) if is_free)
