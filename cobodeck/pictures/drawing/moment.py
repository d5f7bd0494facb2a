"""The moment that a picture shows: at the start of a scene, or in a run."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from itertools import islice
from typing import cast, get_args

from behaviors import first_pose, poses, reachable, soonest_pose
from behaviors.chase import chase_cell, chase_place, tangent_yaw
from behaviors.profile import Settings
from behaviors.situation import ChaseRing
from cobodeck.loop import Plant
from cobodeck.run import stage
from cobodeck.setup import Options, Setup
from cobodeck.shapes import Moment, Trail, situation_at, with_drive
from engine.machine import Leaf
from engine.run import ChartRun
from engine.signals import Board
from hw import Joints, Pose2, UserPose
from hw.scene import Scene
from states import SubsystemName
from states.environment import Environment
from states.navigation import GlobalPlanner


def at_start(scene: Scene, joints: Joints | None = None) -> Moment:
    """The poses in the scene's file; a scene without a start pose of the user shows no user."""
    start = scene.user_start
    user = None if start is None else UserPose(start, start.yaw)
    return Moment(scene.robot_start, user, joints=joints)


def with_next_drive(moment: Moment, environment: Environment, settings: Settings) -> Moment:
    """The moment with the path to the goal that Haptic, otherwise Chase, would choose first."""
    subsystem: SubsystemName = "chase" if moment.deep is None else "haptic"
    now = situation_at(moment, environment, settings)
    if now is None:
        return moment
    goal: Pose2 | None
    if moment.deep is not None:
        free = poses(settings, now.planners["haptic"], moment.deep)
        if settings.policy == "paper":
            goal = first_pose(now, free)
        else:
            goal = soonest_pose(now, reachable(now, "haptic", free), moment.deep)
    else:
        ring, chase = ChaseRing.of(settings.chase), settings.chase
        if settings.policy == "paper":
            place = chase_cell(now, ring, chase.best_angle, chase.best_radius)
        else:
            place = chase_place(now, ring)
        goal = place and Pose2(*place, tangent_yaw(now.user.body, place, 0.0))
    return with_drive(moment, environment, subsystem, goal)


@dataclass(frozen=True, slots=True)
class _Followed:
    """An observer of a loop that keeps its trail."""

    plant: Plant
    trail: Trail

    def watch(self, now_ns: int) -> None:
        if self.plant.truth is not None:
            self.trail.add(now_ns, self.plant.truth)


def after(
    setup: Setup, options: Options, seconds: float, progress: Callable[[str], None] | None = None
) -> Moment:
    """The moment after simulating for `seconds`, or at the end of a run that ends earlier."""
    loop, trail = stage(setup, options), Trail()
    loop.observers = (*loop.observers, _Followed(loop.plant, trail))
    loop.go(loop.grid.instant(loop.grid.last(round(seconds * 1e9))), progress)
    run = loop.wired.run
    running = [node.leaf for node in run.running]
    caption = f"{loop.now_ns * 1e-9:.1f} s, {_doing(running, run.outcome)}"
    moment = replace(trail.moment(), caption=caption)
    for subsystem, goal in islice(_drives(run), 1):
        planner = _planner(setup.environment, subsystem, loop.wired.board)
        moment = with_drive(moment, setup.environment, subsystem, goal, planner)
    return moment


def _planner(environment: Environment, subsystem: SubsystemName, board: Board) -> GlobalPlanner:
    """The planner that the run uses for a subsystem."""
    slot = board.slots.get(f"{subsystem}.planner")
    newest = None if slot is None else slot.read()
    return environment.static_planners[subsystem] if newest is None else newest.value


def _drives(run: ChartRun) -> Iterable[tuple[SubsystemName, Pose2]]:
    """Goals of running drives, and the subsystem whose distances each keeps."""
    for node in run.running:
        inputs = run.life.inputs_of(node.leaf)
        given = node.leaf.parameters
        keeping = given.get("clearance", "own")
        subsystem = given.get("subsystem") if keeping == "own" else keeping
        if isinstance(inputs.get("goal"), Pose2) and subsystem in get_args(SubsystemName):
            yield cast("SubsystemName", subsystem), inputs["goal"]


def _doing(leaves: Iterable[Leaf], outcome: str | None) -> str:
    """The running actions, or the outcome of the run; if it only waits, the node that waits."""
    if outcome is not None:
        return f"ended: {outcome}"
    leaves = list(leaves)
    acting = [leaf.path for leaf in leaves if not leaf.monitor]
    waiting = sorted(
        (leaf.parent.path for leaf in leaves if leaf.parent is not None),
        key=lambda path: -path.count("/"),
    )
    return ", ".join(acting or waiting[:1]) or "nothing under way"
