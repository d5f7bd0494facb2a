"""Where a person will be: predictors by name, to be chosen by the profile."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from hw.geometry import Pose2, Twist2, wrap

SLOWEST = 1e-6
"""What is slower than this, m/s, never comes."""


@dataclass(frozen=True, slots=True)
class Predictor:
    """The person goes on at a share of their speed, along a bend whose turn dies away.

    The bend begins with `keeps` times the present rate of turn plus `turn` (rad/s, left is
    positive), which dies away with the time constant `fades` in s. One who `comes` walks straight
    to the robot instead, at no less than `least` m/s.
    """

    about: str
    speed: float = 1.0
    keeps: float = 0.0
    turn: float = 0.0
    fades: float = 1.0
    comes: bool = False
    least: float = 0.0

    def reach(self, speed: float, ahead: float) -> float:
        """How far a person of this speed comes at most, m."""
        return self.speed * max(self.least, speed) * ahead

    def at(self, body: Pose2, velocity: Twist2, ahead: float, robot: Pose2) -> Pose2:
        """Their pose so many seconds ahead; velocity in the map frame, turn as wz."""
        pace = max(self.least, velocity.speed)
        if self.comes:
            direction = math.atan2(robot.y - body.y, robot.x - body.x)
            way = min(pace * ahead, body.distance_to(robot))
            x, y = body.x + way * math.cos(direction), body.y + way * math.sin(direction)
            return Pose2(x, y, direction)
        rate = self.keeps * velocity.wz + self.turn
        if rate == 0.0 and pace == velocity.speed:
            way = self.speed * ahead
            return Pose2(body.x + way * velocity.vx, body.y + way * velocity.vy, body.yaw)
        turned = rate * self.fades * (1.0 - math.exp(-ahead / self.fades))
        # the chord of a bend points along the mean of its directions
        mean = self.fades * (rate - turned / ahead) if ahead > 0.0 else 0.0
        shorter = math.sin(0.5 * turned) / (0.5 * turned) if turned else 1.0
        chord = self.speed * pace * ahead * shorter
        direction = math.atan2(velocity.vy, velocity.vx) + mean
        return Pose2(
            body.x + chord * math.cos(direction),
            body.y + chord * math.sin(direction),
            wrap(body.yaw + turned),
        )


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
    """When something at `relative` (m) that moves at `velocity` (m/s) comes within `reach`, s.

    0 if it is there already and comes nearer, infinite if it never will.
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
