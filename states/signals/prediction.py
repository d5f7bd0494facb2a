"""Predictors of where a person will be, by the names that profiles use."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from hw import Pose2, Twist2, wrap

STRAIGHT = 1e-9
"""A smaller turn, rad, does not shorten a chord in floating point."""
SLOWEST = 1e-6
"""Anything slower than this never arrives, m/s."""


@dataclass(frozen=True, slots=True)
class Predictor:
    """A person who keeps a share of their speed along a bend that straightens out.

    The turn rate begins with `keeps` times the present one plus `turn` (rad/s, positive to the
    left) and decays with the time constant `fades`, s. With `comes` they walk straight to the
    robot instead, at `least` m/s or faster.
    """

    about: str
    speed: float = 1.0
    keeps: float = 0.0
    turn: float = 0.0
    fades: float = 1.0
    comes: bool = False
    least: float = 0.0

    def reach(self, speed: float, ahead: float) -> float:
        """Upper bound of how far a person of this speed gets, m."""
        return self.speed * max(self.least, speed) * ahead

    def at(self, body: Pose2, velocity: Twist2, ahead: float, robot: Pose2) -> Pose2:
        """Their pose `ahead` seconds from now; velocity in the map, turn rate of the body as wz."""
        pace = max(self.least, velocity.speed)
        if self.comes:
            direction = math.atan2(robot.y - body.y, robot.x - body.x)
            length = min(pace * ahead, body.distance_to(robot))
            x, y = body.x + length * math.cos(direction), body.y + length * math.sin(direction)
            return Pose2(x, y, direction)
        rate = self.keeps * velocity.wz + self.turn
        if rate == 0.0 and pace == velocity.speed:
            time = self.speed * ahead
            return Pose2(body.x + time * velocity.vx, body.y + time * velocity.vy, body.yaw)
        length, off, turned = chord(self.speed * pace, rate, self.fades, ahead)
        direction = math.atan2(velocity.vy, velocity.vx) + off
        return Pose2(
            body.x + length * math.cos(direction),
            body.y + length * math.sin(direction),
            wrap(body.yaw + turned),
        )


def chord(speed: float, rate: float, fades: float, ahead: float) -> tuple[float, float, float]:
    """Chord of a bend whose turn rate decays: length, direction from the first heading, turn.

    With rate(t) = rate e^(-t / fades) the heading at t is rate fades (1 - e^(-t / fades)). The
    chord is taken as that of a circle with the same angle turned, so that it is shorter than the
    arc by sin(a / 2) / (a / 2), and points along the mean heading over the time.
    `behaviors.person.lines` compiles this function as it stands.
    """
    turned = rate * fades * (1.0 - math.exp(-ahead / fades))
    mean = fades * (rate - turned / ahead) if ahead > 0.0 else 0.0
    shorter = math.sin(0.5 * turned) / (0.5 * turned) if abs(turned) > STRAIGHT else 1.0
    return speed * ahead * shorter, mean, turned


PREDICTORS: Mapping[str, Predictor] = {
    "stays": Predictor("stays where they are", speed=0.0),
    "constant_velocity": Predictor("goes straight on"),
    "fading_turn": Predictor("goes straight on after the present bend", keeps=1.0),
    "comes": Predictor("comes straight to the robot", comes=True, least=1.0),
    "turns_left": Predictor("turns to the left", keeps=1.0, turn=1.0),
    "turns_right": Predictor("turns to the right", keeps=1.0, turn=-1.0),
}


def time_to_contact(
    relative: tuple[float, float], velocity: tuple[float, float], reach: float
) -> float:
    """Time until something at `relative` (m) moving at `velocity` (m/s) comes within `reach` m, s.

    0 if it is within reach and closing in, infinite if it never will be. It is the smaller root t
    of |relative + t velocity|^2 = reach^2, in the form that does not cancel: with closing =
    -relative . velocity and gap = |relative|^2 - reach^2, t = gap / (closing + sqrt(closing^2 -
    |velocity|^2 gap)).
    """
    x, y = relative
    vx, vy = velocity
    closing = -(x * vx + y * vy)
    if closing <= 0.0:
        return math.inf
    gap = x * x + y * y - reach * reach
    if gap <= 0.0:
        return 0.0
    speed = vx * vx + vy * vy
    if speed < SLOWEST * SLOWEST:
        return math.inf
    root = closing * closing - speed * gap
    return math.inf if root < 0.0 else gap / (closing + math.sqrt(root))
