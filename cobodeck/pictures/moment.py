"""What a picture shows of robot and user at one instant: at the start of a scene, or in a run."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from itertools import islice
from typing import cast, get_args

from behaviors.chase import best_cell, space, tangent_yaw
from behaviors.chase_space import grid
from behaviors.haptic import best_pose, poses, reachable
from behaviors.settings import Settings
from behaviors.situation import Situation
from cobodeck.options import Options
from cobodeck.plants import Plant
from cobodeck.stage import stage
from cobodeck.wiring import Setup
from engine.board import Board
from engine.machine import Leaf
from engine.run import ChartRun
from hw.geometry import STILL, Pose2, Pose3, wrap
from hw.room import Point
from hw.samples import UserPose
from hw.scene import Scene
from states.environment import Environment
from states.navigation.interfaces import GlobalPlanner
from states.navigation.states import user_disc
from states.subsystems import SubsystemName

TRAIL_S = 3.0
"""For so long the ways that robot and user have come are drawn, s."""


@dataclass(frozen=True, slots=True)
class Moment:
    """Poses are map_from_base and the user's in the map; `path` leads the robot to its goal, m.

    `deep` is where the user reaches, while they ask for a touch. Trails begin at the oldest place.
    """

    robot: Pose2
    user: UserPose | None = None
    deep: Pose3 | None = None
    path: tuple[Point, ...] = ()
    robot_trail: tuple[Point, ...] = ()
    user_trail: tuple[Point, ...] = ()
    caption: str = ""


def at_start(scene: Scene) -> Moment:
    """The poses of the scene's file; a scene without a user's start shows no user."""
    start = scene.user_start
    return Moment(scene.robot_start, None if start is None else UserPose(start, start.yaw))


def with_next_drive(moment: Moment, environment: Environment, settings: Settings) -> Moment:
    """The moment with the way to where Haptic, or else Chase, would send the robot now."""
    if moment.user is None:
        return moment
    planners = environment.static_planners
    now = Situation(environment, settings, moment.robot, STILL, moment.user, STILL, planners)
    goal: Pose2 | None
    if moment.deep is not None:
        free = poses(settings, planners["haptic"], moment.deep)
        goal = best_pose(now, reachable(now, free), moment.deep)
        return replace(moment, path=_path(environment, "haptic", planners["haptic"], moment, goal))
    cells = grid(environment, settings)
    around = space(settings, lambda: cells, planners["chase"], moment.user)
    place = best_cell(now, around)
    goal = None if place is None else Pose2(*place, tangent_yaw(around.centre, place, 0.0))
    return replace(moment, path=_path(environment, "chase", planners["chase"], moment, goal))


class _Trail:
    """Where robot and user have been in the last `TRAIL_S`; an observer of a loop."""

    def __init__(self, plant: Plant) -> None:
        self._plant = plant
        self._places: deque[tuple[int, Pose2, Pose2 | None]] = deque()

    def watch(self, now_ns: int) -> None:
        truth, places = self._plant.truth, self._places
        if truth is not None and truth.base is not None:
            places.append((now_ns, truth.base, truth.body))
        while places and places[0][0] < now_ns - round(TRAIL_S * 1e9):
            places.popleft()

    @property
    def robot(self) -> tuple[Point, ...]:
        return tuple((pose.x, pose.y) for _, pose, _ in self._places)

    @property
    def user(self) -> tuple[Point, ...]:
        return tuple((body.x, body.y) for _, _, body in self._places if body is not None)


def after(
    setup: Setup, options: Options, seconds: float, progress: Callable[[str], None] | None = None
) -> Moment:
    """The moment after simulating so long, or at the end of a run that ends before."""
    loop = stage(setup, options)
    trail = _Trail(loop.plant)
    loop.observers = (*loop.observers, trail)
    loop.go(loop.grid.instant(loop.grid.last(round(seconds * 1e9))), progress)
    run = loop.wired.run
    running = [node.leaf for node in run.running]
    truth = loop.plant.truth
    assert truth is not None
    assert truth.base is not None
    moment = Moment(
        robot=truth.base,
        user=None
        if truth.body is None
        else UserPose(truth.body, wrap(truth.body.yaw + truth.head_turn)),
        deep=truth.request,
        robot_trail=trail.robot,
        user_trail=trail.user,
        caption=f"{loop.now_ns * 1e-9:.1f} s, {_doing(running, loop.wired.run.outcome)}",
    )
    for subsystem, goal in islice(_drives(run), 1):
        planner = _planner(setup.environment, subsystem, loop.wired.board)
        moment = replace(moment, path=_path(setup.environment, subsystem, planner, moment, goal))
    return moment


def _planner(environment: Environment, subsystem: SubsystemName, board: Board) -> GlobalPlanner:
    """The one that the run goes by."""
    slot = board.slots.get(f"{subsystem}.planner")
    newest = None if slot is None else slot.read()
    return environment.static_planners[subsystem] if newest is None else newest.value


def _drives(run: ChartRun) -> Iterable[tuple[SubsystemName, Pose2]]:
    """Goals under way, and which subsystem drives there."""
    for node in run.running:
        inputs = run.life.inputs_of(node.leaf)
        subsystem = node.leaf.parameters.get("subsystem")
        if isinstance(inputs.get("goal"), Pose2) and subsystem in get_args(SubsystemName):
            yield cast("SubsystemName", subsystem), inputs["goal"]


def _path(
    environment: Environment,
    subsystem: SubsystemName,
    planner: GlobalPlanner,
    moment: Moment,
    goal: Pose2 | None,
) -> tuple[Point, ...]:
    if goal is None:
        return ()
    here, there = (moment.robot.x, moment.robot.y), (goal.x, goal.y)
    disc = user_disc(moment.user, environment.navigation.named(subsystem))
    path = planner.plan(here, there, disc)
    return () if path is None else path.points


def _doing(leaves: Iterable[Leaf], outcome: str | None) -> str:
    """The actions under way, or how the run has ended; where it only waits, in which node."""
    if outcome is not None:
        return f"ended: {outcome}"
    leaves = list(leaves)
    acting = [leaf.path for leaf in leaves if not leaf.monitor]
    waiting = sorted(
        (leaf.parent.path for leaf in leaves if leaf.parent is not None),
        key=lambda path: -path.count("/"),
    )
    return ", ".join(acting or waiting[:1]) or "nothing under way"
