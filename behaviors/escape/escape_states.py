"""Escape: what its charts watch and do, by predicted contacts (paper 4.4.3)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from behaviors.escape.escape_drive import AWAY, can_stop, drive_to_goals
from behaviors.escape.escape_poses import free_poses
from behaviors.situation import (
    ESCAPE_POSES,
    ESCAPE_REQUIRED,
    ESCAPE_SAFE,
    WAYS,
    Situation,
    situation,
)
from engine import NEVER_NS, Action, Context, Key, Monitor, On, Run, Until
from engine.files import Duration, Length
from hw import OLD_S, Pose2
from states.environment import ARM_JOINTS

if TYPE_CHECKING:
    from behaviors.escape.escape_candidates import EscapeCandidates

ESCAPE_CANDIDATES: Key[EscapeCandidates] = Key("escape.candidates")
"""The free Escape poses, with what is predicted for the drive to each of them."""


class EscapeRequired(Monitor):
    """`required` when the user could walk into the robot, which then has to escape (R62, R104).

    Outcomes:
        required: the robot has to escape.
    """

    outcomes = ("required",)
    reads = {ESCAPE_REQUIRED: OLD_S}
    policy = "tuned"

    def run(self, ctx: Context) -> Run:
        news = On(ESCAPE_REQUIRED)
        while not ctx.value(ESCAPE_REQUIRED):
            yield news
        return "required"


class OutOfDanger(Monitor):
    """`safe` once no contact is predicted any more, and the robot can stop where it is (R112).

    With `must_reach`, as after a failure of Chase, not before an Escape pose has been `reached`.

    Args:
        must_reach: whether an Escape pose has to have been reached first.
        reached: the Escape pose that has been reached.

    Outcomes:
        safe: no contact is predicted any more, and the robot can stop where it is.
    """

    outcomes = ("safe",)
    reads = {**WAYS, ESCAPE_SAFE: OLD_S}
    policy = "tuned"

    def __init__(self, must_reach: bool = False) -> None:
        self.must_reach = must_reach

    def run(self, ctx: Context, reached: Pose2 | None = None) -> Run:
        if self.must_reach and reached is None:
            yield Until(NEVER_NS)
        while not (ctx.value(ESCAPE_SAFE) and can_stop(situation(ctx, "escape"))):
            yield None
        return "safe"


class NoEscapePose(Monitor):
    """`none` if no Escape pose is free when this begins (R113).

    It does not end a drive that has begun: that has a pose, and ends by itself if the way closes.

    Outcomes:
        none: no Escape pose is free.
    """

    outcomes = ("none",)
    reads = {**WAYS, ESCAPE_POSES: OLD_S}

    def run(self, ctx: Context) -> Run:
        while situation(ctx, "escape") is None:
            yield None
        if ctx.value(ESCAPE_POSES):
            yield Until(NEVER_NS)
        return "none"


class TouchAhead(Monitor):
    """`predicted` once the best drive, and so each, ends in a touch `within` so long (R114).

    Also when a user who keeps walking at the robot, wherever it drives, would touch it before they
    could stop. Late poses and commands count as time that has passed.

    Args:
        within: how soon the touch has to be.

    Outcomes:
        predicted: the best drive ends in a touch so soon.
    """

    outcomes = ("predicted",)
    reads = {**WAYS, ESCAPE_POSES: OLD_S, ESCAPE_CANDIDATES: OLD_S, ARM_JOINTS: OLD_S}
    policy = "tuned"

    def __init__(self, within: Duration) -> None:
        self.within = within

    def run(self, ctx: Context) -> Run:
        while (now := situation(ctx, "escape")) is None or not self._is_due(ctx, now):
            yield None
        return "predicted"

    def _is_due(self, ctx: Context, now: Situation) -> bool:
        from behaviors.escape.pursuit import is_caught

        found = escape_candidates(ctx, now)
        if found.touch_after < self.within + now.environment.delay:
            return True
        return is_caught(found.now, found.poses, found.outline)


class DriveToBest(Action):
    """Drive to the Escape pose with which the user is safe soonest, without a touch on the way.

    If every drive ends in a touch, the one with the largest gap. On the way another pose is taken
    once it is better: safe earlier by `earlier_by`, or, where every drive ends in a contact, with a
    gap wider by `wider_by`. It goes as fast as possible, without turning, the arm as it is
    (R109-R111). While the pose of robot or user or the user's velocity is unknown it brakes.

    Args:
        earlier_by: by how much sooner the user has to be safe with another pose.
        wider_by: by how much wider the gap has to be, where every drive ends in a contact.

    Outcomes:
        reached: the robot stands at the pose.
        no_way: each drive comes too near to walls.

    Outputs:
        pose: the Escape pose, map_from_base.
    """

    outcomes = ("reached", "no_way")
    outputs = {"reached": {"pose": Pose2}}
    reads = {**AWAY, ESCAPE_CANDIDATES: OLD_S, ARM_JOINTS: OLD_S}
    commands = ("base",)
    sideways = True
    policy = "tuned"

    def __init__(self, earlier_by: Duration, wider_by: Length) -> None:
        self.earlier_by, self.wider_by = earlier_by, wider_by

    def run(self, ctx: Context) -> Run:
        return (yield from drive_to_goals(ctx, self._goal))

    def _goal(self, ctx: Context, now: Situation, present: Pose2 | None) -> Pose2 | None:
        found = escape_candidates(ctx, now)
        return found.better_than(present, self.earlier_by, self.wider_by)


def escape_candidates(ctx: Context, now: Situation) -> EscapeCandidates:
    """The Escape poses with what is predicted for each, in this situation.

    The signal knows poses as they were measured. Where they are late, they are predicted anew from
    the situation, which is extrapolated; so they are without the arm's joints, for the rover alone.
    """
    from behaviors.escape.escape_candidates import candidates

    seen = ctx.value(ESCAPE_CANDIDATES) if now.share >= 1.0 else None
    if seen is not None:
        return seen
    arm = ctx.value(ARM_JOINTS)
    outline = now.environment.outline(None if arm is None else arm.joints)
    return candidates(now, ctx.value(ESCAPE_POSES) or (), outline)


def can_get_away(now: Situation) -> bool:
    """True if there is an Escape pose to which the robot could drive."""
    from behaviors.escape.escape_candidates import candidates

    free = free_poses(now.settings, now.planners["escape"], now.user, now.pose)
    return candidates(now, tuple(free)).goal is not None
