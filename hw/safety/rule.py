"""The rule of the safety chain: how much of the next velocity may reach the wheels.

It can only slow the base down or stop it. It is a software stop of a research prototype, not a
safety device (R54): a hardware stop, with a person's hand on it, is needed as well. It knows
nothing of charts and plans, and has no queue, clock or lock; the chain (`hw.safety.chain`) collects
its inputs and applies it at 100 Hz or more:

    rule.track_user(now_ns, stamp_ns, x, y)        # each tracked pose of the user, in the map
    rule.stop_line = reason                        # why the stop line is pulled, or None
    rule.request(True); rule.grant(pose)           # a touch is requested, and served from `pose`
    record = rule.admit(now_ns, command, stamp_ns, pose, twist)

`command` is the velocity that the wheels would get in the next cycle, ramps included: nothing after
the rule may slow down more gently than the brakes. The checks are, in this order: stop line and
latches, age of the command, age of the user's pose, speed limit, separation governor (R48-R52,
R149). The speed limit falls as a command ages, so that a computer that cannot keep up slows the
robot down before it stops it. Time that runs backwards latches a stop. A stamp ahead of the clock
is refused: a negative age is never fresh.

The governor limits only what closes the gap between the robot's footprint, a rectangle at its
measured yaw, and the user's cylinder: the velocity component towards the user, and a rotation that
brings the nearest point of the footprint closer. Both are scaled by one share and neither offsets
the other, because they need not brake in step. Motion away from the user or along the footprint's
side is not limited.
"""

from __future__ import annotations

import math

from hw.finite import is_finite
from hw.geometry import STILL, Pose2, Twist2
from hw.log import Log
from hw.safety.cycle_record import (
    BACKWARDS,
    BASE_UNKNOWN,
    COMMAND_AHEAD,
    COMMAND_LATE,
    COMMAND_OLD,
    GRANTED,
    LATCHED,
    NOT_FINITE,
    RUNS_ON,
    SEPARATION,
    SPEED,
    STOP_LINE,
    TOO_FAST,
    USER_AHEAD,
    USER_LATE,
    USER_LOST,
    USER_OLD,
    USER_UNKNOWN,
    SafetyRecord,
)
from hw.safety.limits import SafetyLimits
from hw.safety.separation import Nearness, UserTrack, nearness
from hw.samples import USER_RADIUS

KEPT = 4096
"""Records kept: 34 s at 120 Hz."""
STANDING = 0.02
"""A base slower than this counts as standing, m/s and rad/s."""
FASTER = 1.1
"""A measured speed above the limit by this factor latches a stop: the base does not obey."""
SLOWER = 1.5
"""A stop that takes longer than the brakes should need, by this factor, latches as well."""
ROUNDING = 1e-9
"""Tolerance within which an already limited velocity is not scaled again, m/s and rad/s."""
_NOWHERE = 1e9
_ORIGIN = Pose2(0.0, 0.0)


class SafetyRule:
    """See the module. `cycles` holds the newest records, for any number of readers.

    `stop_line` is the reason why the stop line is pulled, or None. `holonomic` is False for a base
    that drives along its heading only. `latched` is the reason of a latched stop, or None; while
    latched, nothing moves until `reset`. `refused` says why the last cycle allowed no motion at
    all; it is empty if some was allowed.
    """

    def __init__(self, limits: SafetyLimits) -> None:
        self.limits = limits
        self.latched: str | None = None
        self.refused: tuple[str, ...] = ()
        self.stop_line: str | None = None
        self.holonomic = True
        self.cycles: Log[SafetyRecord] = Log(KEPT)
        self._half = limits.footprint.half_length, limits.footprint.half_width
        self._user = UserTrack(limits.ahead)
        self._requested = False
        self._served_from: Pose2 | None = None
        self._measured = self._command_age = 0.0
        self._stand_by_ns: int | None = None
        self._now_ns: int | None = None

    def track_user(self, now_ns: int, stamp_ns: int, x: float, y: float) -> bool:
        """Take a pose of the user (map) that arrived now; False if refused, see `UserTrack`."""
        return self._user.add_position(now_ns, stamp_ns, x, y)

    def leap(self, span_ns: int) -> None:
        """Pass over so long, ns, in which the base stands and the user is seen where they stand."""
        self._user.leap(span_ns)

    def request(self, level: bool) -> None:
        """Set whether the user requests a touch. The end of a request ends its grant.

        This is a level that is sent on change, so silence does not end it: the owner of the link to
        the user reports its loss (`Vr`). A touch still needs a fresh pose of a user who stands
        still.
        """
        self._requested = level
        if not level:
            self._served_from = None

    def grant(self, pose: Pose2 | None) -> None:
        """Set the base pose (map_from_base) from which the request is served; None: none known.

        A pose that is not finite counts as None.
        """
        self._served_from = pose if is_finite(pose) else None

    def reset(self, now_ns: int) -> bool:
        """Release the latch; False while its cause persists or the base moves.

        Called by an operator's command only (R49).
        """
        if self.latched is None:
            return True
        lost = self.latched == USER_LOST and self._stale(self._user.age_s(now_ns)) != ()
        if lost or self._measured > STANDING:
            return False
        self.latched = None
        return True

    def rest(self, now_ns: int) -> None:
        """Run a cycle of a base that stands without a command: checks time and the user's age only.

        It writes no record.
        """
        self._watch(now_ns, STILL, self._age(now_ns))
        self.refused = ()

    def admit(
        self,
        now_ns: int,
        command: Twist2,
        stamp_ns: int,
        pose: Pose2 | None,
        twist: Twist2 | None,
        sigma: float = 0.0,
    ) -> SafetyRecord:
        """Limit the next velocity of the wheels.

        Args:
            now_ns: the instant of this cycle.
            command: the next velocity of the wheels, base frame.
            stamp_ns: the instant at which that velocity was last commanded.
            pose: measured map_from_base; None if unknown.
            twist: measured velocity, base frame; None if unknown.
            sigma: standard deviation of the pose's position, m.
        """
        age = self._age(now_ns)
        record = None
        if twist is None:
            self.refused = BASE_UNKNOWN
        elif not _is_finite(command, pose or _ORIGIN, twist):
            self.refused = NOT_FINITE
        else:
            self._watch(now_ns, twist, age)
            lost = (pose is None or not sigma < math.inf) and self.limits.watched
            self.refused = BASE_UNKNOWN if lost else self._refusal(now_ns, stamp_ns, age)
            self._command_age = (now_ns - stamp_ns) / 1e9
            if pose is not None and age < math.inf:
                off = self.limits.pose_error(sigma)
                record = self._governed(now_ns, max(age, 0.0), command, pose, twist, off)
        record = record or self._unwatched(now_ns, command)
        self.cycles.append(record)
        return record

    # stop line, latches, ages

    def _age(self, now_ns: int) -> float:
        """Age of the user's pose, s; infinite without a pose, or if no part tracks the user."""
        if self._now_ns is not None and now_ns < self._now_ns:
            self._latch(BACKWARDS)  # stamps from before the jump mean nothing any more
            self._user = UserTrack(self.limits.ahead)
            self._stand_by_ns = None
        self._now_ns = now_ns
        return self._user.age_s(now_ns) if self.limits.watched else math.inf

    def _watch(self, now_ns: int, twist: Twist2, age: float) -> None:
        """Latch a stop on any condition that must not clear by itself."""
        limits = self.limits
        speed, turn = math.hypot(twist.vx, twist.vy), abs(twist.wz)
        self._measured = max(speed, turn)
        if limits.lost < age < math.inf:
            self._latch(USER_LOST)
        if speed > FASTER * limits.speed or turn > FASTER * limits.yaw_rate:
            self._latch(TOO_FAST)
        if not self.refused or self._measured <= STANDING:
            self._stand_by_ns = None
        elif self._stand_by_ns is None:
            within = self._measured / limits.stopping.deceleration
            self._stand_by_ns = now_ns + round((limits.stopping.reaction + SLOWER * within) * 1e9)
        elif now_ns > self._stand_by_ns:
            self._latch(RUNS_ON)

    def _latch(self, reason: str) -> None:
        if self.latched is None:
            self.latched = reason

    def _refusal(self, now_ns: int, stamp_ns: int, age: float) -> tuple[str, ...]:
        """Why no motion at all is allowed; empty if some is."""
        if self.stop_line is not None:
            return STOP_LINE
        if self.latched is not None:
            return LATCHED
        since = (now_ns - stamp_ns) / 1e9
        if since >= self.limits.command_age:
            return COMMAND_OLD
        if since < -self.limits.ahead:
            return COMMAND_AHEAD
        return self._stale(age) if self.limits.watched else ()

    def _stale(self, age: float) -> tuple[str, ...]:
        """Why the user's pose cannot be used; empty if it can."""
        if age > self.limits.old:
            return USER_OLD if age < math.inf else USER_UNKNOWN
        return USER_AHEAD if age < -self.limits.ahead else ()

    # limits and separation

    def _unwatched(self, now_ns: int, command: Twist2) -> SafetyRecord:
        """A cycle without any pose of the user."""
        admitted, reasons = STILL, self.refused
        if not reasons:
            admitted, reasons = self._limited(command, 0.0, ())
        return SafetyRecord(now_ns, command, admitted, reasons=reasons)

    def _governed(
        self, now_ns: int, age: float, command: Twist2, pose: Pose2, twist: Twist2, off: float
    ) -> SafetyRecord:
        """A cycle with a pose of the user; `off` is the excess error of the base's pose, m."""
        limits, user = self.limits, self._user
        near = self._nearness(pose)
        speed = limits.walking if user.speed is None else user.speed + limits.uncertainty
        if age > limits.late:
            speed = max(speed, limits.walking)
        allowed = limits.stopping.allowed(near.gap - off, speed, age)
        admitted, reasons = STILL, self.refused
        if not reasons:
            touch = self._touch_speed(near.gap, age) if self._requested else 0.0
            if touch > allowed:
                allowed, reasons = touch, (GRANTED,)
            admitted, reasons = self._limited(command, age, reasons)
            slower = near.held_back(admitted, allowed, self.holonomic)
            if limits.governor and slower is not admitted:
                admitted, reasons = slower, (*reasons, SEPARATION)
        needed = limits.stopping.needed(near.closing(twist), speed, age)
        needed += off if needed else 0.0
        return SafetyRecord(
            now_ns, command, admitted, near.gap, needed, allowed, speed, age, reasons
        )

    def _nearness(self, pose: Pose2) -> Nearness:
        user = self._user
        c, s = math.cos(pose.yaw), math.sin(pose.yaw)
        dx, dy = user.x - pose.x, user.y - pose.y
        return nearness(*self._half, c * dx + s * dy, c * dy - s * dx, USER_RADIUS)

    def _touch_speed(self, gap: float, age: float) -> float:
        """The closing speed granted towards a user who requests a touch and stands still, m/s.

        It falls with the age of the user's pose, so that the distance covered since that pose
        stays bounded.
        """
        limits, user = self.limits, self._user
        if user.steady is None or user.steady >= limits.still:
            return 0.0
        floor = limits.touch_gap
        if self._served_from is not None:
            floor = max(floor, self._nearness(self._served_from).gap - limits.touch_slack)
        fastest = self._share(age) * limits.touch_speed
        return min(fastest, limits.stopping.allowed_above(floor, gap))

    def _limited(
        self, command: Twist2, age: float, reasons: tuple[str, ...]
    ) -> tuple[Twist2, tuple[str, ...]]:
        """The command scaled to the speed limit; to the reasons so far, that of a scaling is added.

        The limit falls to 0 as the command or the user's pose ages (R149).
        """
        limits, seen = self.limits, self._share(age)
        share = min(seen, limits.command_share(self._command_age))
        speed, turn = math.hypot(command.vx, command.vy), abs(command.wz)
        scale = 1.0
        if speed > share * limits.speed + ROUNDING:
            scale = share * limits.speed / speed
        if turn * scale > share * limits.yaw_rate + ROUNDING:
            scale = share * limits.yaw_rate / turn
        if scale == 1.0:
            return command, reasons
        slower = Twist2(scale * command.vx, scale * command.vy, scale * command.wz)
        reason = SPEED if share == 1.0 else USER_LATE if share == seen else COMMAND_LATE
        return slower, (*reasons, reason)

    def _share(self, age: float) -> float:
        """Share of a speed limit left at this age of the user's pose: 1 to `late`, 0 at `old`."""
        limits = self.limits
        return 1.0 if age <= limits.late else (limits.old - age) / (limits.old - limits.late)


def _is_finite(command: Twist2, pose: Pose2, twist: Twist2) -> bool:
    length = math.hypot(
        command.vx, command.vy, command.wz,
        pose.x, pose.y, pose.yaw,
        twist.vx, twist.vy, twist.wz,
    )  # fmt: skip
    return length < _NOWHERE
