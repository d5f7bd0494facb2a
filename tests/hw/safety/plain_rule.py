"""The rule of the safety chain in plain Python, by which the compiled one is judged.

Classes instead of records; no code is shared with `hw.safety` but the figures of `SafetyLimits` and
the record of a cycle. Floats are computed in one order, so that both are equal to the last bit.
"""

from __future__ import annotations

import math
from collections import deque
from typing import NamedTuple

from hw.geometry import STILL, Pose2, Twist2, unwrap
from hw.safety.cycle_record import SafetyRecord
from hw.safety.limits import SafetyLimits

USER_LOST = "tracking of the user is lost"
TOO_FAST = "the base is faster than its limit"
RUNS_ON = "the base does not stop"
BACKWARDS = "time runs backwards"
FAR, NOWHERE, TOUCH = 1e4, 1e9, 1e-9
LEAST_NS, OLD_NS = 50_000_000, 150_000_000


class PlainMotion:
    """The least-squares velocity over a window."""

    def __init__(self, window: float, gone: float = 0.15) -> None:
        self.velocity: Twist2 | None = None
        self._window_ns, self._gone_ns = round(window * 1e9), round(gone * 1e9)
        self._seen: deque[tuple[int, float, float, float]] = deque()
        self._same_since = 0

    def add_pose(self, stamp_ns: int, x: float, y: float, yaw: float = 0.0) -> None:
        """Take a pose in the map, m and rad; one not newer than the last is ignored."""
        seen = self._seen
        if seen:
            last = seen[-1]
            if stamp_ns <= last[0]:
                return
            if stamp_ns - last[0] > self._gone_ns or _is_jump(last, stamp_ns, x, y):
                seen.clear()
            else:
                yaw = unwrap(yaw, last[3])
        if not seen or last[1] != x or last[2] != y or last[3] != yaw:
            self._same_since = stamp_ns
        seen.append((stamp_ns, x, y, yaw))
        while stamp_ns - seen[0][0] > self._window_ns:
            seen.popleft()
        self.velocity = None
        if stamp_ns - seen[0][0] >= LEAST_NS:
            self.velocity = STILL if seen[0][0] >= self._same_since else _slope(seen)


def _is_jump(last: tuple[int, float, float, float], stamp_ns: int, x: float, y: float) -> bool:
    elapsed = (stamp_ns - last[0]) * 1e-9
    return math.hypot(x - last[1], y - last[2]) > 0.3 + 4.0 * elapsed


def _slope(seen: deque[tuple[int, float, float, float]]) -> Twist2:
    """Least-squares slopes: sum of (t - mean t) x / sum of (t - mean t)^2; y and yaw likewise."""
    origin = seen[0][0]
    times = [(pose[0] - origin) * 1e-9 for pose in seen]
    total = 0.0  # Python 3.12 sums otherwise
    for t in times:
        total += t
    middle = total / len(times)
    spread = vx = vy = wz = 0.0
    for t, (_, x, y, yaw) in zip(times, seen, strict=True):
        away = t - middle
        spread += away * away
        vx += away * x
        vy += away * y
        wz += away * yaw
    return Twist2(vx / spread, vy / spread, wz / spread)


class Near(NamedTuple):
    """The gap, its direction, and the lever of a rotation."""

    gap: float
    nx: float
    ny: float
    lever: float

    def closing(self, twist: Twist2) -> float:
        toward = self.nx * twist.vx + self.ny * twist.vy
        turning = self.lever * twist.wz
        return (toward if toward > 0.0 else 0.0) + (turning if turning > 0.0 else 0.0)

    def held_back(self, twist: Twist2, allowed: float, holonomic: bool = True) -> Twist2:
        closing = self.closing(twist)
        if closing <= allowed:
            return twist
        left = allowed / closing
        vx, vy, wz = twist.vx, twist.vy, twist.wz
        if self.lever * wz > 0.0:
            wz *= left
        toward = self.nx * vx + self.ny * vy
        if toward <= 0.0:
            return Twist2(vx, vy, wz)
        if not holonomic:
            return Twist2(left * vx, left * vy, wz)
        taken = (1.0 - left) * toward
        return Twist2(vx - taken * self.nx, vy - taken * self.ny, wz)


def near_to(half_length: float, half_width: float, x: float, y: float, radius: float) -> Near:
    qx = x if abs(x) < half_length else math.copysign(half_length, x)
    qy = y if abs(y) < half_width else math.copysign(half_width, y)
    dx, dy = x - qx, y - qy
    distance = math.hypot(dx, dy)
    if distance > TOUCH:
        nx, ny = dx / distance, dy / distance
    elif half_width - abs(y) <= half_length - abs(x):
        nx, ny = 0.0, math.copysign(1.0, y)
        qy, distance = ny * half_width, abs(y) - half_width
    else:
        nx, ny = math.copysign(1.0, x), 0.0
        qx, distance = nx * half_length, abs(x) - half_length
    return Near(distance - radius, nx, ny, qx * ny - qy * nx)


class PlainTrack:
    """Where the user was last seen, and how fast."""

    def __init__(self, ahead: float = 0.02) -> None:
        self._ahead_ns = round(ahead * 1e9)
        self.x = self.y = 0.0
        self.stamp_ns: int | None = None
        self.speed: float | None = None
        self.steady: float | None = None
        self._quick, self._steady = PlainMotion(0.1), PlainMotion(0.3)

    def age_s(self, now_ns: int) -> float:
        return math.inf if self.stamp_ns is None else (now_ns - self.stamp_ns) / 1e9

    def add_position(self, now_ns: int, stamp_ns: int, x: float, y: float) -> bool:
        newest = self.stamp_ns
        if not (abs(x) < FAR and abs(y) < FAR) or stamp_ns > now_ns + self._ahead_ns:
            return False
        stamp_ns = min(stamp_ns, now_ns)
        if newest is not None and stamp_ns <= newest:
            return False
        self.x, self.y, self.stamp_ns = x, y, stamp_ns
        self._quick.add_pose(stamp_ns, x, y)
        self._steady.add_pose(stamp_ns, x, y)
        quick, steady = self._quick.velocity, self._steady.velocity
        self.steady = None if steady is None else steady.speed
        if quick is None or steady is None:
            self.speed = None
        else:
            self.speed = max(quick.speed, steady.speed)
        return True


class PlainRule:
    """The rule, one cycle after the other."""

    def __init__(self, limits: SafetyLimits) -> None:
        self.limits = limits
        self.latched: str | None = None
        self.refused: tuple[str, ...] = ()
        self.stop_line: str | None = None
        self.holonomic = True
        self._half = limits.footprint.half_length, limits.footprint.half_width
        self._user = PlainTrack(limits.ahead)
        self._requested = False
        self._served_from: Pose2 | None = None
        self._measured = self._command_age = 0.0
        self._stand_by_ns: int | None = None
        self._now_ns: int | None = None

    def track_user(self, now_ns: int, stamp_ns: int, x: float, y: float) -> bool:
        return self._user.add_position(now_ns, stamp_ns, x, y)

    def request(self, level: bool) -> None:
        self._requested = level
        if not level:
            self._served_from = None

    def grant(self, pose: Pose2 | None) -> None:
        self._served_from = (
            pose
            if pose is not None and all(map(math.isfinite, (pose.x, pose.y, pose.yaw)))
            else None
        )

    def reset(self, now_ns: int) -> bool:
        if self.latched is None:
            return True
        lost = self.latched == USER_LOST and self._stale(self._user.age_s(now_ns)) != ()
        if lost or self._measured > 0.02:
            return False
        self.latched = None
        return True

    def rest(self, now_ns: int) -> None:
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
        age = self._age(now_ns)
        record = None
        if twist is None:
            self.refused = ("pose or velocity of the base is not known",)
        elif not _is_finite(command, pose or Pose2(0.0, 0.0), twist):
            self.refused = ("a value is not finite",)
        else:
            self._watch(now_ns, twist, age)
            lost = (pose is None or not sigma < math.inf) and self.limits.watched
            self.refused = (
                ("pose or velocity of the base is not known",)
                if lost
                else self._refusal(now_ns, stamp_ns, age)
            )
            self._command_age = (now_ns - stamp_ns) / 1e9
            if pose is not None and age < math.inf:
                off = max(0.0, 3.0 * sigma - 0.075)
                record = self._governed(now_ns, max(age, 0.0), command, pose, twist, off)
        return record or self._unwatched(now_ns, command)

    # stop line, latches, ages

    def _age(self, now_ns: int) -> float:
        if self._now_ns is not None and now_ns < self._now_ns:
            self._latch(BACKWARDS)  # stamps from before the jump mean nothing any more
            self._user = PlainTrack(self.limits.ahead)
            self._stand_by_ns = None
        self._now_ns = now_ns
        return self._user.age_s(now_ns) if self.limits.watched else math.inf

    def _watch(self, now_ns: int, twist: Twist2, age: float) -> None:
        limits = self.limits
        speed, turn = math.hypot(twist.vx, twist.vy), abs(twist.wz)
        self._measured = max(speed, turn)
        if limits.lost < age < math.inf:
            self._latch(USER_LOST)
        if speed > 1.1 * limits.speed or turn > 1.1 * limits.yaw_rate:
            self._latch(TOO_FAST)
        if not self.refused or self._measured <= 0.02:
            self._stand_by_ns = None
        elif self._stand_by_ns is None:
            within = self._measured / limits.stopping.deceleration
            self._stand_by_ns = now_ns + round((limits.stopping.reaction + 1.5 * within) * 1e9)
        elif now_ns > self._stand_by_ns:
            self._latch(RUNS_ON)

    def _latch(self, reason: str) -> None:
        if self.latched is None:
            self.latched = reason

    def _refusal(self, now_ns: int, stamp_ns: int, age: float) -> tuple[str, ...]:
        if self.stop_line is not None:
            return ("stop line",)
        if self.latched is not None:
            return ("latched",)
        since = (now_ns - stamp_ns) / 1e9
        if since >= self.limits.command_age:
            return ("command is old",)
        if since < -self.limits.ahead:
            return ("command is stamped ahead of the clock",)
        return self._stale(age) if self.limits.watched else ()

    def _stale(self, age: float) -> tuple[str, ...]:
        if age > self.limits.old:
            return ("pose of the user is old",) if age < math.inf else ("no pose of the user yet",)
        return (
            ("pose of the user is stamped ahead of the clock",) if age < -self.limits.ahead else ()
        )

    # limits and separation

    def _unwatched(self, now_ns: int, command: Twist2) -> SafetyRecord:
        admitted, reasons = STILL, self.refused
        if not reasons:
            admitted, reasons = self._limited(command, 0.0, ())
        return SafetyRecord(now_ns, command, admitted, reasons=reasons)

    def _governed(
        self, now_ns: int, age: float, command: Twist2, pose: Pose2, twist: Twist2, off: float
    ) -> SafetyRecord:
        limits, user = self.limits, self._user
        near = self._nearness(pose)
        speed = limits.walking if user.speed is None else user.speed + limits.uncertainty
        if age > limits.late:
            speed = max(speed, limits.walking)
        allowed = self._allowed(near.gap - off, speed, age)
        admitted, reasons = STILL, self.refused
        if not reasons:
            touch = self._touch_speed(near.gap, age) if self._requested else 0.0
            if touch > allowed:
                allowed, reasons = touch, ("granted touch",)
            admitted, reasons = self._limited(command, age, reasons)
            slower = near.held_back(admitted, allowed, self.holonomic)
            if limits.governor and slower is not admitted:
                admitted, reasons = slower, (*reasons, "separation")
        needed = self._needed(near.closing(twist), speed, age)
        needed += off if needed else 0.0
        return SafetyRecord(
            now_ns, command, admitted, near.gap, needed, allowed, speed, age, reasons
        )

    def _nearness(self, pose: Pose2) -> Near:
        user = self._user
        c, s = math.cos(pose.yaw), math.sin(pose.yaw)
        dx, dy = user.x - pose.x, user.y - pose.y
        return near_to(*self._half, c * dx + s * dy, c * dy - s * dx, 0.5)

    def _touch_speed(self, gap: float, age: float) -> float:
        limits, user = self.limits, self._user
        if user.steady is None or user.steady >= limits.still:
            return 0.0
        floor = limits.touch_gap
        if self._served_from is not None:
            floor = max(floor, self._nearness(self._served_from).gap - limits.touch_slack)
        fastest = self._share(age) * limits.touch_speed
        return min(fastest, self._speed(gap - floor, limits.stopping.reaction))

    def _limited(
        self, command: Twist2, age: float, reasons: tuple[str, ...]
    ) -> tuple[Twist2, tuple[str, ...]]:
        limits, seen = self.limits, self._share(age)
        share = min(seen, self._command_share(self._command_age))
        speed, turn = math.hypot(command.vx, command.vy), abs(command.wz)
        scale = 1.0
        if speed > share * limits.speed + 1e-9:
            scale = share * limits.speed / speed
        if turn * scale > share * limits.yaw_rate + 1e-9:
            scale = share * limits.yaw_rate / turn
        if scale == 1.0:
            return command, reasons
        slower = Twist2(scale * command.vx, scale * command.vy, scale * command.wz)
        reason = (
            "speed limit"
            if share == 1.0
            else "pose of the user is late"
            if share == seen
            else "command is late"
        )
        return slower, (*reasons, reason)

    def _share(self, age: float) -> float:
        limits = self.limits
        return 1.0 if age <= limits.late else (limits.old - age) / (limits.old - limits.late)

    def _command_share(self, age: float) -> float:
        late, oldest = self.limits.command_late, self.limits.command_age
        return 1.0 if age <= late else max(0.0, (oldest - age) / (oldest - late))

    def _needed(self, closing: float, user_speed: float, age: float) -> float:
        robot = self.limits.stopping
        if closing <= 1e-6:
            return 0.0
        stop = closing / robot.deceleration
        return (
            user_speed * (age + robot.reaction + stop)
            + closing * (robot.reaction + 0.5 * stop)
            + robot.clearance
        )

    def _allowed(self, gap: float, user_speed: float, age: float) -> float:
        robot = self.limits.stopping
        lag = robot.reaction + user_speed / robot.deceleration
        return self._speed(gap - robot.clearance - user_speed * (age + robot.reaction), lag)

    def _speed(self, room: float, lag: float) -> float:
        if room <= 1e-12:
            return 0.0
        return (
            2.0
            * room
            / (lag + math.sqrt(lag * lag + 2.0 * room / self.limits.stopping.deceleration))
        )


def _is_finite(command: Twist2, pose: Pose2, twist: Twist2) -> bool:
    values = (
        command.vx, command.vy, command.wz, pose.x, pose.y, pose.yaw, twist.vx, twist.vy, twist.wz,
    )  # fmt: skip
    return all(abs(value) < NOWHERE for value in values)
