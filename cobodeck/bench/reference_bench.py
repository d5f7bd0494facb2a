"""Tiers 1 and 2 against tier 3, in which MuJoCo moves base and arm: what they cost, how far off.

`response`: the mean of what each request took longer or shorter than the same one at tier 3, as a
share of its response. It is judged on `study`, whose walk repeats, so that requests are pairs: on
the profile's floor, and on one that takes nothing of the way, as tier 1 knows no other.
`pose`: the same commands through the three bases, without anything that would correct them.
`step`: the physics with coarser steps against fine ones.
"""

from __future__ import annotations

import math
import statistics
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from importlib.metadata import version
from typing import Any

from cobodeck.bench.harness import ROUNDS, BenchRow
from cobodeck.bench.simulation_cpu import HZ, cpu_us
from cobodeck.run import simulate
from cobodeck.setup import FULL, REFERENCE, Options, open_setup
from hw import Pose2, Twist2
from hw.model import MotionLimits, RobotModel, Slip, load_robot
from hw.sim import MovingBase, SimBase, SlipperyFloor
from hw.sim.sensors import Track

NAME = "reference"
TIERS = (REFERENCE, FULL, 1)
GOAL = 3.0
"""Most that the response on `study` may differ from that of tier 3, %."""
LIMITS = MotionLimits(base_acceleration=1.0, base_yaw_acceleration=2.0)
FLOOR = Slip()
EVEN = replace(FLOOR, patchy=0.0)
FLOORS = {
    "tier 2": FLOOR,
    "tier 2, even floor": EVEN,
    "tier 2, even floor, no lags": replace(EVEN, pulling=0.0, braking=0.0),
}
"""With patches that take more or less at random; with the same shares everywhere; these alone."""
SECONDS = 12.0
CORNER = (0.565, 0.455)
"""Of the outline in the base frame, m, so that turns count as well."""
START = Pose2(0.0, 0.0)
FINE_S, STEPS_S = 0.00025, (0.0005, 0.001, 0.002, 0.004)

TimedTwist = Callable[[float], Twist2]
COMMANDS: Mapping[str, TimedTwist] = {
    "ahead": lambda t: Twist2(1.5 * (t % 6.0 < 3.0)),
    "aside": lambda t: Twist2(0.0, 1.0 * (t % 6.0 < 3.0), 0.0),
    "turns": lambda t: Twist2(0.0, 0.0, math.copysign(1.0, math.sin(0.7 * t))),
    "winding": lambda t: Twist2(0.8, 0.4 * math.sin(t), 0.6 * math.sin(0.6 * t)),
}


@dataclass(frozen=True, slots=True)
class TierCase:
    """A run that is done at all tiers; `judged` are those of which its response is.

    Without `response` it is done for its Escapes.
    """

    scene: str
    options: Options
    sets: tuple[str, ...] = ()
    judged: tuple[int, ...] = ()
    response: bool = True


CASES = {
    "study": TierCase("study", Options(requests=20, seed=1), judged=(FULL, 1)),
    "study, firm floor": TierCase(
        "study", Options(requests=20, seed=1), ("plant.sensing.slip=null",), (FULL, 1)
    ),
    "lab_a": TierCase("lab_a", Options(user="random", requests=6, seed=1)),
    "lab_a, curious": TierCase(
        "lab_a", Options(user="random:curious", duration_s=400.0, seed=1), response=False
    ),
}


@dataclass(frozen=True, slots=True)
class TierRun:
    """The figures of a run, and its CPU, µs per 33 ms."""

    figures: Mapping[str, Any]
    cpu_us: float

    @property
    def responses(self) -> list[float | None]:
        """Of the requests, in order, s; None: not served."""
        return [request["response_s"] for request in self.figures["request_list"]]


def rows(rounds: int = ROUNDS) -> Iterator[BenchRow]:  # noqa: ARG001  runs are exact
    """Runs at all tiers; then poses, and steps."""
    for name, case in CASES.items():
        yield from run_rows(name, case)
    for name in COMMANDS:
        yield from pose_rows(name)
    yield from step_rows()


def run_rows(name: str, case: TierCase) -> Iterator[BenchRow]:
    """Response, Escapes and the prop's error of the same requests at each tier."""
    found = {tier: run_of(case, tier) for tier in TIERS}
    judge = found[REFERENCE]
    for tier, run in found.items():
        if case.response:
            yield _response_row(name, case, tier, run, judge)
    for tier, run in found.items():
        yield from _other_rows(name, tier, run, judge)


def _response_row(name: str, case: TierCase, tier: int, run: TierRun, judge: TierRun) -> BenchRow:
    row = BenchRow(
        NAME, f"response, {name}", f"tier {tier}", "requests", case.options.requests,
        time_us=run.cpu_us, ratio=run.cpu_us / judge.cpu_us, ratio_to=f"tier {REFERENCE}",
    )  # fmt: skip
    if tier == REFERENCE:
        return row
    told = f"{_mean(run):.3f} s, {_mean(judge):.3f} s at tier {REFERENCE}"
    error, goal = abs(response_difference(run, judge)), GOAL if tier in case.judged else None
    return replace(row, error=error, error_unit="% of response", reference=told, goal=goal)


def _other_rows(name: str, tier: int, run: TierRun, judge: TierRun) -> Iterator[BenchRow]:
    figures, variant = run.figures, f"tier {tier}"
    escapes, taken = figures["escapes"], figures["escape_time_s"]["mean"]
    told = f"{escapes} Escapes, {figures['escape_failures']} failed"
    if taken is not None:
        told += f", {taken:.2f} s each"
    off = float(abs(escapes - judge.figures["escapes"]))
    yield BenchRow(
        NAME, f"escapes, {name}", variant, error=off, error_unit="Escapes",
        reference=f"{told}, {figures['contacts']} contacts",
    )  # fmt: skip
    prop = figures["prop_error_m"]["max"]
    yield BenchRow(NAME, f"prop, {name}", variant, error=prop, error_unit="m", reference="the DEEP")


def run_of(case: TierCase, tier: int) -> TierRun:
    """The run at this tier."""
    setup, options = open_setup(scene=case.scene, sets=case.sets), replace(case.options, tier=tier)
    figures = simulate(setup, options).figures
    return TierRun(figures, cpu_us(figures))


def response_difference(run: TierRun, judge: TierRun) -> float:
    """The mean of the differences of requests served in both, % of the mean response there."""
    pairs = [
        (own, there)
        for own, there in zip(run.responses, judge.responses, strict=False)
        if own is not None and there is not None
    ]
    apart = statistics.fmean(own - there for own, there in pairs)
    return 100.0 * apart / statistics.fmean(there for _, there in pairs)


def _mean(run: TierRun) -> float:
    return float(run.figures["response_s"]["mean"])


# open loop


def pose_rows(name: str) -> Iterator[BenchRow]:
    """How far the bases of tiers 1 and 2 are from that of tier 3 by the same commands."""
    robot, command = load_robot("rbkairos_ur10"), COMMANDS[name]
    judge = driven(physical(robot), command)
    slipping = {variant: on_floor(robot, slip) for variant, slip in FLOORS.items()}
    for variant, base in {"tier 1": ideal(robot), **slipping}.items():
        apart = distances(driven(base, command), judge)
        yield BenchRow(
            NAME, f"pose, {name}", variant, error=math.sqrt(statistics.fmean(d * d for d in apart)),
            error_unit="m, rms", reference=f"tier 3, {max(apart):.3f} m at most in {SECONDS:g} s",
        )  # fmt: skip


def step_rows() -> Iterator[BenchRow]:
    """The physics with steps of several lengths, against short ones."""
    robot, command = load_robot("rbkairos_ur10"), COMMANDS["winding"]
    judge = driven(physical(robot, FINE_S), command)
    for step in STEPS_S:
        base = physical(robot, step)
        begin = time.thread_time()
        found = driven(base, command)
        cpu = (time.thread_time() - begin) / (HZ * SECONDS) * 1e6
        apart = distances(found, judge)
        yield BenchRow(
            NAME, "step", "MuJoCo", "step, ms", 1e3 * step, time_us=cpu,
            error=math.sqrt(statistics.fmean(d * d for d in apart)), error_unit="m, rms",
            reference=f"steps of {1e3 * FINE_S:g} ms, MuJoCo {version('mujoco')}",
        )  # fmt: skip


def ideal(robot: RobotModel) -> MovingBase:
    """The base of tier 1."""
    return SimBase(robot, LIMITS, START)


def on_floor(robot: RobotModel, slip: Slip) -> MovingBase:
    """The base of tier 2."""
    base = SimBase(robot, LIMITS, START)
    base.watch(Track(START), Track(START), SlipperyFloor(slip, seed=1))
    return base


def physical(robot: RobotModel, step_s: float | None = None) -> MovingBase:
    """The base of tier 3, on the same floor; its arm is folded."""
    from hw.sim.physics import Mechanics, physical_robot

    mechanics = None if step_s is None else Mechanics(step=step_s)
    base, _ = physical_robot(robot, LIMITS, START, FLOOR, mechanics)
    return base


def driven(base: MovingBase, command: TimedTwist, seconds: float = SECONDS) -> list[Pose2]:
    """The poses of a base that is commanded in ticks."""
    poses = []
    for n in range(round(seconds * HZ)):
        base.drive(command(n / HZ))
        base.advance(round((n + 1) * 1e9 / HZ))
        poses.append(base.pose)
    return poses


def distances(poses: Sequence[Pose2], others: Sequence[Pose2]) -> list[float]:
    """Between the places of a corner of the outline at the same instants, m."""
    return [
        math.dist(a.transform(*CORNER), b.transform(*CORNER))
        for a, b in zip(poses, others, strict=True)
    ]
