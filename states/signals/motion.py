"""How a person moves, estimated from tracked poses that are noisy and sometimes missing."""

from __future__ import annotations

import math
from collections import deque
from typing import Protocol

from hw.geometry import STILL, Twist2, wrap
from hw.samples import UserPose

LEAST_SHARE = 0.3
"""Share of the window that must be filled before there is a velocity."""

JUMP = 0.3
FASTEST = 4.0
"""A step of more than JUMP m and FASTEST m/s is the tracking's, not the person's."""


class Stamped(Protocol):
    """A value and the instant it was true, ns."""

    @property
    def value(self) -> object: ...

    @property
    def stamp(self) -> int: ...


class VelocityEstimator:
    """Velocity of the body in the map, m/s, and its rate of turn, rad/s, as a `Twist2`.

    A straight line is laid through the poses of the last `window` seconds by least squares: the
    noise of motion capture (1 mm at 120 Hz would be 0.1 m/s between samples) averages out, at the
    price of half a window of delay. After a gap or a jump it begins anew; it is None until a part
    of the window is filled, and exactly `STILL` while all poses in it are the same.
    """

    def __init__(self, window: float) -> None:
        self._window_ns = round(window * 1e9)
        self._least_ns = round(LEAST_SHARE * window * 1e9)
        self._poses: deque[tuple[int, float, float, float]] = deque()
        self._velocity: Twist2 | None = None
        self._same_since = 0

    def update(self, _signal: str, sample: Stamped) -> None:
        """Take one `UserPose`; late ones are left out."""
        pose = sample.value
        assert isinstance(pose, UserPose)
        stamp, body = sample.stamp, pose.body
        poses, yaw = self._poses, body.yaw
        if poses:
            last = poses[-1]
            if stamp <= last[0]:
                return
            if self._broken(last, stamp, body.x, body.y):
                poses.clear()
            else:
                yaw = last[3] + wrap(body.yaw - last[3])
        if not poses or poses[-1][1:] != (body.x, body.y, yaw):
            self._same_since = stamp
        poses.append((stamp, body.x, body.y, yaw))
        while stamp - poses[0][0] > self._window_ns:
            poses.popleft()
        self._velocity = None
        if len(poses) > 1 and stamp - poses[0][0] >= self._least_ns:
            self._velocity = STILL if poses[0][0] >= self._same_since else _slope(poses)

    def value(self) -> Twist2 | None:
        """The present estimate."""
        return self._velocity

    def _broken(
        self, last: tuple[int, float, float, float], stamp: int, x: float, y: float
    ) -> bool:
        elapsed = (stamp - last[0]) * 1e-9
        step = math.hypot(x - last[1], y - last[2])
        return stamp - last[0] > self._window_ns or step > JUMP + FASTEST * elapsed


def _slope(poses: deque[tuple[int, float, float, float]]) -> Twist2:
    origin = poses[0][0]
    times = [(pose[0] - origin) * 1e-9 for pose in poses]
    middle = sum(times) / len(times)
    spread = vx = vy = wz = 0.0
    for t, (_, x, y, yaw) in zip(times, poses, strict=True):
        away = t - middle
        spread += away * away
        vx += away * x
        vy += away * y
        wz += away * yaw
    return Twist2(vx / spread, vy / spread, wz / spread)


class StillnessEstimator:
    """Since when a person has been slower than both limits, ns; None while they move (R89)."""

    def __init__(self, speed: float, turn: float) -> None:
        self._speed, self._turn = speed, turn
        self._since: int | None = None

    def update(self, _signal: str, sample: Stamped) -> None:
        """Take one velocity."""
        velocity = sample.value
        assert isinstance(velocity, Twist2)
        if velocity.speed >= self._speed or abs(velocity.wz) >= self._turn:
            self._since = None
        elif self._since is None:
            self._since = sample.stamp

    def value(self) -> int | None:
        """The stamp of the first velocity of this stand."""
        return self._since
