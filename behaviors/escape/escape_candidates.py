"""What is predicted for each free Escape pose beside a walking user, by simulated drives."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from behaviors.choice import cheapest
from behaviors.person import (
    Array,
    RolloutEvaluation,
    Rollouts,
    evaluate,
    predict_user,
    roll_out,
)
from behaviors.profile import Settings
from behaviors.situation import Situation
from hw import Outline, Pose2, UserPose
from states.environment import Environment

if TYPE_CHECKING:
    from states.navigation import GlobalPlanner

Rank = tuple[float, float, float]
"""The smaller, the better."""


@dataclass(frozen=True, slots=True, eq=False)
class EscapeCandidates:
    """The free Escape poses, with what is predicted for the drive to each of them.

    `ranks` tells drives without a touch, by the time until the user is safe; then those that come
    near, by the gap; then those with a contact. `best` is the index of the pose of the least rank
    whose drive keeps off walls, None without one. `outline` is that of rover and arm, None for the
    rover alone, and `walks` are the user's predicted trajectories, from the situation `now`.
    """

    now: Situation
    poses: tuple[Pose2, ...]
    outline: Outline | None
    walks: Array
    ranks: tuple[Rank, ...]
    best: int | None
    touch_after: float
    """Time until a touch on the best drive, s, or, without one, while braking; infinite: none."""

    @property
    def goal(self) -> Pose2 | None:
        """The best pose, for a robot that does not yet drive to another; None without one."""
        return None if self.best is None else self.poses[self.best]

    def better_than(
        self, present: Pose2 | None, earlier_by: float, wider_by: float
    ) -> Pose2 | None:
        """The pose to drive to from here: the present one, unless another is better.

        That one has to be safe earlier by so much, s, or, where all end in a contact, to leave a
        gap wider by so much, m. None if every drive, also that to the present one, comes too near
        to walls.
        """
        best = self.goal
        if present is None:
            return best
        drives = _drives(self.now, (present,))
        found = evaluate(self.now, drives, self.walks, self.outline)
        [(kind, first, second)] = _ranks(found)
        rank = kind, first - (earlier_by, 0.0, wider_by)[int(kind)], second
        if self.best is not None and self.ranks[self.best] < rank:
            return best
        return present if drives.keeps_off(0, self.now.planners["escape"]) else best


def candidates(
    now: Situation, poses: Sequence[Pose2], outline: Outline | None = None
) -> EscapeCandidates:
    """Predict the drive to each of these poses, in the map."""
    walks, planner = predict_user(now, now.settings.user.likely), now.planners["escape"]
    ranks: tuple[Rank, ...] = ()
    best = None
    if poses:
        drives = _drives(now, poses)
        found = evaluate(now, drives, walks, outline)
        ranks = _ranks(found)
        best = cheapest(ranks, lambda i: ranks[i] if drives.keeps_off(i, planner) else None)
    if best is None:
        found = evaluate(now, _drives(now, (now.rest,)), walks, outline)
    touch_after = float(found.touch_after[0 if best is None else best])
    return EscapeCandidates(now, tuple(poses), outline, walks, ranks, best, touch_after)


def seen_candidates(
    environment: Environment,
    settings: Settings,
    poses: tuple[Pose2, ...],
    planner: GlobalPlanner,
    user: UserPose,
    base: Pose2,
    *others: Any,
) -> EscapeCandidates:
    """The candidates by signals: `poses` are free by Escape's `planner`.

    The `others` are the user's velocity, the robot's, in its own frame, and the state of its arm.
    """
    velocity, twist, *arm = others
    now = Situation(environment, settings, base, twist, user, velocity, {"escape": planner})
    return candidates(now, poses, environment.outline(arm[0].joints if arm else None))


def _drives(now: Situation, poses: Sequence[Pose2]) -> Rollouts:
    places = [(pose.x, pose.y) for pose in poses]
    return roll_out(now, places, now.environment.navigation.escape.max_speed)


def _ranks(found: RolloutEvaluation) -> tuple[Rank, ...]:
    """Of each drive: 0 without a touch, 1 if it comes near, 2 with a contact; then, how good.

    With a contact in any case the sign is shown, and what counts is how much is left until an
    attentive user has stopped.
    """
    told = zip(
        found.touch_after.tolist(),
        found.safe_after.tolist(),
        found.gap.tolist(),
        found.gap_soon.tolist(),
        strict=True,
    )
    return tuple(
        (0.0, safe_after, -gap)
        if touch_after == math.inf
        else (1.0, -gap, safe_after)
        if gap > 0.0
        else (2.0, -gap_soon, -gap)
        for touch_after, safe_after, gap, gap_soon in told
    )
