"""The drive of Escape: as fast as possible, straight to one pose after the other (R109-R111)."""

from __future__ import annotations

from collections.abc import Callable, Generator, Mapping

from behaviors.situation import ESCAPE_POSES, WAYS, Situation, situation
from engine import Context, Outcome, Yielded
from hw import OLD_S, Pose2
from states.navigation import DRIVES, BaseDrive, is_there

Chooser = Callable[[Context, Situation, Pose2 | None], Pose2 | None]
"""The pose to drive to, from the one driven to so far; None: no pose can be reached."""
AWAY: Mapping[str, float | None] = {**WAYS, **DRIVES, ESCAPE_POSES: OLD_S}
"""`reads` of a state that drives to Escape poses."""


def drive_to_goals(ctx: Context, choose: Chooser) -> Generator[Yielded, None, Outcome]:
    """Drive, without turning, to the pose that `choose` gives at each tick.

    Ends `reached`, with the `pose` at which the robot stands, or `no_way` without one. While the
    pose of robot or user or the user's velocity is unknown the base brakes.
    """
    goal, planner = None, None
    with BaseDrive(ctx, "escape", "escape", patience=None, straight=True) as drive:
        while True:
            now = situation(ctx, "escape")
            if now is None:
                drive.rest()
                yield None
                continue
            if planner is not now.planners["escape"]:
                planner = now.planners["escape"]
                goal = _still_in_reach(now, goal)
            subsystem = now.environment.navigation.escape
            if goal is not None and is_there(now.pose, now.twist, goal, subsystem):
                return "reached", {"pose": goal}
            goal = choose(ctx, now, goal)
            if goal is None:
                return "no_way"
            drive.towards(goal, now=now.around)
            yield None


def _still_in_reach(now: Situation, goal: Pose2 | None) -> Pose2 | None:
    """The goal, unless a scanned obstacle now blocks the way to it."""
    here, planner = (now.pose.x, now.pose.y), now.planners["escape"]
    return goal if goal is not None and planner.allows(here, (goal.x, goal.y)) else None


def can_stop(now: Situation | None) -> bool:
    """True if the place where the robot would come to rest is free."""
    return now is not None and now.planners["escape"].is_free((now.rest.x, now.rest.y))
