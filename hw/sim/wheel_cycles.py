"""The cycles of simulated wheels within one step of the world, as one compiled call.

Each cycle ramps the velocity towards the wanted one, asks the safety chain, brakes away what it
cuts, and moves wheels and body. Everything is kept in the record `BODY`.
"""

from __future__ import annotations

import math

import numpy as np

from hw.jit import Struct, Structs, compiled, example, record_type, wrapped
from hw.motion import RECKONING, reckoned
from hw.safety import (
    CYCLE,
    CYCLE_NS,
    RAMPS,
    RULE,
    PlanarPose,
    PlanarState,
    Velocity,
    cycle as chain_cycle,
    limited,
    toward,
    velocity_after,
)
from hw.sim.slip import FLOOR, slide, suffices

TURN_STEP = 0.01
"""Largest rotation, rad, within which the direction of the wanted velocity is held constant."""
NOTED = 32
"""Cycles that are noted in one call."""

BODY = record_type(
    ("ramps", RAMPS), ("mass", "f8"), ("inertia", "f8"), ("rolling", "f8"),
    ("chained", "?"), ("noisy", "?"), ("slips", "?"),
    ("omni", "?"), ("omni_wanted", "?"), ("braked", "?"), ("target", "f8", (3,)),
    ("place", "f8", (3,)), ("velocity", "f8", (3,)), ("kinetic", "f8"), ("twist", "f8", (3,)),
    ("error", "f8", (3,)), ("distance", "f8"), ("energy", "f8"), ("floor", FLOOR),
    ("cycles", "i8"), ("done", "i8"),
    ("noted", "i8"), ("stamps", "i8", (NOTED,)), ("bodies", "f8", (NOTED, 3)),
    ("wheels", "f8", (NOTED, 3)),
)  # fmt: skip
"""A base: its limits, kg, kg m2 and N; how it is driven; the wanted velocity `target` (base frame).

`place` is that of the wheels, map_from_base, `velocity` theirs along the axes of the map, `kinetic`
their energy, J, and `twist` their velocity in the base frame. The body is at the same place, or
with `slips` at that of the `floor`; `error` is that of its measured pose. `distance`, m, and
`energy`, J, add up. Of the `cycles` of a step so many are `done`. The last call has `noted` so many
instants, ns, and the places of body and wheels then.
"""

Moved = tuple[bool, bool, PlanarPose, Velocity, float, float]
"""Whether `move` has to be called again, for the cycles left; whether the wheels stand; pose and
twist of the body, distance and energy."""


@compiled
def move(
    bodies: Structs, since: int, until: int, rules: Structs, rows: Structs, reckonings: Structs
) -> Moved:
    """Move from cycle to cycle, as far as the chain admits it.

    Args:
        bodies: (1,) of `BODY`.
        since: the start, ns.
        until: the end, ns.
        rules: (1,) of `hw.safety.RULE`, used if the body is `chained`; so are the others.
        rows: of its log.
        reckonings: (1,) of `hw.motion.RECKONING`, used if the rule `reckons`.
    """
    body, rule, whole, done = bodies[0], rules[0], until - since, bodies[0].done
    turning = max(abs(body.velocity[2]), abs(body.target[2])) * (whole * 1e-9)
    if done == 0:
        pieces = max(1, math.ceil(turning / TURN_STEP))
        body.cycles = max(pieces, -(-whole // CYCLE_NS)) if body.chained else pieces
    cycles, body.noted = body.cycles, 0
    while done < cycles and body.noted < NOTED and (not body.slips or suffices(body.floor)):
        _cycle(
            body, rule, rows, reckonings[0], since + whole * done // cycles, whole * 1e-9 / cycles
        )
        done += 1
        _note(body, since + whole * done // cycles)
    body.done = done % cycles
    return _moved(body, done < cycles)


@compiled
def _cycle(
    body: Struct, rule: Struct, rows: Structs, reckoning: Struct, now_ns: int, h: float
) -> None:
    """One cycle of h s, from now on."""
    yaw = body.place[2]
    motion = _toward(body, _tuple(body.target), h, body.braked)
    twist = velocity_after(yaw, motion, body.omni)
    if body.chained:
        rule.holonomic = body.omni
        base, moves = _located(body, rule, reckoning, now_ns), (True, _tuple(body.twist))
        stamp = rule.stamp_ns if rule.commanded else now_ns
        row = chain_cycle(rule, rows, now_ns, stamp, twist, base, moves)
        if row.cut:
            slower = limited(body.ramps, _tuple(row.admitted), body.omni_wanted)
            motion = _toward(body, slower, h, True)
            twist = velocity_after(yaw, motion, body.omni)
    step(body, motion)
    body.twist[0], body.twist[1], body.twist[2] = twist


@compiled
def step(body: Struct, motion: PlanarState) -> None:
    """Move the wheels, and the body with them or over the floor."""
    dx, dy, turn, (vx, vy, wz) = motion
    if body.slips:
        way = slide(body.floor, body.place[2], _tuple(body.velocity), motion)
    else:
        way = math.hypot(dx, dy)
    body.place[0] += dx
    body.place[1] += dy
    body.place[2] = wrapped(body.place[2] + turn)
    body.velocity[0], body.velocity[1], body.velocity[2] = vx, vy, wz
    body.distance += way
    # braking costs as much as speeding up: no energy is recovered
    kinetic = 0.5 * (body.mass * (vx * vx + vy * vy) + body.inertia * wz * wz)
    body.energy += abs(kinetic - body.kinetic) + body.rolling * way
    body.kinetic = kinetic


@compiled
def _tuple(values: Structs) -> tuple[float, float, float]:
    return values[0], values[1], values[2]


@compiled
def _toward(body: Struct, target: Velocity, h: float, braked: bool) -> PlanarState:
    """The motion of h s towards a velocity, within ramps or brakes."""
    return toward(body.ramps, body.place[2], _tuple(body.velocity), target, h, body.omni, braked)


@compiled
def _place(body: Struct) -> PlanarPose:
    """The pose of the body."""
    return _tuple(body.floor.place) if body.slips else _tuple(body.place)


@compiled
def _located(
    body: Struct, rule: Struct, reckoning: Struct, now_ns: int
) -> tuple[bool, PlanarPose, float]:
    """The pose of the body as the chain knows it, with its sigma, m."""
    if rule.reckons:
        return reckoned(reckoning, now_ns)
    x, y, yaw = _place(body)
    if body.noisy:
        x, y, yaw = x + body.error[0], y + body.error[1], wrapped(yaw + body.error[2])
    return True, (x, y, yaw), 0.0


@compiled
def _note(body: Struct, now_ns: int) -> None:
    n = body.noted
    body.stamps[n] = now_ns
    body.bodies[n, 0], body.bodies[n, 1], body.bodies[n, 2] = _place(body)
    body.wheels[n, 0], body.wheels[n, 1], body.wheels[n, 2] = _tuple(body.place)
    body.noted = n + 1


@compiled
def _moved(body: Struct, left: bool) -> Moved:
    vx, vy, wz = body.velocity
    stands = vx == 0.0 and vy == 0.0 and wz == 0.0
    return left, stands, _place(body), _tuple(body.twist), body.distance, body.energy


@compiled
def step_once(bodies: Structs, now_ns: int, motion: PlanarState) -> Moved:
    """Move by a motion that ends now."""
    body = bodies[0]
    step(body, motion)
    body.noted = 0
    _note(body, now_ns)
    return _moved(body, False)


@example
def _example() -> None:
    bodies = np.zeros(1, BODY)
    bodies["mass"] = bodies["inertia"] = bodies["ramps"]["gentle"] = 1.0
    others = np.zeros(1, RULE), np.zeros(1, CYCLE), np.zeros(1, RECKONING)
    move(bodies, 0, CYCLE_NS, *others)
    step_once(bodies, CYCLE_NS, (0.0, 0.0, 0.0, (0.0, 0.0, 0.0)))
