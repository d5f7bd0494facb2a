"""When Inform ends: who is ready, and when both can go on."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest
from hypothesis import given, settings, strategies as st

from behaviors.inform import UserReady, WarnUser
from behaviors.profile.profile import Profile
from behaviors.situation.present_situation import Situation
from engine.state import NEVER_NS, Stamped
from hw.geometry import Pose2, Twist2
from hw.samples import UserPose
from hw.scene.room import Room
from tests.fake_context import FakeContext
from tests.repeats import examples

STANDING, WALKING = Twist2(0.0), Twist2(0.5)
MS = st.integers(0, 6000).map(lambda ms: ms / 1000.0)
FREE = UserPose(Pose2(14.0, 10.0, 0.0), 0.0)
"""A user 4 m away from the robot at 10, 10."""
CORRIDOR = Room(outer=((0.0, 0.0), (20.0, 0.0), (20.0, 2.2), (0.0, 2.2)))
END, BLOCKING = Pose2(1.1, 1.1), UserPose(Pose2(2.7, 1.1, math.pi), math.pi)
"""The end of a corridor, and a user before it who leaves no way out."""
LOST = {"user_pose": None}


class Waiting:
    """`UserReady` in a situation, begun at 0 s, with signals as the test puts them."""

    def __init__(self, now: Situation, lost: bool = False, **parameters: Any) -> None:
        inform = replace(now.settings.inform, least=2.0, until_clear=True, cornered=6.0, moment=0.2)
        values = {
            "environment": now.environment, "settings": replace(now.settings, inform=inform),
            "base.pose": now.pose,
            "base.twist": now.twist, "user.pose": now.user, "user.velocity": now.velocity,
            "stop.engaged": None,
        }  # fmt: skip
        self.ctx = FakeContext(values)
        self.run = UserReady(**parameters).run(self.ctx)
        self.until = 0
        assert self.at(0.0, **(LOST if lost else {})) is None

    def at(self, seconds: float, *, restart: bool = False, **values: Any) -> Any:
        """A step at this time, s; the outcome, or None while it waits."""
        self.ctx.now = round(seconds * 1e9)
        self.ctx.values |= {name.replace("_", ".", 1): value for name, value in values.items()}
        if restart:
            self.ctx.pending["vr.restart"] = [Stamped(True, self.ctx.now)]
        try:
            self.until = next(self.run).until
        except StopIteration as ended:
            return ended.value
        return None


@pytest.fixture(scope="module")
def waiting(tuned: Profile, situation_of: Callable[..., Situation]) -> Any:
    def make(
        user: UserPose = FREE,
        pose: Pose2 = Pose2(10.0, 10.0),  # noqa: B008  it is frozen
        room: Room | None = None,
        **parameters: Any,
    ) -> Waiting:
        rooms = {} if room is None else {"room": room}
        return Waiting(situation_of(tuned, pose, user, **rooms), **parameters)

    return make


READY = ("restarted", {"user": FREE})


@pytest.mark.requirement(114, 115)
@given(least=MS, told=MS, looked=st.lists(MS))
@settings(deadline=None, max_examples=examples(100))
def test_nobody_is_ready_before_the_least_time_nor_without_the_signal(
    waiting: Any, least: float, told: float, looked: list[float]
) -> None:
    inform = waiting(least=least)
    for at in sorted({told, least, *looked}):
        found = inform.at(at, restart=at == told)
        due = at >= told and inform.ctx.now >= round(least * 1e9)
        assert found == (READY if due else None)
        if due:
            return
        assert inform.until == (round(least * 1e9) if at < least else NEVER_NS)


@pytest.mark.requirement(115)
def test_walking_on_revokes_the_signal_however_often_it_was_given(waiting: Any) -> None:
    inform = waiting()
    for at in (0.1, 0.6, 1.1):
        assert inform.at(at, restart=True) is None
    assert inform.at(1.5, user_velocity=WALKING) is None

    assert inform.at(2.5, user_velocity=STANDING) is None
    assert inform.at(4.0) is None
    assert inform.at(4.5, restart=True) == READY


@pytest.mark.requirement(115)
def test_a_signal_given_while_walking_is_none(waiting: Any) -> None:
    inform = waiting()
    assert inform.at(2.5, restart=True, user_velocity=WALKING) is None
    assert inform.at(2.6, user_velocity=STANDING) is None


@pytest.mark.requirement(65, 115)
@pytest.mark.parametrize(
    ("held", "free"),
    [
        ({"stop_engaged": "button"}, {"stop_engaged": None}),
        ({"user_pose": None}, {"user_pose": FREE}),
        ({"user_velocity": None}, {"user_velocity": STANDING}),
        ({"base_pose": None}, {"base_pose": Pose2(10.0, 10.0)}),
    ],
)
def test_with_a_fault_or_without_tracking_inform_goes_on(
    waiting: Any, held: dict[str, Any], free: dict[str, Any]
) -> None:
    inform = waiting()
    assert inform.at(2.5, restart=True, **held) is None
    assert inform.at(9.0) is None

    assert inform.at(9.1, **free) == READY


@pytest.mark.requirement(65, 116)
def test_without_a_way_out_of_the_zones_inform_waits_until_the_user_makes_one(waiting: Any) -> None:
    inform = waiting(BLOCKING, END, CORRIDOR)
    assert inform.at(2.5, restart=True) is None
    assert inform.at(30.0, restart=True) is None

    aside = UserPose(Pose2(3.9, 1.1, math.pi), math.pi)
    assert inform.at(31.0, user_pose=aside) == ("restarted", {"user": aside})


@pytest.mark.requirement(65, 116)
def test_with_a_way_out_a_robot_in_a_zone_may_go_on(waiting: Any) -> None:
    near = UserPose(Pose2(11.5, 10.0, math.pi), math.pi)

    assert waiting(near).at(2.5, restart=True) == ("restarted", {"user": near})


@pytest.mark.requirement(117)
def test_a_robot_that_could_not_drive_off_stays_shown_though_the_user_leaves(waiting: Any) -> None:
    """Who walks at it again and again finds it shown, not cornered anew each time."""
    inform = waiting(BLOCKING, END, CORRIDOR)
    assert inform.at(2.5, restart=True, user_pose=FREE) is None
    assert inform.at(5.9) is None
    assert inform.at(6.0) == READY


@pytest.mark.requirement(65)
def test_the_paper_s_inform_ends_with_the_signal_alone(waiting: Any) -> None:
    inform = waiting(BLOCKING, END, CORRIDOR, least=0.0, until_clear=False)

    assert inform.at(0.1, restart=True) == ("restarted", {"user": BLOCKING})


@pytest.mark.requirement(149)
@pytest.mark.parametrize(("seconds", "seen"), [(0.05, True), (0.2, True), (0.21, False)])
def test_an_inform_for_a_moment_without_tracking_ends_with_it(
    waiting: Any, seconds: float, seen: bool
) -> None:
    """Walking or not: they have nothing to wait for, and may walk at the robot."""
    inform = waiting(lost=True)
    assert inform.at(0.02) is None

    found = inform.at(seconds, user_pose=FREE, user_velocity=WALKING)

    assert found == (READY if seen else None)


@pytest.mark.requirement(149)
@pytest.mark.parametrize(
    "missing", [{"user_velocity": None}, {"base_pose": None}, {"stop_engaged": "button"}]
)
def test_whatever_else_is_wrong_keeps_inform_from_ending_at_once(
    waiting: Any, missing: dict[str, Any]
) -> None:
    assert waiting(lost=True).at(0.1, user_pose=FREE, **missing) is None


@pytest.mark.requirement(65, 149)
def test_an_inform_for_another_reason_does_not_end_because_the_user_is_tracked(
    waiting: Any,
) -> None:
    inform = waiting()
    for seen in (FREE, None, FREE):
        assert inform.at(0.1, user_pose=seen) is None


class Vr:
    def __init__(self) -> None:
        self.told: list[tuple[bool, bool, float]] = []

    def inform(self, show: bool, sign: bool = True, least: float = 0.0) -> None:
        self.told.append((show, sign, least))


@pytest.mark.requirement(18, 114)
def test_the_robot_is_shown_with_the_sign_while_inform_runs_and_hidden_whatever_ends_it(
    context: Any,
) -> None:
    vr = Vr()
    run = WarnUser(least=1.5).run(context({}, {"vr": vr}))
    for _ in range(3):
        assert next(run).ns == NEVER_NS
    assert vr.told == [(True, True, 1.5)]

    run.close()

    assert [show for show, *_ in vr.told] == [True, False]
