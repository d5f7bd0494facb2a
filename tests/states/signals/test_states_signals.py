"""States that watch the user, tracking and faults."""

from __future__ import annotations

import math
from typing import Any

import pytest

from engine.state import NEVER_NS, Stamped
from hw.geometry import Pose2
from hw.samples import OLD_S, UserPose
from states.signals.states import (
    STUCK,
    USER_LOST,
    CallOperator,
    FaultRaised,
    UserLost,
    UserSettled,
)

BEFORE = UserPose(Pose2(1.0, 1.0, 0.0), 0.0)


def moved(distance: float, turn: float = 0.0) -> UserPose:
    return UserPose(Pose2(1.0 + distance, 1.0, turn), turn)


def standing(context: Any, still: float, user: UserPose) -> Any:
    """What is seen of a user who has stood there for so many seconds."""
    ctx = context({"user.still_since": 10**9, "user.pose": user})
    ctx.now = ctx.stamps["user.still_since"] = 10**9 + round(still * 1e9)
    return ctx


@pytest.mark.requirement(89)
@pytest.mark.parametrize(
    ("still", "distance", "turn", "settled"),
    [
        (0.49, 0.31, 0.0, False),
        (0.51, 0.31, 0.0, True),
        (0.51, 0.29, 0.0, False),
        (0.51, 0.0, math.pi / 6 + 0.01, True),
        (0.51, 0.0, math.pi / 6 - 0.01, False),
        (0.51, 0.0, -math.pi / 6 - 0.01, True),
        (0.49, 0.0, 3.0, False),
    ],
)
def test_a_user_has_settled_after_half_a_second_and_30_cm_or_30_degrees(
    context: Any, take_step: Any, still: float, distance: float, turn: float, settled: bool
) -> None:
    ctx = standing(context, still, moved(distance, turn))

    outcome = take_step(UserSettled().run(ctx, since=BEFORE))

    assert outcome == ("settled" if settled else None)


@pytest.mark.requirement(89)
def test_before_the_first_goal_standing_still_is_enough(context: Any, take_step: Any) -> None:
    ctx = standing(context, 0.51, BEFORE)

    assert take_step(UserSettled().run(ctx)) == "settled"


@pytest.mark.requirement(89, 125)
def test_how_long_and_how_far_can_be_chosen(context: Any, take_step: Any) -> None:
    ctx = standing(context, 1.1, moved(0.31))

    assert take_step(UserSettled(still_for=1.2).run(ctx, since=BEFORE)) is None
    assert take_step(UserSettled(moved=0.4).run(ctx, since=BEFORE)) is None
    assert take_step(UserSettled(still_for=1.0).run(ctx, since=BEFORE)) == "settled"


@pytest.mark.requirement(89)
def test_a_user_who_stands_is_looked_at_again_when_they_have_stood_long_enough(
    context: Any,
) -> None:
    ctx = standing(context, 0.2, BEFORE)

    waited = next(UserSettled().run(ctx))

    assert (waited.signals, waited.until) == (("user.still_since", "user.pose"), 1_500_000_001)


@pytest.mark.requirement(89)
@pytest.mark.parametrize("still", [None, 0.7])
def test_a_user_who_walks_or_has_not_moved_is_looked_at_when_that_changes(
    context: Any, still: float | None
) -> None:
    ctx = standing(context, still or 0.0, BEFORE)
    if still is None:
        ctx.values["user.still_since"] = None

    assert next(UserSettled().run(ctx, since=BEFORE)).until == NEVER_NS


@pytest.mark.requirement(149)
def test_a_user_is_lost_once_their_pose_is_stale(context: Any, take_step: Any) -> None:
    ctx = context({"user.pose": BEFORE})
    run = UserLost().run(ctx)
    assert take_step(run) is None

    ctx.now, ctx.values["user.pose"] = round(0.2e9), None  # as the engine gives what is too old

    assert take_step(run) == "lost"


@pytest.mark.requirement(149)
def test_at_the_very_start_the_first_pose_may_take_its_time(context: Any, take_step: Any) -> None:
    ctx = context({})
    run = UserLost().run(ctx)

    assert take_step(run) is None
    ctx.now = round((OLD_S + 0.01) * 1e9)
    assert take_step(run) == "lost"


@pytest.mark.requirement(149)
def test_who_is_lost_when_a_chart_is_entered_is_lost_at_once(context: Any, take_step: Any) -> None:
    assert take_step(UserLost().run(context({"user.pose": None}))) == "lost"


@pytest.mark.requirement(5, 49)
def test_a_pulled_stop_line_is_a_fault(context: Any, take_step: Any) -> None:
    ctx = context({"stop.engaged": None})
    run = FaultRaised().run(ctx)
    assert take_step(run) is None

    ctx.values["stop.engaged"] = "bumper: person"

    assert take_step(run) == "raised"


class Desk:
    """Operator and stop line in one."""

    def __init__(self) -> None:
        self.reported: list[str] = []
        self.pulled: list[str] = []
        self.cause_holds = False
        self.resets = 0

    def report(self, fault: str) -> None:
        self.reported.append(fault)

    def pull(self, reason: str) -> None:
        self.pulled.append(reason)

    def reset(self) -> bool:
        self.resets += 1
        return not self.cause_holds


@pytest.fixture
def desk() -> Desk:
    return Desk()


ACKNOWLEDGED = [Stamped(True, 0)]


def calling(
    context: Any, desk: Desk, values: dict[str, Any], **parameters: float
) -> tuple[Any, Any]:
    ctx = context(values, {"operator": desk, "stop_line": desk})
    return ctx, CallOperator(**parameters).run(ctx)


def step_at(ctx: Any, take_step: Any, run: Any, seconds: float, acknowledged: bool = False) -> Any:
    """A step at this time, s, with or without an acknowledgement since the one before."""
    ctx.now = round(seconds * 1e9)
    if acknowledged:
        ctx.pending["operator.acknowledge"] = ACKNOWLEDGED
    return take_step(run)


@pytest.mark.requirement(49)
def test_without_a_fault_nobody_is_called(context: Any, take_step: Any, desk: Desk) -> None:
    ctx, run = calling(context, desk, {"stop.engaged": None, "user.pose": BEFORE}, patience=40.0)

    for seconds in range(40):
        assert step_at(ctx, take_step, run, seconds, acknowledged=True) is None

    assert (desk.reported, desk.pulled, desk.resets) == ([], [], 0)


@pytest.mark.requirement(49)
def test_a_fault_is_reported_once_and_reset_only_when_acknowledged(
    context: Any, take_step: Any, desk: Desk
) -> None:
    ctx, run = calling(context, desk, {"stop.engaged": "bumper", "user.pose": BEFORE})
    for _ in range(5):
        assert take_step(run) is None
    assert (desk.reported, desk.resets) == (["bumper"], 0)

    ctx.pending["operator.acknowledge"] = ACKNOWLEDGED
    take_step(run)
    ctx.values["stop.engaged"] = None

    assert desk.resets == 1
    assert take_step(run) is None
    assert desk.reported == ["bumper"]


@pytest.mark.requirement(49)
def test_a_second_fault_is_reported_as_the_first_was(
    context: Any, take_step: Any, desk: Desk
) -> None:
    ctx, run = calling(context, desk, {"stop.engaged": "bumper", "user.pose": BEFORE})
    take_step(run)
    ctx.values["stop.engaged"] = None
    take_step(run)

    ctx.values["stop.engaged"] = "button"
    take_step(run)

    assert desk.reported == ["bumper", "button"]


@pytest.mark.requirement(49)
def test_a_fault_whose_cause_holds_needs_another_acknowledgement(
    context: Any, take_step: Any, desk: Desk
) -> None:
    desk.cause_holds = True
    ctx, run = calling(context, desk, {"stop.engaged": "bumper", "user.pose": BEFORE})
    take_step(run)
    ctx.pending["operator.acknowledge"] = ACKNOWLEDGED

    assert take_step(run) is None
    desk.cause_holds = False
    ctx.pending["operator.acknowledge"] = ACKNOWLEDGED
    take_step(run)

    assert desk.resets == 2


@pytest.mark.requirement(149)
def test_a_user_lost_for_half_a_second_is_latched(context: Any, take_step: Any, desk: Desk) -> None:
    ctx, run = calling(context, desk, {"stop.engaged": None, "user.pose": None})
    take_step(run)
    step_at(ctx, take_step, run, 0.34)
    assert not desk.pulled

    step_at(ctx, take_step, run, 0.36)

    assert desk.pulled == [USER_LOST]


@pytest.mark.requirement(149)
def test_a_short_drop_out_needs_no_operator(context: Any, take_step: Any, desk: Desk) -> None:
    ctx, run = calling(context, desk, {"stop.engaged": None, "user.pose": None})
    assert take_step(run) is None

    ctx.values["user.pose"] = BEFORE
    assert step_at(ctx, take_step, run, 0.3) is None
    ctx.values["user.pose"] = None
    assert step_at(ctx, take_step, run, 0.6) is None  # 0.3 s since they were last seen

    assert not desk.pulled


@pytest.mark.requirement(65)
@pytest.mark.parametrize("patience", [0.0, 40.0])
def test_after_its_patience_the_operator_is_asked_once_and_helps_by_acknowledging(
    context: Any, take_step: Any, desk: Desk, patience: float
) -> None:
    values = {"stop.engaged": None, "user.pose": BEFORE}
    ctx, run = calling(context, desk, values, patience=patience)
    if patience > 0.0:
        assert step_at(ctx, take_step, run, 0.0) is None
        assert step_at(ctx, take_step, run, patience - 0.1, acknowledged=True) is None
        assert not desk.reported

    for later in (0.0, 1.0, 50.0):
        assert step_at(ctx, take_step, run, patience + later) is None
    assert desk.reported == [STUCK]

    ctx.values["user.pose"] = moved(0.4)
    found = step_at(ctx, take_step, run, patience + 60.0, acknowledged=True)

    assert found == ("helped", {"user": moved(0.4)})
    assert (desk.pulled, desk.resets) == ([], 0)


@pytest.mark.requirement(65)
@pytest.mark.parametrize(("engaged", "user"), [("button", BEFORE), (None, None)])
def test_with_a_fault_or_a_lost_user_nobody_has_helped_yet(
    context: Any, take_step: Any, desk: Desk, engaged: str | None, user: UserPose | None
) -> None:
    values = {"stop.engaged": engaged, "user.pose": user}
    ctx, run = calling(context, desk, values, patience=0.0)

    for _ in range(3):
        assert step_at(ctx, take_step, run, 0.0, acknowledged=True) is None
    assert STUCK not in desk.reported

    ctx.values |= {"stop.engaged": None, "user.pose": BEFORE}
    assert step_at(ctx, take_step, run, 0.1) is None
    assert desk.reported[-1] == STUCK
    assert step_at(ctx, take_step, run, 0.2, acknowledged=True) == ("helped", {"user": BEFORE})


@pytest.mark.requirement(65)
@pytest.mark.parametrize("at", [0.0, 3.0, 5.9])
def test_an_operator_who_acknowledges_early_has_helped_once_the_least_time_is_over(
    context: Any, take_step: Any, desk: Desk, at: float
) -> None:
    values = {"stop.engaged": None, "user.pose": BEFORE}
    ctx, run = calling(context, desk, values, patience=0.0, least=6.0)
    assert step_at(ctx, take_step, run, 0.0) is None

    assert step_at(ctx, take_step, run, at, acknowledged=True) is None
    assert step_at(ctx, take_step, run, 5.95) is None

    assert step_at(ctx, take_step, run, 6.0) == ("helped", {"user": BEFORE})
    assert desk.reported == [STUCK]
