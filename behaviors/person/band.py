"""Band: the distance that is comfortable beside a user who walks, 3 to 4 m (R91)."""

from __future__ import annotations

import math

import numpy as np

from behaviors.person.drives import STEP_S, Array
from hw import compiled, example
from hw.scene import Point
from states.navigation.exact import distance_to_nearest


@compiled
def off_the_band(
    trajectories: Array,
    lines: Array,
    room: float,
    far: float,
    beyond: float,
    close: float,
    dread: float,
) -> Array:
    """Cost of distances to the user outside of `room` to `far`, m, along trajectories, (n,), m2.

    Sum over the steps of the squared deficit, or of the squared excess times `beyond`; the squared
    deficit below `close`, m, is added `dread` times. The mean over the user's lines.
    """
    found = np.zeros(len(trajectories))
    for i in range(len(trajectories)):
        for j in range(len(lines)):
            for step in range(trajectories.shape[1]):
                dx = trajectories[i, step, 0] - lines[j, step, 0]
                dy = trajectories[i, step, 1] - lines[j, step, 1]
                square = dx * dx + dy * dy
                if room * room <= square <= far * far:
                    continue
                distance = math.sqrt(square)
                near, excess, missing = room - distance, distance - far, close - distance
                found[i] += max(0.0, near) ** 2 + beyond * max(0.0, excess) ** 2
                found[i] += dread * max(0.0, missing) ** 2
        found[i] /= len(lines)
    return found


@compiled
def haste(trajectories: Array, user: Point, keep: float, acceleration: float) -> Array:
    """Excess of the robot's closing speed to where the user is now, (n,), m2/s2.

    A user who walks away may stop and turn. A stop from the speed v takes v^2 / 2a, which must fit
    in the distance beyond `keep`, m; the squared excess of the speed is summed over the steps.
    """
    found = np.zeros(len(trajectories))
    for i in range(len(trajectories)):
        before = math.hypot(trajectories[i, 0, 0] - user[0], trajectories[i, 0, 1] - user[1])
        for step in range(1, trajectories.shape[1]):
            dx, dy = trajectories[i, step, 0] - user[0], trajectories[i, step, 1] - user[1]
            distance = math.hypot(dx, dy)
            closing = (before - distance) / STEP_S
            admitted = math.sqrt(2.0 * acceleration * max(0.0, distance - keep))
            found[i] += max(0.0, closing - admitted) ** 2
            before = distance
    return found


@compiled
def cornered(places: Array, walls: Array, open_m: float) -> Array:
    """Squared clearance from walls that each place (n, 2) lacks, (n,), m2."""
    found = np.empty(len(places))
    for i in range(len(places)):
        px, py = places[i, 0], places[i, 1]
        found[i] = max(0.0, open_m - distance_to_nearest(px, py, walls)) ** 2
    return found


@example
def _example() -> None:
    drives = np.zeros((1, 2, 2))
    off_the_band(drives, np.zeros((1, 2, 3)), 3.0, 4.0, 1.0, 1.0, 1.0)
    haste(drives, (0.0, 0.0), 1.0, 1.0)
    cornered(np.ones((1, 2)), np.ones((1, 4)), 1.0)
