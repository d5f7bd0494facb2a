"""The pace that the arm's separation allows, compiled: one call per tick.

The rule, with its symbols, is that of `states.arm.arm_separation`. A *pair* is a capsule of the arm
and a part of the person, now or a little ahead on the trajectory; the pair with the least share of
the pace decides. Rover frame, if not said otherwise; m, rad, s.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from hw import OLD_S, compiled
from states.arm.kinematics import Array, CapsuleSet, Integers, approaching, approaching_limbs

REACTION_S = 0.1
"""From a new pose of the person to an arm that slows down, s."""
CLEARANCE, TOUCH_CLEARANCE = 0.10, 0.03
"""C of S_p, m; the smaller one is for prop and wrist, which come near by purpose."""
SLOW = 0.225
"""No capsule is slowed down below this, m/s."""
STARTING, WALKING = 0.5, 1.6
"""Speed assumed of a person whose speed is not known yet, or whose newest pose is too old, m/s."""
HAND_SPEED = 2.0
"""Speed that a hand may have at any instant, m/s (ISO 13855, K within arm's length)."""
HAND_REACTION_S = 0.05
"""From the newest pose of a hand to an arm that slows down: a tick, and a cycle of the arm, s."""
STEP_S = 0.01
"""Time between two places on the trajectory that are looked at, s."""
_NOTHING = 1e-9


class WatchedCourse(NamedTuple):
    """An arm on its trajectory.

    `own` and `clearance` (k,) are radius and C of each of the capsules of `body` from its `first`
    on; joints and velocities (t, j) are `STEP_S` apart; stop and speed_up as in `Brakes`. Bodies
    are met `ahead`, limbs `hands_ahead` on the trajectory, (n,), s.
    """

    body: CapsuleSet
    own: Array
    clearance: Array
    joints: Array
    velocities: Array
    stop: float
    speed_up: float
    ahead: Array
    hands_ahead: Array


class TrackedWalker(NamedTuple):
    """The person's body as seen `age` s ago, in the map: place, m, and velocity, m/s, if `known`.

    Its `radius` is where the prop meets it; `floor` is the speed below which a touch is harmless.
    """

    x: float
    y: float
    vx: float
    vy: float
    known: bool
    age: float
    radius: float
    floor: float


class Rover(NamedTuple):
    """Where the rover is: rover_from_map, m and rad, and its yaw in the map."""

    x: float
    y: float
    turn: float
    yaw: float


class Pair(NamedTuple):
    """What a pair has to do with each other.

    Gap, m, closing speeds of the arm and of the person, m/s; t_s at full pace, s, and how much
    faster the arm may be by what it can still slow down until then; T of the person and, as far as
    the gap does not show it yet, of the arm, s; C, m; below the pace `slow` a touch is harmless.
    The arm has to be down to the pace `least` once the gap is used up: 0, at rest, or `slow`.
    """

    gap: float
    closing: float
    coming: float
    stopping: float
    later: float
    reaction: float
    lag: float
    clearance: float
    slow: float
    least: float


class Choice(NamedTuple):
    """Of the pairs so far: the least share and its pair, the least of S - C, m, and its pair."""

    share: float
    slowest: Pair
    room: float
    nearest: Pair


_NO_PAIR = Pair(math.inf, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0)
_NO_CHOICE = Choice(math.inf, _NO_PAIR, math.inf, _NO_PAIR)


@compiled
def allowed(pair: Pair) -> float:
    """The pace that a pair allows; beyond 1 it does not matter.

    The largest one, `least` to 1, for S_p <= S is r + e, with the pace r to slow down to and e the
    root of v t_s / 2 e^2 + (v_h t_s + v T + r v t_s) e = S - C - v_h T - r v T, without
    cancellation.
    """
    room = pair.gap - pair.clearance
    left = room - pair.coming * pair.reaction - pair.least * pair.closing * pair.lag
    slope = pair.coming * pair.stopping + pair.closing * (pair.lag + pair.least * pair.stopping)
    more = 0.0
    if left > 0.0:
        root = math.sqrt(slope * slope + 2.0 * pair.closing * pair.stopping * left)
        more = 2.0 * left / max(slope + root, _NOTHING)
    return max(min(pair.least + more, 1.0), pair.slow) + pair.later


@compiled
def after(choice: Choice, pair: Pair) -> Choice:
    """The choice with one more pair; of equal ones the first counts."""
    share, room = allowed(pair), pair.gap - pair.clearance
    least, slowest = (share, pair) if share < choice.share else (choice.share, choice.slowest)
    lowest, nearest = (room, pair) if room < choice.room else (choice.room, choice.nearest)
    return Choice(least, slowest, lowest, nearest)


@compiled
def deciding(choice: Choice) -> Pair:
    """The slowest pair; where none slows the arm down, the nearest."""
    return choice.slowest if choice.share < 1.0 else choice.nearest


@compiled
def needed(pair: Pair, pace: float) -> float:
    """S_p of a pair at a pace, m."""
    stop = max(0.0, pace - pair.least) * pair.stopping
    used = pair.coming * (pair.reaction + stop) + pace * pair.closing * (pair.lag + 0.5 * stop)
    return used + 0.5 * pair.least * pair.closing * stop + pair.clearance


@compiled
def slow_share(floor: float, closing: float) -> float:
    """The pace at which an arm that closes at this speed closes at `floor` only, at most 1."""
    return min(1.0, floor / max(closing, _NOTHING))


@compiled
def assumed_speed(age: float) -> float:
    """Speed assumed of a person of whom only a pose of this age, s, is known, m/s."""
    return STARTING if age <= OLD_S else WALKING


@compiled
def turned(closing: float, speed: float, off: float) -> float:
    """How fast a point of this speed closes at most on what has moved by `off` of its distance.

    That turns the direction in which it closes by up to asin(off); m/s, at least 0.
    """
    sine = min(off, 1.0)
    across = math.sqrt(max(speed * speed - closing * closing, 0.0))
    if off >= 1.0 or (across <= speed * sine and closing > 0.0):
        return speed  # its own direction is one of those
    return max(closing * math.sqrt(1.0 - sine * sine) + across * sine, 0.0)


@compiled
def looked_ahead(course: WatchedCourse, since: float, ahead: Array) -> tuple[Array, Array, Array]:
    """Joints and their velocities, (n, j), and t_s at full pace, (n,), so long ahead, s (n,)."""
    count, last, j = len(ahead), len(course.joints) - 1, course.joints.shape[1]
    q, velocity, stopping = np.empty((count, j)), np.empty((count, j)), np.empty(count)
    for n in range(count):
        at = min(round((since + ahead[n]) / STEP_S), last)
        fastest = _NOTHING
        for i in range(j):
            q[n, i], velocity[n, i] = course.joints[at, i], course.velocities[at, i]
            fastest = max(fastest, abs(velocity[n, i]))
        stopping[n] = fastest / course.stop
    return q, velocity, stopping


@compiled
def body_pairs(
    course: WatchedCourse, since: float, walker: TrackedWalker, rover: Rover
) -> tuple[Choice, float]:
    """What decides of the body's cylinder, seen from above.

    A person whose speed is known has gone on since they were seen: from there an arm that passes
    beside them would seem to close more slowly than it does. With t_s now, s.
    """
    body, count, k = course.body, len(course.ahead), len(course.own)
    q, velocity, stopping = looked_ahead(course, since, course.ahead)
    towards, distance, closing = np.empty((count, k, 2)), np.empty((count, k)), np.empty((count, k))
    at_x, at_y, late = walker.x, walker.y, REACTION_S + walker.age
    vx = vy = 0.0
    if walker.known:
        at_x, at_y, late = at_x + walker.vx * walker.age, at_y + walker.vy * walker.age, REACTION_S
        c, s = math.cos(-rover.yaw), math.sin(-rover.yaw)
        vx, vy = c * walker.vx - s * walker.vy, s * walker.vx + c * walker.vy
    at_x, at_y = seen_from(rover, at_x, at_y)
    approaching(body, body.first, q, velocity, at_x, at_y, towards, distance, closing)
    choice = _NO_CHOICE
    for n in range(count):
        later = max(0.0, course.ahead[n] - REACTION_S) / stopping[n]
        for i in range(k):
            coming = assumed_speed(walker.age)
            if walker.known:
                coming = max(-(towards[n, i, 0] * vx + towards[n, i, 1] * vy), 0.0)
            fast = max(closing[n, i], 0.0)
            pair = Pair(
                distance[n, i] - (course.own[i] + walker.radius), fast, coming, stopping[n], later,
                late, late, course.clearance[i], slow_share(walker.floor, fast), 0.0,
            )  # fmt: skip
            choice = after(choice, pair)
    return choice, stopping[0]


@compiled
def limb_pairs(
    course: WatchedCourse, since: float, walker: TrackedWalker, limbs: Array, ages: Array
) -> Choice:
    """What decides of limbs (m, 7): both ends of their axes and their radii, seen ages (m,) ago, s.

    They may have gone anywhere since then. Of a link that a hand may have gone along, a faster
    point is met than the nearest: only prop and wrist, which are short, have the body's floor.
    """
    body, count, k, m = course.body, len(course.hands_ahead), len(course.own), len(limbs)
    q, velocity, stopping = looked_ahead(course, since, course.hands_ahead)
    distance, closing, speed, along = np.empty((4, count, k, m))
    axes = limbs[:, :6].copy().reshape(m, 2, 3)
    approaching_limbs(body, body.first, q, velocity, axes, distance, closing, speed, along)
    choice = _NO_CHOICE
    for n in range(count):
        for i in range(k):
            floor = walker.floor if course.clearance[i] == TOUCH_CLEARANCE else SLOW
            for j in range(m):
                walking = assumed_speed(ages[j])
                if walker.known:
                    walking = math.hypot(walker.vx, walker.vy)
                coming = walking + along[n, i, j] * (HAND_SPEED - walking)
                late = HAND_REACTION_S + ages[j]
                off = late * coming / distance[n, i, j]
                fast = turned(closing[n, i, j], speed[n, i, j], off)
                slow = slow_share(floor, fast)
                pair = Pair(
                    distance[n, i, j] - (course.own[i] + limbs[j, 6]), fast, coming, stopping[n],
                    0.0, late, 0.0, course.clearance[i], slow, slow,
                )  # fmt: skip
                choice = after(choice, pair)
    return choice


@compiled
def seen_from(rover: Rover, x: float, y: float) -> tuple[float, float]:
    """A point of the map in the rover frame, m; see `Pose2.transform`."""
    c, s = math.cos(rover.turn), math.sin(rover.turn)
    return rover.x + c * x - s * y, rover.y + s * x + c * y


@compiled
def next_pace(  # noqa: PLR0913 - all that a pace depends on
    course: WatchedCourse,
    walker: TrackedWalker,
    rover: Rover,
    limbs: Array,
    stamps: Integers,
    now_ns: int,
    since: float,
    span: float,
    share_before: float,
) -> tuple[float, float, float]:
    """The pace from now on, with S and S_p, m, of the pair that decides, else of the nearest.

    Limbs (m, 7), in the map, were seen at stamps (m,), ns; the last pace, `span` s ago, was
    `share_before`; `since` s of the trajectory are done.
    """
    choice, stopping = body_pairs(course, since, walker, rover)
    wanted, pair = min(1.0, choice.share), deciding(choice)
    if len(limbs) > 0:
        seen, ages = limbs.copy(), np.empty(len(limbs))
        for j in range(len(limbs)):
            ages[j] = max(0.0, (now_ns - stamps[j]) * 1e-9)
            for e in (0, 3):
                seen[j, e], seen[j, e + 1] = seen_from(rover, limbs[j, e], limbs[j, e + 1])
        choice = limb_pairs(course, since, walker, seen, ages)
        share, other = min(1.0, choice.share), deciding(choice)
        nearer = other.gap - other.clearance < pair.gap - pair.clearance
        if share < wanted or (share == wanted and nearer):
            wanted, pair = share, other
    fastest = course.stop * stopping
    pace = min(wanted, share_before + span * course.speed_up / fastest)
    return pace, pair.gap, needed(pair, pace)
