"""What the physics alone costs: base, ramps and stop chain beside one person, compiled. Frozen.

30 ticks a second, four cycles of the chain a tick (120 Hz). Each cycle looks at the person's gap
(rectangle against disc), computes the speed at which braking still ends in time (S >= S_p), limits
the closing part of the command, ramps the velocity (one limit for speeding up, one for braking) and
moves the base. It checks, records and decides nothing: the limit of what a simulation can reach.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable

import numpy as np
from numba import njit
from numpy.typing import NDArray

CYCLES, PERIOD = 4, 1.0 / 120.0
HALF_X, HALF_Y, RADIUS = 0.565, 0.455, 0.5
SPEED_UP, BRAKE, YAW, REACTION, WALK, MARGIN = 1.0, 1.0, 2.0, 0.1, 1.6, 0.05
TICKS = 30_113


def prepare() -> Callable[[], float]:
    """Compile it; returns what simulates 1004 s and tells the CPU, µs per 33 ms."""
    rollout(np.zeros(6), 10)

    def measure() -> float:
        state = np.zeros(6)
        begin = time.process_time()
        rollout(state, TICKS)
        return (time.process_time() - begin) / TICKS * 1e6

    return measure


@njit(cache=False)
def gap(dx: float, dy: float, yaw: float) -> float:
    """Gap, m, between the robot's rectangle and the person's disc at (dx, dy) from it."""
    c, s = math.cos(yaw), math.sin(yaw)
    x, y = c * dx + s * dy, c * dy - s * dx
    ox, oy = max(abs(x) - HALF_X, 0.0), max(abs(y) - HALF_Y, 0.0)
    return math.sqrt(ox * ox + oy * oy) - RADIUS


@njit(cache=False)
def rollout(state: NDArray[np.float64], ticks: int) -> float:
    """Advance x, y, yaw and their velocities (6,), m and rad; returns the least gap, m."""
    px, py, least = 4.0, 2.0, 1e9
    for k in range(ticks):
        phase = k % 300
        walk = 1.2 if phase < 100 else 0.0
        px += walk * math.cos(0.001 * k) / 30.0 * (1.0 if (k // 300) % 2 else -1.0)
        gx, gy = 3.0 * math.cos(0.0007 * k), 3.0 * math.sin(0.0007 * k)
        ex, ey = gx - state[0], gy - state[1]
        far = math.sqrt(ex * ex + ey * ey) + 1e-9
        want = min(1.5, 2.0 * far)
        for _ in range(CYCLES):
            dx, dy = px - state[0], py - state[1]
            apart = math.sqrt(dx * dx + dy * dy) + 1e-9
            free = gap(dx, dy, state[2]) - MARGIN
            least = min(least, free)
            vx, vy = ex / far * want, ey / far * want
            closing = (vx * dx + vy * dy) / apart
            room = free - walk * REACTION
            b = BRAKE * (REACTION + walk / BRAKE)
            allowed = max(0.0, -b + math.sqrt(max(b * b + 2.0 * BRAKE * room, 0.0)))
            if closing > allowed:
                cut = (closing - allowed) / apart
                vx, vy = vx - cut * dx, vy - cut * dy
            ax, ay = vx - state[3], vy - state[4]
            need = math.sqrt(ax * ax + ay * ay)
            slower = vx * vx + vy * vy < state[3] * state[3] + state[4] * state[4]
            step = (BRAKE if slower else SPEED_UP) * PERIOD
            share = 1.0 if need <= step else step / need
            state[3] += share * ax
            state[4] += share * ay
            turn = max(-YAW * PERIOD, min(YAW * PERIOD, -state[5]))
            state[5] += turn
            state[0] += state[3] * PERIOD
            state[1] += state[4] * PERIOD
            state[2] += state[5] * PERIOD
    return least
