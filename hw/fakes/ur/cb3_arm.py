"""Joint motion of the fake UR controller: limited speeds, with lag, cycle by cycle; rad, s.

A motion is a generator: stepped once per cycle, it yields the joints (rad) and ends on arrival.
Stops use a single deceleration instead of the controller's own ramps.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

CYCLE_S = 0.008
"""Period of a CB3 controller, s: it runs at 125 Hz."""
FASTEST = (2.094, 2.094, 3.142, 3.142, 3.142, 3.142)
"""Largest speeds of a UR10's joints, rad/s."""
STOP = 15.0
"""Deceleration of the controller's own stops, rad/s2."""

Joints = tuple[float, ...]
JointMotion = Iterator[Joints]


def move(start: Joints, goal: Sequence[float], speed: float, acceleration: float) -> JointMotion:
    """movej: all joints together, with a trapezoidal profile for the joint that moves furthest."""
    way = max(abs(b - a) for a, b in zip(start, goal, strict=True))
    if way < 1e-9:
        return
    acceleration, speed = max(acceleration, 1e-3), max(speed, 1e-3)
    speed = min(speed, math.sqrt(way * acceleration))
    ramp = speed / acceleration
    whole = way / speed + ramp
    t = 0.0
    while t < whole:
        t = min(whole, t + CYCLE_S)
        share = _trapezoid(t, speed, acceleration, ramp, whole, way) / way
        yield tuple(a + share * (b - a) for a, b in zip(start, goal, strict=True))


def _trapezoid(
    t: float, speed: float, acceleration: float, ramp: float, whole: float, way: float
) -> float:
    if t < ramp:
        return 0.5 * acceleration * t * t
    if t > whole - ramp:
        return way - 0.5 * acceleration * (whole - t) ** 2
    return speed * (t - 0.5 * ramp)


def servo(joints: Joints, target: Sequence[float], lookahead: float, scaling: float) -> Joints:
    """One cycle of servoj: towards the target with a lag of half the lookahead, limited speeds."""
    share = 1.0 - math.exp(-CYCLE_S / max(0.5 * lookahead, 1e-3))
    found = []
    for angle, wanted, fastest in zip(joints, target, FASTEST, strict=True):
        most = fastest * CYCLE_S * scaling
        found.append(angle + max(-most, min(most, share * (wanted - angle))))
    return tuple(found)


def speed(
    joints: Joints, velocities: Joints, wanted: Sequence[float], acceleration: float
) -> Joints:
    """One cycle of speedj: towards velocities, with an acceleration."""
    change = max(acceleration, 1e-3) * CYCLE_S
    return tuple(
        angle + CYCLE_S * (v + max(-change, min(change, w - v)))
        for angle, v, w in zip(joints, velocities, wanted, strict=True)
    )


def brake(joints: Joints, velocities: Joints, deceleration: float) -> JointMotion:
    """Slow all joints down together, until they stand."""
    fastest = max(abs(v) for v in velocities)
    left = fastest
    while left > 0.0:
        left = max(0.0, left - max(deceleration, 0.1) * CYCLE_S)
        share = left / fastest
        joints = tuple(q + CYCLE_S * share * v for q, v in zip(joints, velocities, strict=True))
        yield joints
