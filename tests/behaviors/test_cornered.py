"""Chase without a free place: being cornered, and leaving in the user's sight."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest
from hypothesis import assume, example, given, settings, strategies as st

from behaviors.chase.cornered import Cornered, Leave
from behaviors.chase.refuge import is_outside
from behaviors.profile.profile import Profile
from behaviors.situation.present_situation import Situation
from hw.geometry import Pose2, Twist2
from hw.samples import UserPose
from hw.scene.room import Room
from tests.behaviors.conftest import Base, Vr
from tests.fake_context import FakeContext
from tests.repeats import examples

CORRIDOR = Room(outer=((0.0, 0.0), (20.0, 0.0), (20.0, 2.2), (0.0, 2.2)))
LAB = Room(outer=((0.0, 0.0), (7.0, 0.0), (7.0, 6.0), (0.0, 6.0)))
END = Pose2(1.1, 1.1)
STANDING, WALKING = Twist2(0.0), Twist2(0.25)


def facing_back(x: float, y: float = 1.1) -> UserPose:
    return UserPose(Pose2(x, y, math.pi), math.pi)


BEFORE = facing_back(3.1)
"""Before a robot at END, who leaves it no way out."""


class Watched:
    """`Cornered` begun at 0 s, with signals as the test puts them."""

    def __init__(self, now: Situation, patience: float, shown: UserPose | None = None) -> None:
        self.ctx = FakeContext({
            "environment": now.environment, "settings": now.settings, "base.pose": now.pose,
            "base.twist": now.twist, "user.pose": now.user, "user.velocity": now.velocity,
        })  # fmt: skip
        self.run = Cornered(patience=patience).run(self.ctx, shown=shown)
        assert self.at(0.0) is None

    def at(self, seconds: float, **values: Any) -> str | None:
        self.ctx.now = round(seconds * 1e9)
        self.ctx.values |= {name.replace("_", ".", 1): value for name, value in values.items()}
        try:
            next(self.run)
        except StopIteration as ended:
            outcome: str = ended.value
            return outcome
        return None


@pytest.fixture
def watched(tuned: Profile, situation_of: Callable[..., Situation]) -> Callable[..., Watched]:
    def make(shown: UserPose | None = None, user: UserPose = BEFORE) -> Watched:
        return Watched(situation_of(tuned, END, user, room=CORRIDOR), 10.0, shown)

    return make


@pytest.mark.requirement(101, 116)
def test_a_robot_without_a_way_out_of_a_zone_is_cornered_after_the_patience(
    watched: Callable[..., Watched],
) -> None:
    seen = watched()

    assert [seen.at(at) for at in (3.0, 9.9, 10.0)] == [None, None, "cornered"]


@pytest.mark.requirement(101, 114)
@pytest.mark.parametrize(("x", "after"), [(2.9, 1.0), (3.1, 10.0)])
def test_somebody_so_near_that_a_sign_would_come_too_late_is_shown_the_robot_after_a_second(
    watched: Callable[..., Watched], x: float, after: float
) -> None:
    """Nearer than 1.9 m to a robot that has no way out."""
    seen = watched(user=facing_back(x))

    assert seen.at(after - 0.1) is None
    assert seen.at(after) == "cornered"


@pytest.mark.requirement(101)
@pytest.mark.parametrize(
    "else_where",
    [
        {"user_velocity": WALKING},
        {"user_pose": facing_back(4.5)},
        {"user_pose": None},
        {"base_pose": None},
    ],
    ids=["walks", "outside", "user lost", "robot lost"],
)
def test_only_ten_seconds_on_end_beside_a_standing_user_count(
    watched: Callable[..., Watched], else_where: dict[str, Any]
) -> None:
    seen = watched()
    before = {name: seen.ctx.values[name.replace("_", ".", 1)] for name in else_where}
    assert seen.at(9.0, **else_where) is None

    assert seen.at(12.0) is None
    assert seen.at(13.0, **before) is None
    assert seen.at(22.9) is None
    assert seen.at(23.0) == "cornered"


@pytest.mark.requirement(101)
@pytest.mark.parametrize(("away", "cornered"), [(0.0, False), (0.29, False), (0.31, True)])
def test_nobody_is_shown_the_robot_twice_where_they_stand(
    watched: Callable[..., Watched], away: float, cornered: bool
) -> None:
    shown = UserPose(Pose2(BEFORE.body.x + away, BEFORE.body.y), 0.0)
    seen = watched(shown=shown)

    assert seen.at(10.0) == ("cornered" if cornered else None)


@pytest.mark.requirement(101)
def test_with_a_way_out_a_robot_is_not_cornered_until_it_is_gone(
    tuned: Profile, situation_of: Callable[..., Situation]
) -> None:
    near = UserPose(Pose2(1.1, 3.0, -math.pi / 2), -math.pi / 2)
    seen = Watched(situation_of(tuned, END, near, room=LAB), 10.0)

    assert [seen.at(at) for at in (10.0, 11.0, 50.0)] == [None] * 3
    walled = situation_of(tuned, END, BEFORE, room=CORRIDOR)
    seen.ctx.values["environment"] = walled.environment
    assert seen.at(52.0, user_pose=BEFORE) == "cornered"


class Leaving:
    """`Leave` on a base that takes on the commanded velocity within its acceleration."""

    def __init__(self, now: Situation, shown: UserPose | None, speed: float = 0.8) -> None:
        self.base, self.vr, self.now = Base("chase"), Vr(), now
        self.pose, self.twist = now.pose, now.twist
        self.ctx = FakeContext({
            "environment": now.environment, "settings": now.settings, "base.pose": self.pose,
            "base.twist": self.twist, "user.pose": now.user, "user.velocity": now.velocity,
        }, {"base": self.base, "vr": self.vr})  # fmt: skip
        self.run = Leave(speed=speed).run(self.ctx, shown=shown)
        self.path, self.fastest = [self.pose], 0.0

    def tick(self) -> str | None:
        """One tick of the state and of the base; the outcome, or None."""
        period = self.now.environment.period
        try:
            next(self.run)
        except StopIteration as ended:
            outcome: str = ended.value
            return outcome
        command = self.base.command
        assert command is not None
        self.fastest = max(self.fastest, command.speed)
        dx, dy = command.vx - self.twist.vx, command.vy - self.twist.vy
        share = min(
            1.0,
            period * self.now.environment.limits.base_acceleration / max(1e-9, math.hypot(dx, dy)),
        )
        self.twist = Twist2(self.twist.vx + share * dx, self.twist.vy + share * dy, command.wz)
        self.pose = self.pose.moved(self.twist.rotated(self.pose.yaw), period)
        self.path.append(self.pose)
        self.ctx.now += round(period * 1e9)
        self.ctx.values |= {"base.pose": self.pose, "base.twist": self.twist}
        return None

    def go(self, seconds: float = 20.0) -> str | None:
        """Tick by tick until it ends; None if it does not."""
        for _ in range(round(seconds / self.now.environment.period)):
            outcome = self.tick()
            if outcome is not None:
                return outcome
        return None


@pytest.mark.requirement(52, 110, 116)
@given(
    robot=st.tuples(st.floats(0.9, 6.1), st.floats(0.9, 5.1)),
    bearing=st.floats(-3.1, 3.1),
    distance=st.floats(1.1, 2.4),
    view=st.floats(-3.1, 3.1),
    yaw=st.floats(-3.1, 3.1),
    speed=st.sampled_from([0.3, 0.8, 1.5]),
)
@example((0.9375, 3.0), 0.0, 1.109375, 0.0, 0.0, 0.3)  # two ways out of the same length
@settings(deadline=None, max_examples=examples(60))
def test_a_robot_leaves_slowly_in_sight_without_the_sign_and_keeps_off_user_and_walls(
    tuned: Profile,
    situation_of: Callable[..., Situation],
    robot: tuple[float, float],
    bearing: float,
    distance: float,
    view: float,
    yaw: float,
    speed: float,
) -> None:
    x, y = robot
    user = x + distance * math.cos(bearing), y + distance * math.sin(bearing)
    assume(0.5 < user[0] < 6.5 and 0.5 < user[1] < 5.5)
    shown = UserPose(Pose2(*user, view), view)
    now = situation_of(tuned, Pose2(*robot, yaw), shown, room=LAB)
    leaving = Leaving(now, shown, speed)

    outcome = leaving.go()

    assert outcome in ("away", "blocked")
    assert leaving.fastest <= speed + 1e-9
    least = min(tuned.navigation.haptic.user_radius, math.dist(robot, user))
    assert min(pose.distance_to(shown.body) for pose in leaving.path) >= least - 0.02
    assert min(min(p.x, p.y, 7.0 - p.x, 6.0 - p.y) for p in leaving.path) >= 0.77 - 0.01
    assert max(abs(pose.yaw - yaw) for pose in leaving.path) < math.radians(1.0)
    if outcome == "away":
        assert is_outside(replace(now, pose=leaving.pose))
    assert leaving.vr.told == (["robot", "hidden"] if len(leaving.path) > 1 else [])
    assert leaving.base.command is None


@pytest.mark.requirement(116)
def test_on_open_floor_it_gets_away(tuned: Profile, situation_of: Callable[..., Situation]) -> None:
    shown = facing_back(11.6, 10.0)
    leaving = Leaving(situation_of(tuned, Pose2(10.0, 10.0), shown), shown)

    assert leaving.go(5.0) == "away"
    assert leaving.fastest == pytest.approx(0.8)


@pytest.mark.requirement(116)
@pytest.mark.parametrize(
    ("shown", "pose", "outcome"),
    [
        (None, Pose2(10.0, 10.0), "away"),  # to nobody
        (facing_back(11.95, 10.0), Pose2(10.0, 10.0), "away"),  # to somebody who has moved on
        (facing_back(11.6, 10.0), Pose2(7.0, 10.0), "away"),  # outside already
    ],
)
def test_without_need_nothing_drives_and_nothing_is_shown(
    tuned: Profile,
    situation_of: Callable[..., Situation],
    shown: UserPose | None,
    pose: Pose2,
    outcome: str,
) -> None:
    leaving = Leaving(situation_of(tuned, pose, facing_back(11.6, 10.0)), shown)

    assert leaving.tick() == outcome
    assert (leaving.vr.told, leaving.base.command) == ([], None)


@pytest.mark.requirement(91, 116)
@pytest.mark.parametrize(("speed", "outcome"), [(0.25, None), (0.35, "away")])
def test_once_the_user_sets_off_leaving_is_over(
    tuned: Profile, situation_of: Callable[..., Situation], speed: float, outcome: str | None
) -> None:
    """Making room is what follows; slowly out of the zones would be across their way."""
    shown = facing_back(11.6, 10.0)
    leaving = Leaving(situation_of(tuned, Pose2(10.0, 10.0), shown), shown)
    assert leaving.tick() is None

    leaving.ctx.values["user.velocity"] = Twist2(0.0, speed)

    assert leaving.tick() == outcome


@pytest.mark.requirement(116)
def test_without_a_way_out_it_stays_and_is_not_shown(
    tuned: Profile, situation_of: Callable[..., Situation]
) -> None:
    leaving = Leaving(situation_of(tuned, END, BEFORE, room=CORRIDOR), BEFORE)

    assert leaving.tick() == "blocked"
    assert (leaving.vr.told, leaving.base.command) == ([], None)


@pytest.mark.requirement(116)
@pytest.mark.parametrize("end", ["closed", "user lost"])
def test_whatever_ends_it_hides_the_robot_and_releases_the_base(
    tuned: Profile, situation_of: Callable[..., Situation], end: str
) -> None:
    shown = facing_back(11.6, 10.0)
    leaving = Leaving(situation_of(tuned, Pose2(10.0, 10.0), shown), shown)
    assert leaving.tick() is None
    assert leaving.tick() is None

    if end == "closed":
        leaving.run.close()
    else:
        leaving.ctx.values["user.pose"] = None
        assert leaving.tick() is not None

    assert leaving.vr.told == ["robot", "hidden"]
    assert leaving.base.command is None
