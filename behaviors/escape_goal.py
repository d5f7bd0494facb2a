"""Choosing the Escape pose to drive to beside a walking user, by simulated drives."""

from __future__ import annotations

import math
from collections.abc import Sequence

from behaviors.person import RolloutEvaluation, evaluate, predict_user, roll_out
from behaviors.situation import Situation
from hw import Outline, Pose2

KEEP_S, KEEP_M = 0.2, 0.05
"""Hysteresis: another Escape pose has to be safe earlier than the current one by this, s, or, if
every drive ends in a contact, leave a larger gap by this, m."""


def safest_goal(
    now: Situation,
    goals: Sequence[Pose2],
    present: Pose2 | None,
    outline: Outline | None = None,
) -> tuple[Pose2 | None, float]:
    """The Escape pose with which the user is safe soonest, without a touch on the way.

    If every drive ends in a touch, the one with the largest gap; None if all come too near to
    walls. Also returned: the time until a touch on the drive that delays it most, s; infinite if
    there is one without a touch. `present` is the current goal, one of `goals`; `outline` that of
    rover and arm, None for the rover alone.
    """
    if not goals:
        return None, math.inf
    environment, settings = now.environment, now.settings
    places = [(goal.x, goal.y) for goal in goals]
    rollouts = roll_out(now, places, environment.navigation.escape.max_speed)
    found = evaluate(now, rollouts, predict_user(now, settings.user.likely), outline)
    ranked = sorted(range(len(goals)), key=lambda i: _rank(found, i, goals[i] is present))
    planner = now.planners["escape"]
    best = next((i for i in ranked if rollouts.keeps_off(i, planner)), None)
    if best is None:
        return None, math.inf
    return goals[best], float(found.touch_after[best])


def _rank(found: RolloutEvaluation, i: int, is_present: bool) -> tuple[float, float, float]:
    """The smaller, the better; drives without a touch, then near ones, then those with contact.

    With a contact in any case the sign is shown, and what counts is how much is left until an
    attentive user has stopped.
    """
    gap = float(found.gap[i])
    if found.touch_after[i] == math.inf:
        return 0.0, float(found.safe_after[i]) - KEEP_S * is_present, -gap
    if gap > 0.0:
        return 1.0, -gap, float(found.safe_after[i])
    return 2.0, -float(found.gap_soon[i]) - KEEP_M * is_present, -gap
