"""States that only watch signals: what the user does, lost tracking, faults."""

from __future__ import annotations

from typing import Annotated

from engine import NEVER_NS, Action, Context, Monitor, On, Run
from engine.files import Angle, Duration, Length
from engine.files.declared import FROM_0
from hw import OLD_S, UserPose, wrap
from states.environment import ACKNOWLEDGE, STOP_ENGAGED, USER_POSE, USER_STILL_SINCE
from states.watching import silence

USER_LOST = "tracking of the user is lost"
STUCK = "robot and user are in each other's way"
"""What the operator is asked to look at when nothing else helps."""


class UserSettled(Monitor):
    """`settled` once the user stands still after having moved or turned since `since`.

    Without a `since` standing still is enough. Paper 4.4.2, first criterion (R89).

    Args:
        still_for: how long they have to stand still.
        moved: they have moved if they are farther than this from where they were at `since`.
        turned: they have turned if their view is off by more than this.
        since: their pose to compare with, as `ChooseChasePose` outputs it.

    Outcomes:
        settled: they stand still, and have moved or turned if `since` was given.
    """

    outcomes = ("settled",)
    reads = {USER_STILL_SINCE: OLD_S, USER_POSE: OLD_S}

    def __init__(
        self,
        still_for: Annotated[Duration, FROM_0] = 0.5,
        moved: Length = 0.3,
        turned: Angle = 0.5235987755982988,
    ) -> None:
        self.still_for, self.moved, self.turned = still_for, moved, turned

    def run(self, ctx: Context, since: UserPose | None = None) -> Run:
        while True:
            stood, user = _stood(ctx), ctx.value(USER_POSE)
            long_enough = stood is not None and stood > self.still_for
            if long_enough and user is not None and self._has_moved(since, user):
                return "settled"
            until = NEVER_NS
            if stood is not None and not long_enough:
                until = ctx.after(self.still_for - stood) + 1
            yield On(USER_STILL_SINCE, USER_POSE, until=until)

    def _has_moved(self, since: UserPose | None, user: UserPose) -> bool:
        if since is None or since.body.distance_to(user.body) > self.moved:
            return True
        return abs(wrap(user.body.yaw - since.body.yaw)) > self.turned


def _stood(ctx: Context) -> float | None:
    """How long the user had stood still at the newest velocity, s; None while they move."""
    since, newest = ctx.value(USER_STILL_SINCE), ctx.sample(USER_STILL_SINCE)
    if since is None or newest is None:
        return None
    stood: int = newest.stamp - since
    return max(0.0, stood * 1e-9)


class UserLost(Monitor):
    """`lost` once the newest pose of the user is older than 150 ms: `Silent` with that time.

    Outcomes:
        lost: the newest pose of the user is older than 150 ms, or there is none.
    """

    outcomes = ("lost",)
    reads = {USER_POSE: OLD_S}

    def run(self, ctx: Context) -> Run:
        yield from silence(ctx, USER_POSE, OLD_S)
        return "lost"


class FaultRaised(Monitor):
    """`raised` while the stop line is pulled, by the bumper, a driver or the operator.

    Older charts name it; it is `WaitFor` with the signal `stop.engaged`.

    Outcomes:
        raised: the stop line is pulled.
    """

    outcomes = ("raised",)
    reads = {STOP_ENGAGED: None}

    def run(self, ctx: Context) -> Run:
        while ctx.value(STOP_ENGAGED) is None:
            yield On(STOP_ENGAGED)
        return "raised"


class CallOperator(Action):
    """Call the operator for what the robot cannot do alone.

    A pulled stop line is reported, and reset once they acknowledge it; a user who stays lost for
    `latch` is a fault as well: the stop line is pulled for it. Where no fault is left, but this
    state still runs after `patience`, they are asked to look; `helped`, with the user's pose, once
    they acknowledge that, but not before `least`.

    Args:
        latch: how long the user may be lost before the stop line is pulled.
        patience: how long after the start, if no fault is left then, they are asked to look.
        least: not `helped` sooner than this.

    Outcomes:
        helped: the operator has acknowledged that they were asked to look; no fault is left and the
            user is tracked.

    Outputs:
        user: the pose of the user then.
    """

    outcomes = ("helped",)
    outputs = {"helped": {"user": UserPose}}
    reads = {STOP_ENGAGED: None, USER_POSE: OLD_S, ACKNOWLEDGE: None}
    commands = ("operator", "stop_line")

    def __init__(
        self,
        latch: Annotated[Duration, FROM_0] = 0.5,
        patience: Annotated[Duration, FROM_0] = 40.0,
        least: Annotated[Duration, FROM_0] = 0.0,
    ) -> None:
        self.latch, self.patience, self.least = latch, patience, least

    def run(self, ctx: Context) -> Run:
        operator, stop_line = ctx.part("operator"), ctx.part("stop_line")
        ask_at, asked, helped = ctx.after(self.patience), False, False
        earliest = ctx.after(self.least)
        latch_at = ctx.after(self.latch - OLD_S)
        reported = None
        while True:
            reason, user = ctx.value(STOP_ENGAGED), ctx.value(USER_POSE)
            acknowledged = bool(ctx.events(ACKNOWLEDGE))
            if reason is None and reported is not None:
                reported, latch_at = None, ctx.after(self.latch)
            if reason is None and user is None and ctx.now >= latch_at:
                stop_line.pull(USER_LOST)
            if reason is None and user is not None:
                latch_at = ctx.after(self.latch - OLD_S)
                helped = helped or (asked and acknowledged)
                if helped and ctx.now >= earliest:
                    return "helped", {"user": user}
                if not asked and ctx.now >= ask_at:
                    asked = True
                    operator.report(STUCK)
            if reason is not None and reported is None:
                operator.report(reason)
                reported = reason
            elif reason is not None and acknowledged:
                stop_line.reset()  # `stop.engaged` shows whether it was
            yield None
