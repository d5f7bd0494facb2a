"""Robot and user at one instant, for a picture: at the start of a scene, or in a run."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from itertools import islice
from typing import cast, get_args

from behaviors import first_pose, poses, reachable, soonest_pose
from behaviors.chase import chase_cell, chase_place, tangent_yaw
from behaviors.profile import Settings
from behaviors.situation import ChaseRing, Situation
from cobodeck.loop import Plant
from cobodeck.run import stage
from cobodeck.setup import Options, Setup
from engine.machine import Leaf
from engine.run import ChartRun
from engine.signals import Board
from hw import STILL, Joints, Pose2, Pose3, Twist2, UserPose, wrap
from hw.scene import Point, Scene
from states import SubsystemName
from states.environment import Environment
from states.navigation import GlobalPlanner, user_disc

TRAIL_S = 3.0
"""Duration of the past paths of robot and user that are drawn, s."""


@dataclass(frozen=True, slots=True)
class Moment:
    """Robot and user at one instant; poses and positions in the map, m and rad.

    `path` leads the robot to `goal`. `deep` is where the user reaches during a request. Trails
    begin at the oldest place. `joints` are the arm's, rad; without them no arm is drawn. `twist` is
    the robot's velocity in the base frame, `velocity` the user's in the map.
    """

    robot: Pose2
    user: UserPose | None = None
    deep: Pose3 | None = None
    path: tuple[Point, ...] = ()
    robot_trail: tuple[Point, ...] = ()
    user_trail: tuple[Point, ...] = ()
    caption: str = ""
    joints: Joints | None = None
    goal: Pose2 | None = None
    twist: Twist2 = STILL
    velocity: Twist2 = STILL


def at_start(scene: Scene, joints: Joints | None = None) -> Moment:
    """The poses in the scene's file; a scene without a start pose of the user shows no user."""
    start = scene.user_start
    user = None if start is None else UserPose(start, start.yaw)
    return Moment(scene.robot_start, user, joints=joints)


def with_next_drive(moment: Moment, environment: Environment, settings: Settings) -> Moment:
    """The moment with the path to the goal that Haptic, otherwise Chase, would choose first."""
    if moment.user is None:
        return moment
    planners = environment.static_planners
    now = situation_at(moment, moment.user, environment, settings)
    if moment.deep is not None:
        free = poses(settings, planners["haptic"], moment.deep)
        goal = (
            first_pose(now, free)
            if settings.policy == "paper"
            else soonest_pose(now, reachable(now, "haptic", free), moment.deep)
        )
        return _driving(moment, environment, "haptic", planners["haptic"], goal)
    ring, chase = ChaseRing.of(settings.chase), settings.chase
    if settings.policy == "paper":
        place = chase_cell(now, ring, chase.best_angle, chase.best_radius)
    else:
        place = chase_place(now, ring)
    goal = None if place is None else Pose2(*place, tangent_yaw(now.user.body, place, 0.0))
    return _driving(moment, environment, "chase", planners["chase"], goal)


def situation_at(
    moment: Moment, user: UserPose, environment: Environment, settings: Settings
) -> Situation:
    """The moment as the states' situation."""
    planners = environment.static_planners
    return Situation(
        environment, settings, moment.robot, moment.twist, user, moment.velocity, planners
    )


class _Trail:
    """An observer of a loop that keeps where robot and user were in the last `TRAIL_S`."""

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

    @property
    def twist(self) -> Twist2:
        """The robot's velocity over the last tick, base frame."""
        if len(self._places) < 2:
            return STILL
        (start, before, _), (end, now, _) = self._places[-2], self._places[-1]
        moved, per_s = before.inverse() @ now, 1e9 / (end - start)
        return Twist2(per_s * moved.x, per_s * moved.y, per_s * moved.yaw)

    @property
    def velocity(self) -> Twist2:
        """The user's velocity over the last tick, in the map."""
        if len(self._places) < 2:
            return STILL
        (start, _, before), (end, _, now) = self._places[-2], self._places[-1]
        if before is None or now is None:
            return STILL
        per_s = 1e9 / (end - start)
        turn = wrap(now.yaw - before.yaw)
        return Twist2(per_s * (now.x - before.x), per_s * (now.y - before.y), per_s * turn)


def after(
    setup: Setup, options: Options, seconds: float, progress: Callable[[str], None] | None = None
) -> Moment:
    """The moment after simulating for `seconds`, or at the end of a run that ends earlier."""
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
        joints=truth.joints,
        twist=trail.twist,
        velocity=trail.velocity,
        caption=f"{loop.now_ns * 1e-9:.1f} s, {_doing(running, loop.wired.run.outcome)}",
    )
    for subsystem, goal in islice(_drives(run), 1):
        planner = _planner(setup.environment, subsystem, loop.wired.board)
        moment = _driving(moment, setup.environment, subsystem, planner, goal)
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


def _driving(
    moment: Moment,
    environment: Environment,
    subsystem: SubsystemName,
    planner: GlobalPlanner,
    goal: Pose2 | None,
) -> Moment:
    """The moment with a goal and the path there, if there is a goal."""
    if goal is None:
        return moment
    here, there = (moment.robot.x, moment.robot.y), (goal.x, goal.y)
    disc = user_disc(moment.user, environment.navigation.named(subsystem))
    path = planner.plan(here, there, disc)
    return replace(moment, goal=goal, path=() if path is None else path.points)


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
