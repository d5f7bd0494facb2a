"""Walking lines: whether one meets the robot, and whether the robot clears it in time."""

from __future__ import annotations

import math

from hw import Twist2
from hw.scene import Point

STEP_S = 0.1
"""Step at which the distance of a braking robot is looked at, s."""
SETS_OFF_S = (0.0, 0.15, 0.3, 0.45)
"""Times of further turning after which a user who turns on the spot may set off, s."""


def turns_at_it(off: float, distance: float, rate: float, contact: float) -> bool:
    """True if a user turning on the spot may set off on a line within `contact`, m, of the robot.

    It is at `distance`, m, and `off`, rad, to the left of where they face; they turn at `rate`,
    rad/s. A line at the angle a from the robot's direction passes it at `distance` sin a.
    """
    reach, ahead = math.asin(contact / max(distance, contact)), math.copysign(1.0, rate) * off
    return -reach < ahead < abs(rate) * SETS_OFF_S[-1] + reach


def time_aside(lateral: float, drift: float, contact: float, acceleration: float) -> float:
    """Time until the robot, driving off at once, is `contact`, m, beside a line for good, s.

    `lateral`, m, is how far to the left of the line it is, `drift`, m/s, its velocity to the left;
    the side that takes less time counts. To either side, with both signs turned for the right one,
    it is the last root t of lateral + drift t + acceleration t^2 / 2 = contact, or 0 without one.
    `behaviors.person.costs` compiles this function as it stands.
    """
    soonest = math.inf
    for side in (1.0, -1.0):
        away = side * drift
        square = away * away + 2.0 * acceleration * (contact - side * lateral)
        time = (math.sqrt(square) - away) / acceleration if square > 0.0 else 0.0
        soonest = min(soonest, max(0.0, time))
    return soonest


def is_met_braking(
    apart: Point,
    velocity: Twist2,
    motion: Twist2,
    contact: float,
    reaction: float,
    acceleration: float,
) -> bool:
    """True if a walker comes within `contact`, m, of a robot that brakes after `reaction`, s.

    `apart` is the robot's centre as they see it, m, in the map frame like their `velocity` and the
    robot's `motion`. Evaluated until the robot stands: after T = v / acceleration of braking, into
    which it has driven v (b - b^2 / 2 T) after b seconds.
    """
    stopping = max(motion.speed / acceleration, 1e-9)
    for step in range(math.ceil((reaction + stopping) / STEP_S) + 1):
        at = STEP_S * step
        braking = min(max(0.0, at - reaction), stopping)
        moving = min(at, reaction) + braking - braking * braking / (2.0 * stopping)
        x = apart[0] + motion.vx * moving - velocity.vx * at
        y = apart[1] + motion.vy * moving - velocity.vy * at
        if math.hypot(x, y) < contact:
            return True
    return False
