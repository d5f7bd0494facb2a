"""Dead reckoning of robot and user between measured poses that are noisy and late.

Replanning from each measured pose would follow every error of it. The velocities sent are known
exactly, and a pose reckoned from them moves as smoothly as the plan; measured poses only correct
it, by a tenth of the difference per cycle at 30 Hz, so that replanning gives the same plan again.
Differences beyond noise (the robot was pushed, or relocalized) are corrected at once. m, s, rad; in
the map.

What is remembered stands in arrays, which compiled functions update: the track of the robot, with
what the delay of the wheels is estimated from at its beginning, and the place of the user.
"""

from __future__ import annotations

import math

import numpy as np

from hw import compiled, wrapped
from hw.scene import Point
from states.navigation.exact import Array, Triple

MEMORY = 1.0 / 3.0
"""Time constant with which measured poses are averaged, s."""
BAND = 0.06
"""Largest difference between reckoned and measured pose that is left after an update, m and rad."""
LEAK = 1.0
"""Time constant of the sums of missing distance and change of velocity, s."""
FORGOTTEN = 4.0
"""Time constant with which older pairs of these sums are forgotten, s."""
DOUBT = 7e-4
"""Weight of the prior delay against the squared changes of velocity, m2/s."""
LONGEST_DELAY = 0.3
"""Upper limit of the estimated delay, s."""

PRIOR, DELAY, PRODUCTS, SQUARES, MISSING, CHANGED = 0, 1, 2, 3, 4, 6
"""Where an array with what the delay is estimated from has these; the last two are vectors."""
COUNT, POSE, SENT, MEASURED = 8, 9, 12, 15
"""And where that of a robot has, beyond these, the number of cycles, the last pose, the velocity
sent, and the position measured."""


@compiled
def share_of(error: float, count: float, dt: float) -> float:
    """Gain with which the count-th measurement corrects a difference, m or rad, 0 to 1.

    The first measurements are averaged. A larger error is brought down to what an error of BAND
    would leave: (1 - gain) error = (1 - share) BAND.
    """
    share = min(1.0, max(dt / MEMORY, 1.0 / count))
    if error > BAND:
        share = max(share, 1.0 - BAND * (1.0 - share) / error)
    return share


@compiled
def forget_delay(delay: Array) -> None:
    """Start again from the prior delay: the missing distance had another cause."""
    delay[DELAY] = delay[PRIOR]
    delay[PRODUCTS : CHANGED + 2] = 0.0


@compiled
def estimate_delay(delay: Array, missing: Point, changed: Point, dt: float) -> None:
    """Estimate how late the wheels follow what was sent, s, dead time and lag together.

    Over any interval the distance driven falls short of the distance sent by the delay times the
    change of velocity: missing = delay * changed. The delay is the least-squares solution over
    exponentially forgotten sums, sum(missing . changed) / sum(changed . changed), regularised
    towards the prior delay. This adds a cycle of dt s: its missing distance, m, and its change of
    velocity, m/s.
    """
    kept = math.exp(-dt / LEAK)
    mx, my = kept * delay[MISSING] + missing[0], kept * delay[MISSING + 1] + missing[1]
    cx, cy = kept * delay[CHANGED] + changed[0], kept * delay[CHANGED + 1] + changed[1]
    delay[MISSING], delay[MISSING + 1], delay[CHANGED], delay[CHANGED + 1] = mx, my, cx, cy
    kept = math.exp(-dt / FORGOTTEN)
    delay[PRODUCTS] = kept * delay[PRODUCTS] + dt * (mx * cx + my * cy)
    delay[SQUARES] = kept * delay[SQUARES] + dt * (cx * cx + cy * cy)
    found = (delay[PRODUCTS] + DOUBT * delay[PRIOR]) / (delay[SQUARES] + DOUBT)
    delay[DELAY] = min(LONGEST_DELAY, max(0.0, found))


def track_of(delay: float) -> Array:
    """The track of a robot that has not been seen; `delay`, s, is a first guess of the wheels'."""
    track = np.zeros(MEASURED + 2)
    track[PRIOR] = track[DELAY] = delay
    return track


@compiled
def reckon_pose(track: Array, measured: Triple, twist: Triple, sent: Triple, dt: float) -> Triple:
    """The pose at the instant from which the velocity sent now acts.

    `measured` is map_from_base, `twist` the measured velocity and `sent` the one that the base
    should have by now, both in the map; `dt` is the time since the last cycle, s.
    """
    track[COUNT] += 1.0
    count = track[COUNT]
    x, y, yaw = track[POSE], track[POSE + 1], track[POSE + 2]
    if count > 1.0:
        last_x, last_y, last_turn = track[SENT], track[SENT + 1], track[SENT + 2]
        vx, vy = 0.5 * (last_x + sent[0]), 0.5 * (last_y + sent[1])
        wz = 0.5 * (last_turn + sent[2])
        gone_x, gone_y = measured[0] - track[MEASURED], measured[1] - track[MEASURED + 1]
        missing, changed = (
            (dt * vx - gone_x, dt * vy - gone_y),
            (sent[0] - last_x, sent[1] - last_y),
        )
        estimate_delay(track, missing, changed, dt)
        x, y, yaw = x + dt * vx, y + dt * vy, wrapped(yaw + dt * wz)
    track[MEASURED], track[MEASURED + 1] = measured[0], measured[1]
    track[SENT], track[SENT + 1], track[SENT + 2] = sent
    late = track[DELAY]
    ex, ey = measured[0] + late * twist[0] - x, measured[1] + late * twist[1] - y
    turn = wrapped(wrapped(measured[2] + late * twist[2]) - yaw)
    share, turned = share_of(math.hypot(ex, ey), count, dt), share_of(abs(turn), count, dt)
    found = x + share * ex, y + share * ey, wrapped(yaw + turned * turn)
    track[POSE], track[POSE + 1], track[POSE + 2] = found
    return found


@compiled
def lose_track(track: Array) -> None:
    """The base did not follow: start again from the next measured pose."""
    forget_delay(track)
    track[COUNT] = 0.0


@compiled
def reckon_place(place: Array, measured: Point, velocity: Point, dt: float) -> Point:
    """The user's position, integrated from their velocity and corrected by measured positions.

    `place` has the last one and the number of cycles so far.
    """
    place[2] += 1.0
    if place[2] > 1.0:
        place[0], place[1] = place[0] + dt * velocity[0], place[1] + dt * velocity[1]
    ex, ey = measured[0] - place[0], measured[1] - place[1]
    share = share_of(math.hypot(ex, ey), place[2], dt)
    place[0], place[1] = place[0] + share * ex, place[1] + share * ey
    return place[0], place[1]
