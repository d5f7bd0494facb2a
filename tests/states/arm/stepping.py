"""A simulated arm beside a person who steps in, or whose hand comes: finer than the ticks."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from hw.geometry import Pose2, Pose3
from hw.model.robot import load_robot
from hw.samples import EXACT, UserPose
from hw.scene.room import Room
from hw.sim.sim_arm import SimArm
from states.arm.arm_situation import ARM_RADIUS, SLIMMEST, ArmSituation
from states.arm.kinematics.collision import outline
from states.arm.planning.planning import Plan, ended, in_turn
from states.environment.environment import Environment

HALL = Room(outer=((0.0, 0.0), (10.0, 0.0), (10.0, 8.0), (0.0, 8.0)))
BASE = Pose2(6.85, 4.0, math.pi)
DEEP = Pose3.from_yaw(5.85, 4.0, 1.2, 0.0)
HARMLESS = 0.25
ROBOT = load_robot("rbkairos_ur10")
USER = Pose2(5.0, 4.0, 0.0)
TICK_NS, STEP_NS = 33_333_333, 5_000_000
SHALLOW = 0.02
"""Depth of a contact, m, up to which its direction says how fast it came about."""


@dataclass
class Stepping:
    """A person who stands, and from `since_ns` on walks 0.9 m; measured late and noisily."""

    speed: float
    direction: float
    late_ns: int
    rng: np.random.Generator
    since_ns: int = 1 << 60
    noise: float = 0.003
    known_ns: int = 0

    def at(self, now_ns: int) -> tuple[float, float]:
        way = min(0.9, self.speed * max(0, now_ns - self.since_ns) * 1e-9)
        return (
            USER.x + way * math.cos(self.direction), USER.y + way * math.sin(self.direction)
        )  # fmt: skip

    def stamp(self, now_ns: int) -> int:
        """When the newest pose that has arrived was measured."""
        return max(0, (now_ns - self.late_ns) // TICK_NS * TICK_NS)

    def measured(self, now_ns: int) -> tuple[int, UserPose | None]:
        stamp = self.stamp(now_ns)
        x, y = np.array(self.at(stamp)) + self.rng.normal(0.0, self.noise, 2)
        pose = UserPose(Pose2(float(x), float(y), 0.0), 0.0)
        return stamp, pose if now_ns >= self.known_ns else None

    def moved(self, now_ns: int, tool: np.ndarray, *, met: bool) -> None:
        """The next step of whoever moves by what they see."""


@dataclass
class Reaching(Stepping):
    """A person who stands, with a hand that waits and from `since_ns` on goes for the tool."""

    hand: tuple[float, float, float] = (5.85, 4.0, 1.2)
    travel: float = 0.9
    _seen: list[tuple[int, np.ndarray]] = field(default_factory=list)

    def at(self, now_ns: int) -> tuple[float, float]:
        del now_ns
        return USER.x, USER.y

    @property
    def axis(self) -> np.ndarray:
        """The arm from shoulder to hand, as points (n, 3)."""
        shoulder = np.array((USER.x, USER.y - 0.19, 1.4))
        return shoulder + np.linspace(0.0, 1.0, 30)[:, None] * (np.array(self.hand) - shoulder)

    def moved(self, now_ns: int, tool: np.ndarray, *, met: bool) -> None:
        self._seen.append((now_ns, np.array(self.hand)))
        way, step = tool - self.hand, self.speed * STEP_NS * 1e-9
        if now_ns >= self.since_ns and self.travel > 0.0 and not met:
            step = min(step, float(np.linalg.norm(way)))
            x, y, z = self.hand + step * way / max(float(np.linalg.norm(way)), 1e-9)
            self.hand, self.travel = (float(x), float(y), float(z)), self.travel - step

    def measured(self, now_ns: int) -> tuple[int, UserPose | None]:
        stamp, pose = super().measured(now_ns)
        if pose is None:
            return stamp, None
        before = [hand for at, hand in self._seen if at <= stamp]
        x, y, z = (before[-1] if before else self.hand) + self.rng.normal(0.0, self.noise, 3)
        return stamp, UserPose(pose.body, 0.0, right_hand=Pose3(float(x), float(y), float(z)))


class Scene:
    """A simulated arm and a person; notes how fast what touches body or arm of them closes."""

    def __init__(self, environment: Environment, context: Any, person: Stepping, base: Pose2):
        self.arm, self.person, self.base = SimArm(ROBOT.arm, ROBOT.parked), person, base
        self.workspace = environment.workspace
        values = {"environment": environment, "base.pose": base, "base.pose_sigma": EXACT}
        self.ctx = context(values, {"arm": self.arm})
        self.now = 0
        self.touched: float | None = None
        self.met: float | None = None
        self._before: np.ndarray | None = None

    def run(self, run: Iterator[Any], seconds: float, watch: bool = True) -> tuple[Any, float]:
        begin = self.now
        due, outcome = self.now, None
        while self.now - begin < seconds * 1e9:
            if self.now >= due:
                due += TICK_NS
                self.ctx.now = self.now
                stamp, pose = self.person.measured(self.now)
                self.ctx.values["user.pose"], self.ctx.stamps["user.pose"] = pose, stamp
                self.ctx.values["arm.joints"] = self.arm.state
                try:
                    next(run)
                except StopIteration as end:
                    outcome = end.value
                    break
            self.now += STEP_NS
            self.arm.advance(self.now)
            self._look(watch)
        return outcome, (self.now - begin) * 1e-9

    def _look(self, watch: bool) -> None:
        ends, radii = outline(self.workspace.arm, self.arm.state.joints)
        first = self.workspace.arm.solid.first
        ends, radii = ends[first:], radii[first:]
        before, self._before = self._before, ends
        met = False
        inverse = self.base.inverse()
        if before is not None and watch:
            if self.touched is None:
                body = np.array([inverse.transform(*self.person.at(self.now))])
                _, self.touched = _met(ends[:, :, :2], before[:, :, :2], radii + SLIMMEST, body)
            if isinstance(self.person, Reaching):
                seen = [(*inverse.transform(x, y), z) for x, y, z in self.person.axis.tolist()]
                met, closing = _met(ends, before, radii + ARM_RADIUS, np.array(seen))
                if closing is not None:
                    self.met = max(closing, self.met or 0.0)
        x, y, z = ends[-1].mean(axis=0).tolist()
        self.person.moved(self.now, np.array((*self.base.transform(x, y), z)), met=met)


def _met(
    ends: np.ndarray, before: np.ndarray, radii: np.ndarray, points: np.ndarray
) -> tuple[bool, float | None]:
    """Whether capsules touch points, and how fast those close that do not overlap by much, m/s."""
    start, way = ends[:, None, 0], ends[:, None, 1] - ends[:, None, 0]
    square = np.maximum((way * way).sum(axis=2), 1e-12)
    along = np.clip(((points - start) * way).sum(axis=2) / square, 0.0, 1.0)[..., None]
    nearest = start + along * way
    was = before[:, None, 0] + along * (before[:, None, 1] - before[:, None, 0])
    away = np.linalg.norm(points - nearest, axis=2)
    gap = away - radii[:, None]
    towards = (points - nearest) / np.maximum(away, 1e-9)[..., None]
    closing = ((nearest - was) * towards).sum(axis=2) / (STEP_NS * 1e-9)
    touching = (gap <= 0.0) & (gap == gap.min(axis=1, keepdims=True)) & (gap > -SHALLOW)
    return bool((gap <= 0.0).any()), float(closing[touching].max()) if touching.any() else None


def plan_to_deep(environment: Environment) -> Plan:
    """The plan to `DEEP` from `BASE` beside `USER`, from the parked pose."""
    situation = ArmSituation(BASE, USER, environment.workspace.parked)
    found = ended(in_turn(environment.workspace.reaching(situation, DEEP)))
    assert isinstance(found, Plan)
    return found
