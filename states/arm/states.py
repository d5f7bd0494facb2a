"""States that move the arm: planned, checked and followed in the room as it is (R43-R47)."""

from __future__ import annotations

from collections.abc import Generator, Iterable
from dataclasses import replace
from importlib.util import find_spec
from itertools import chain
from typing import TYPE_CHECKING, Annotated, Literal

from engine import NEVER_NS, Action, Context, On, Run, Until, Yielded
from engine.files import Angle, Duration
from engine.files.declared import ABOVE_0, FROM_0
from hw import Arm, ArmState, Pose3, needs
from states.arm.destination import FOLDED, Destination
from states.arm.following import (
    CORRECTIONS,
    LATE_S,
    MOVED,
    SLICES,
    SLOWEST,
    TURNED,
    Frame,
    in_map,
    is_at,
    refusal_of,
    stopped,
)
from states.arm.standing import Standing
from states.environment import (
    ARM_JOINTS,
    BASE_POSE,
    BASE_POSE_SIGMA,
    ENVIRONMENT,
    STOP_ENGAGED,
    USER_POSE,
    environment_of,
)

if TYPE_CHECKING:
    from states.arm.arm_separation import Governor
    from states.arm.arm_situation import ArmSituation
    from states.arm.planning import NoPlan, Plan, Query

AGE_S = 0.2
"""Greatest age of the signals that arm states read, s."""
READS: dict[str, float | None] = {
    ENVIRONMENT: None,
    BASE_POSE: AGE_S,
    BASE_POSE_SIGMA: AGE_S,
    ARM_JOINTS: AGE_S,
    USER_POSE: None,
    STOP_ENGAGED: None,
}
"""An untracked user is assumed to stand where last seen."""

SURE, SURE_YAW = 0.01, 0.005
"""Largest sigma of the base's pose to reach from, m and rad: it adds to the prop's error."""

Solver = Literal["lines_first", "rrt_connect", "ompl"]
"""Planners of `states.arm.planning.planning`; `ompl` needs the extra of that name."""


class ParkArm(Action):
    """Fold the arm within the bumper's outline, so that the base may drive (R46, R87).

    `{do: ParkArm, timeout: 15 s, next: {parked: drive, failed: .failed, timeout: .failed}}`.

    Args:
        tolerance: how far each joint may be off.
        solver: the planner; `ompl` needs the package of this name.

    Outcomes:
        parked: the arm is folded.
        failed: there is no free path, or the arm did not get there.
    """

    outcomes = ("parked", "failed")
    reads = READS
    optional = (USER_POSE,)
    commands = ("arm",)

    def __init__(
        self, tolerance: Annotated[Angle, ABOVE_0] = 0.01, solver: Solver = "lines_first"
    ) -> None:
        self.tolerance = tolerance
        self.solver = _installed(solver)

    def run(self, ctx: Context) -> Run:
        parked = environment_of(ctx).robot.parked
        assert parked is not None  # the chart commands an arm
        if is_at(ctx.value(ARM_JOINTS), parked, self.tolerance):
            return "parked"
        end = yield from _move(ctx, FOLDED, self.tolerance, self.solver)
        return "parked" if end == "there" else "failed"


class _MovesTool(Action):
    """Moves the tool to a pose that is given in a frame.

    Args:
        tolerance: how far each joint may be off.
        frame: what the pose is given in: the map, the rover (base_link on the floor), or the user
            (their pose on the floor when the state starts).
        solver: the planner; `ompl` needs the package of this name.
        settle: how long to wait for a pose of the base that is certain enough; not in the rover's
            frame.
    """

    reads = READS
    commands = ("arm",)

    def __init__(
        self,
        tolerance: Annotated[Angle, ABOVE_0] = 0.002,
        frame: Frame = "map",
        solver: Solver = "lines_first",
        settle: Annotated[Duration, FROM_0] = 2.0,
    ) -> None:
        self.tolerance = tolerance
        self.frame: Frame = frame
        self.settle = settle
        self.solver = _installed(solver)


class MoveArmTo(_MovesTool):
    """Move the tool to `goal` on a planned path that touches nothing.

    `{do: MoveArmTo, with: {frame: rover}, in: {goal: {x: 80 cm, y: 0 m, z: 90 cm}}, next: …}`.
    The tool is the point in the middle of what the arm holds, and points along -x of the goal:
    with `{x: 80 cm, y: 0 m, z: 90 cm, pitch: -90 deg}` in the frame `rover` it is 80 cm ahead of
    the robot's centre, 90 cm above the floor, and points straight down. Its way there is straight
    in the joints rather than in space.

    Args:
        goal: the pose of the tool in `frame`.

    Outcomes:
        arrived: the tool is at the goal.
        no_solution: the goal is out of the arm's reach.
        blocked: every path to it is obstructed, or the arm touches something to begin with.
        failed: the arm did not get there, the pose of the base stays too uncertain, or the user is
            not known.
    """

    outcomes = ("arrived", "no_solution", "blocked", "failed")
    optional = (USER_POSE,)

    def run(self, ctx: Context, goal: Pose3) -> Run:
        to = Destination(goal, on_rover=True)
        if self.frame != "rover":
            placed = yield from _placed(ctx, goal, self.frame, self.settle)
            if placed is None:
                return "failed"
            to = Destination(placed)
        end = yield from _move(ctx, to, self.tolerance, self.solver)
        return "arrived" if end == "there" else end


class MoveArmJoints(Action):
    """Move the joints to these angles, shoulder first, on a planned path that touches nothing.

    `{do: MoveArmJoints, with: {joints: [0, -90 deg, 90 deg, -90 deg, -90 deg, 0]}, next: …}`.
    Angles that the arm does not have, or too many or few of them, are an error.

    Args:
        joints: an angle for each joint, shoulder first.
        tolerance: how far each joint may be off.
        solver: the planner; `ompl` needs the package of this name.

    Outcomes:
        arrived: the joints are there.
        blocked: every path there is obstructed, or the arm touches something to begin with.
        failed: the arm did not get there.
    """

    outcomes = ("arrived", "blocked", "failed")
    reads = READS
    optional = (USER_POSE,)
    commands = ("arm",)

    def __init__(
        self,
        joints: tuple[Angle, ...],
        tolerance: Annotated[Angle, ABOVE_0] = 0.002,
        solver: Solver = "lines_first",
    ) -> None:
        self.joints, self.tolerance = joints, tolerance
        self.solver = _installed(solver)

    def run(self, ctx: Context) -> Run:
        model = environment_of(ctx).robot.arm
        assert model is not None  # the chart commands an arm
        model.check(self.joints)
        end = yield from _move(ctx, Destination(joints=self.joints), self.tolerance, self.solver)
        return "arrived" if end == "there" else end


class ReachDeep(_MovesTool):
    """Bring the prop to the DEEP from wherever the base stands (R47, R80, R84).

    The DEEP is given in `frame`, and is transformed into the map once, when the state starts.

    Args:
        deep: where the hand meets the prop, as `HapticRequest` outputs it.

    Outcomes:
        reached: the prop is at the DEEP.
        no_solution: the DEEP is out of the arm's reach.
        blocked: every path to it is obstructed, or the arm touches something to begin with.
        failed: the arm did not get there, the pose of the base stays too uncertain, or the user is
            not known.
    """

    outcomes = ("reached", "no_solution", "blocked", "failed")

    def run(self, ctx: Context, deep: Pose3) -> Run:
        placed = yield from _placed(ctx, deep, self.frame, self.settle)
        if placed is None:
            return "failed"
        to = Destination(placed, meets=True)
        end = yield from _move(ctx, to, self.tolerance, self.solver)
        return "reached" if end == "there" else end


class HoldProp(Action):
    """Hold the prop still until another state ends this one."""

    outcomes = ()
    commands = ("arm",)

    def run(self, ctx: Context) -> Run:
        while True:
            yield Until(NEVER_NS)


Moving = Generator[Yielded, None, Literal["there", "no_solution", "blocked", "failed"]]


def _placed(
    ctx: Context, pose: Pose3, frame: Frame, patience: float
) -> Generator[Yielded, None, Pose3 | None]:
    """The pose in the map, once the base is known well enough and the arm is at rest; else None."""
    if not (yield from _sure(ctx, patience)):
        return None
    situation = yield from _at_rest(ctx)
    return None if situation is None else in_map(situation, pose, frame)


def _sure(ctx: Context, patience: float) -> Generator[Yielded, None, bool]:
    """Wait for a base pose certain enough to reach from; False if it does not come in time."""
    until = ctx.after(patience)
    while True:
        sigma = ctx.value(BASE_POSE_SIGMA)
        if sigma is not None and sigma.position <= SURE and sigma.yaw <= SURE_YAW:
            return True
        if ctx.now >= until:
            known = "not known" if sigma is None else f"known within {sigma.position * 1e3:.0f} mm"
            yield f"the pose of the base is {known}, which is not enough to reach from"
            return False
        yield On(BASE_POSE_SIGMA, until=until)


def _installed(solver: Solver) -> Solver:
    """The name of a planner, if its package is installed."""
    if solver == "ompl" and find_spec("ompl") is None:
        raise ValueError(f"solver 'ompl' {needs('ompl')}")
    return solver


def _move(ctx: Context, to: Destination, tolerance: float, solver: str) -> Moving:
    """Move to a destination; replan whenever somebody steps into the path."""
    from states.arm.planning import NoPlan

    workspace, standing, corrections = environment_of(ctx).workspace, Standing(), 0
    while True:
        situation = yield from _at_rest(ctx)
        if situation is None:
            return "failed"
        if corrections:
            situation = replace(situation, base=standing.pose(situation.base))
        queries = workspace.queries(situation, to)
        first = next(queries, None)
        if first is None:
            off = workspace.missed(situation, to.tool(situation.base))
            yield f"{to.name} is {off:.3f} m out of reach"
            return "no_solution"
        plan = yield from _planned(chain([first], queries), solver)
        if isinstance(plan, NoPlan):
            yield plan.reason
            return "blocked"
        told = None if to.deep is None or corrections else workspace.detour(plan)
        if told is not None:
            yield told
        there = yield from _follow(ctx, plan, situation, to, tolerance, standing)
        left = to.stays and standing.has_left(situation.base, ctx.value(BASE_POSE_SIGMA))
        if there and left and corrections < CORRECTIONS:
            corrections += 1  # the base was still coming to rest, or its pose was noisy
        elif there is not None:
            return "there" if there else "failed"


def _at_rest(ctx: Context) -> Generator[Yielded, None, ArmSituation | None]:
    """The situation once the arm is at rest; None if the stop line or the arm forbids motion."""
    while ctx.value(STOP_ENGAGED) is None:
        arm = ctx.value(ARM_JOINTS)
        situation = _situation(ctx, arm)
        if situation is not None and arm is not None:
            refused = stopped(arm)
            if refused is not None:
                yield refused
                return None
            if not arm.moving:
                return situation
        yield On(ARM_JOINTS, BASE_POSE, USER_POSE, STOP_ENGAGED)
    return None


def _situation(ctx: Context, arm: ArmState | None) -> ArmSituation | None:
    from states.arm.arm_situation import ArmSituation

    base = ctx.value(BASE_POSE)
    if base is None or arm is None:
        return None
    return ArmSituation.of(base, ctx.value(USER_POSE), arm.joints)


def _planned(queries: Iterable[Query], solver: str) -> Generator[Yielded, None, Plan | NoPlan]:
    """Plan the first of these queries that has a plan, a few slices per tick."""
    from states.arm.planning import in_turn, planner

    work, slices = in_turn(queries, planner(solver)), 0
    while True:
        try:
            next(work)
        except StopIteration as done:
            answer: Plan | NoPlan = done.value
            return answer
        slices += 1
        if slices % SLICES == 0:
            yield None


def _follow(
    ctx: Context,
    plan: Plan,
    planned: ArmSituation,
    to: Destination,
    tolerance: float,
    standing: Standing,
) -> Generator[Yielded, None, bool | None]:
    """Follow a plan; True if the arm got there, False if not, None if its path is obstructed."""
    from states.arm.workspace import waypoints

    arm: Arm = ctx.part("arm")
    environment, points, checked = environment_of(ctx), waypoints(plan), planned
    workspace = environment.workspace
    governor = workspace.governor_of(plan, planned, to.deep, environment.user_margin)
    number = arm.follow(points) if len(points) > 1 else None
    since, before = 0.0, ctx.now
    try:
        while since < points[-1][0] + LATE_S and ctx.value(STOP_ENGAGED) is None:
            state, now = ctx.value(ARM_JOINTS), ctx.now
            situation = _situation(ctx, state)
            span, before = (now - before) * 1e-9, now
            if situation is not None:
                standing.add_base_pose(now, situation.base)
            if is_at(state, points[-1][1], tolerance):
                return True
            refused = refusal_of(state, number)
            if refused is not None:
                yield refused
                return False
            since += span * (1.0 if state is None else max(SLOWEST, state.scaling))
            if situation is not None and not situation.is_like(checked, MOVED, TURNED):
                checked = situation
                if not workspace.is_free(plan, since, situation, to):
                    return None
            if governor is not None and situation is not None and number is not None:
                _pace(ctx, arm, governor, situation, since, span)
            wait = points[-1][0] + LATE_S - since
            yield On(ARM_JOINTS, BASE_POSE, USER_POSE, STOP_ENGAGED, until=ctx.after(wait))
        return False
    finally:
        arm.stop()


def _pace(
    ctx: Context, arm: Arm, governor: Governor, situation: ArmSituation, since: float, span: float
) -> None:
    """Slow the arm down, or let it speed up, by where the person is and how fast they come."""
    seen = ctx.sample(USER_POSE)
    if seen is not None and seen.value is not None:
        governor.add_user_pose(seen.stamp, seen.value.body, situation.limbs())
    pace = governor.pace(ctx.now, since, span, situation.base)
    if pace is not None:
        arm.pace(*pace)
