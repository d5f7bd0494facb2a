"""Finds joint angles in which an arm with its prop is folded: a search, once per arm and prop.

Folded is an arm that stays inside the bumper frame, foam not counted, and keeps its distance from
itself, rover and floor (R46). Among such poses the best is the one from which the prop is soonest
at DEEPs in front of the robot. Random joint sets with the tool over the rover are improved by
random steps that shrink, and the roomiest are ranked by their joint lines.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from hw import Joints, Pose2, Pose3
from hw.model import MotionLimits, RobotModel
from states.arm.description import manipulator_of
from states.arm.kinematics import (
    Array,
    CollisionChecker,
    Surroundings,
    forward,
    nearest_copies,
    room_within,
)
from states.arm.motion import line_durations
from states.arm.planning.planning import goals_at
from states.arm.planning.reach import rover_from_deep

CLEARANCE = 0.015
"""Least clearance of a folded arm, m."""
DRAWN, KEPT, ROUNDS = 200_000, 300, 120
"""Joint sets drawn, those that are improved, and rounds of improvement."""
TARGETS = 40
ACCELERATION, POINT_SPEED = 5.0, 1.0
"""Limits for the ranking, rad/s2 and m/s."""
UNREACHED_S = 5.0
"""What a DEEP without a free joint line counts, s."""
_DIGITS = 2


@dataclass(frozen=True, slots=True)
class ParkedPose:
    """Joint angles, rad; clearance and room to the bumper frame, m; mean time to DEEPs, s.

    `reached` is the share of those DEEPs to which a joint line is free.
    """

    joints: Joints
    clearance: float
    room: float
    time: float
    reached: float


class ParkingSearch:
    """The search for one robot with its prop."""

    def __init__(self, robot: RobotModel, seed: int = 0) -> None:
        self._arm = manipulator_of(robot)
        self._checker = CollisionChecker.of(self._arm, Surroundings.empty())
        self._limits = MotionLimits(arm_acceleration=ACCELERATION, tool_speed=POINT_SPEED)
        outline = robot.footprint
        self._half = outline.half_length - outline.foam, outline.half_width - outline.foam
        self._rng = np.random.default_rng(seed)

    def best(self, count: int = 5) -> list[ParkedPose]:
        """The best poses, quickest first; fewer or none where the arm does not fit."""
        poses = np.round(self._roomiest(), _DIGITS)
        clearance, room = self._room(poses)
        fit = np.flatnonzero((clearance >= CLEARANCE) & (room >= 0.0))
        targets = self._targets()
        found = [
            ParkedPose(tuple(poses[i].tolist()), float(clearance[i]), float(room[i]), *times)
            for i in fit
            for times in (self._times(poses[i], targets),)
        ]
        found.sort(key=lambda pose: pose.time)
        different: list[ParkedPose] = []
        for pose in found:
            if all(math.dist(pose.joints, other.joints) > 0.5 for other in different):
                different.append(pose)
        return different[:count]

    def _room(self, joints: Array) -> tuple[Array, Array]:
        """Clearance, and distance inside the bumper frame less its foam, (n,) each, m."""
        room = np.empty(len(joints))
        room_within(self._arm.solid, joints, *self._half, room)
        return self._checker.clearance(joints), room

    def _roomiest(self) -> Array:
        low = np.maximum(self._arm.lower, -math.pi)
        high = np.minimum(self._arm.upper, math.pi)
        drawn = self._rng.uniform(low, high, (DRAWN, self._arm.count))
        over = np.abs(forward(self._arm, drawn)[:, :2, 3]) < self._half
        poses = drawn[over.all(axis=1)]
        score = np.minimum(*self._room(poses))
        order = np.argsort(-score)[:KEPT]
        poses, score = poses[order], score[order]
        for step in np.geomspace(0.3, 0.01, ROUNDS):
            tried = np.clip(poses + self._rng.normal(0.0, step, poses.shape), low, high)
            new = np.minimum(*self._room(tried))
            better = new > score
            poses[better], score[better] = tried[better], new[better]
        return poses

    def _targets(self) -> list[Array]:
        """Free joints at DEEPs in front of the robot that the arm reaches, (k, j) each."""
        found: list[Array] = []
        for _ in range(50 * TARGETS):
            distance, height = self._rng.uniform(0.7, 1.1), self._rng.uniform(0.6, 1.4)
            turn = self._rng.uniform(-1.0, 1.0)
            deep = Pose3.from_yaw(distance, 0.0, height, math.pi + turn)
            goals = goals_at(
                self._arm, rover_from_deep(Pose2(0.0, 0.0), deep), np.zeros(self._arm.count)
            )
            goals = goals[self._checker.free(goals)]
            if len(goals):
                found.append(goals)
            if len(found) == TARGETS:
                break
        return found

    def _times(self, start: Array, targets: list[Array]) -> tuple[float, float]:
        """Mean time to the targets, s, and the share of them to which a line is free."""
        total, reached = 0.0, 0
        for goals in targets:
            near = nearest_copies(self._arm, goals, start)
            times = line_durations(self._arm, start, near, self._limits)
            for i in np.argsort(times):
                if self._checker.line_free(start, near[i]):
                    total, reached = total + float(times[i]), reached + 1
                    break
            else:
                total += UNREACHED_S
        return total / max(1, len(targets)), reached / max(1, len(targets))
