"""Margin: how much time is left until a robot has to begin to clear the way of who walks there.

A line of walk is a straight piece, walked at a constant speed. The margin of a robot with a place
and a velocity is the latest time up to which it can keep that velocity, and then, a reaction later,
still gets out of the line in time: to the left, to the right, or by braking where it is the robot
that closes in. m, s, m/s in the map; an infinite margin: they do not meet.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from behaviors.person.drives import STEP_S, Array
from behaviors.profile import Settings
from behaviors.situation import Situation
from hw import compiled, example
from hw.scene import Point
from states import signals
from states.environment import Environment

_time_to_contact = compiled(signals.time_to_contact)


class Clearing(NamedTuple):
    """What it takes to clear a line of walk.

    The line has to be `contact`, m, from the robot's centre; the robot begins to move a `reaction`,
    s, later, with this `acceleration`, m/s2. Meetings later than `lookahead`, s, do not count.
    """

    contact: float
    reaction: float
    acceleration: float
    lookahead: float

    @classmethod
    def of(cls, environment: Environment, settings: Settings) -> Clearing:
        """By the profile; late poses and commands and uncertain poses are added."""
        return cls(
            settings.escape.contact + environment.user_margin,
            settings.escape.reaction + environment.delay,
            environment.limits.base_acceleration,
            settings.user.walks.lookahead,
        )


@compiled
def time_aside(lateral: float, drift: float, contact: float, acceleration: float) -> float:
    """Time until the robot, driving off at once, is `contact`, m, beside a line for good, s.

    `lateral`, m, is how far to the left of the line it is, `drift`, m/s, its velocity to the left;
    the side that takes less time counts. To either side, with both signs turned for the right one,
    it is the last root t of lateral + drift t + acceleration t^2 / 2 = contact, or 0 without one.
    """
    soonest = math.inf
    for side in (1.0, -1.0):
        away = side * drift
        square = away * away + 2.0 * acceleration * (contact - side * lateral)
        time = (math.sqrt(square) - away) / acceleration if square > 0.0 else 0.0
        soonest = min(soonest, max(0.0, time))
    return soonest


@compiled
def is_met_braking(
    apart: Point,
    walks: Point,
    drives: Point,
    contact: float,
    reaction: float,
    acceleration: float,
) -> bool:
    """True if a walker comes within `contact`, m, of a robot that brakes after `reaction`, s.

    Arguments as for `time_left`. Evaluated until the robot stands: after T = v / acceleration of
    braking, into which it has driven v (b - b^2 / 2 T) after b seconds.
    """
    stopping = max(math.hypot(drives[0], drives[1]) / acceleration, 1e-9)
    for step in range(math.ceil((reaction + stopping) / STEP_S) + 1):
        at = STEP_S * step
        braking = min(max(0.0, at - reaction), stopping)
        moving = min(at, reaction) + braking - braking * braking / (2.0 * stopping)
        x = apart[0] + drives[0] * moving - walks[0] * at
        y = apart[1] + drives[1] * moving - walks[1] * at
        if math.hypot(x, y) < contact:
            return True
    return False


@compiled
def time_left(
    apart: Point,
    walks: Point,
    drives: Point,
    rules: Clearing,
) -> float:
    """The margin, s, of a robot `apart` from the user, m, against their straight line of walk.

    `walks` is their velocity, `drives` the robot's. Beside the user, or ahead and as fast, it is
    the robot's own motion that takes it into their line, and it brakes: what is left then is the
    reaction that it lacks, or no end.
    """
    contact, reaction, acceleration, lookahead = rules
    relative = (walks[0] - drives[0], walks[1] - drives[1])
    if not _time_to_contact((-apart[0], -apart[1]), relative, contact) < lookahead:
        return math.inf
    speed = math.hypot(walks[0], walks[1])
    c, s = (walks[0] / speed, walks[1] / speed) if speed > 0.0 else (0.0, 0.0)
    along, lateral = c * apart[0] + s * apart[1], c * apart[1] - s * apart[0]
    closing = speed - c * drives[0] - s * drives[1]
    drift = c * drives[1] - s * drives[0]
    if along <= 0.0 or closing <= 0.0:
        met = is_met_braking(apart, walks, drives, contact, reaction, acceleration)
        return -reaction if met else math.inf
    aside = time_aside(lateral + reaction * drift, drift, contact, acceleration)
    reach = along - math.sqrt(max(0.0, contact * contact - lateral * lateral))
    return max(0.0, reach) / closing - reaction - aside


@compiled
def lacking(drives: Array, lines: Array, wanted: float, rules: Clearing) -> Array:
    """Squared margin that drives lack of what is `wanted`, s, for each line, (n, m), s2.

    At each step of a drive (n, steps, 2) the user has walked so far on their line (m, steps, 3) and
    goes on straight. They come to where the robot is then, however fast it leaves: a robot that
    drives along their line ahead of them lacks margin, and one that drives beside it does not.
    """
    found = np.zeros((len(drives), len(lines)))
    for i in range(len(drives)):
        for j in range(len(lines)):
            for step in range(drives.shape[1] - 1):
                ux, uy = lines[j, step, 0], lines[j, step, 1]
                c, s = (lines[j, step + 1, 0] - ux) / STEP_S, (lines[j, step + 1, 1] - uy) / STEP_S
                speed = math.hypot(c, s)
                if speed < 1e-6:  # they stand, or are at a wall
                    continue
                c, s = c / speed, s / speed
                x, y = drives[i, step, 0], drives[i, step, 1]
                vx, vy = (
                    (drives[i, step + 1, 0] - x) / STEP_S,
                    (drives[i, step + 1, 1] - y) / STEP_S,
                )
                along, lateral = c * (x - ux) + s * (y - uy), c * (y - uy) - s * (x - ux)
                if along <= 0.0 or abs(lateral) >= rules.contact:
                    continue
                reach = along - math.sqrt(rules.contact * rules.contact - lateral * lateral)
                aside = time_aside(lateral, c * vy - s * vx, rules.contact, rules.acceleration)
                left = max(0.0, reach) / speed - rules.reaction - aside
                found[i, j] += max(0.0, wanted - left) ** 2
    return found


def watched_from(now: Situation) -> float:
    """How near to a robot at rest somebody who sets off leaves less margin than wanted, m."""
    user, rules = now.settings.user, Clearing.of(now.environment, now.settings)
    aside = time_aside(0.0, 0.0, rules.contact, rules.acceleration)
    return rules.contact + user.walks.pace * (user.margins.wanted + rules.reaction + aside)


def turns_at_it(now: Situation) -> bool:
    """True if a user turning on the spot may set off on a line that meets the robot at rest.

    The robot is `off`, rad, to the left of where they face; a line at the angle a from its
    direction passes it at distance sin a.
    """
    body, rest, rate = now.user.body, now.rest, now.velocity.wz
    contact, turns = now.settings.escape.contact, now.settings.user.walks.sets_off[-1]
    reach = math.asin(contact / max(rest.distance_to(body), contact))
    ahead = math.copysign(1.0, rate) * body.bearing_to(rest)
    return -reach < ahead < abs(rate) * turns + reach


@example
def _example() -> None:
    drives, lines, at = np.zeros((1, 2, 2)), np.zeros((1, 2, 3)), (1.0, 0.0)
    rules = Clearing(1.0, 0.1, 1.0, 3.0)
    lacking(drives, lines, 1.0, rules)
    time_left(at, at, at, rules)
    time_aside(0.0, 0.0, 1.0, 1.0)
