"""From where a person can be escaped at all: made-up approaches to a robot that stands.

The robot stands at the origin; the person comes along the x axis from the negative side. Where a
sign is shown, it is shown when the robot begins: it cannot show what it has not seen.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from cobodeck.avoidable.motion_search import (
    NO_WALLS,
    RADIUS,
    Question,
    RobotLimits,
    RobotState,
    Walk,
    best_motion,
    is_avoidable,
)
from cobodeck.avoidable.motions import GAP
from cobodeck.avoidable.shapes import Array

HALF_LENGTH, HALF_WIDTH, SPEED = 0.565, 0.455, 2.5
"""Outline of the robot with foam, m, and its largest speed in an Escape, m/s."""
STANDING = 1e-6
"""An acceleration with which the robot stays where it is, m/s2."""
YAWS = (0.0, math.pi / 4, math.pi / 2)
"""Yaws of the robot that are tried; the worst counts, rad."""
STOPPING_S = 0.5
"""Time in which a person stops who has seen the sign, s."""
WALL_M = 1.5
"""Distance of the wall behind the robot's centre, m."""
HORIZON_S = 6.0
FARTHEST, EXACT = 10.0, 0.005
"""Distances that are searched, and how exactly, m."""
TURN_RATE = 3.0
"""How fast a person turns on the spot, rad/s."""


@dataclass(frozen=True, slots=True)
class Oncoming:
    """A person who walks straight at a robot that stands.

    Attributes:
        speed: of the person, m/s.
        acceleration: of the robot, m/s2.
        delay_s: from the start of the walk until the robot moves and shows the sign.
        reaction_s: from the sign until the person slows down; None: they do not heed it.
        wall: whether there is a wall WALL_M behind the robot.
        limits: of the robot; None: those of this module, with `acceleration`.
    """

    speed: float = 1.5
    acceleration: float = 1.0
    delay_s: float = 0.2
    reaction_s: float | None = None
    wall: bool = False
    limits: RobotLimits | None = None


def least_distance(approach: Oncoming, aim: int) -> float | None:
    """The least distance of centres, m, from which the aim is met; None: not below FARTHEST.

    The aim is that outlines do not touch (GAP), that centres stay 1.27 m apart (CENTRES), or that
    the robot is never in an Escape zone (ZONES).
    """
    yaws = YAWS if aim == GAP else YAWS[:1]

    def is_met(distance: float) -> bool:
        return all(is_avoidable(asked(approach, distance, yaw, aim)) for yaw in yaws)

    return _least(is_met)


def _least(is_met: Callable[[float], bool]) -> float | None:
    low, high = 0.0, FARTHEST
    if not is_met(high):
        return None
    while high - low > EXACT:
        middle = 0.5 * (low + high)
        low, high = (low, middle) if is_met(middle) else (middle, high)
    return high


def asked(approach: Oncoming, distance: float, yaw: float = 0.0, aim: int = GAP) -> Question:
    """What can be done about an approach that starts at this distance of centres, m."""
    return Question(
        RobotState(0.0, 0.0, yaw),
        approach.limits or _limits(approach.acceleration),
        approaching(approach, distance),
        horizon_s=HORIZON_S,
        delay_s=approach.delay_s,
        walls=wall_behind() if approach.wall else NO_WALLS,
        aim=aim,
        one_side=yaw != YAWS[1],
    )


def _limits(acceleration: float) -> RobotLimits:
    return RobotLimits(acceleration, max(acceleration, 3.0), SPEED, HALF_LENGTH, HALF_WIDTH)


def approaching(approach: Oncoming, distance: float) -> Walk:
    """The person's walk from `distance` in front of the robot; at a wall they stop."""
    times = np.arange(0.0, HORIZON_S + 2.0, 0.01)
    gone = approach.speed * times
    if approach.reaction_s is not None:
        since = np.clip(times - approach.delay_s - approach.reaction_s, 0.0, STOPPING_S)
        late = np.maximum(times - approach.delay_s - approach.reaction_s - STOPPING_S, 0.0)
        gone -= approach.speed * (0.5 * since**2 / STOPPING_S + late)
        gone -= gone[0]  # who saw the sign before setting off is slower from the start
    if approach.wall:
        gone = np.minimum(gone, distance + WALL_M - RADIUS)
    return Walk(times, np.column_stack([gone - distance, 0.0 * times, 0.0 * times]))


def wall_behind() -> Array:
    """The edges of a long wall WALL_M behind the robot."""
    near, far, end = WALL_M, WALL_M + 0.2, 50.0
    corners = [(near, -end), (far, -end), (far, end), (near, end)]
    return np.array([(*a, *b) for a, b in zip(corners, corners[1:] + corners[:1], strict=True)])


def gap_beside_turning(
    off: float, distance: float = 2.5, seen: str = "turn", approach: Oncoming | None = None
) -> float:
    """The largest gap, m, to a person who turns by `off`, rad, and then walks at the robot.

    The robot begins `delay_s` after it could see something: the turn, or only the walk (`seen`).
    """
    approach = approach or Oncoming()
    turning_s = off / TURN_RATE
    start_s = approach.delay_s + (0.0 if seen == "turn" else turning_s)
    walked = approaching(replace(approach, delay_s=start_s - turning_s), distance)
    walk = Walk(
        np.concatenate([[0.0], walked.times + turning_s]),
        np.concatenate([[(-distance, 0.0, off)], walked.places]),
    )
    at_once = replace(approach, delay_s=0.0)
    found = [
        best_motion(replace(asked(at_once, distance, yaw), walk=walk, start_s=start_s))
        for yaw in YAWS
    ]
    return min(-RADIUS if motion is None else motion.gap for motion in found)
