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
of the user's pose, speed limit, separation governor (R48-R52, R149).

The governor takes away only what closes the gap between the outline as it stands, a rectangle, and
the user's cylinder: the part of the velocity towards the user, and a turn that brings the nearest
point of the outline nearer. Both are judged apart and shortened by the same share, so that one
cannot make up for the other while they brake. Going away, and along the side, is free.
"""

from __future__ import annotations

import math
from collections import deque
from typing import NamedTuple

from hw.geometry import STILL, Pose2, Twist2
from hw.person import RADIUS
from hw.safety_limits import SafetyLimits as SafetyLimits  # who wires a chain needs both
from hw.separation import Nearness, UserTrack, nearness

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

USER_LOST = "tracking of the user is lost"
TOO_FAST = "the base is faster than its limit"
RUNS_ON = "the base does not stop"

NOT_FINITE = ("a value is not finite",)
STOP_LINE = ("stop line",)
LATCHED = ("latched",)
COMMAND_OLD = ("command is old",)
USER_UNKNOWN = ("no pose of the user yet",)
USER_OLD = ("pose of the user is old",)
USER_LATE = "pose of the user is late"
SPEED = "speed limit"
SEPARATION = "separation"
GRANTED = "granted touch"


class SafetyRecord(NamedTuple):
    """One cycle of the chain.

    `command` and `admitted` are in the base frame; `admitted is command` where nothing was taken
    away. `separation` is the measured gap S, m, and `needed` the S_p of the measured motion: where
    S is less and no touch is granted, the robot is nearer than it should be for its speed.
    `allowed` is the closing speed up to which the governor does nothing, `user_speed` what it took
    the user for (m/s), `user_age` the age of their pose (s). None: there is no pose yet.
    """

    stamp_ns: int
    command: Twist2
    admitted: Twist2
    separation: float | None = None
    needed: float = 0.0
    allowed: float = 0.0
    user_speed: float | None = None
    user_age: float | None = None
    reasons: tuple[str, ...] = ()


class SafetyChain:
    """See the module. `records` holds the newest cycles, oldest first; whoever reads may clear it.

    `stop_line` is why the stop line is pulled, or None; `holonomic` is False for a base that goes
    along its heading only. `latched` is None, or why the stop has latched: then nothing moves until
    `reset`.
    """

    def __init__(self, limits: SafetyLimits) -> None:
        self.limits = limits
        self.latched: str | None = None
        self.stop_line: str | None = None
        self.holonomic = True
        self.records: deque[SafetyRecord] = deque(maxlen=KEPT)
        self._half = limits.footprint.half_length, limits.footprint.half_width
        self._user = UserTrack()
        self._requested = False
        self._served_from: Pose2 | None = None
        self._measured = 0.0
        self._stopping = False
        self._stand_by_ns: int | None = None

    def see(self, now_ns: int, stamp_ns: int, x: float, y: float) -> bool:
        """A pose of the user, map, arrived now; False if it is refused: see `UserTrack`."""
        return self._user.see(now_ns, stamp_ns, x, y)

    def request(self, level: bool) -> None:
        """Does the user ask for a touch? The end of a request ends its grant."""
        self._requested = level
        if not level:
            self._served_from = None

    def grant(self, pose: Pose2 | None) -> None:
        """The request is served from this pose, map_from_base; None: from no known one."""
        self._served_from = pose

    def reset(self, now_ns: int) -> bool:
        """Take the latch away; False while its cause holds or the base moves.

        Only an operator's command leads here (R49).
        """
        if self.latched is None:
            return True
        lost = self.latched == USER_LOST and self._user.age_s(now_ns) > self.limits.old
        if lost or self._measured > STANDING:
            return False
        self.latched = None
        return True

    def rest(self, now_ns: int) -> None:
        """The base stands and is to stand: a cycle in which only the user can get lost.

        It leaves no record.
        """
        self._watch(now_ns, STILL, self._user.age_s(now_ns))

    def admit(
        self, now_ns: int, command: Twist2, stamp_ns: int, pose: Pose2, twist: Twist2
    ) -> SafetyRecord:
        """What the wheels may be told now.

        Args:
            now_ns: the instant of this cycle.
            command: the next velocity of the wheels, base frame.
            stamp_ns: when whoever drives last said so.
            pose: map_from_base, measured.
            twist: measured velocity, base frame.
        """
        age = self._user.age_s(now_ns)
        finite = _is_finite(command, pose, twist)
        if finite:
            self._watch(now_ns, twist, age)
        refusal = self._refusal(now_ns, stamp_ns, age) if finite else NOT_FINITE
        self._stopping = bool(refusal)
        if finite and age < math.inf:
            record = self._governed(now_ns, age, command, pose, twist, refusal)
        else:
            record = SafetyRecord(now_ns, command, STILL, reasons=refusal)
        self.records.append(record)
        return record

    # stop line, latches, ages

    def _watch(self, now_ns: int, twist: Twist2, age: float) -> None:
        """Latch a stop that must not end by itself."""
        limits = self.limits
        speed, turn = math.hypot(twist.vx, twist.vy), abs(twist.wz)
        self._measured = max(speed, turn)
        if limits.lost < age < math.inf:
            self._latch(USER_LOST)
        if speed > FASTER * limits.speed or turn > FASTER * limits.yaw_rate:
            self._latch(TOO_FAST)
        if not self._stopping or self._measured <= STANDING:
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
        if (now_ns - stamp_ns) / 1e9 > self.limits.command_age:
            return COMMAND_OLD
        if age > self.limits.old:
            return USER_OLD if age < math.inf else USER_UNKNOWN
        return ()

    # limits and separation

    def _governed(
        self,
        now_ns: int,
        age: float,
        command: Twist2,
        pose: Pose2,
        twist: Twist2,
        refusal: tuple[str, ...],
    ) -> SafetyRecord:
        limits, user = self.limits, self._user
        near = self._nearness(pose)
        speed = limits.walking if user.speed is None else user.speed + limits.uncertainty
        if age > limits.late:
            speed = max(speed, limits.walking)
        allowed = limits.stopping.allowed(near.gap, speed, age)
        admitted, reasons = STILL, refusal
        if not refusal:
            touch = self._touch_speed(near.gap, age) if self._requested else 0.0
            if touch > allowed:
                allowed, reasons = touch, (GRANTED,)
            admitted, reasons = self._limited(command, age, reasons)
            slower = near.held_back(admitted, allowed, self.holonomic)
            if slower is not admitted:
                admitted, reasons = slower, (*reasons, SEPARATION)
        needed = limits.stopping.needed(near.closing(twist), speed, age)
        return SafetyRecord(
            now_ns, command, admitted, near.gap, needed, allowed, speed, age, reasons
        )

    def _nearness(self, pose: Pose2) -> Nearness:
        user = self._user
        c, s = math.cos(pose.yaw), math.sin(pose.yaw)
        dx, dy = user.x - pose.x, user.y - pose.y
        return nearness(*self._half, c * dx + s * dy, c * dy - s * dx, RADIUS)

    def _touch_speed(self, gap: float, age: float) -> float:
        """The closing speed towards a user who has asked for a touch and stands still, m/s."""
        limits, user = self.limits, self._user
        if user.speed is None or user.speed >= limits.still or age > limits.late:
            return 0.0
        floor = limits.touch_gap
        if self._served_from is not None:
            floor = max(floor, self._nearness(self._served_from).gap - limits.touch_slack)
        return min(limits.touch_speed, limits.stopping.allowed_above(floor, gap))

    def _limited(
        self, command: Twist2, age: float, reasons: tuple[str, ...]
    ) -> tuple[Twist2, tuple[str, ...]]:
        """The command within the speed limit, which falls to 0 while the pose gets old (R149)."""
        limits = self.limits
        share = 1.0
        if age > limits.late:
            share = (limits.old - age) / (limits.old - limits.late)
        speed, turn = math.hypot(command.vx, command.vy), abs(command.wz)
        scale = 1.0
        if speed > share * limits.speed + ROUNDING:
            scale = share * limits.speed / speed
        if turn * scale > share * limits.yaw_rate + ROUNDING:
            scale = share * limits.yaw_rate / turn
        if scale == 1.0:
            return command, reasons
        slower = Twist2(scale * command.vx, scale * command.vy, scale * command.wz)
        return slower, (*reasons, SPEED if share == 1.0 else USER_LATE)


def _is_finite(command: Twist2, pose: Pose2, twist: Twist2) -> bool:
    length = math.hypot(
        command.vx, command.vy, command.wz,
        pose.x, pose.y, pose.yaw,
        twist.vx, twist.vy, twist.wz,
    )  # fmt: skip
    return length < _NOWHERE
