"""What scans show and no map knows takes poses away and turns drives, and is cleared again."""

from __future__ import annotations

import math
import random
from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from behaviors.chase.chase_states import Approach
from behaviors.chase.make_room import MakeRoom
from behaviors.escape import escape_poses
from behaviors.escape.escape_states import DriveToBest
from behaviors.escape.paper_escape import DriveToFirst
from behaviors.profile.profile import Profile
from behaviors.signal_table import OBSTACLES, signals
from behaviors.situation.present_situation import Situation
from engine.interfaces import interface
from engine.run.context import LeafContext
from engine.signals.board import Board
from engine.signals.signal_kinds import closure, declare, roots
from engine.state import ALWAYS_NS, Action
from hw.geometry import STILL, Pose2, Pose3, Twist2
from hw.model.robot import RobotModel
from hw.safety.guarded import GuardedBase
from hw.safety.limits import SafetyLimits
from hw.samples import UserPose
from hw.scene.room import Point, Room
from hw.sim.sim_base import SimBase
from states.environment.environment import Environment
from states.navigation.drive import NO_PATH_S
from states.navigation.grid.scanned_obstacles import Obstacles
from states.navigation.states import DriveTo
from states.subsystems import SUBSYSTEMS
from tests.scans import scan_of

HALL = Room(outer=((0.0, 0.0), (16.0, 0.0), (16.0, 12.0), (0.0, 12.0)))
CORRIDOR = Room(outer=((0.0, 0.0), (16.0, 0.0), (16.0, 3.0), (0.0, 3.0)))
HZ = 30
POSES = ("escape.poses",)
PLANNERS = tuple(f"{name}.planner" for name in SUBSYSTEMS)
WANTED = (*POSES, *PLANNERS, "settings")
ROBOT, DEEP = Pose2(6.0, 6.0), Pose3.from_yaw(8.0, 6.0, 1.4, math.pi)
WALKER = UserPose(Pose2(4.2, 6.0, 0.0), 0.0)


def planning(profile: Profile, planner: str) -> Profile:
    """The profile, all of whose subsystems plan so."""
    navigation = profile.navigation
    for name in SUBSYSTEMS:
        subsystem = replace(navigation.named(name), planner=planner)
        navigation = replace(navigation, **{name: subsystem})
    return replace(profile, navigation=navigation)


class Watching:
    """A board, and what arrives at it in each tick."""

    def __init__(self, environment: Environment, profile: Profile, eager: bool = False) -> None:
        self.environment, self.tick = environment, 0
        self.board = Board(declare(signals(environment, profile.settings)), WANTED, eager)
        self.board.put("environment", environment, 0)
        self.board.put("settings", profile.settings, 0)

    @property
    def now(self) -> int:
        return self.tick * 10**9 // HZ

    def put(self, name: str, value: Any) -> None:
        self.board.put(name, value, self.now)

    def pass_time(self, *posts: Point, scanning: bool = True, robot: Pose2 = ROBOT) -> None:
        """A tick; a scanner sees these posts."""
        self.tick += 1
        self.put("base.pose", robot)
        self.put("user.pose", WALKER)
        if scanning:
            self.put("base.scan", scan_of(*posts, sensor=robot))
        self.board.begin(self.now)

    def read(self, name: str) -> Any:
        newest = self.board.slots[name].read()
        return None if newest is None else newest.value

    def free(self, name: str) -> set[Any]:
        return set(self.read(name))


@pytest.fixture
def watching(tuned: Profile, robot: RobotModel) -> Callable[..., Watching]:
    def make(planner: str = "theta_star", room: Room = HALL, eager: bool = False) -> Watching:
        profile = planning(tuned, planner)
        found = Watching(profile.environment(room, robot), profile, eager)
        found.put("vr.haptic_request", DEEP)
        return found

    return make


@pytest.mark.requirement(37, 77, 100, 105)
@pytest.mark.parametrize("planner", ["exact", "theta_star", "navfn"])
@pytest.mark.parametrize(
    ("name", "post"), [("escape.poses", (7.8, 6.4))],
)  # fmt: skip
def test_scans_take_poses_away_and_clearing_brings_them_back(
    watching: Callable[..., Watching], planner: str, name: str, post: Point
) -> None:
    seen = watching(planner)
    seen.pass_time(scanning=False)
    before = seen.free(name)

    seen.pass_time(post)
    during = seen.free(name)
    for _ in range(8):
        seen.pass_time()

    assert during < before
    assert during
    # all within Haptic's and Chase's 1 m or Escape's 0.77 m of what is seen of the post
    reach = 0.2 + seen.environment.navigation.named(name.partition(".")[0]).inflation + 0.15
    for place in before - during:
        x, y = (place.x, place.y) if isinstance(place, Pose2) else place[:2]
        assert math.dist((x, y), post) <= reach
    assert seen.free(name) == before


@pytest.mark.requirement(34)
@pytest.mark.parametrize("planner", ["exact", "theta_star", "navfn"])
def test_without_scans_all_is_as_the_room_says_and_as_fresh_as_the_poses(
    watching: Callable[..., Watching], planner: str
) -> None:
    seen = watching(planner)
    for _ in range(30):
        seen.pass_time(scanning=False)

    known, settings = seen.environment.static_planners, seen.read("settings")
    assert seen.read("escape.poses") == escape_poses.poses(settings, known["escape"], WALKER, ROBOT)
    stamps = {name: seen.board.slots[name].read().stamp for name in (*POSES, *PLANNERS)}
    assert stamps == {
        "escape.poses": seen.now,
        **dict.fromkeys(PLANNERS, ALWAYS_NS),
    }  # fmt: skip


@pytest.mark.parametrize("planner", ["exact", "theta_star"])
def test_planners_wait_for_no_scan_and_costmaps_are_there_only_for_those_on_cells(
    watching: Callable[..., Watching], planner: str
) -> None:
    board = watching(planner).board
    asked = {n for n in board.slots if n in ("base.scan", OBSTACLES) or n.endswith(".costmap")}
    costmaps = {f"{name}.costmap" for name in SUBSYSTEMS} if planner != "exact" else set()

    assert asked == {"base.scan", OBSTACLES} | costmaps
    assert roots(board.declared, PLANNERS) == set()


def test_where_nothing_scans_planners_rest_on_the_environment_alone(
    watching: Callable[..., Watching], tuned: Profile
) -> None:
    seen = watching("exact")
    declared = declare(signals(seen.environment, tuned.settings, scanning=False))
    assert set(closure(declared, PLANNERS)) == {"environment", *PLANNERS}


@pytest.mark.parametrize("planner", ["exact", "theta_star"])
def test_a_planner_is_made_anew_for_what_scans_show_and_not_for_a_pose(
    watching: Callable[..., Watching], planner: str
) -> None:
    seen, found = watching(planner), []
    for x, scanning in ((8.0, True), (8.0, False), (8.0, True), (8.2, True)):
        seen.pass_time((x, 6.0), scanning=scanning)
        found.append(seen.read("escape.planner"))
        assert seen.board.slots["escape.planner"].read().stamp == seen.now

    assert found[0] is found[1] is found[2]
    assert found[2] is not found[3]


@pytest.mark.parametrize("planner", ["exact", "theta_star"])
def test_the_same_poses_whoever_asks_when(watching: Callable[..., Watching], planner: str) -> None:
    chance = random.Random(4)
    lazy, eager = watching(planner), watching(planner, eager=True)
    for tick in range(40):
        posts = [(6.0 + chance.uniform(-2, 2), 6.0 + chance.uniform(-2, 2)) for _ in range(2)]
        for seen in (lazy, eager):
            robot = Pose2(6.0 + 0.01 * tick, 6.0, 0.02 * tick)
            seen.pass_time(*posts, scanning=tick % 3 == 0, robot=robot)

    for name in POSES:
        assert lazy.free(name) == eager.free(name)
        assert lazy.free(name)
        stamps = {seen.board.slots[name].read().stamp for seen in (lazy, eager)}
        assert len(stamps) == 1


class Drive:
    """A drive on a simulated base, among posts that only its scanner knows."""

    def __init__(self, seen: Watching, goal: Pose2, *posts: Point, silent_after: float) -> None:
        self.seen, self.posts = seen, posts
        self.silent_after = silent_after
        self.base = SimBase(seen.environment.robot, seen.environment.limits, Pose2(2.0, 1.5, 0.0))
        limits = SafetyLimits.of(seen.environment.robot, seen.environment.limits)
        self.guard = GuardedBase(self.base, replace(limits, watched=False))
        made = interface(DriveTo)
        leaf: Any = SimpleNamespace(path="drive", interface=made, commands=made.commands)
        seen.board = Board(seen.board.declared, made.reads)
        seen.put("environment", seen.environment)
        ctx = LeafContext(leaf, seen.board, {"base": self.guard}, print)
        self.run = DriveTo("chase").run(ctx, goal)
        self.nearest = math.inf

    def outcome(self, seconds: float) -> str | None:
        for _ in range(round(seconds * HZ)):
            seen, scanning = self.seen, self.seen.now <= self.silent_after * 1e9
            seen.tick += 1
            self.base.advance(seen.now)
            pose = self.base.pose
            for name, stamp, value in self.guard.samples(seen.now):
                seen.board.put(name, value, stamp)
            if scanning and seen.tick % 3 == 0:  # 10 Hz
                seen.put("base.scan", scan_of(*self.posts, sensor=pose))
            seen.board.begin(seen.now)
            for post in self.posts:
                self.nearest = min(self.nearest, math.dist(post, (pose.x, pose.y)))
            try:
                next(self.run)
            except StopIteration as end:
                return str(end.value)
            finally:
                self.guard.tick(seen.now)
        return None


@pytest.mark.requirement(38, 51, 101)
@pytest.mark.parametrize("planner", ["exact", "theta_star"])
@pytest.mark.few(1)
def test_a_drive_goes_round_what_its_scanner_sees(
    watching: Callable[..., Watching], planner: str
) -> None:
    post, goal = (7.0, 1.6), Pose2(12.0, 1.5, 0.0)
    nearest = {}
    for silent_after in (math.inf, -1.0):
        drive = Drive(watching(planner), goal, post, silent_after=silent_after)
        assert drive.outcome(30.0) == "arrived"
        nearest[silent_after] = drive.nearest

    assert nearest[math.inf] >= 1.2 - 0.06
    assert nearest[-1.0] < 0.2  # who does not see it runs through it


@pytest.mark.requirement(38, 51, 101)
@pytest.mark.parametrize("planner", ["exact", "theta_star"])
def test_a_drive_whose_way_a_scan_closes_ends_before_it(
    watching: Callable[..., Watching], planner: str
) -> None:
    drive = Drive(
        watching(planner, CORRIDOR), Pose2(12.0, 1.5, 0.0), (7.0, 1.5), silent_after=math.inf
    )

    assert drive.outcome(30.0) == "no_path"

    for n in range(30):  # released, the base brakes
        drive.base.advance(drive.seen.now + n * 10**8)
    assert drive.base.twist.speed < 1e-6
    assert math.dist((7.0, 1.5), (drive.base.pose.x, drive.base.pose.y)) >= 1.2 - 0.06


@pytest.mark.requirement(149)
def test_a_drive_is_lost_when_its_scanner_falls_silent(watching: Callable[..., Watching]) -> None:
    drive = Drive(watching(), Pose2(12.0, 1.5, 0.0), (7.0, 6.0), silent_after=1.0)

    assert drive.outcome(30.0) == "lost"

    assert 1.3 <= drive.seen.now * 1e-9 <= 1.5


class Wheel:
    """Takes down what drives it."""

    def __init__(self) -> None:
        self.command = STILL

    def use(self, _mode: str) -> None:
        pass

    def drive(self, command: Twist2, *_: Any) -> None:
        self.command = command

    def release(self, _source: str) -> None:
        self.command = STILL


class Vr:
    """A virtual world; what it shows is of no interest here."""

    def inform(self, show: bool, sign: bool = True, least: float = 0.0) -> None:
        """Nobody looks."""


def shown(environment: Environment, name: Any, marks: Any) -> Any:
    """A planner of this subsystem, scans having shown these cells of 5 m about the robot."""
    grid = environment.ground(0.05).grid
    corner = grid.cell(ROBOT.x - 2.475, ROBOT.y - 2.475)
    assert corner is not None
    rows, columns = np.nonzero(marks)
    cells = np.sort((rows + corner[0]) * grid.columns + columns + corner[1])
    return environment.planner_among(name, Obstacles(grid, cells, 1.0))


ACROSS = 0.05 * (np.arange(100) - 49.5)
CLOSED = np.abs(np.hypot(ACROSS, ACROSS[:, None]) - 1.5) < 0.2
POST = np.hypot(ACROSS + 1.6, ACROSS[:, None] - 0.3) < 0.1
"""A wall 1.3 m away all about the robot; a post 1.6 m behind it."""

FAR, NEAR = UserPose(Pose2(1.0, 6.0, 0.0), 0.0), UserPose(Pose2(3.6, 6.0, 0.0), 0.0)
DRIVES: list[tuple[Any, UserPose, dict[str, Any], str | None]] = [
    (DriveTo(), FAR, {"goal": Pose2(9.0, 6.0)}, "no_path"),
    (Approach(near=3.0), FAR, {}, "no_path"),
    (MakeRoom(room=3.0), NEAR, {}, None),
    (DriveToBest(earlier_by=0.2, wider_by=0.05), NEAR, {}, "no_way"),
    (DriveToFirst(), NEAR, {}, "no_way"),
]


@pytest.mark.requirement(38, 51)
@pytest.mark.parametrize("drive", DRIVES, ids=lambda drive: type(drive[0]).__name__)
def test_whoever_drives_goes_by_the_newest_scan(
    drive: tuple[Action, UserPose, dict[str, Any], str | None],
    tuned: Profile,
    robot: RobotModel,
    context: Any,
) -> None:
    state, user, inputs, outcome = drive
    rules = replace(tuned.settings.escape, distances=(1.75, 2.5))  # beyond the wall
    settings = replace(tuned.settings, escape=rules)
    environment, wheel = planning(tuned, "theta_star").environment(HALL, robot), Wheel()
    poses = escape_poses.poses(settings, environment.static_planners["escape"], user, ROBOT)
    values = {
        "environment": environment, "settings": settings, "base.pose": ROBOT, "base.twist": STILL,
        "user.pose": user, "user.velocity": Twist2(1.0), "arm.joints": None,
        "escape.poses": poses, "escape.safe": False, "base.mode": "omni",
    }  # fmt: skip
    ctx = context(values, {"base": wheel, "vr": Vr()})
    run = state.run(ctx, **inputs)

    next(run)
    assert wheel.command.speed > 0.01
    ctx.values |= {f"{name}.planner": shown(environment, name, CLOSED) for name in SUBSYSTEMS}
    if outcome is None:
        ctx.now += 10**9
        next(run)
    else:
        if isinstance(state, DriveTo):  # it brakes, and waits whether a way comes back
            next(run)
            assert wheel.command.speed < 1e-9
            ctx.now += round(1e9 * NO_PATH_S)
        with pytest.raises(StopIteration) as ended:
            next(run)
        assert ended.value.value == outcome

    assert wheel.command.speed < 1e-9


def test_who_approaches_goes_round_what_has_been_seen_by_now(
    tuned: Profile, robot: RobotModel, context: Any
) -> None:
    environment, wheel = planning(tuned, "theta_star").environment(HALL, robot), Wheel()
    values = {
        "environment": environment,
        "settings": tuned.settings, "base.pose": ROBOT, "base.twist": STILL,
        "user.pose": FAR, "user.velocity": STILL,
    }  # fmt: skip
    ctx = context(values, {"base": wheel})
    run = Approach(near=2.0).run(ctx)
    next(run)
    straight = wheel.command

    ctx.values["chase.planner"] = shown(environment, "chase", POST)
    next(run)

    assert abs(straight.vy) < 0.05 * straight.speed
    assert wheel.command.vy < -0.2 * wheel.command.speed


def test_an_escape_pose_is_kept_while_no_scan_comes(
    paper: Profile, situation_of: Callable[..., Situation], context: Any
) -> None:
    """Though a column has come between, and another pose would be the first by now."""
    column = ((8.8, 10.5), (9.2, 10.5), (9.2, 10.9), (8.8, 10.9))
    room = Room(outer=((0.0, 0.0), (20.0, 0.0), (20.0, 20.0), (0.0, 20.0)), columns=(column,))
    user = UserPose(Pose2(11.9, 9.0, math.pi), math.pi)
    now = situation_of(paper, Pose2(10.0, 9.0), user, room=room)
    poses = escape_poses.poses(now.settings, now.planners["escape"], now.user, now.pose)
    wheel = Wheel()
    values = {
        "environment": now.environment,
        "settings": now.settings, "base.pose": now.pose, "base.twist": STILL,
        "user.pose": now.user, "user.velocity": Twist2(-1.0), "arm.joints": None,
        "escape.poses": poses, "escape.safe": False,
    }  # fmt: skip
    ctx = context(values, {"base": wheel, "vr": Vr()})
    run = DriveToFirst().run(ctx)
    next(run)
    goal = next(pose for pose in poses if wheel.command.speed and _leads(wheel, now.pose, pose))

    here = Pose2(goal.x + 0.5, goal.y + 3.5)
    assert not now.planners["escape"].allows((here.x, here.y), (goal.x, goal.y))
    ctx.values |= {"base.pose": here, "escape.poses": poses[::-1]}
    next(run)

    assert _leads(wheel, here, goal)


def _leads(wheel: Wheel, here: Pose2, goal: Pose2) -> bool:
    command = wheel.command.rotated(here.yaw)
    bearing = math.atan2(command.vy, command.vx)
    return abs(bearing - math.atan2(goal.y - here.y, goal.x - here.x)) < 1e-6
