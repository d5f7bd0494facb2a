"""Runs a chart on the simulated robot, as fast as it goes.

Tick n is at n * 10^9 // tick_hz ns. Before it the world moves on to that instant and its samples
go to the board; what the states command takes effect the profile's `latency` later, because the
world moves on by that much before the tick. Wall time is looked at only to report it.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import Any

from cobodeck.arm_contact import ArmWatch, OutlineOf
from cobodeck.console import FAILED, Problem
from cobodeck.logic import LogicLoop, wander
from cobodeck.metrics import Evaluator, visits
from cobodeck.refusals import refusals
from cobodeck.separation import SeparationWatch
from cobodeck.warmup import warm_up
from cobodeck.wiring import Setup, Wired, wire
from engine.signals import Usage
from hw.geometry import Pose2, Pose3
from hw.mock import mock_world
from hw.person import Person
from hw.robot import RobotModel
from hw.samples import Joints
from hw.sim.base import SimBase
from hw.sim.world import World
from hw.user import open_user

LONGEST_S = 3600.0
"""A run whose user never comes to an end is over after this time, s."""


@dataclass(frozen=True, slots=True)
class Options:
    """How to run.

    `duration_s` ends a run early, `stretch_m` makes a recording longer, `eager` computes every
    signal in every tick, `mock` takes the robot that does exactly as told.
    """

    user: str | None = None
    requests: int | None = None
    stretch_m: float | None = None
    tier: int = 1
    seed: int = 0
    duration_s: float = LONGEST_S
    eager: bool = False
    frozen_base: bool = False
    mock: bool = False


@dataclass(frozen=True, slots=True)
class Result:
    """What came out of a run."""

    figures: Mapping[str, Any]
    wired: Wired
    loop: Loop | LogicLoop

    @property
    def usage(self) -> dict[str, Usage]:
        """What was built, computed and skipped."""
        return self.wired.board.usage()


class FrozenBase(SimBase):
    """A base that does not move, whatever it is told: to see whether a test would notice."""

    def drive(self, command: object) -> None:
        """Ignored."""


@dataclass(slots=True)
class Loop:
    """World, run and evaluator, tick by tick; `latency_ns` as in the module's text.

    `spent_ns` is the wall time of the world, of handing over samples, of the evaluator, and of the
    chart with its states and signals.
    """

    world: World
    wired: Wired
    evaluator: Evaluator
    separation: SeparationWatch
    tick_hz: int
    latency_ns: int = 0
    ticks: int = 0
    overruns: int = 0
    spent_ns: list[int] = field(default_factory=lambda: [0, 0, 0, 0])

    @property
    def next_ns(self) -> int:
        """The instant of the next tick."""
        return self.ticks * 10**9 // self.tick_hz

    @property
    def finished(self) -> bool:
        """Whether the user has done."""
        return self.world.person.finished

    def prepare(self, now_ns: int) -> None:
        """All that comes before a tick: the world moves on, samples arrive."""
        clock, spent = time.perf_counter_ns, self.spent_ns
        begin = clock()
        self.world.step(now_ns)
        moved = clock()
        self.wired.deliver(now_ns)
        delivered = clock()
        self.evaluator.watch(now_ns)
        self.separation.watch()
        spent[0] += moved - begin
        spent[1] += delivered - moved
        spent[2] += clock() - delivered
        if self.latency_ns:
            self.world.step(now_ns + self.latency_ns)

    def tick(self) -> str | None:
        """One tick; the chart's outcome once there is one."""
        now = self.ticks * 10**9 // self.tick_hz
        self.prepare(now)
        self.ticks += 1
        begin = time.perf_counter_ns()
        outcome = self.wired.tick(now)
        self.spent_ns[3] += time.perf_counter_ns() - begin
        return outcome

    def report(self) -> dict[str, Any]:
        """The evaluator's figures, at the end."""
        self.evaluator.finish()
        faults: list[str] = getattr(self.wired.run.parts["operator"], "faults", [])
        names = {name: faults.count(name) for name in dict.fromkeys(faults)}
        limits = self.world.guard.chain.limits
        return {
            "governor": limits.governor,
            "person_watched": limits.watched,
            "separation": self.separation.report(),
            **self.evaluator.report(),
            "refusals": refusals(self.wired.run, self.evaluator.unserved),
            "faults": len(faults),
            "fault_names": names,
        }


def stage(setup: Setup, options: Options, parameters: Mapping[str, Any] | None = None) -> Loop:
    """Everything for a run, before its first tick.

    Raises:
        Problem: nothing says who walks about; ValueError of `hw`: the user's file is wrong.
    """
    source = options.user or setup.scene.user
    if source is None:
        raise Problem(f"scene {setup.scene.name} names no user; give one with --user")
    person = open_user(source, setup.scene, options.requests, options.stretch_m, options.seed)
    world = _world(setup, person, options)
    clock = time.perf_counter_ns
    wired = wire(setup, world.parts, eager=options.eager, clock=clock, parameters=parameters)
    evaluator = Evaluator(world, prop_of(setup.robot), ArmWatch(world, outline_of(setup.robot)))
    separation = SeparationWatch(world.guard.chain.cycles)
    return Loop(world, wired, evaluator, separation, setup.tick_hz, _latency(setup))


def simulate(
    setup: Setup,
    options: Options,
    progress: Callable[[str], None] | None = None,
    wait: Callable[[int], None] | None = None,
) -> Result:
    """Run until the user has done, the chart has ended, or the time is over.

    `progress` is told now and then where the run has got to; `wait` is called before each tick
    with its instant, ns, so that a run can go along with real time.
    """
    loop = _loop(setup, options)
    begin = time.perf_counter_ns()
    end_ns = _run(loop, round(options.duration_s * 1e9), progress, wait)
    wall_s, sim_s = (time.perf_counter_ns() - begin) / 1e9, end_ns / 1e9
    run, board = loop.wired.run, loop.wired.board
    figures = {
        "chart": setup.chart.name,
        "scene": setup.scene.name,
        "user": options.user or setup.scene.user,
        "profile": setup.profile.name,
        "tier": options.tier,
        "seed": options.seed,
        "tick_hz": setup.tick_hz,
        "sim_s": sim_s,
        "wall_s": wall_s,
        "realtime_factor": sim_s / wall_s if wall_s > 0.0 else None,
        "ticks": loop.ticks,
        "outcome": run.outcome,
        "transitions": sum(record.kind == "move" for record in run.trace),
        "trace_sha256": run.trace.sha256(),
        "escapes": visits(run, "escape"),
        "escape_failures": visits(run, "escape", "failed"),
        **loop.report(),
        "overruns": loop.overruns,
        "signals": {
            name: {"evaluated": usage.evaluated, "skipped": usage.skipped}
            for name, usage in board.usage().items()
        },
    }
    return Result(figures, loop.wired, loop)


def _loop(setup: Setup, options: Options) -> Loop | LogicLoop:
    if options.tier == 0:
        return LogicLoop(wander(setup, options.seed), setup.tick_hz)
    refuse_small_floor(setup)
    loop = stage(setup, options)
    warm_up(setup, loop.wired.run.machine)
    return loop


def refuse_small_floor(setup: Setup) -> None:
    """Look whether all behaviours have room (R124).

    Raises:
        Problem: the floor is too small.
    """
    from states.navigation.floor_plan import RoomFloor
    from states.navigation.space import shortcoming

    found = shortcoming(RoomFloor(setup.scene.room), setup.profile.navigation.haptic.inflation)
    if found is not None:
        raise Problem(f"scene {setup.scene.name}: {found}", FAILED)


def _run(
    loop: Loop | LogicLoop,
    end_ns: int,
    progress: Callable[[str], None] | None,
    wait: Callable[[int], None] | None,
) -> int:
    """Tick until something ends the run; the instant of the last tick, ns."""
    period, clock = 10**9 // loop.tick_hz, time.perf_counter_ns
    while True:
        now = loop.next_ns
        if wait is not None:
            wait(now)
        before = clock()
        outcome = loop.tick()
        if clock() - before > period:
            loop.overruns += 1
        if outcome is not None or loop.finished or now >= end_ns:
            return now
        if progress is not None and not loop.ticks % 1024:
            progress(f"{now / 1e9:.0f} s simulated")


def _latency(setup: Setup) -> int:
    latency = round(setup.profile.plant.latency * 1e9)
    if latency >= 10**9 // setup.tick_hz:
        shown = f"{latency / 1e6:g} ms is not less than a tick at {setup.tick_hz} Hz"
        raise Problem(f"profile {setup.profile.name}: plant.latency of {shown}")
    return latency


def _world(setup: Setup, person: Person, options: Options) -> World:
    limits = setup.profile.robot.limits
    safety = setup.profile.safety.limits(setup.robot, limits)
    if options.mock:
        return mock_world(setup.scene, setup.site.robot, person, safety)
    base = None
    if options.frozen_base:
        base = FrozenBase(setup.robot, limits, setup.scene.robot_start)
    return World(setup.scene, setup.site.robot, person, limits, base, safety=safety)


def prop_of(robot: RobotModel) -> Callable[[Pose2, Joints], Pose3]:
    """Where the prop is in the map, from the pose of the base and the joints."""
    from states.arm.kinematics import Chain, forward
    from states.arm.model import manipulator_of

    chain = Chain.of(manipulator_of(robot))

    def prop(base: Pose2, joints: Joints) -> Pose3:
        matrix = forward(chain, joints)
        map_from_rover = Pose3.from_yaw(base.x, base.y, 0.0, base.yaw)
        return map_from_rover @ pose_of(matrix.tolist())

    return prop


def outline_of(robot: RobotModel) -> OutlineOf:
    """The arm's capsules in the rover frame, from the joints."""
    from states.arm.collision import CollisionModel, outline
    from states.arm.model import manipulator_of

    return partial(outline, CollisionModel.of(manipulator_of(robot)))


def pose_of(m: list[list[float]]) -> Pose3:
    """A homogeneous 4 x 4 matrix as a pose."""
    trace = m[0][0] + m[1][1] + m[2][2]
    # the largest of the four squares is taken, so that nothing is divided by almost 0
    squares = [trace, m[0][0], m[1][1], m[2][2]]
    largest = squares.index(max(squares))
    if largest == 0:
        q = (m[2][1] - m[1][2], m[0][2] - m[2][0], m[1][0] - m[0][1], 1.0 + trace)
    else:
        i = largest - 1
        j, k = (i + 1) % 3, (i + 2) % 3
        axis = [0.0, 0.0, 0.0]
        axis[i] = 1.0 + m[i][i] - m[j][j] - m[k][k]
        axis[j] = m[j][i] + m[i][j]
        axis[k] = m[k][i] + m[i][k]
        q = (axis[0], axis[1], axis[2], m[k][j] - m[j][k])
    length = sum(part * part for part in q) ** 0.5
    x, y, z, w = (part / length for part in q)
    return Pose3(m[0][3], m[1][3], m[2][3], x, y, z, w)
