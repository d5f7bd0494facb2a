"""The safety chain: the last thing before the wheels. It can only slow the base down, or stop it.

What it does is a software stop of a research prototype, and it is no safety device (R54): a stop
in hardware and somebody with a hand on it have to be there. It knows nothing of charts and plans,
has no queue and no lock, and is called at 100 Hz or more by whoever owns the wheels:

    chain.see(now_ns, stamp_ns, x, y)              # each tracked pose of the user, in the map
    chain.stop_line = reason                       # why the stop line is pulled, or None
    chain.request(True); chain.grant(pose)         # a touch is asked for, and served from there
    record = chain.admit(now_ns, command, stamp_ns, pose, twist)
    wheels.go(record.admitted)

`command` is what the wheels would be given in the next cycle, ramps included, because behind the
chain nothing may be slower than the brakes. In this order: stop line and latches, command age, age
of the user's pose, speed limit, separation governor (R48-R52, R149). While a command gets old the
limit falls, so that a computer that is too slow slows the robot down before it stops it.
Time that runs backwards latches, and what is stamped ahead of the clock counts for nothing: a
negative age is never fresh.

The governor takes away only what closes the gap between the outline as it stands, a rectangle, and
the user's cylinder: the part of the velocity towards the user, and a turn that brings the nearest
point of the outline nearer. Both are judged apart and shortened by the same share, so that one
cannot make up for the other while they brake. Going away, and along the side, is free.
"""

from __future__ import annotations

import math

from hw.geometry import STILL, Pose2, Twist2
from hw.log import Log
from hw.people.person import RADIUS
from hw.safety.limits import SafetyLimits as SafetyLimits  # who wires a chain needs both
from hw.safety.record import (
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
from hw.safety.separation import Nearness, UserTrack, nearness
from hw.samples import is_finite

KEPT = 4096
"""So many records are kept: 34 s at 120 Hz."""
STANDING = 0.02
"""A base slower than this, m/s and rad/s, stands."""
FASTER = 1.1
"""A base faster than its limit by this factor does not do what it is told."""
SLOWER = 1.5
"""A base that takes longer to stop than its brakes should, by this factor, does not either."""
ROUNDING = 1e-9
"""What was limited before, to the last bit, is not limited again; m/s and rad/s."""
_NOWHERE = 1e9
_ORIGIN = Pose2(0.0, 0.0)


class SafetyChain:
    """See the module. `cycles` holds the newest records, for any number of readers.

    `stop_line` is why the stop line is pulled, or None; `holonomic` is False for a base that goes
    along its heading only. `latched` is None, or why the stop has latched: then nothing moves until
    `reset`. `refused` is why nothing at all could move in the last cycle; empty if something could.
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

    def see(self, now_ns: int, stamp_ns: int, x: float, y: float) -> bool:
        """A pose of the user, map, arrived now; False if it is refused: see `UserTrack`."""
        return self._user.see(now_ns, stamp_ns, x, y)

    def request(self, level: bool) -> None:
        """Does the user ask for a touch? The end of a request ends its grant.

        A level that comes on change: silence does not end it, and whoever loses the link to the
        user says so (`Vr`). Meanwhile a touch still needs a fresh pose of a user who stands.
        """
        self._requested = level
        if not level:
            self._served_from = None

    def grant(self, pose: Pose2 | None) -> None:
        """The request is served from this pose, map_from_base; None: from no known one.

        A pose that is not finite is no known one.
        """
        self._served_from = pose if is_finite(pose) else None

    def reset(self, now_ns: int) -> bool:
        """Take the latch away; False while its cause holds or the base moves.

        Only an operator's command leads here (R49).
        """
        if self.latched is None:
            return True
        lost = self.latched == USER_LOST and self._stale(self._user.age_s(now_ns)) != ()
        if lost or self._measured > STANDING:
            return False
        self.latched = None
        return True

    def rest(self, now_ns: int) -> None:
        """The base stands and is to stand: a cycle in which only the user can get lost.

        It leaves no record.
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
        """What the wheels may be told now.

        Args:
            now_ns: the instant of this cycle.
            command: the next velocity of the wheels, base frame.
            stamp_ns: when whoever drives last said so.
            pose: map_from_base, measured; None: not known.
            twist: measured velocity, base frame; None: not known.
            sigma: standard deviation of the pose, m.
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
        """The age of the user's pose, s; infinite if there is none, or if nobody tracks them."""
        if self._now_ns is not None and now_ns < self._now_ns:
            self._latch(BACKWARDS)  # no stamp from before the leap means anything any more
            self._user = UserTrack(self.limits.ahead)
            self._stand_by_ns = None
        self._now_ns = now_ns
        return self._user.age_s(now_ns) if self.limits.watched else math.inf

    def _watch(self, now_ns: int, twist: Twist2, age: float) -> None:
        """Latch a stop that must not end by itself."""
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
        """Why nothing at all may move; empty if something may."""
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
        """Why the pose of the user is not to be used; empty if it is."""
        if age > self.limits.old:
            return USER_OLD if age < math.inf else USER_UNKNOWN
        return USER_AHEAD if age < -self.limits.ahead else ()

    # limits and separation

    def _unwatched(self, now_ns: int, command: Twist2) -> SafetyRecord:
        """A cycle in which nothing is known of the user."""
        admitted, reasons = STILL, self.refused
        if not reasons:
            admitted, reasons = self._limited(command, 0.0, ())
        return SafetyRecord(now_ns, command, admitted, reasons=reasons)

    def _governed(
        self, now_ns: int, age: float, command: Twist2, pose: Pose2, twist: Twist2, off: float
    ) -> SafetyRecord:
        """A cycle beside the user; the pose of the base may be `off` by more than usual, m."""
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
        return nearness(*self._half, c * dx + s * dy, c * dy - s * dx, RADIUS)

    def _touch_speed(self, gap: float, age: float) -> float:
        """The closing speed towards a user who has asked for a touch and stands still, m/s.

        It falls with the age of their pose, so that the way covered unseen does not grow.
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
        """The command within the speed limit, which falls to 0 as it gets old (R149).

        So it does while the pose of the user gets old.
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
        """Of a speed limit, what a pose of this age leaves: all if it is not late, none if old."""
        limits = self.limits
        return 1.0 if age <= limits.late else (limits.old - age) / (limits.old - limits.late)


def _is_finite(command: Twist2, pose: Pose2, twist: Twist2) -> bool:
    length = math.hypot(
        command.vx, command.vy, command.wz,
        pose.x, pose.y, pose.yaw,
        twist.vx, twist.vy, twist.wz,
    )  # fmt: skip
    return length < _NOWHERE
