"""States that drive the base, on the simulated base."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from hw.geometry import Pose2, Twist2
from hw.interfaces import DriveMode
from hw.safety.guarded import GuardedBase
from hw.safety.limits import SafetyLimits
from hw.samples import UserPose
from hw.scene.room import Room
from hw.sim.sim_base import SimBase
from states.environment.environment import Environment
from states.navigation.drive import NO_PATH_S, GoalProgress
from states.navigation.states import DriveTo
from states.subsystems import SubsystemName

HZ = 30
START = Pose2(2.0, 2.0, 0.0)


def alone(base: SimBase, environment: Environment) -> GuardedBase:
    """A base about which nobody has to be watched, and whose commands may be late."""
    limits = SafetyLimits.of(environment.robot, environment.limits)
    return GuardedBase(base, replace(limits, watched=False, command_late=0.079))


class Drive:
    """A state that drives a simulated base, tick by tick."""

    def __init__(
        self,
        environment: Environment,
        context: Any,
        goal: Pose2,
        name: SubsystemName = "chase",
        mode: DriveMode = "omni",
        start: Pose2 = START,
        speed: float | None = None,
    ) -> None:
        self.base = SimBase(environment.robot, environment.limits, start)
        self.guard = alone(self.base, environment)
        values = {"environment": environment, "base.pose": start, "base.twist": self.base.twist}
        self.ctx = context(values | {"base.mode": self.base.mode}, {"base": self.guard})
        self.run = DriveTo(name, mode=mode, speed=speed).run(self.ctx, goal)
        self.fastest = self.sideways = 0.0

    def until_end(self, take_step: Any, seconds: float) -> str | None:
        for tick in range(round(seconds * HZ)):
            now = tick * 10**9 // HZ
            self.base.advance(now)
            self.ctx.now = now
            self.ctx.values |= {"base.pose": self.base.pose, "base.twist": self.base.twist}
            self.fastest = max(self.fastest, self.base.twist.speed)
            self.sideways = max(self.sideways, abs(self.base.twist.vy))
            outcome = take_step(self.run)
            self.guard.tick(now)
            if outcome is not None:
                return str(outcome)
        return None


@pytest.mark.requirement(39, 79, 129)
@pytest.mark.parametrize("goal", [Pose2(7.0, 5.0, 1.2), Pose2(2.5, 2.0, -3.0), START])
def test_a_drive_arrives_at_place_and_yaw_and_stands(
    environment: Environment, context: Any, take_step: Any, goal: Pose2
) -> None:
    drive = Drive(environment, context, goal)

    assert drive.until_end(take_step, 15) == "arrived"

    assert drive.base.pose.distance_to(goal) <= environment.navigation.chase.tolerance
    assert drive.base.pose.yaw == pytest.approx(
        goal.yaw, abs=environment.navigation.chase.yaw_tolerance
    )
    assert drive.fastest <= 1.5 + 1e-6


@pytest.mark.parametrize(("speed", "fastest"), [(0.2, 0.2), (9.0, 1.5)])
def test_a_drive_is_nowhere_faster_than_told_nor_than_its_subsystem(
    environment: Environment, context: Any, take_step: Any, speed: float, fastest: float
) -> None:
    drive = Drive(environment, context, Pose2(6.0, 2.0, 0.0), speed=speed)

    assert drive.until_end(take_step, 30) == "arrived"

    assert drive.fastest == pytest.approx(fastest, abs=0.01)


@pytest.mark.requirement(2)
def test_a_differential_drive_never_goes_sideways_and_gives_the_mode_back(
    environment: Environment, context: Any, take_step: Any
) -> None:
    goal = Pose2(6.0, 5.0, 1.2)
    aside, ahead = (
        Drive(environment, context, goal),
        Drive(environment, context, goal, mode="differential"),
    )

    assert aside.until_end(take_step, 20) == ahead.until_end(take_step, 20) == "arrived"

    assert aside.sideways > 0.3
    assert ahead.sideways == 0.0
    assert ahead.base.pose.distance_to(goal) <= environment.navigation.chase.tolerance
    for seconds in (25, 26):  # the wheels change over at standstill
        ahead.base.advance(seconds * 10**9)
    assert ahead.base.mode == "omni"


@pytest.mark.requirement(51, 52)
def test_a_drive_goes_round_the_user(
    environment: Environment, context: Any, take_step: Any
) -> None:
    drive = Drive(environment, context, Pose2(8.0, 2.0, 0.0), "haptic")
    user = UserPose(Pose2(5.0, 2.3, 0.0), 0.0)
    drive.ctx.values["user.pose"] = user
    nearest = []
    for _ in range(300):
        outcome = drive.until_end(take_step, 1 / HZ)
        nearest.append(drive.base.pose.distance_to(user.body))
        if outcome is not None:
            break
        drive.base._now = 0  # the next tick begins at 0 again

    assert min(nearest) >= environment.navigation.haptic.user_radius - 0.01


@pytest.mark.requirement(52, 101)
@pytest.mark.parametrize("name", ["chase", "haptic", "escape"])
@pytest.mark.parametrize("user", [None, UserPose(Pose2(3.7, 2.5, 1.1), 1.1)])
def test_a_robot_pushed_into_a_corner_drives_out_and_does_not_turn_in_it(
    environment: Environment, context: Any, take_step: Any, name: SubsystemName, user: Any
) -> None:
    """Half its diagonal is 0.725 m; turning at 0.71 m would swing a corner into the wall."""
    start = Pose2(0.71, 0.73, 1.21)
    drive = Drive(environment, context, Pose2(4.0, 5.0, -1.9), name, start=start)
    drive.ctx.values["user.pose"] = user
    poses = []

    assert (
        drive.until_end(lambda run: poses.append(drive.base.pose) or take_step(run), 8) == "arrived"
    )

    close = [pose.yaw for pose in poses if min(pose.x, pose.y) < 0.725]
    assert len(close) > 3
    assert close == [start.yaw] * len(close)


@pytest.mark.requirement(101)
def test_a_goal_in_a_wall_s_inflation_has_no_path(
    environment: Environment, context: Any, take_step: Any
) -> None:
    drive = Drive(environment, context, Pose2(0.9, 4.0, 0.0))

    assert drive.until_end(take_step, NO_PATH_S + 0.1) == "no_path"


@pytest.mark.requirement(101)
def test_a_way_that_is_gone_for_a_moment_is_waited_for_braking(
    environment: Environment, context: Any, take_step: Any
) -> None:
    rig, goal = Rig(environment, context), Pose2(7.0, 5.0, 0.0)
    run = DriveTo("chase").run(rig.ctx, goal)
    for _ in range(30):
        rig.tick(run, take_step)
    fast = rig.base.twist.speed
    waits = round(NO_PATH_S * HZ) - 1
    for ticks in (waits, 1, waits):
        rig.ctx.values["chase.planner"] = NoWay(environment) if ticks > 1 else None
        if ticks == 1:
            del rig.ctx.values["chase.planner"]
        found = [rig.tick(run, take_step) for _ in range(ticks)]
        assert found == [None] * ticks
    assert rig.base.twist.speed < 0.6 * fast

    assert [rig.tick(run, take_step) for _ in range(2)] == [None, "no_path"]


@pytest.mark.requirement(101)
def test_a_robot_that_does_not_move_is_stuck(
    environment: Environment, context: Any, take_step: Any
) -> None:
    drive = Drive(environment, context, Pose2(7.0, 5.0, 0.0))
    drive.base.braked = True

    assert drive.until_end(take_step, 3.4) == "stuck"


@pytest.mark.requirement(101)
@pytest.mark.parametrize(("metres", "stuck"), [(0.04, True), (0.06, False)])
def test_creeping_is_no_progress(context: Any, metres: float, stuck: bool) -> None:
    """Of a way that gets shorter by less than 5 cm within the patience nothing is reached."""
    ctx = context({}, {})
    progress, ticks = GoalProgress(3.0), 4 * HZ
    found = []
    for tick in range(ticks):
        ctx.now = tick * 10**9 // HZ
        found.append(progress.failure(ctx, 5.0 - metres * tick / (3 * HZ), 0.0))

    assert found[: 3 * HZ] == [None] * 3 * HZ
    assert ("stuck" in found) is stuck


def test_without_a_pose_of_the_base_the_drive_is_lost(
    environment: Environment, context: Any, take_step: Any
) -> None:
    drive = Drive(environment, context, Pose2(7.0, 5.0, 0.0))
    take_step(drive.run)
    drive.ctx.values["base.pose"] = None

    assert take_step(drive.run) == "lost"


@pytest.mark.requirement(42, 71)
def test_whatever_ends_a_drive_stops_the_base(
    environment: Environment, context: Any, take_step: Any
) -> None:
    drive = Drive(environment, context, Pose2(7.0, 5.0, 0.0))
    drive.until_end(take_step, 1)
    assert drive.base.twist.speed > 0.3

    drive.run.close()
    drive.guard.tick(10**9)
    drive.base.advance(4 * 10**9)

    assert drive.base.twist.speed == 0.0


@pytest.mark.requirement(35)
def test_each_subsystem_drives_with_its_own_values(
    environment: Environment, context: Any, take_step: Any
) -> None:
    speeds = {}
    names: tuple[SubsystemName, ...] = ("chase", "escape")
    for name in names:
        drive = Drive(environment, context, Pose2(8.0, 6.0, 0.0), name)
        drive.until_end(take_step, 15)
        speeds[name] = drive.fastest

    assert speeds["chase"] == pytest.approx(1.5, abs=0.01)
    assert 2.0 < speeds["escape"] <= 2.5


class NoWay:
    """The planner of a subsystem to which every way has been barred."""

    def __init__(self, environment: Environment) -> None:
        self._planner = environment.static_planners["chase"]

    def plan(self, *_: Any) -> None:
        return None

    def __getattr__(self, name: str) -> Any:
        return getattr(self._planner, name)


class Rig:
    """A drive in which the base hears every command some ns after its tick."""

    def __init__(self, environment: Environment, context: Any, late_ns: int = 0) -> None:
        self.base, self.late_ns = SimBase(environment.robot, environment.limits, START), late_ns
        self.guard = alone(self.base, environment)
        self.ctx = context({"environment": environment}, {"base": self.guard})
        self.n = 0

    def tick(self, run: Any, take_step: Any) -> Any:
        now = self.n * 10**9 // HZ
        self.base.advance(now)
        self.ctx.now = now
        self.ctx.values |= {"base.pose": self.base.pose, "base.twist": self.base.twist}
        self.ctx.values["base.admitted"] = self.guard.chain.admitted
        self.base.advance(now + self.late_ns)
        outcome = take_step(run)
        self.guard.tick(now)
        self.n += 1
        return outcome


@pytest.mark.requirement(149)
@pytest.mark.parametrize("told", [0.03, 0.0])
def test_a_drive_arrives_exactly_whether_or_not_it_is_told_the_latency(
    environment: Environment, context: Any, take_step: Any, told: float
) -> None:
    rig, goal = Rig(environment, context, late_ns=30_000_000), Pose2(7.0, 5.0, 1.2)
    rig.ctx.values["environment"] = replace(environment, latency=told)
    run = DriveTo("chase").run(rig.ctx, goal)

    while rig.tick(run, take_step) is None:
        assert rig.n < 10 * HZ
    rig.base.advance((rig.n + HZ) * 10**9 // HZ)

    assert rig.base.pose.distance_to(goal) <= 0.01


@pytest.mark.requirement(51)
@pytest.mark.parametrize("told", [True, False])
def test_a_drive_keeps_off_a_user_who_walks_across_if_it_knows_their_velocity(
    environment: Environment, context: Any, take_step: Any, told: bool
) -> None:
    rig = Rig(environment, context)
    run = DriveTo("haptic").run(rig.ctx, Pose2(8.0, 2.0, 0.0))
    body, least, outcome = Pose2(5.0, 5.0), 9.0, None
    while outcome is None:
        rig.ctx.values["user.pose"] = UserPose(body, 0.0)
        rig.ctx.values["user.velocity"] = Twist2(0.0, -1.0) if told else None
        outcome = rig.tick(run, take_step)
        least = min(least, rig.base.pose.distance_to(body))
        body = Pose2(body.x, max(-9.0, body.y - 1.0 / HZ))

    assert outcome == "arrived"
    assert (least > environment.navigation.haptic.user_radius - 0.05) is told


@pytest.mark.parametrize(
    ("told", "speed"),
    [
        ({}, 1.0),
        ({"base.admitted": Twist2(0.8)}, 0.8),
        ({"base.refusal": "the arm is not folded", "base.twist": Twist2(0.9)}, 0.9),
    ],
)
def test_a_drive_goes_on_from_what_was_left_of_its_velocity(
    environment: Environment, context: Any, take_step: Any, told: dict[str, Any], speed: float
) -> None:
    rig, sent = Rig(environment, context), []
    run = DriveTo("chase").run(rig.ctx, Pose2(8.0, 2.0, 0.0))
    for _ in range(30):
        rig.tick(run, take_step)
    rig.guard.drive = lambda command, *_: sent.append(command)  # type: ignore[method-assign]
    rig.ctx.values |= told

    take_step(run)

    step = environment.limits.base_acceleration / HZ
    assert sent[0].vx == pytest.approx(speed + step, abs=1e-3)


@pytest.mark.requirement(78, 86)
@pytest.mark.parametrize(("name", "granted"), [("haptic", True), ("chase", False)])
def test_the_chain_is_told_the_pose_a_touch_is_served_from_while_the_drive_lasts(
    environment: Environment, context: Any, take_step: Any, name: SubsystemName, granted: bool
) -> None:
    rig, goal, grants = Rig(environment, context), Pose2(7.0, 5.0, 0.0), []
    rig.guard.grant = grants.append  # type: ignore[method-assign]
    run = DriveTo(name).run(rig.ctx, goal)
    for _ in range(5):
        rig.tick(run, take_step)
    assert grants == ([goal] if granted else [])

    run.close()

    assert grants == ([goal, None] if granted else [])


NARROW = Room(
    outer=((0.0, 0.0), (10.0, 0.0), (10.0, 8.0), (0.0, 8.0)),
    walls=(((4.0, 0.0), (6.0, 0.0), (6.0, 3.1), (4.0, 3.1)),
           ((4.0, 4.9), (6.0, 4.9), (6.0, 8.0), (4.0, 8.0))),
)  # fmt: skip
"""A passage 1.8 m wide: enough for Escape's inflation, not for Haptic's."""


@pytest.mark.requirement(35, 129)
@pytest.mark.parametrize(
    ("clearance", "outcome"), [("own", "no_path"), ("haptic", "no_path"), ("escape", "arrived")]
)
def test_a_drive_may_keep_the_distances_of_another_subsystem_at_its_own_speed(
    environment: Environment, context: Any, take_step: Any, clearance: Any, outcome: str
) -> None:
    rig, fastest, found = Rig(replace(environment, room=NARROW), context), 0.0, None
    run = DriveTo("haptic", clearance=clearance).run(rig.ctx, Pose2(8.0, 6.0, 0.0))
    while found is None:
        assert rig.n < 20 * HZ
        found = rig.tick(run, take_step)
        fastest = max(fastest, rig.base.twist.speed)

    assert found == outcome
    assert fastest <= environment.navigation.haptic.max_speed + 1e-9


@pytest.mark.requirement(51, 120)
@pytest.mark.parametrize(("width", "least"), [(4.4, 1.27), (5.2, 1.6)])
def test_a_close_drive_comes_near_to_the_user_only_where_there_is_no_room(
    environment: Environment, context: Any, take_step: Any, width: float, least: float
) -> None:
    """The user stands in the middle of a corridor, and the way leads past them."""
    room = Room(outer=((0.0, 0.0), (10.0, 0.0), (10.0, width), (0.0, width)))
    rig, user = Rig(replace(environment, room=room), context), Pose2(5.0, 0.5 * width)
    rig.ctx.values["user.pose"] = UserPose(user, 0.0)
    run = DriveTo("haptic", clearance="escape").run(rig.ctx, Pose2(8.0, 2.0, 0.0))
    nearest, found = 9.0, None
    while found is None:
        found = rig.tick(run, take_step)
        nearest = min(nearest, rig.base.pose.distance_to(user))

    assert found == "arrived"
    assert least - 0.01 <= nearest < least + 0.1
