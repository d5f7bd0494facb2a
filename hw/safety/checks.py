"""The checks of the safety chain, in the order of a cycle; see `hw.safety.rule`.

They are compiled, so that all cycles of a simulated tick are one call, and work on two records in
place: `RULE` has the limits, the inputs and what the rule remembers, and each cycle is written to a
row of the log (`hw.safety.cycle_log.CYCLE`). Without numba they run as plain Python.
"""

from __future__ import annotations

import math

from hw.jit import Struct, Structs, compiled, record_type
from hw.safety.cycle_record import LATCHES, REASONS
from hw.safety.separation import (
    Braking,
    Nearness,
    PlanarPose,
    Velocity,
    allowed_speed,
    closing_speed,
    held_back,
    nearness,
    needed_separation,
    pose_error,
)
from hw.safety.user_track import USER, age_of, forget
from hw.samples import USER_RADIUS

STANDING = 0.02
"""A base slower than this counts as standing, m/s and rad/s."""
FASTER = 1.1
"""A measured speed above the limit by this factor latches a stop: the base does not obey."""
SLOWER = 1.5
"""A stop that takes longer than the brakes should need, by this factor, latches as well."""
ROUNDING = 1e-9
"""Tolerance within which an already limited velocity is not scaled again, m/s and rad/s."""
_NOWHERE = 1e9
_STILL = (0.0, 0.0, 0.0)
_BACKWARDS, _LOST, _FAST, _RUNS = range(1, len(LATCHES))
(
    _STOP_LINE, _LATCHED, _NOT_FINITE, _BASE_UNKNOWN, _COMMAND_OLD, _COMMAND_AHEAD, _USER_UNKNOWN,
    _USER_OLD, _USER_AHEAD, _GRANTED, _SPEED, _USER_LATE, _COMMAND_LATE, _SEPARATION,
) = (1 << place for place in range(len(REASONS)))  # fmt: skip

FIGURES = (
    "speed", "yaw_rate", "walking", "uncertainty", "still", "touch_speed", "touch_gap",
    "touch_slack", "command_late", "command_age", "late", "old", "lost", "ahead",
)  # fmt: skip
BRAKING, OUTLINE = ("deceleration", "reaction", "clearance"), ("half_length", "half_width")
LIMITS = record_type(
    *((name, "f8") for name in (*FIGURES, *BRAKING, *OUTLINE)),
    ("governor", "?"), ("watched", "?"),
)  # fmt: skip
"""The figures of `SafetyLimits`, with its braking and outline, for compiled functions."""

RULE = record_type(
    ("limits", LIMITS), ("user", USER), ("written", "i8"),
    ("commanded", "?"), ("stamp_ns", "i8"), ("reckons", "?"), ("holonomic", "?"),
    ("stopped", "?"), ("requested", "?"), ("granted", "?"), ("served_from", "f8", (3,)),
    ("latched", "i8"), ("refused", "i8"), ("measured", "f8"), ("command_age", "f8"),
    ("must_stand", "?"), ("stand_by_ns", "i8"), ("began", "?"), ("now_ns", "i8"),
    ("slowed", "?"), ("admitted", "f8", (3,)),
)  # fmt: skip
"""What the rule knows.

Inputs: whether a velocity is commanded, and since when; whether the pose of the base is reckoned,
the base is holonomic, the stop line is pulled, a touch is requested, and granted from which place.
`latched` is a place in `LATCHES`, `refused` are bits of `REASONS`; `measured` is the greater of
speed and yaw rate, `command_age` in s. `slowed`: something was cut since the owner set it to False;
`admitted` is what was last.
"""


@compiled
def cycle(
    rule: Struct,
    rows: Structs,
    now_ns: int,
    stamp_ns: int,
    command: Velocity,
    base: tuple[bool, PlanarPose, float],
    moves: tuple[bool, Velocity],
) -> Struct:
    """Limit the next velocity of the wheels; the row of the log that says how.

    Args:
        rule: of type `RULE`.
        rows: of type `CYCLE`, a ring.
        now_ns: the instant of this cycle.
        stamp_ns: the instant at which the velocity was last commanded.
        command: the next velocity of the wheels, base frame.
        base: whether the pose of the base is known, map_from_base, and sigma of its position, m.
        moves: whether the velocity of the base is known, and that in the base frame.
    """
    row = rows[rule.written % len(rows)]
    row.number, row.stamp_ns = 0, now_ns
    row.separation = row.user_speed = row.user_age = math.nan
    row.needed = row.allowed = 0.0
    age = _age(rule, now_ns)
    (located, pose, sigma), (known, twist) = base, moves
    governed = False
    if not known:
        rule.refused = _BASE_UNKNOWN
    elif not (_is_finite(command) and _is_finite(twist) and (not located or _is_finite(pose))):
        rule.refused = _NOT_FINITE
    else:
        _watch(rule, now_ns, twist, age)
        lost = rule.limits.watched and not (located and sigma < math.inf)
        rule.refused = _BASE_UNKNOWN if lost else _refusal(rule, now_ns, stamp_ns, age)
        rule.command_age = (now_ns - stamp_ns) / 1e9
        governed = located and age < math.inf
    admitted, reasons, cut = _STILL, rule.refused, True
    if governed:
        off = pose_error(sigma)
        admitted, reasons, cut = _governed(rule, row, max(age, 0.0), command, pose, twist, off)
    elif not rule.refused:
        admitted, reasons = _limited(rule, command, 0.0)
        cut = reasons != 0
    row.cut, row.reasons = cut, reasons
    row.command[0], row.command[1], row.command[2] = command
    row.admitted[0], row.admitted[1], row.admitted[2] = admitted
    rule.admitted[0], rule.admitted[1], rule.admitted[2] = admitted
    rule.slowed = rule.slowed or admitted != command
    rule.written += 1
    row.number = rule.written
    return row


@compiled
def rest(rule: Struct, now_ns: int) -> None:
    """Run a cycle of a base that stands without a command: checks time and the user's age only."""
    _watch(rule, now_ns, _STILL, _age(rule, now_ns))
    rule.refused = 0


@compiled
def release(rule: Struct, now_ns: int) -> bool:
    """Release a latched stop; False while its cause persists or the base moves."""
    if rule.latched:
        lost = rule.latched == _LOST and _stale(rule, age_of(rule.user, now_ns)) != 0
        if lost or rule.measured > STANDING:
            return False
    rule.latched = 0
    return True


# stop line, latches, ages


@compiled
def _is_finite(values: tuple[float, float, float]) -> bool:
    a, b, c = values
    return abs(a) < _NOWHERE and abs(b) < _NOWHERE and abs(c) < _NOWHERE


@compiled
def _latch(rule: Struct, why: int) -> None:
    if not rule.latched:
        rule.latched = why


@compiled
def _age(rule: Struct, now_ns: int) -> float:
    """Age of the user's pose, s; infinite without a pose, or if no part tracks the user."""
    if rule.began and now_ns < rule.now_ns:
        _latch(rule, _BACKWARDS)  # stamps from before the jump mean nothing any more
        forget(rule.user)
        rule.must_stand = False
    rule.began, rule.now_ns = True, now_ns
    return age_of(rule.user, now_ns) if rule.limits.watched else math.inf


@compiled
def _watch(rule: Struct, now_ns: int, twist: Velocity, age: float) -> None:
    """Latch a stop on any condition that must not clear by itself."""
    limits = rule.limits
    speed, turn = math.hypot(twist[0], twist[1]), abs(twist[2])
    rule.measured = max(speed, turn)
    if limits.lost < age < math.inf:
        _latch(rule, _LOST)
    if speed > FASTER * limits.speed or turn > FASTER * limits.yaw_rate:
        _latch(rule, _FAST)
    if not rule.refused or rule.measured <= STANDING:
        rule.must_stand = False
    elif not rule.must_stand:
        within = rule.measured / limits.deceleration
        rule.must_stand = True
        rule.stand_by_ns = now_ns + round((limits.reaction + SLOWER * within) * 1e9)
    elif now_ns > rule.stand_by_ns:
        _latch(rule, _RUNS)


@compiled
def _refusal(rule: Struct, now_ns: int, stamp_ns: int, age: float) -> int:
    """Why no motion at all is allowed; 0 if some is."""
    if rule.stopped:
        return _STOP_LINE
    if rule.latched:
        return _LATCHED
    since = (now_ns - stamp_ns) / 1e9
    if since >= rule.limits.command_age:
        return _COMMAND_OLD
    if since < -rule.limits.ahead:
        return _COMMAND_AHEAD
    return _stale(rule, age) if rule.limits.watched else 0


@compiled
def _stale(rule: Struct, age: float) -> int:
    """Why the user's pose cannot be used; 0 if it can."""
    if age > rule.limits.old:
        return _USER_OLD if age < math.inf else _USER_UNKNOWN
    return _USER_AHEAD if age < -rule.limits.ahead else 0


# limits and separation


@compiled
def _governed(
    rule: Struct,
    row: Struct,
    age: float,
    command: Velocity,
    pose: PlanarPose,
    twist: Velocity,
    off: float,
) -> tuple[Velocity, int, bool]:
    """What is admitted with the user's pose, why, and if it is less; `off`: `pose_error`, m."""
    limits, user = rule.limits, rule.user
    near = _near(rule, pose)
    speed = user.speed + limits.uncertainty if user.speed_known else limits.walking
    if age > limits.late:
        speed = max(speed, limits.walking)
    braking = (limits.deceleration, limits.reaction, limits.clearance)
    allowed = allowed_speed(near.gap - off, speed, age, braking)
    admitted, reasons, cut = _STILL, rule.refused, True
    if not rule.refused:
        touch = _touch_speed(rule, near.gap, age)
        granted = touch > allowed
        allowed = touch if granted else allowed
        admitted, reasons = _limited(rule, command, age)
        cut = reasons != 0
        if granted:
            reasons |= _GRANTED
        if limits.governor and closing_speed(near, admitted) > allowed:
            admitted, cut = held_back(near, admitted, allowed, rule.holonomic), True
            reasons |= _SEPARATION
    needed = needed_separation(closing_speed(near, twist), speed, age, braking)
    row.needed = needed + off if needed else 0.0
    row.separation, row.allowed, row.user_speed, row.user_age = near.gap, allowed, speed, age
    return admitted, reasons, cut


@compiled
def _near(rule: Struct, pose: PlanarPose) -> Nearness:
    x, y, yaw = pose
    c, s = math.cos(yaw), math.sin(yaw)
    dx, dy = rule.user.x - x, rule.user.y - y
    limits = rule.limits
    ahead, left = c * dx + s * dy, c * dy - s * dx
    return nearness(limits.half_length, limits.half_width, ahead, left, USER_RADIUS)


@compiled
def _touch_speed(rule: Struct, gap: float, age: float) -> float:
    """The closing speed granted towards a user who requests a touch and stands still, m/s.

    It falls with the age of the user's pose: the distance covered since then stays bounded.
    """
    limits, user = rule.limits, rule.user
    if not rule.requested or not user.steady_known or user.steady >= limits.still:
        return 0.0
    floor = limits.touch_gap
    if rule.granted:
        x, y, yaw = rule.served_from
        floor = max(floor, _near(rule, (x, y, yaw)).gap - limits.touch_slack)
    braking: Braking = (limits.deceleration, limits.reaction, 0.0)
    fastest: float = _share(age, limits.late, limits.old) * limits.touch_speed
    return min(fastest, allowed_speed(gap - floor, 0.0, 0.0, braking))


@compiled
def _limited(rule: Struct, command: Velocity, age: float) -> tuple[Velocity, int]:
    """The command scaled to the speed limit, and the reason of a scaling.

    The limit falls to 0 as the command or the user's pose ages (R149).
    """
    limits = rule.limits
    seen = _share(age, limits.late, limits.old)
    share = min(seen, _share(rule.command_age, limits.command_late, limits.command_age))
    vx, vy, wz = command
    speed, turn = math.hypot(vx, vy), abs(wz)
    scale = 1.0
    if speed > share * limits.speed + ROUNDING:
        scale = share * limits.speed / speed
    if turn * scale > share * limits.yaw_rate + ROUNDING:
        scale = share * limits.yaw_rate / turn
    if scale == 1.0:
        return command, 0
    reason = _SPEED if share == 1.0 else _USER_LATE if share == seen else _COMMAND_LATE
    return (scale * vx, scale * vy, scale * wz), reason


@compiled
def _share(age: float, late: float, old: float) -> float:
    """Share of a speed limit left at this age of what it depends on: 1 to `late`, 0 from `old`."""
    return 1.0 if age <= late else max(0.0, (old - age) / (old - late))
