"""The motion of a stock RB-KAIROS, as far as its topics show it; and its messages.

After `watchdog` without a command the commanded velocity is zero; the drives follow within `ramp`
and `turn_ramp`, and no faster than `speed`. Figures of its configuration files.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

Message = dict[str, Any]
Velocity = tuple[float, float, float]


@dataclass(slots=True)
class KairosWheels:
    """Planar motion in SI units; `place` is the pose of its odometry: x, y, yaw."""

    watchdog: float = 0.5
    ramp: float = 0.6
    turn_ramp: float = 1.5
    speed: float = 1.5
    turn: float = 3.0
    place: tuple[float, float, float] = (3.0, -2.0, 1.0)
    velocity: Velocity = (0.0, 0.0, 0.0)
    stopped: bool = False
    _wanted: Velocity = (0.0, 0.0, 0.0)
    _age: float = math.inf

    def command(self, message: Mapping[str, Any]) -> None:
        """Take a Twist.

        Raises:
            KeyError, TypeError, ValueError: invalid, as the real one refuses it.
        """
        linear, angular = message["linear"], message["angular"]
        wanted = (float(linear["x"]), float(linear["y"]), float(angular["z"]))
        if not all(map(math.isfinite, wanted)):
            raise ValueError("not finite")
        self._wanted, self._age = wanted, 0.0

    def step(self, dt: float) -> None:
        """Advance by dt, s."""
        alive = self._age < self.watchdog and not self.stopped
        self._age += dt
        vx, vy, wz = self._wanted if alive else (0.0, 0.0, 0.0)
        scale = min(1.0, self.speed / max(math.hypot(vx, vy), 1e-9))
        ux, uy, ur = self.velocity
        dx, dy = scale * vx - ux, scale * vy - uy
        part = min(1.0, self.ramp * dt / max(math.hypot(dx, dy), 1e-9))
        most = self.turn_ramp * dt
        wz = max(-self.turn, min(self.turn, wz))
        self.velocity = (ux + part * dx, uy + part * dy, ur + max(-most, min(most, wz - ur)))
        x, y, yaw = self.place
        ux, uy, ur = self.velocity
        c, s = math.cos(yaw + 0.5 * ur * dt), math.sin(yaw + 0.5 * ur * dt)
        self.place = (x + dt * (c * ux - s * uy), y + dt * (s * ux + c * uy), yaw + dt * ur)

    def wheels(self, radius: float, lever: float) -> tuple[float, float, float, float]:
        """Rates of its Mecanum wheels, rad/s: front left and right, rear left and right."""
        vx, vy, wz = self.velocity
        turning = lever * wz
        ahead = (vx - vy - turning, vx + vy + turning, vx + vy - turning, vx - vy + turning)
        return (ahead[0] / radius, ahead[1] / radius, ahead[2] / radius, ahead[3] / radius)


def header(stamp_ns: int, number: int, frame: str, version: int) -> Message:
    """A Header of this version of ROS."""
    seconds, rest = divmod(stamp_ns, 1_000_000_000)
    if version == 1:
        stamp = {"secs": seconds, "nsecs": rest}
        return {"seq": number, "stamp": stamp, "frame_id": frame}
    return {"stamp": {"sec": seconds, "nanosec": rest}, "frame_id": frame}


def odometry(head: Message, place: tuple[float, float, float], velocity: Velocity) -> Message:
    """A nav_msgs/Odometry."""
    (x, y, yaw), (vx, vy, wz) = place, velocity
    turned = {"x": 0.0, "y": 0.0, "z": math.sin(0.5 * yaw), "w": math.cos(0.5 * yaw)}
    pose = {"position": {"x": x, "y": y, "z": 0.0}, "orientation": turned}
    twist = {"linear": {"x": vx, "y": vy, "z": 0.0}, "angular": {"x": 0.0, "y": 0.0, "z": wz}}
    return {
        "header": head,
        "child_frame_id": "robot_base_footprint",
        "pose": {"pose": pose, "covariance": [0.0] * 36},
        "twist": {"twist": twist, "covariance": [0.0] * 36},
    }


def laser_scan(
    head: Message, start: float, step: float, ranges: tuple[float, ...], beam_time: float
) -> Message:
    """A sensor_msgs/LaserScan."""
    return {
        "header": head,
        "angle_min": start,
        "angle_max": start + step * (len(ranges) - 1),
        "angle_increment": step,
        "time_increment": beam_time,
        "scan_time": 0.08,
        "range_min": 0.05,
        "range_max": 30.0,
        "ranges": list(ranges),
        "intensities": [],
    }
