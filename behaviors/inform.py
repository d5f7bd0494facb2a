"""Inform: show the robot to the user until both can continue (paper 4.4.4)."""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated, Any

from behaviors.chase import is_outside, way_out
from behaviors.escape import can_get_away
from behaviors.profile import InformSettings
from behaviors.situation import CHANGES, WAYS, Situation, settings_of, situation
from engine import NEVER_NS, Action, Context, Monitor, On, Run, Until
from engine.files import Duration
from engine.files.declared import FROM_0
from hw import UserPose
from states.environment import RESTART, STOP_ENGAGED, USER_POSE, planner_key


class WarnUser(Action):
    """Show the robot and the stop sign to the user while this state runs (R18, R114).

    The sign stays for `least`, even if the state ends before, so that a person can take it in.

    Args:
        least: how long the sign stays at least.
    """

    outcomes = ()
    commands = ("vr",)

    def __init__(self, least: Annotated[Duration, FROM_0] = 0.0) -> None:
        self.least = least

    def run(self, ctx: Context) -> Run:
        vr = ctx.part("vr")
        vr.inform(True, least=self.least)
        try:
            while True:
                yield Until(NEVER_NS)
        finally:
            vr.inform(False)


class UserReady(Monitor):
    """`restarted` when the user has stopped, gives the restart signal, and the robot can go on.

    Walking on revokes the signal (R65, R115). Not before `least`, and not while a fault is left or
    the user is not tracked. With `until_clear`, not before the user has left both Escape zones or
    there is a way out of them, nor, if the robot could not drive off when this began, before
    `cornered`: a user who returns at once would find it there.

    If the user was lost when this began and is tracked again within `moment`, with a velocity (its
    window spans the gap), it ends at once, unless for a fault.

    Args:
        least: how long the robot stays shown at least; by default the profile's.
        until_clear: whether the robot has to be outside of both zones, or have a way out; by
            default the profile's.
        cornered: how long it stays shown at least if it could not drive off; by default the
            profile's.
        moment: a user who was lost when this began need not give the signal if they are tracked
            again within this; by default the profile's.

    Outcomes:
        restarted: the robot can go on.

    Outputs:
        user: the pose of the user then.
    """

    outcomes = ("restarted",)
    outputs = {"restarted": {"user": UserPose}}
    reads = {**WAYS, RESTART: None, STOP_ENGAGED: None}

    def __init__(
        self,
        least: Annotated[Duration, FROM_0] | None = None,
        until_clear: bool | None = None,
        cornered: Annotated[Duration, FROM_0] | None = None,
        moment: Annotated[Duration, FROM_0] | None = None,
    ) -> None:
        given = {
            "least": least, "until_clear": until_clear, "cornered": cornered, "moment": moment
        }  # fmt: skip
        self.given: dict[str, Any] = {key: v for key, v in given.items() if v is not None}

    def run(self, ctx: Context) -> Run:
        inform = replace(settings_of(ctx).inform, **self.given)
        earliest, willing = ctx.after(_shortest(ctx, inform)), False
        bridged = ctx.after(inform.moment) if ctx.value(USER_POSE) is None else -1
        while True:
            willing = bool(ctx.events(RESTART)) or willing
            now = situation(ctx, "escape")
            if now is not None and now.velocity.speed >= now.settings.escape.moving:
                willing = False
            if now is not None and ctx.value(STOP_ENGAGED) is None:
                ready = willing and ctx.now >= earliest and _can_go_on(now, inform)
                if ready or ctx.now <= bridged:
                    return "restarted", {"user": now.user}
            until = earliest if ctx.now < earliest else NEVER_NS
            yield On(RESTART, STOP_ENGAGED, planner_key("escape"), *CHANGES, until=until)


def _shortest(ctx: Context, inform: InformSettings) -> Duration:
    """How long the robot stays shown at least, as it stands now, s."""
    if not inform.until_clear or inform.least >= inform.cornered:
        return inform.least
    now = situation(ctx, "escape")
    return inform.least if now is None or can_get_away(now) else inform.cornered


def _can_go_on(now: Situation, inform: InformSettings) -> bool:
    return not inform.until_clear or is_outside(now) or way_out(now) is not None
