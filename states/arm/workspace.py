"""The arm in its room: planning queries of its states, and re-checks of a running trajectory."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from heapq import heappop, heappush

import numpy as np
from numpy.typing import NDArray

from hw import Joints, Pose2, Pose3, TimedJoints, example
from hw.model import MotionLimits, RobotModel, inverted
from states.arm.arm_separation import Brakes, Governor
from states.arm.arm_situation import (
    ARM_RADIUS,
    NOBODY,
    ArmSituation,
    PersonObstacles,
    cylinder,
    person_obstacles,
)
from states.arm.description import manipulator_of
from states.arm.destination import Destination
from states.arm.kinematics import (
    MARGIN,
    Array,
    CollisionChecker,
    Limb,
    Manipulator,
    Surroundings,
    Wall,
    WallSegments,
    deviation,
    edges_of,
    forward,
    inverse,
    inverse_near,
    jacobian,
    link_frames,
    nearest_copies,
    outline,
    pose_matrix,
    seen_from_above,
)
from states.arm.motion import first_contact, line_durations
from states.arm.planning import (
    TOUCH_SPEED,
    Plan,
    Query,
    Reach,
    ReachPlace,
    ToolLine,
    WayIn,
    around,
    disc,
    goals_at,
    moved_along,
    plan,
    rover_from_deep,
    rungs,
    tool_lines,
)

ACCEPTED = (0.02, 0.1)
"""A DEEP that is out of reach by less than this, m and rad, is met as closely as possible (R44)."""

EXACTLY = (0.001, 0.001)
"""The same for any other pose of the tool, m and rad: of rounding."""

CLOSE = 0.05
"""A tool nearer to the DEEP than this, m, goes straight there."""

DRAWN_BACK = 1.25
"""A tool that points at a user nearer than this, m, is drawn back before the arm folds."""

LADDER_BUDGET = 30_000
"""Joint sets checked for trees to one length of the line before the next is tried."""

PERIOD = 0.008
"""Time between points of a trajectory sent to the arm, s: the cycle of a UR controller (CB3)."""


@dataclass(frozen=True, slots=True, eq=False)
class Workspace:
    """One arm on its rover, among fixed walls, with its limits.

    `limits.approach` are the lengths of the line to a DEEP, m, tried in this order.
    `stop_deceleration` is that of the joints, rad/s2; with a `governor` the arm slows down for a
    person. Rover poses are ranked by the nominal arm, which is accurate enough for that.
    """

    arm: Manipulator
    limits: MotionLimits
    walls: Array
    parked: Joints
    stop_deceleration: float
    governor: bool = True

    @classmethod
    def of(
        cls,
        robot: RobotModel,
        limits: MotionLimits,
        walls: Sequence[Wall],
        *,
        governor: bool = True,
    ) -> Workspace:
        """The arm of a robot, from its file or its URDF.

        Raises:
            FileError: the URDF is wrong, or its arm is not the one that the robot file names.
            ValueError: the robot has no arm.
        """
        arm = manipulator_of(robot)
        assert robot.arm is not None
        assert robot.parked is not None
        deceleration = robot.arm.stop_deceleration
        return cls(arm, limits, edges_of(walls), robot.parked, deceleration, governor)

    def queries(self, situation: ArmSituation, to: Destination) -> Iterator[Query]:
        """The planning queries for a destination, best first; none if it is out of reach."""
        if to.deep is not None:
            return self.reaching(situation, to.deep)
        return self.parking(situation) if to.folds else self._going(situation, to)

    def _going(self, situation: ArmSituation, to: Destination) -> Iterator[Query]:
        """The query for a pose of the tool, or for joints."""
        if to.joints is not None:
            goals = np.array([to.joints])
        else:
            target = rover_from_deep(situation.base, to.tool(situation.base))
            goals = goals_at(self.arm, target, situation.joints, EXACTLY)
        if len(goals):
            yield self._query(self.checker(situation, escapes=False), situation, goals)

    def reaching(self, situation: ArmSituation, deep: Pose3) -> Iterator[Query]:
        """The planning queries for map_from_deep, best first; none if it is out of reach.

        Those with a line to the DEEP come first, by its length as in `limits.approach`, then the
        one that goes straight to the DEEP, which also a tool does that is there already.
        """
        target, joints = rover_from_deep(situation.base, deep), situation.joints
        goals = goals_at(self.arm, target, joints, ACCEPTED)
        if not len(goals):
            return
        tool = forward(self.arm, joints)
        if self.limits.approach and deviation(tool, target)[0] > CLOSE:
            lines = tool_lines(self.arm, goals, max(self.limits.approach))
            for length in self.limits.approach:
                query = self._approaching(situation, deep, lines, length)
                if query is not None:
                    yield query
        straight = self._query(self.checker(situation, deep), situation, goals)
        if self.limits.approach:
            straight = replace(straight, slow=around(self.arm, goals[0]))
            yield replace(
                straight, checker=self.checker(situation, deep, 0.0), budget=LADDER_BUDGET
            )
        yield straight

    def _approaching(
        self, situation: ArmSituation, deep: Pose3, lines: Sequence[ToolLine], length: float
    ) -> Query | None:
        """The query to the stand-offs of this distance, m; None if no line is so long."""
        reached = [line for line in lines if rungs(line, [length])]
        if not reached:
            return None
        return replace(
            self._query(
                self.checker(situation, deep, length),
                situation,
                np.array([line.at(length) for line in reached]),
            ),
            budget=LADDER_BUDGET,
            slow=around(self.arm, reached[0].knots[0]),
            ways_in=tuple(WayIn(line, length) for line in reached),
            beside=self.checker(situation, deep),
        )

    def governor_of(
        self, plan: Plan, situation: ArmSituation, deep: Pose3 | None, unsure: float = 0.0
    ) -> Governor | None:
        """What paces the arm along a plan beside the user, who may come later; None if unasked.

        Head and hands may be nearer than tracked by `unsure`, m.
        """
        if not self.governor:
            return None
        brakes = Brakes(self.stop_deceleration, self.limits.arm_acceleration)
        met = deep.flat() if deep is not None else self._tool_at(situation)
        made = Governor(
            self.arm, plan.trajectory, brakes, met, granted=deep is not None, unsure=unsure
        )
        if situation.user is not None:
            made.expect(situation.user)
        return made

    def detour(self, plan: Plan) -> str | None:
        """How a plan to a DEEP falls short of the line that is asked for; None if it does not."""
        if not self.limits.approach or plan.line > self.limits.approach[0] - 1e-6:
            return None
        if plan.line > 0.0:
            return f"the prop comes on a line of {plan.line * 100:.0f} cm only"
        return "no line to the DEEP is free: the prop comes straight to it, slowly"

    def _tool_at(self, situation: ArmSituation) -> Pose2:
        x, y = forward(self.arm, situation.joints)[:2, 3].tolist()
        return Pose2(*situation.base.transform(x, y))

    def missed(self, situation: ArmSituation, deep: Pose3) -> float:
        """Distance between the nearest branch and map_from_deep, m; obstacles do not count."""
        near = inverse_near(self.arm, rover_from_deep(situation.base, deep))
        return float(near.position_error.min())

    def parking(self, situation: ArmSituation) -> Iterator[Query]:
        """The planning queries for the parked joints, best first.

        A tool that points at a user near it is drawn back along its axis before anything else.
        """
        parked, checker = np.array([self.parked]), self.checker(situation)
        joints = np.array(situation.joints)
        slow = None
        if self.limits.approach and self._points_at(situation):
            (line,) = tool_lines(self.arm, joints[None], max(self.limits.approach))
            slow = around(self.arm, joints)
            for length in rungs(line, self.limits.approach):
                lead, start = line.outwards(length), line.at(length)
                if first_contact(checker, lead) is None:
                    yield replace(
                        self._query(checker, situation, parked),
                        start=start, lead=lead, slow=slow, budget=LADDER_BUDGET, beside=checker,
                    )  # fmt: skip
        yield replace(self._query(checker, situation, parked), slow=slow)

    def _points_at(self, situation: ArmSituation) -> bool:
        """True if the user is near the tool and on the side to which it points."""
        user = situation.user
        if user is None:
            return False
        tool = forward(self.arm, situation.joints)
        x, y = situation.base.inverse().transform(user.x, user.y)
        away = np.array((x, y)) - tool[:2, 3]
        return bool(-tool[:2, 0] @ away > 0.0 and math.hypot(*away) < DRAWN_BACK)

    def checker(
        self,
        situation: ArmSituation,
        deep: Pose3 | None = None,
        length: float | None = None,
        *,
        escapes: bool = True,
    ) -> CollisionChecker:
        """What the arm must not touch on its path to a DEEP or, without one, to anywhere else.

        With the `length` of a line to the DEEP: what it keeps from on its way to the stand-off.
        Where the arm is too near to that already, there are no gaps to head and hands and no room
        behind the DEEP, and a limb that it touches is left out; the governor still knows it.
        Without a DEEP, an arm that `escapes` leaves out other obstacles that it touches as well,
        the user first, then the walls: it has to get out of contact.
        """
        person = person_obstacles(situation, deep, length)
        checker = self._among(situation, self.walls, person)
        kept = person.limbs or person.walls
        if kept and self._gap(checker, situation) <= checker.margin:
            person = self._clear_of(person_obstacles(situation, deep), situation)
            checker = self._among(situation, self.walls, person)
        if deep is None and escapes:
            for walls, left in ((self.walls, person.slim()), (self.walls, NOBODY), ((), NOBODY)):
                if self._gap(checker, situation) > 0.0:
                    break
                checker = self._among(situation, walls, left)
        gap = self._gap(checker, situation)
        return replace(checker, margin=0.9 * gap) if 0.0 < gap < checker.margin else checker

    def _clear_of(self, person: PersonObstacles, situation: ArmSituation) -> PersonObstacles:
        """A person without the limbs that the arm touches."""
        clear = []
        for limb in person.limbs:
            checker = self._among(situation, (), PersonObstacles(limbs=(limb,)))
            if self._gap(checker, situation) > checker.margin:
                clear.append(limb)
        return PersonObstacles(person.cylinders, tuple(clear))

    def is_free(self, plan: Plan, since: float, situation: ArmSituation, to: Destination) -> bool:
        """True if a plan may still be followed from `since` s on in the present situation."""
        path, deep = plan.trajectory.path, to.deep
        place = float(plan.trajectory.along(np.array([since]))[0][0])
        beside = self.checker(situation, deep, escapes=to.folds)
        between = self.checker(situation, deep, plan.line) if plan.line > 0.0 else beside
        return (
            first_contact(beside, path, place, plan.leads) is None
            and first_contact(between, path, max(place, plan.leads), plan.lands) is None
            and first_contact(beside, path, max(place, plan.lands)) is None
        )

    def best(
        self,
        poses: Sequence[Pose2],
        drive_times: Sequence[float],
        deep: Pose3,
        user: Pose2 | None,
        tolerance: tuple[float, float],
    ) -> int | None:
        """Index of the pose from which the prop is soonest at the DEEP; None if none reaches it.

        Among poses that reach it from everywhere within the drive's tolerance (m, rad); without
        any, the pose that reaches it from the largest part of that disc (R76, R78, R79).
        """
        reach = Reach(self.arm, self.arm.nominal)
        place = ReachPlace(self.walls, [] if user is None else [cylinder(user, deep)])
        best, most = None, 0.0
        for i in self._soonest_first(poses, drive_times, deep, user):
            share = float(reach.reached(disc(poses[i], *tolerance), deep, place).mean())
            if share == 1.0:
                return i
            if best is None or share > most:
                best, most = i, share
        return best

    def reached(
        self, poses: Sequence[Pose2], deep: Pose3, *, walled: bool = False
    ) -> NDArray[np.bool_]:
        """True for rover poses from which the prop would reach map_from_deep with nobody there.

        In an empty room or, with `walled`, among the walls of this one.
        """
        place = ReachPlace(self.walls if walled else ())
        return Reach(self.arm, self.arm.nominal).reached(poses, deep, place)

    def held(self, deep: Pose3) -> tuple[Array, Array]:
        """Flange and prop with the prop at map_from_deep, whatever the rest of the arm does.

        Ends (k, 2, 3) of the axes of their capsules, in the map, and radii (k,) with the margin
        that the arm keeps from walls.
        """
        body, flange = self.arm.solid, pose_matrix(deep) @ inverted(self.arm.tip)
        last = body.links == self.arm.count
        return body.ends[last] @ flange[:3, :3].T + flange[:3, 3], body.radii[last] + MARGIN

    def _soonest_first(
        self,
        poses: Sequence[Pose2],
        drive_times: Sequence[float],
        deep: Pose3,
        user: Pose2 | None,
    ) -> Iterator[int]:
        """Indices of the poses that reach the DEEP, by the time until the prop is there.

        The arm's time is computed only for poses whose drive alone does not take longer.
        """
        due = list[tuple[float, int]]()
        for i in sorted(range(len(poses)), key=drive_times.__getitem__):
            while due and due[0][0] <= drive_times[i]:
                yield heappop(due)[1]
            time = drive_times[i] + self._arm_time(ArmSituation(poses[i], user, self.parked), deep)
            if time < math.inf:
                heappush(due, (time, i))
        while due:
            yield heappop(due)[1]

    def _arm_time(self, situation: ArmSituation, deep: Pose3) -> float:
        """Time to the DEEP by a free joint line to a stand-off and the line from it, s.

        An estimate: a stand-off counts if it is free and its branch leads to the DEEP (of the
        nominal chain). Without any the arm goes straight there.
        """
        drawn, start = self.arm.nominal, np.array(situation.joints)
        target = rover_from_deep(situation.base, deep)
        for length in (*self.limits.approach[:1], 0.0):
            if length > 0.0:
                both = inverse(drawn, np.stack([target, moved_along(target, length)]))
                goals = nearest_copies(drawn, both.joints[1][both.valid.all(axis=0)], start)
            else:
                goals = goals_at(drawn, target, start, ACCEPTED)
            goals = goals[self.checker(situation, deep, length).free(goals)]
            if len(goals):
                times = line_durations(drawn, start, goals, self.limits)
                return float(length / TOUCH_SPEED + times.min())
        return math.inf

    def _query(self, checker: CollisionChecker, situation: ArmSituation, goals: Array) -> Query:
        return Query(checker, self.limits, np.array(situation.joints), goals)

    def _among(
        self, situation: ArmSituation, walls: WallSegments, person: PersonObstacles
    ) -> CollisionChecker:
        if person.walls:
            walls = np.concatenate([edges_of(walls), person.walls])
        around = Surroundings.seen_from(situation.base, walls, person.cylinders, person.limbs)
        return CollisionChecker.of(self.arm, around)

    def _gap(self, checker: CollisionChecker, situation: ArmSituation) -> float:
        return checker.tightest(np.array(situation.joints))[0]


def waypoints(plan: Plan) -> tuple[TimedJoints, ...]:
    """Timed joints of a plan for `Arm.follow`; the last equals the goal exactly."""
    trajectory = plan.trajectory
    count = math.ceil(trajectory.duration / PERIOD)
    times = np.linspace(0.0, trajectory.duration, count + 1)
    joints = trajectory.at(times + trajectory.times[0])[0].tolist()
    return tuple(zip(times.tolist(), map(tuple, joints), strict=True))


@example
def _example(workspace: Workspace) -> None:
    arm, still = workspace.arm, np.zeros(workspace.arm.count)
    inverse(arm, forward(arm, still))
    goals_at(arm, forward(arm, still), still)
    jacobian(arm, still)
    link_frames(arm, still)
    checker = CollisionChecker.of(arm, Surroundings.empty())
    checker.clearance(still)
    checker.line_free(still, still)
    ends, radii = outline(arm, still)
    seen_from_above(ends, ends, radii, 0.5, 0.4, 1.0, 0.0)
    situation = ArmSituation(Pose2(0.0, 0.0), Pose2(1.85, 0.0), workspace.parked)
    deep = Pose3.from_yaw(1.0, 0.0, 1.2, math.pi)
    workspace.best([situation.base], [0.0], deep, situation.user, (0.1, 0.1))
    workspace.reached([situation.base], deep)
    start = np.array(workspace.parked)
    answer = plan(Query(checker, workspace.limits, start, start[None] + 0.01))
    assert isinstance(answer, Plan)  # it is hardly a motion
    governor = workspace.governor_of(answer, situation, deep)
    if governor is not None:
        hand = Limb((1.85, 0.0, 1.4), (1.2, 0.0, 1.2), ARM_RADIUS)
        governor.add_user_pose(0, Pose2(1.85, 0.0), (hand,))
        governor.pace(0, 0.0, 0.0, situation.base)
