"""Run time of the simulation against error: its time step, the tick rate, the beams of a scanner.

Times are of one simulated second. The world is given the same commands at the same instants
whatever its step, and no command depends on where the robot is.
"""

from __future__ import annotations

import statistics
from collections.abc import Iterable, Iterator, Mapping
from functools import cache, partial
from typing import Any

from cobodeck.bench.harness import ROUNDS, BenchRow, TimedPoint, Work, timed, times
from cobodeck.bench.localization import SCENE as ROOM, TRUTH, by_localizer, ride, rmse_cm
from cobodeck.run import simulate
from cobodeck.setup import TICK_HZ, Options, Setup, open_setup
from hw import Pose2, Twist2
from hw.model import MotionLimits, SensorErrors, SensorModel, load_robot
from hw.scene import load_scene
from hw.sim import World
from states.maps import Field, room_field

NAME = "simulation"
SCENE, ROBOT = "study", "rbkairos_ur10"
TICKS_HZ, FINEST_HZ = (15, 20, 30, 60, 120), 240
"""The safety chain refuses commands that come more seldom than every 80 ms."""
REQUESTS, DURATION_S = 5, 600.0
STEPS_MS, FINEST_MS = (250, 100, 50, 20, 10, 5), 1
COMMAND_MS, DRIVE_S = 500, 20
COMMANDS = (
    Twist2(0.8, 0.0, 0.5), Twist2(0.3, 0.6, -0.8), Twist2(-0.9, 0.2, 0.7), Twist2(0.0, -0.7, 0.0),
    Twist2(0.0, 0.0, -1.0), Twist2(0.2, 0.2, 0.4),
)  # fmt: skip
"""They are given in turn, in the base frame, and lead nowhere near a wall."""
LIMITS = MotionLimits(base_speed=1.2, base_acceleration=1.0)
BEAMS = (19, 46, 91, 181, 541)
RIDE_S = 20.0
MOST_ROUNDS = 3


def rows(rounds: int = ROUNDS) -> Iterator[BenchRow]:
    """All curves."""
    some = min(rounds, MOST_ROUNDS)
    yield from timed(list(step_points()), some)
    yield from timed(list(tick_points()), some)
    yield from timed(list(beam_points()), some)


# time step


def step_points(steps_ms: Iterable[int] = STEPS_MS) -> Iterator[TimedPoint]:
    """The base driven blindly, on ideal wheels and on slipping ones, over the world's step."""
    for variant, slips in (("ideal wheels", False), ("slipping wheels", True)):
        exact = driven(FINEST_MS, slips)
        for step in steps_ms:
            move = partial(driven, step, slips)
            off = [a.distance_to(b) for a, b in zip(move(), exact, strict=True)]
            row = BenchRow(
                NAME, "drive by time step", variant, "step", 1e-3 * step,
                error=round(1e3 * statistics.fmean(off), 6), error_unit="mm off, mean",
                reference=f"the same at {FINEST_MS} ms",
            )  # fmt: skip
            yield row, Work(times(move), items=DRIVE_S)


def driven(step_ms: int, slips: bool) -> list[Pose2]:
    """Drive by `COMMANDS`; returns the pose at each new command."""
    sensing, sensors = SensorErrors() if slips else None, SensorModel(seed=1)
    world = World(
        load_scene(ROOM), load_robot(ROBOT), None, LIMITS, sensing=sensing, sensors=sensors
    )
    poses = []
    for now in range(0, 1000 * DRIVE_S, step_ms):
        world.advance(now * 1_000_000)
        if now % COMMAND_MS == 0:
            poses.append(world.base.pose)
            world.base.drive(COMMANDS[now // COMMAND_MS % len(COMMANDS)])
    return poses


# tick rate


def tick_points(rates: Iterable[int] = TICKS_HZ) -> Iterator[TimedPoint]:
    """Responses of whole runs of tier 1 over the tick rate."""
    exact = _responses(FINEST_HZ)
    for hz in rates:
        run = partial(_responses, hz)
        row = BenchRow(
            NAME, "response by tick rate", "cobodeck", "Hz", hz,
            error=round(100.0 * abs(run() / exact - 1.0), 3), error_unit="% of the mean response",
            reference=f"the same at {FINEST_HZ} Hz", default=hz == TICK_HZ,
        )  # fmt: skip
        yield row, Work(times(run), items=_simulated_s(hz))


def _responses(hz: int) -> float:
    """The mean response of a run, s."""
    return float(_run(hz)["response_s"]["mean"])


def _simulated_s(hz: int) -> int:
    return round(float(_run(hz)["sim_s"]))


def _run(hz: int) -> Mapping[str, Any]:
    options = Options(requests=REQUESTS, seed=3, duration_s=DURATION_S)
    return simulate(_setup(hz), options).figures


@cache
def _setup(hz: int) -> Setup:
    return open_setup(scene=SCENE, tick_hz=hz)


# beams


def beam_points(beams: Iterable[int] = BEAMS) -> Iterator[TimedPoint]:
    """The full simulation of a drive with the localizer, over the beams of its two scanners."""
    field = room_field(load_scene(ROOM).room)
    for number in beams:
        errors = partial(_localized, field, number)
        row = BenchRow(
            NAME, "localization by beams", "cobodeck", "beams", number,
            error=rmse_cm(errors(), RIDE_S), error_unit="cm rmse", reference=TRUTH,
            default=number == BEAMS[-1],
        )  # fmt: skip
        yield row, Work(times(errors), items=round(RIDE_S))


def _localized(field: Field, beams: int) -> list[float]:
    return by_localizer(field, ride(RIDE_S, beams=beams), beams)
