"""Robot and user at one instant: at the start of a scene, in a run, or on record."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import lru_cache
from math import hypot
from typing import TYPE_CHECKING

from behaviors.profile import Settings
from behaviors.situation import Situation
from hw import STILL, Joints, Pose2, Pose3, Scan, Truth, Twist2, UserPose, wrap
from hw.scene import Point
from states import SUBSYSTEMS, SubsystemName
from states.environment import Environment
from states.navigation import GlobalPlanner, user_disc

if TYPE_CHECKING:
    from states.navigation.grid import Obstacles

TRAIL_S = 3.0
"""Duration of the past paths of robot and user that are drawn, s."""


@dataclass(frozen=True, slots=True)
class Moment:
    """Robot and user at one instant, as far as known; poses and positions in the map, m and rad.

    Attributes:
        deep: where the user reaches during a request.
        path: leads the robot to `goal`; `subsystem` keeps its distances.
        robot_trail: past places, the oldest first; `user_trail` likewise.
        joints: the arm's, rad; without them no arm is drawn.
        twist: the robot's velocity in the base frame; `velocity` is the user's, in the map.
        at_s: time in the run, by which objects appear and walk; None: they are where they begin.
        scans: the newest of each scanner, each with map_from_base at its time.
        obstacles: what scans have shown; None: planners know map or room alone.
    """

    robot: Pose2 | None = None
    user: UserPose | None = None
    deep: Pose3 | None = None
    path: tuple[Point, ...] = ()
    robot_trail: tuple[Point, ...] = ()
    user_trail: tuple[Point, ...] = ()
    caption: str = ""
    joints: Joints | None = None
    goal: Pose2 | None = None
    subsystem: SubsystemName | None = None
    twist: Twist2 = STILL
    velocity: Twist2 = STILL
    at_s: float | None = None
    scans: tuple[tuple[Pose2, Scan], ...] = ()
    obstacles: Obstacles | None = None


class MomentTrail:
    """Makes moments of what is known tick by tick, with the paths that led there.

    Args:
        lasting_s: the duration of these paths, s.
        apart_m: the least distance between their points, m.
    """

    def __init__(self, lasting_s: float = TRAIL_S, apart_m: float = 0.0) -> None:
        self._lasting_ns, self._apart = round(lasting_s * 1e9), apart_m
        self._seen: deque[tuple[int, Truth]] = deque()

    def add(self, now_ns: int, truth: Truth) -> None:
        """Take what is true, or measured, at an instant after the last one."""
        self._seen.append((now_ns, truth))
        while self._seen[0][0] < now_ns - self._lasting_ns:
            self._seen.popleft()

    def moment(self) -> Moment:
        """The moment of the last instant; velocities are those since the one before."""
        if not self._seen:
            return Moment()
        now_ns, truth = self._seen[-1]
        before_ns, before = self._seen[-2] if len(self._seen) > 1 else (0, Truth())
        per_s, body = 1e9 / max(1, now_ns - before_ns), truth.body
        robots = (truth.base for _, truth in reversed(self._seen))
        users = (truth.body for _, truth in reversed(self._seen))
        return Moment(
            truth.base,
            None if body is None else UserPose(body, wrap(body.yaw + truth.head_turn)),
            truth.request,
            robot_trail=self._path(robots),
            user_trail=self._path(users),
            joints=truth.joints,
            twist=_twist(before.base, truth.base, per_s),
            velocity=_velocity(before.body, body, per_s),
            at_s=now_ns * 1e-9,
        )

    def _path(self, poses: Iterable[Pose2 | None]) -> tuple[Point, ...]:
        """Their places from the last one back, as far apart as they are to be."""
        found: list[Point] = []
        for pose in poses:
            if pose is not None and (
                not found or hypot(pose.x - found[-1][0], pose.y - found[-1][1]) >= self._apart
            ):
                found.append((pose.x, pose.y))
        return tuple(reversed(found))


def _twist(before: Pose2 | None, now: Pose2 | None, per_s: float) -> Twist2:
    if before is None or now is None:
        return STILL
    moved = before.inverse() @ now
    return Twist2(per_s * moved.x, per_s * moved.y, per_s * moved.yaw)


def _velocity(before: Pose2 | None, now: Pose2 | None, per_s: float) -> Twist2:
    if before is None or now is None:
        return STILL
    turn = wrap(now.yaw - before.yaw)
    return Twist2(per_s * (now.x - before.x), per_s * (now.y - before.y), per_s * turn)


def next_deep(settings: Settings, user: UserPose) -> Pose3:
    """Where the user would reach if they requested a touch now (R132)."""
    x, y = user.body.transform(settings.haptic.deep_ahead, 0.0)
    return Pose3.from_yaw(x, y, settings.haptic.deep_height, user.body.yaw)


def situation_at(
    moment: Moment, environment: Environment, settings: Settings, *names: SubsystemName
) -> Situation | None:
    """The moment as the states' situation, with these planners, or all; None without both poses."""
    if moment.robot is None or moment.user is None:
        return None
    planners = {
        name: planner_at(environment, name, moment.obstacles) for name in names or SUBSYSTEMS
    }
    return Situation(
        environment, settings, moment.robot, moment.twist, moment.user, moment.velocity, planners
    )


@lru_cache(maxsize=6)
def planner_at(
    environment: Environment, name: SubsystemName, obstacles: Obstacles | None = None
) -> GlobalPlanner:
    """The global planner of a subsystem with what scans have shown."""
    if obstacles is None:
        return environment.static_planners[name]
    return environment.planner_among(name, obstacles)


def with_drive(
    moment: Moment,
    environment: Environment,
    subsystem: SubsystemName,
    goal: Pose2 | None,
    planner: GlobalPlanner | None = None,
) -> Moment:
    """The moment with a goal and the path there, if there is a goal.

    `planner` is the subsystem's; None: that of the moment.
    """
    if goal is None or moment.robot is None:
        return moment
    here, there = (moment.robot.x, moment.robot.y), (goal.x, goal.y)
    disc = user_disc(moment.user, environment.navigation.named(subsystem))
    planner = planner or planner_at(environment, subsystem, moment.obstacles)
    path = planner.plan(here, there, disc)
    points = () if path is None else path.points
    return replace(moment, goal=goal, subsystem=subsystem, path=points)
