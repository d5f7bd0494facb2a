"""Where a person goes: as recorded, as without the stop sign, and in made-up cases."""

from __future__ import annotations

import math

import numpy as np

from cobodeck.avoidable.motion_search import RADIUS, Walk
from cobodeck.avoidable.recorded_escapes import RecordedRun
from cobodeck.avoidable.shapes import free_way

OBEYED_S = 1.5
"""A sign shown for longer than this has been obeyed by whoever heeds it, s."""
LOOK_BACK_S = 0.04
"""The velocity at an instant is that over this time before it, s."""
AHEAD_S = 8.0
"""How long an unwarned person walks on at most, s."""
MOVING = 0.2
"""A person slower than this stands, m/s."""
_STEPS_OFF, _PAUSE_S = 0.05, 0.5


def unwarned(run: RecordedRun, start_s: float, until_s: float) -> Walk:
    """The person from `start_s` on, had they not been shown the sign.

    The recorded way as far as the sign appears, if it does by `until_s`; then straight on with the
    velocity at that instant, up to RADIUS from a wall. If the sign is there at the start already,
    they go on from where they are with the velocity that they had when it appeared.
    """
    sign_s = sign_at(run, start_s, until_s)
    if sign_s is None:
        return run.way
    turn_s = max(sign_s, start_s)
    before = run.times < turn_s
    x, y, view = run.way.at(np.array([turn_s]))[0].tolist()
    vx, vy = velocity_at(run, sign_s)
    speed = math.hypot(vx, vy)
    if speed < MOVING:
        times, places = np.array([turn_s]), np.array([[x, y, view]])
    else:
        left = free_way(run.walls, (x, y), (vx / speed, vy / speed), RADIUS, speed * AHEAD_S)
        end = (x + left * vx / speed, y + left * vy / speed)
        view = view + math.remainder(math.atan2(vy, vx) - view, math.tau)
        times = np.array([turn_s, turn_s + max(left / speed, 1e-6)])
        places = np.array([[x, y, view], [*end, view]])
    return Walk(
        np.concatenate([run.times[before], times]), np.concatenate([run.person[before], places])
    )


def sign_at(run: RecordedRun, start_s: float, until_s: float) -> float | None:
    """When the sign appeared that is shown first between two instants; None if none is.

    One that the person has had OBEYED_S for at the start does not count.
    """
    shown = run.shown & (run.times >= start_s - 1e-6) & (run.times <= until_s)
    if not shown.any():
        return None
    n = int(shown.argmax())
    while n and run.shown[n - 1]:
        n -= 1
    since = float(run.times[n])
    return None if start_s - since > OBEYED_S else since


def velocity_at(run: RecordedRun, at_s: float) -> tuple[float, float]:
    """Velocity of the person just before an instant, m/s."""
    (x0, y0, _), (x1, y1, _) = run.way.at(np.array([at_s - LOOK_BACK_S, at_s])).tolist()
    return (x1 - x0) / LOOK_BACK_S, (y1 - y0) / LOOK_BACK_S


def walking_since(run: RecordedRun, at_s: float) -> float:
    """When the person last began to walk before an instant, s; pauses below 0.5 s do not count."""
    steps = np.diff(run.person[:, :2], axis=0)
    speeds = np.hypot(*steps.T) / np.diff(run.times)
    walks = np.flatnonzero((speeds > _STEPS_OFF) & (run.times[1:] <= at_s + 1e-6))
    if not len(walks):
        return at_s
    pauses = np.flatnonzero(np.diff(run.times[walks]) > _PAUSE_S)
    first = walks[pauses[-1] + 1] if len(pauses) else walks[0]
    return float(run.times[first])
