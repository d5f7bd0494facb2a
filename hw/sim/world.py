"""The simulated world of tiers 1 to 3: robot, person and room, advanced from tick to tick.

Person, room and arm are optional. All of it is deterministic.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from hw.geometry import Pose2
from hw.interfaces import RobotPart
from hw.model import IDEAL, MotionLimits, RobotModel, SensorErrors, SensorModel
from hw.motion import EVER_NS
from hw.people.walking import Person
from hw.safety import CYCLE_NS, CycleLog, GuardedBase, SafetyLimits, StopLatch
from hw.samples import Sample, UserPose
from hw.scene import Scene, SpacePoint
from hw.sim.contact import Collisions, MovingArm, MovingBase
from hw.sim.hand import Hand, LooseItems
from hw.sim.sensors import ScriptedOperator, SimBumper, SimTrackers, SimVr
from hw.sim.sim_arm import SimArm
from hw.sim.sim_base import SimBase
from hw.truth import Truth

if TYPE_CHECKING:
    from hw.sim.equipment import Equipment

LONGEST_STEP_NS = 33_333_334
"""Longer steps are cut into pieces of this length, ns, so that people and parts can react."""


class World:
    """A robot, with a room and a person if given: a plant of the loop.

    `parts` are the parts of the run, by name. The other attributes are the state, and `truth` is a
    snapshot of it; `collisions` has what the footprint has touched. Without a scene the robot
    starts at the map's origin and meets no walls.

    `guard` is the part `base`, in front of the wheels `base`. A stop that it latches pulls the stop
    line. `safety`: the limits of its chain; None: those of the robot. `operator`: a scripted one
    handles faults; otherwise that is up to the caller.

    `shaken`: whether a base that stands is moved by its arm, as by physics.

    With `sensing` the base does not measure its pose: it slips, and the sensors of the robot file
    are there with these errors.

    Raises:
        FileError: the robot's footprint touches a wall or the person at the start.
    """

    paced = False
    """Time advances only by calls of `advance`."""
    now_ns = 0
    _vr: SimVr | None = None
    _trackers: SimTrackers | None = None
    _equipment: Equipment | None = None
    _items: LooseItems | None = None
    _tracked: tuple[int | None, float, int | None] = (None, 0.0, None)
    """Stamp of the newest measured pose of the person, the head's turn in it, rad, and the stamp
    since which one has come in every step."""
    _viewed: object = None
    """The pose measured last."""
    _truth = Truth()
    _began = False

    def __init__(  # noqa: PLR0913 - most are optional
        self,
        scene: Scene | None,
        robot: RobotModel,
        person: Person | None,
        limits: MotionLimits | None = None,
        base: MovingBase | None = None,
        arm: MovingArm | None = None,
        *,
        hand: Hand | None = None,
        safety: SafetyLimits | None = None,
        latency_ns: int = 0,
        sensors: SensorModel = IDEAL,
        sensing: SensorErrors | None = None,
        operator: bool = True,
    ) -> None:
        limits = limits or MotionLimits()
        self.scene, self.robot, self.person = scene, robot, person
        self.latency_ns = latency_ns
        start = Pose2(0.0, 0.0) if scene is None else scene.robot_start
        self.base = base or SimBase(robot, limits, start, sensors.of_pose)
        self.shaken = getattr(self.base, "shaken", False)
        self.arm = arm
        if arm is None and robot.arm is not None and robot.parked is not None:
            self.arm = SimArm(robot.arm, robot.parked)
        self.hand = hand or (Hand() if robot.prop is None else Hand.of(robot.prop))
        if scene is not None and scene.items and robot.arm is not None and robot.prop is not None:
            self._items = LooseItems(scene.items, robot.arm, robot.prop, self.hand)
        self._line = StopLatch(self._release)
        self._bumper = SimBumper(self._line)
        self.collisions = Collisions(robot, scene, person, self.base, self._bumper)
        if sensing is not None:  # before the guard, which asks the base what it measures
            self._equipment = self._equip(sensing, sensors.seed)
        safety = safety or SafetyLimits.of(robot, limits)
        if person is None:
            safety = replace(safety, watched=False)
        self.guard = GuardedBase(self.base, safety, robot.parked, self._line.pull, robot.base.modes)
        self._own: dict[str, Any] = {}
        self._failures: list[tuple[str, Exception]] = []
        self._operator = None
        if operator:
            self._operator = ScriptedOperator(self._line, by_hand=self.push_off)
        parts = self._own_parts()
        if self._equipment is not None:
            parts |= self._equipment.parts
        parts |= self._of_person(sensors)
        self.parts: Mapping[str, Any] = {k: part for k, part in parts.items() if part is not None}
        if scene is not None:
            self.collisions.check_start(scene)

    def _own_parts(self) -> dict[str, RobotPart | None]:
        return {
            "base": self.guard,
            "arm": self.arm,
            "bumper": self._bumper,
            "stop_line": self._line,
            "operator": self._operator,
            "gripper": self.hand.gripper,
            "wrench": self.hand.wrench,
        }

    def _of_person(self, sensors: SensorModel) -> dict[str, RobotPart | None]:
        if self.person is None:
            return {}
        delay, view, room = sensors.tracking_delay, None, None
        if self.scene is not None and self.scene.tracking == "area":
            room = self.scene.room
        if self._equipment is not None:
            delay, view = delay + self._equipment.tracking_delay, self._equipment.view
            room = None  # the view knows where tracking works
        noise = sensors.of_tracking
        self._vr = SimVr(self.person, view)
        self._trackers = SimTrackers(self.person, room, round(delay * 1e9), noise, view)
        return {"vr": self._vr, "trackers": self._trackers}

    def _equip(self, sensing: SensorErrors, seed: int) -> Equipment:
        """The sensor models; imported here, so that worlds without sensing need no kernels."""
        from hw.sim.equipment import Equipment

        if not isinstance(self.base, SimBase):
            raise TypeError(f"sensing needs a SimBase, not a {type(self.base).__name__}")
        bodies = self.collisions.others.bodies
        return Equipment(self.robot, self.base, self.person, self.scene, sensing, seed, bodies)

    @property
    def items(self) -> Mapping[str, SpacePoint]:
        """The centres of the scene's items by name, m, in the map; none for a robot without arm."""
        return {} if self._items is None else MappingProxyType(self._items.places)

    @property
    def pressed(self) -> bool:
        """True while anybody touches the foam."""
        return self.collisions.pressed

    @property
    def finished(self) -> bool:
        """True once the person has finished."""
        return self.person is not None and self.person.finished

    @property
    def truth(self) -> Truth:
        """A snapshot of the ground truth; the same object until something of it changes."""
        base, arm, person, touched = self.base, self.arm, self.person, self.collisions
        state = None if arm is None else arm.state
        seen_ns, head_turn, since_ns = self._tracked
        now = Truth(
            base.pose,
            None if state is None else state.joints,
            state is not None and state.moving,
            None if person is None else person.body,
            0.0 if person is None else person.speed,
            None if person is None else person.request,
            seen_ns,
            head_turn,
            self._vr is not None and self._vr.shown,
            base.distance_m,
            base.energy_j,
            touched.wall_hits,
            None if person is None else touched.user.least,
            None if person is None else touched.contacts,
            touched.object_hits,
            touched.others.people(self.now_ns) if touched.others.bodies else (),
            touched.hits,
            since_ns,
        )
        if now != self._truth:
            self._truth = now
        return self._truth

    @property
    def cycles(self) -> CycleLog:
        """The cycles of the safety chain."""
        return self.guard.chain.cycles

    def add(self, parts: Mapping[str, RobotPart]) -> None:
        """Add parts, in place of those of the same names; `advance` advances them too.

        A base among them gets its own guard, which commands it from cycle to cycle.
        """
        self._own |= {name: part for name, part in parts.items() if hasattr(part, "advance")}
        own: dict[str, Any] = dict(parts)
        if "base" in own:
            limits, robot = self.guard.chain.limits, self.robot
            self.guard = GuardedBase(
                own["base"], limits, robot.parked, self._line.pull, robot.base.modes
            )
            own["base"] = self.guard
        self.parts = {**self.parts, **own}

    @property
    def failures(self) -> list[tuple[str, Exception]]:
        """What added parts have raised since the last call; they are not advanced any more."""
        told, self._failures = self._failures, []
        return told

    def quiet_until(self) -> int:
        """The instant before which nothing changes and each part repeats its samples, ns.

        Now, unless all of them say so; see `engine/LEAPS.md`.
        """
        person, now = self.person, self.now_ns
        until = EVER_NS if person is None else getattr(person, "still_until_ns", now)
        parts = self.guard, self.base, self.arm, self.hand, self._line, self._operator, self._vr
        if until <= now or self._own or self._equipment is not None or not self._began:
            return now
        if not all(part is None or getattr(part, "still", False) for part in parts):
            return now
        if self._trackers is not None and not (self._trackers.exact and self._tracked[0] == now):
            return now
        return until if self.collisions.others.stand(now) else now

    def leap(self, span_ns: int) -> None:
        """Pass over so long, ns, before `quiet_until`: all repeat their samples meanwhile."""
        self._advance(self.now_ns + span_ns)
        self.guard.leap(span_ns)
        if self._trackers is not None:
            self._trackers.samples(self.now_ns)  # one of those repeated

    def close(self) -> None:
        """Nothing to do: nothing is open."""

    @property
    def informed(self) -> bool:
        """True while the robot is shown to the person."""
        return self._vr is not None and self._vr.shown

    def advance(self, to_ns: int) -> None:
        """Advance everything to to_ns; call it before taking the parts' samples.

        Raises:
            ValueError: to_ns is in the past.
        """
        if to_ns < self.now_ns:
            raise ValueError(f"world: advance to {to_ns} ns, but it is {self.now_ns} ns already")
        while to_ns - self.now_ns > LONGEST_STEP_NS:
            self._advance(self.now_ns + LONGEST_STEP_NS)
        self._advance(to_ns)

    def _advance(self, now_ns: int) -> None:
        since_ns, self.now_ns, self._began = self.now_ns, now_ns, True
        base, arm, person, touched = self.base, self.arm, self.person, self.collisions
        touched.since_ns, touched.now_ns = since_ns, now_ns
        robot_before = base.pose
        base.braked = braked = self._line.reason is not None
        if arm is not None:
            arm.braked = braked  # before the base moves: physics moves both at once
        base.advance(now_ns)
        if arm is not None:
            arm.advance(now_ns)
        if self.hand.gripper is not None:
            self.hand.advance(now_ns, braked=braked)
        if self._items is not None and arm is not None:
            self._items.step(base.pose, arm.state.joints)
        if base.pose is not robot_before:
            touched.collide(robot_before)
        if person is not None:
            self._advance_person(person, robot_before, since_ns)
        if touched.others.bodies:
            touched.watch_others(robot_before)
        if self._operator is not None:
            self._operator.step(now_ns)
        if self._own:
            self._advance_own(since_ns, now_ns)

    def _advance_own(self, since_ns: int, now_ns: int) -> None:
        """Advance added parts; a base among them from cycle to cycle."""
        if "base" in self._own:
            self._attempt("base", self._cycle, since_ns, now_ns)
        for name, part in list(self._own.items()):
            self._attempt(name, part.advance, now_ns)

    def _cycle(self, since_ns: int, now_ns: int) -> None:
        wheels: Any = self.guard.base
        for now in range(since_ns, now_ns, CYCLE_NS):
            self.guard.cycle(now)
            wheels.advance(min(now + CYCLE_NS, now_ns))

    def _attempt(self, name: str, act: Callable[..., object], *arguments: int) -> None:
        try:
            act(*arguments)
        except Exception as error:  # noqa: BLE001  an added part may raise anything
            self._own.pop(name, None)
            self._failures.append((name, error))

    def _advance_person(self, person: Person, robot_before: Pose2, since_ns: int) -> None:
        base, vr, trackers = self.base, self._vr, self._trackers
        assert vr is not None
        assert trackers is not None
        body_before = person.body
        person.step(self.now_ns, base.pose, vr.shown)
        if self._equipment is not None:
            self._equipment.note(self.now_ns)
        if base.pose is not robot_before or person.body is not body_before:
            self.collisions.watch_user(robot_before, body_before)
        vr.step(self.now_ns)
        seen = trackers.step()
        if seen is not None:
            self._note_view(seen, since_ns)

    def _note_view(self, sample: Sample, before_ns: int) -> None:
        """Note a measured pose, unless its head's turn is not finite.

        Tracking has gone on if there was one at the instant before, `before_ns`.
        """
        pose, stamp = sample.value, sample.stamp_ns
        last_ns, turn, since_ns = self._tracked
        if pose is not self._viewed:
            turn = pose.head_yaw - pose.body.yaw if isinstance(pose, UserPose) else math.nan
            if not math.isfinite(turn):
                return
            self._viewed = pose
        if last_ns is None or last_ns < before_ns:
            since_ns = stamp
        self._tracked = stamp, turn, since_ns

    def push_off(self) -> None:
        """The operator pushes a robot that has touched somebody one step away from them."""
        self.collisions.push_off()

    def _release(self) -> bool:
        """True if the stop line may be reset: nobody touches the foam, and the chain agrees."""
        freed = not self.pressed and self.guard.chain.reset(self.now_ns)
        self.collisions.release(freed)
        return freed
