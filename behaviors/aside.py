"""How long the robot needs to get out of the line that somebody walks."""

from __future__ import annotations

import math


def time_aside(lateral: float, drift: float, contact: float, acceleration: float) -> float:
    """Time until the robot, driving off at once, is `contact`, m, beside a line for good, s.

    `lateral`, m, is how far to the left of the line it is, `drift`, m/s, its velocity to the left;
    the side that takes less time counts. To either side, with both signs turned for the right one,
    it is the last root t of lateral + drift t + acceleration t^2 / 2 = contact, or 0 without one.
    `behaviors.costs` compiles this function as it stands.
    """
    soonest = math.inf
    for side in (1.0, -1.0):
        away = side * drift
        square = away * away + 2.0 * acceleration * (contact - side * lateral)
        time = (math.sqrt(square) - away) / acceleration if square > 0.0 else 0.0
        soonest = min(soonest, max(0.0, time))
    return soonest
