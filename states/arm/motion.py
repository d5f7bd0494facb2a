"""The arm in its room: planning queries of its states, and re-checks of a running trajectory.

The user is the cylinder of R23, made slimmer where a DEEP has been granted: a DEEP nearer to the
user than half a metre would lie inside it.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from heapq import heappop, heappush

import numpy as np
from numpy.typing import NDArray

from hw.geometry import Pose2, Pose3, wrap
from hw.people.person import RADIUS
from hw.prop import JOINTS
from hw.robot import ArmModel, MotionLimits
from hw.samples import Joints, TimedJoints
from states.arm.collision import MARGIN, CollisionChecker, CollisionModel, Cylinder, Surroundings
from states.arm.inverse import inverse_near
from states.arm.kernels import Array
from states.arm.kinematics import KinematicChain, inverted, pose_matrix
from states.arm.model import Manipulator, six
from states.arm.path import first_contact
from states.arm.planning import Plan, Query, goals_at, warm_up
from states.arm.reach import Reach, ReachPlace, disc, rover_from_deep
from states.arm.timing import line_durations
from states.arm.trajectory import ArmLimits, Trajectory

ACCEPTED = (0.02, 0.1)
"""A DEEP that is out of reach by less than this, m and rad, is met as closely as possible (R44)."""

USER_HEIGHT = 2.0
"""Height of the user's cylinder, m."""
TOUCH_GAP = 0.15
"""Gap between the user's cylinder and a granted DEEP, m; the arm comes from the other side."""
SLIMMEST = 0.25
"""Least radius of the slimmed cylinder, m: a person's body."""

PERIOD = 0.008
"""Time between points of a trajectory sent to the arm, s: the cycle of a UR controller (CB3)."""

Wall = tuple[float, float, float, float]


@dataclass(frozen=True, slots=True)
class ArmSituation:
    """map_from_base, the user's body in the map (None: unknown), and the joints at rest."""

    base: Pose2
    user: Pose2 | None
    joints: Joints

    def is_like(self, other: ArmSituation, distance: float, turn: float) -> bool:
        """True if base and user have moved less than this, m and rad; joints do not count."""
        if (self.user is None) != (other.user is None):
            return False
        near = self.base.distance_to(other.base) < distance
        if self.user is not None and other.user is not None:
            near = near and self.user.distance_to(other.user) < distance
        return near and abs(wrap(self.base.yaw - other.base.yaw)) < turn


@dataclass(frozen=True, slots=True, eq=False)
class Workspace:
    """One arm on its rover, among fixed walls, with its limits.

    `nominal` is the chain of the maker's drawing: accurate enough to rank rover poses, and ten
    times faster to invert than a calibrated one.
    """

    chain: KinematicChain
    nominal: KinematicChain
    solid: CollisionModel
    limits: ArmLimits
    walls: Sequence[Wall]
    parked: Joints

    @classmethod
    def of(
        cls, model: Manipulator, arm: ArmModel, limits: MotionLimits, walls: Sequence[Wall]
    ) -> Workspace:
        """The arm of a model with the speeds and the parked pose of a robot file."""
        jerk = limits.arm_jerk if math.isfinite(limits.arm_jerk) else None
        even = ArmLimits.even(six(arm.max_speed), limits.arm_acceleration, limits.tool_speed, jerk)
        chain, nominal = KinematicChain.of(model), KinematicChain.of(model.calibrated(None))
        return cls(chain, nominal, CollisionModel.of(model), even, walls, arm.parked)

    def reaching(self, situation: ArmSituation, deep: Pose3) -> Query:
        """The planning query for map_from_deep; without goals if that is out of reach."""
        goals = goals_at(
            self.chain, rover_from_deep(situation.base, deep), situation.joints, ACCEPTED
        )
        return self._query(self.checker(situation, deep), situation, goals)

    def missed(self, situation: ArmSituation, deep: Pose3) -> float:
        """Distance between the nearest branch and map_from_deep, m; obstacles do not count."""
        near = inverse_near(self.chain, rover_from_deep(situation.base, deep))
        return float(near.position_error.min())

    def parking(self, situation: ArmSituation) -> Query:
        """The planning query for the parked joints."""
        return self._query(self.checker(situation), situation, np.array([self.parked]))

    def checker(self, situation: ArmSituation, deep: Pose3 | None = None) -> CollisionChecker:
        """What the arm must not touch on its path to a DEEP or, without one, to the parked pose.

        On the path back, obstacles that the arm touches already are left out, the user first, then
        the walls: it has to get out of contact.
        """
        people = [] if situation.user is None else [_person(situation.user, deep)]
        checker = self._among(situation, self.walls, people)
        if deep is None and people and self._gap(checker, situation) <= 0.0:
            checker = self._among(situation, self.walls, [])
        if deep is None and self._gap(checker, situation) <= 0.0:
            checker = self._among(situation, (), [])
        gap = self._gap(checker, situation)
        return replace(checker, margin=0.9 * gap) if 0.0 < gap < checker.margin else checker

    def is_free(
        self, trajectory: Trajectory, since: float, situation: ArmSituation, deep: Pose3 | None
    ) -> bool:
        """True if a trajectory may still be followed from `since` s on in the present situation."""
        place = float(trajectory.along(np.array([since]))[0][0])
        return first_contact(self.checker(situation, deep), trajectory.path, place) is None

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
        reach = Reach(self.nominal, self.solid)
        place = ReachPlace(self.walls, [] if user is None else [_person(user, deep)])
        best, most = None, 0.0
        for i in self._soonest_first(poses, drive_times, deep, user):
            share = float(reach.reached(disc(poses[i], *tolerance), deep, place).mean())
            if share == 1.0:
                return i
            if best is None or share > most:
                best, most = i, share
        return best

    def reached(self, poses: Sequence[Pose2], deep: Pose3) -> NDArray[np.bool_]:
        """True for rover poses from which the prop would reach map_from_deep in an empty room."""
        return Reach(self.nominal, self.solid).reached(poses, deep, ReachPlace())

    def held(self, deep: Pose3) -> tuple[Array, Array]:
        """Flange and prop with the prop at map_from_deep, whatever the rest of the arm does.

        Ends (k, 2, 3) of the axes of their capsules, in the map, and radii (k,) with the margin
        that the arm keeps from walls.
        """
        body, flange = self.solid.body, pose_matrix(deep) @ inverted(self.nominal.tip)
        last = body.links == JOINTS
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
        drawn, due = replace(self, chain=self.nominal), list[tuple[float, int]]()
        for i in sorted(range(len(poses)), key=drive_times.__getitem__):
            while due and due[0][0] <= drive_times[i]:
                yield heappop(due)[1]
            time = drive_times[i] + drawn._arm_time(ArmSituation(poses[i], user, self.parked), deep)
            if time < math.inf:
                heappush(due, (time, i))
        while due:
            yield heappop(due)[1]

    def _arm_time(self, situation: ArmSituation, deep: Pose3) -> float:
        query = self.reaching(situation, deep)
        goals = query.goals[query.checker.free(query.goals)] if len(query.goals) else query.goals
        if not len(goals):
            return math.inf
        return float(line_durations(self.chain, query.start, goals, self.limits).min())

    def _query(self, checker: CollisionChecker, situation: ArmSituation, goals: Array) -> Query:
        return Query(self.chain, checker, self.limits, np.array(situation.joints), goals)

    def _among(
        self, situation: ArmSituation, walls: Sequence[Wall], people: Sequence[Cylinder]
    ) -> CollisionChecker:
        return CollisionChecker.of(
            self.solid, Surroundings.seen_from(situation.base, walls, people)
        )

    def _gap(self, checker: CollisionChecker, situation: ArmSituation) -> float:
        return checker.tightest(np.array(situation.joints))[0]

    def warm_up(self, model: Manipulator) -> None:
        """Compile what moving the arm needs, so that no control tick does."""
        warm_up(model)
        situation = ArmSituation(Pose2(0.0, 0.0), Pose2(1.85, 0.0), self.parked)
        deep = Pose3.from_yaw(1.0, 0.0, 1.2, math.pi)
        self.best([situation.base], [0.0], deep, situation.user, (0.1, 0.1))
        self.reached([situation.base], deep)


def waypoints(plan: Plan) -> tuple[TimedJoints, ...]:
    """Timed joints of a plan for `Arm.follow`; the last equals the goal exactly."""
    trajectory = plan.trajectory
    count = math.ceil(trajectory.duration / PERIOD)
    times = np.linspace(0.0, trajectory.duration, count + 1)
    joints = trajectory.at(times + trajectory.times[0])[0].tolist()
    return tuple((t, tuple(q)) for t, q in zip(times.tolist(), joints, strict=True))


def _person(user: Pose2, deep: Pose3 | None) -> Cylinder:
    radius = RADIUS
    if deep is not None:
        granted = user.distance_to(deep.flat()) - TOUCH_GAP
        radius = min(RADIUS, max(SLIMMEST, granted))
    return Cylinder(user.x, user.y, radius, USER_HEIGHT)
