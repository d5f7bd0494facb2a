"""From how far off a turn is watched, and what a crowded robot is told."""

from __future__ import annotations

import math
from collections.abc import Callable

import pytest

from behaviors.chase import beside
from behaviors.chase.make_room import MakeRoom, UserCrowds
from behaviors.profile.profile import Profile
from behaviors.situation.present_situation import Situation
from engine.state import Stamped
from hw.geometry import Pose2, Twist2
from hw.samples import UserPose
from states.signals.user_motion import StillnessEstimator
from tests.behaviors.conftest import Base
from tests.fake_context import FakeContext

USER = UserPose(Pose2(10.0, 10.0, 0.0), 0.0)
TURNING, NOW_NS = Twist2(0.0, 0.0, 1.5), 10 * 10**9


def turner(now: Situation, stood_s: float | None) -> FakeContext:
    """Somebody who turns and has stood for so long, s; None: they have not stood yet."""
    ctx = FakeContext({
        "environment": now.environment, "settings": now.settings, "base.pose": now.pose,
        "base.twist": now.twist, "user.pose": now.user, "user.velocity": TURNING,
        "user.stands_since": None if stood_s is None else NOW_NS - round(stood_s * 1e9),
    }, {"base": Base("chase")})  # fmt: skip
    ctx.now = NOW_NS
    return ctx


@pytest.fixture
def at(tuned: Profile, situation_of: Callable[..., Situation]) -> Callable[[float], Situation]:
    return lambda distance: situation_of(tuned, Pose2(10.0 + distance, 10.0), USER, TURNING)


@pytest.mark.requirement(91)
@pytest.mark.parametrize(
    ("stood_s", "far"), [(None, 2.9), (0.99, 2.9), (1.0, 4.0568), (60.0, 4.0568)]
)
def test_who_has_stood_for_a_second_is_watched_from_where_a_walk_would_leave_too_little_margin(
    at: Callable[[float], Situation], stood_s: float | None, far: float
) -> None:
    """1.27 m, and at 1.3 m/s 0.4 s of margin, 0.15 s of reaction, 1.59 s of driving aside."""
    for distance, crowded in ((far - 0.01, True), (far + 0.01, False)):
        found = next(UserCrowds(room=1.0).run(turner(at(distance), stood_s)), None)

        assert (found is None) == crowded


@pytest.mark.requirement(91)
@pytest.mark.parametrize(("stood_s", "crowded"), [(None, False), (0.5, False), (1.5, True)])
def test_a_turn_of_somebody_who_stood_before_the_chart_was_entered_crowds_the_robot_at_once(
    at: Callable[[float], Situation], stood_s: float | None, crowded: bool
) -> None:
    run = UserCrowds(room=3.0).run(turner(at(3.5), stood_s))

    if crowded:
        with pytest.raises(StopIteration, match="crowded"):
            next(run)
    else:
        next(run)


@pytest.mark.requirement(91)
@pytest.mark.parametrize(("stood_s", "drives"), [(0.5, False), (1.5, True)])
def test_the_robot_makes_room_as_long_as_it_is_crowded(
    at: Callable[[float], Situation], stood_s: float, drives: bool
) -> None:
    ctx = turner(at(3.5), stood_s)
    run = MakeRoom().run(ctx)

    if drives:
        next(run)
        assert ctx.parts["base"].command is not None
    else:
        with pytest.raises(StopIteration, match="clear"):
            next(run)


def test_who_turns_on_the_spot_still_stands() -> None:
    estimator = StillnessEstimator(0.1, math.inf)

    for stamp, velocity in enumerate((Twist2(0.5), Twist2(0.0), TURNING, Twist2(0.05, 0.0, -3.0))):
        estimator.update("user.velocity", Stamped(velocity, stamp))
    assert estimator.value() == 1

    estimator.update("user.velocity", Stamped(Twist2(0.0, 0.1), 4))
    assert estimator.value() is None


def beside_who_leaves(now: Situation) -> FakeContext:
    """Somebody who walks away from the robot."""
    ctx = turner(now, None)
    ctx.values["user.velocity"] = Twist2(-0.5)
    return ctx


@pytest.mark.requirement(91)
@pytest.mark.parametrize(("distance", "drives"), [(2.99, True), (3.19, True), (3.21, False)])
def test_room_is_made_until_there_is_a_little_more_of_it_than_is_asked_for(
    at: Callable[[float], Situation], distance: float, drives: bool
) -> None:
    ctx = beside_who_leaves(at(distance))

    run = MakeRoom(room=3.0).run(ctx)
    next(run, None)

    assert (ctx.parts["base"].command is not None) == drives


def test_the_place_that_it_drives_to_is_one_of_those_it_chooses_from_again(
    at: Callable[[float], Situation], monkeypatch: pytest.MonkeyPatch
) -> None:
    original, chosen = beside.place_with_room, []

    def noted(now: Situation, band: tuple[float, float], present: object) -> object:
        found = original(now, band, present)  # type: ignore[arg-type]
        chosen.append((present, found[0]))
        return found

    monkeypatch.setattr(beside, "place_with_room", noted)
    ctx = beside_who_leaves(at(2.0))
    run = MakeRoom(room=3.0).run(ctx)
    for _ in range(15):  # three times, once in 0.2 s
        next(run)
        ctx.now += 33_000_000

    assert [present for present, _ in chosen] == [None, *(found for _, found in chosen[:-1])]
    assert len(chosen) == 3
