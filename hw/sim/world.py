"""The reduced simulation (tier 1): robot, person and room, stepped from tick to tick.

All of it is plain Python and deterministic; nothing here draws random numbers.
"""

from __future__ import annotations

import math
from typing import Protocol

from hw.geometry import Pose2, Twist2, wrap
from hw.guarded import GuardedBase
from hw.interfaces import Arm, Base, Parts
from hw.person import RADIUS, Person
from hw.robot import MotionLimits, RobotModel
from hw.room import Room
from hw.safety_limits import SafetyLimits
from hw.samples import ArmState
from hw.scene import Scene, SceneError
from hw.sim.arm import SimArm
from hw.sim.base import SimBase
from hw.sim.contact import gap, rectangle_segment_distance, swept_gap
from hw.sim.surroundings import ScriptedOperator, SimBumper, SimStopLine, SimTrackers, SimVr
from hw.sim.tool import Hand

PUSHED_OFF, PUSHING = 0.3, 0.3
"""The operator pushes a robot that touches the person off to this gap, m, at this speed, m/s."""
_PUSHES = tuple(math.radians(angle) for angle in (0, 40, -40, 80, -80))
"""Directions to push in, from the one away from the person, rad."""
LONGEST_STEP_NS = 33_333_334
"""A longer step is cut into pieces of this length, ns, so that people and parts can react."""


class MovingBase(Base, Protocol):
    """A base whose motion the world computes."""

    pose: Pose2
    twist: Twist2
    distance_m: float
    energy_j: float
    braked: bool
    gate: GuardedBase | None

    def advance(self, until_ns: int) -> None:
        """Move on to until_ns."""
        ...

    def block(self, pose: Pose2) -> None:
        """Something solid holds the base: it stands at once, at this pose."""
        ...


class MovingArm(Arm, Protocol):
    """An arm whose motion the world computes."""

    state: ArmState
    braked: bool

    def advance(self, until_ns: int) -> None:
        """Move on to until_ns."""
        ...


class World:
    """A room with a robot and a person in it.

    `parts` is what a run is wired to. The other attributes are the truth, for evaluators:
    `contacts` counts touches of robot and person (swept between steps), `wall_hits` those of robot
    and room, `min_gap` is the least distance between outline and person so far, m. With `area_only`
    the person is tracked in the room's tracked area only (R6), else everywhere.

    `guard` is the part `base`: it stands in front of the wheels, which are `base`. A stop that it
    latches pulls the stop line. `safety`: the limits of its chain; None: those of the robot.

    Raises:
        SceneError: the robot's outline touches a wall or the person at the start.
    """

    def __init__(  # noqa: PLR0913 - most are optional
        self,
        scene: Scene,
        robot: RobotModel,
        person: Person,
        limits: MotionLimits | None = None,
        base: MovingBase | None = None,
        arm: MovingArm | None = None,
        *,
        hand: Hand | None = None,
        area_only: bool = False,
        safety: SafetyLimits | None = None,
    ) -> None:
        limits = limits or MotionLimits()
        self.scene, self.robot, self.person = scene, robot, person
        self.base = base or SimBase(robot, limits, scene.robot_start)
        self.arm = arm or SimArm(robot.arm, limits)
        self.hand = hand or Hand.of(robot.prop)
        self.now_ns = 0
        self.contacts = 0
        self.wall_hits = 0
        self.touching = self._touched = False
        self._elapsed_s = 0.0
        self.min_gap = gap(robot.footprint, self.base.pose, person.body.x, person.body.y)
        self._walls = _Walls(scene.room, robot)
        self._line = SimStopLine(self._release)
        safety = safety or SafetyLimits.of(robot, limits)
        self.guard = GuardedBase(self.base, safety, robot.arm.parked, self._line.pull)
        self._bumper = SimBumper(self._line)
        self._vr = SimVr(person)
        self._operator = ScriptedOperator(self._line, by_hand=self._push_off)
        self._trackers = SimTrackers(person, scene.room if area_only else None)
        self.parts = Parts(
            base=self.guard,
            arm=self.arm,
            trackers=self._trackers,
            vr=self._vr,
            bumper=self._bumper,
            stop_line=self._line,
            operator=self._operator,
            gripper=self.hand.gripper,
            wrench=self.hand.wrench,
        )
        self._check_start()

    @property
    def informed(self) -> bool:
        """Is the robot shown to the person?"""
        return self._vr.shown

    def step(self, until_ns: int) -> None:
        """Let everything happen up to until_ns; call before the parts' samples are taken.

        Raises:
            ValueError: until_ns is in the past.
        """
        if until_ns < self.now_ns:
            raise ValueError(f"world: step to {until_ns} ns, but it is {self.now_ns} ns already")
        while until_ns - self.now_ns > LONGEST_STEP_NS:
            self._advance(self.now_ns + LONGEST_STEP_NS)
        self._advance(until_ns)

    def _advance(self, now_ns: int) -> None:
        self._elapsed_s, self.now_ns = (now_ns - self.now_ns) * 1e-9, now_ns
        base, arm, person = self.base, self.arm, self.person
        robot_before, body_before = base.pose, person.body
        base.braked = arm.braked = self._line.reason is not None
        base.advance(now_ns)
        arm.advance(now_ns)
        self.hand.advance(now_ns, braked=arm.braked)
        if base.pose is not robot_before and self._walls.hit_by(base.pose):
            self._hit_wall(robot_before)
        person.step(now_ns, base.pose, self._vr.shown)
        if base.pose is not robot_before or person.body is not body_before:
            self._watch_gap(robot_before, body_before)
        self._vr.step(now_ns)
        self._operator.step(now_ns)

    def _release(self) -> bool:
        """May the stop line be reset?"""
        free = not self.touching and self.guard.reset(self.now_ns)
        self._touched = self._touched and not free
        return free

    def _push_off(self) -> None:
        """The operator pushes a robot that has touched the person off them, where there is room."""
        robot, body = self.base.pose, self.person.body
        near = gap(self.robot.footprint, robot, body.x, body.y) < PUSHED_OFF
        if not (self._touched and near):
            return
        away = math.atan2(robot.y - body.y, robot.x - body.x)
        step = PUSHING * self._elapsed_s
        for aside in _PUSHES:
            x, y = robot.x + step * math.cos(away + aside), robot.y + step * math.sin(away + aside)
            pushed = Pose2(x, y, robot.yaw)
            if not self._walls.hit_by(pushed):
                self.base.block(pushed)
                self._watch_gap(robot, body)
                return

    def _watch_gap(self, robot_before: Pose2, body_before: Pose2) -> None:
        robot, body = self.base.pose, self.person.body
        travel = robot_before.distance_to(robot) + body_before.distance_to(body)
        footprint = self.robot.footprint
        least = robot.distance_to(body) - footprint.half_diagonal - RADIUS - travel
        if least > 0.0 and least > self.min_gap:
            self.touching = False
            return
        found = swept_gap(footprint, (robot_before, robot), (body_before, body))
        self.min_gap = min(self.min_gap, found)
        if found <= 0.0 and not self.touching:
            self.contacts += 1
            self._bumper.touch(self.now_ns, robot.bearing_to(body), "person")
        self.touching = found <= 0.0 and gap(footprint, robot, body.x, body.y) <= 0.0
        self._touched = self._touched or self.touching

    def _hit_wall(self, before: Pose2) -> None:
        self.wall_hits += 1
        moved = math.atan2(self.base.pose.y - before.y, self.base.pose.x - before.x)
        self._bumper.touch(self.now_ns, wrap(moved - before.yaw), "wall")
        self.base.block(before)

    def _check_start(self) -> None:
        start = self.base.pose
        place = f"robot.start ({start.x:g}, {start.y:g}, {start.yaw:g})"
        if self._walls.hit_by(start):
            raise SceneError(self.scene.name, 0, f"{place}: the robot would touch a wall")
        if self.min_gap <= 0.0:
            body = self.person.body
            raise SceneError(
                self.scene.name,
                0,
                f"{place}: the robot would touch the person, who starts at "
                f"({body.x:.2f}, {body.y:.2f}); start one of them elsewhere",
            )


class _Walls:
    """Does the robot's outline touch a wall? Looks again only when it could have got there."""

    def __init__(self, room: Room, robot: RobotModel) -> None:
        self._room, self._footprint = room, robot.footprint
        self._clear = 0.0
        self._at = Pose2(math.inf, math.inf)

    def hit_by(self, pose: Pose2) -> bool:
        reach = self._footprint.half_diagonal
        at = self._at
        if math.hypot(pose.x - at.x, pose.y - at.y) + reach * abs(pose.yaw - at.yaw) < self._clear:
            return False
        self._at, self._clear = pose, self._distance(pose)
        return self._clear <= 0.0 or not self._room.is_free(pose.x, pose.y)

    def _distance(self, pose: Pose2) -> float:
        length, width = self._footprint.half_length, self._footprint.half_width
        base_from_map = pose.inverse()
        return min(
            rectangle_segment_distance(
                length, width, base_from_map.transform(x1, y1), base_from_map.transform(x2, y2)
            )
            for x1, y1, x2, y2 in self._room.segments
        )
