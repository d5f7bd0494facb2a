"""How long the arm moves for a touch, by planner and by how exactly the base stands.

The paper's spread of the arm's times, 3.20 to 5.30 s, has two candidates: its planner, which is
random, and its base, which stops up to the goal tolerance of 20 cm away from the pose (5.3).
"""

from __future__ import annotations

import math
import random
from itertools import chain
from typing import Any

from cobodeck.evaluate import spread
from cobodeck.setup import Setup, open_setup
from hw import Pose2, Pose3
from states.arm import ArmSituation
from states.arm.planning import NoPlan, in_turn, planner

SOLVERS = ("lines_first", "rrt_connect")
OFFSETS_M = (0.0, 0.2)
"""How far the base stands from its pose at most, m."""
TOUCHES = 60
DEEP_Z = 1.5
"""Height of the DEEP, m (R132)."""


def arm_times(scene: str, profile: str) -> list[dict[str, Any]]:
    """A row per planner and offset of the base: mean, SD, min and max of the motion's time, s.

    The base stands straight behind the DEEP as Haptic places it first (R76), shifted by a random
    offset that is the same for all planners; the person stands on the other side.
    """
    setup = open_setup(scene=scene, profile=profile)
    return [_row(setup, solver, offset) for offset in OFFSETS_M for solver in SOLVERS]


def _row(setup: Setup, solver: str, offset: float) -> dict[str, Any]:
    chance = random.Random(f"arm {offset}")
    times = [_time(setup, _shift(chance, offset), solver) for _ in range(TOUCHES)]
    known = [time for time in times if time is not None]
    about = {"solver": solver, "offset_m": offset, "planned": len(known), "of": len(times)}
    return about | spread(known, ("mean", "sd", "min", "max"))


def _shift(chance: random.Random, offset: float) -> tuple[float, float]:
    """A place drawn evenly from a disc of this radius, m."""
    away, bearing = offset * math.sqrt(chance.random()), chance.uniform(-math.pi, math.pi)
    return away * math.cos(bearing), away * math.sin(bearing)


def _time(setup: Setup, shift: tuple[float, float], solver: str) -> float | None:
    """Time of the motion to the DEEP, s; None without a plan."""
    haptic, workspace = setup.profile.settings.haptic, setup.environment.workspace
    disc = setup.environment.room.largest_free_disc
    base = Pose2(disc.x, disc.y)
    there = base.transform(haptic.radius, 0.0)
    deep = Pose3.from_yaw(*there, DEEP_Z, math.pi)
    user = Pose2(there[0] + haptic.deep_ahead, there[1], math.pi)
    standing = Pose2(base.x + shift[0], base.y + shift[1])
    situation = ArmSituation(standing, user, workspace.parked)
    queries = workspace.reaching(situation, deep)
    first = next(queries, None)
    if first is None:
        return None
    work = in_turn(chain([first], queries), planner(solver))
    while True:
        try:
            next(work)
        except StopIteration as done:
            answer = done.value
            return None if isinstance(answer, NoPlan) else float(answer.trajectory.duration)
