"""Four drives on which local planners are compared, with the least possible time of each.

A user stands at the origin; the robot drives from the Chase space to the first Haptic pose, or in
free space. The base is ideal: it changes its velocity linearly within each period and knows its
pose. The least times are from an optimal control problem solved with casadi and ipopt (direct
transcription, 120 intervals, v <= 1.5 m/s and a <= 1.0 m/s2 as norms, at least 1.27 m from the
user), until within 5 cm of the goal and slower than 0.1 m/s.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from hw import STILL, Pose2, Twist2, wrap
from hw.scene import Disc, Ring
from states.navigation.local import LocalPlanner

SLOW = 0.1
"""Speed below which a robot at its goal has arrived, m/s."""


@dataclass(frozen=True, slots=True)
class Trial:
    """A drive from rest; `least_time` in s; `user` is the disc to keep out of, if any."""

    name: str
    start: Pose2
    goal: Pose2
    user: Disc | None
    least_time: float


def slow_enough(distance: float, speed: float, acceleration: float, slow: float = SLOW) -> float:
    """The least time from rest over a straight distance, m, to a speed of `slow` or less, s.

    Up at full acceleration to the peak p, along, down to `slow`: the ramps cover p^2 / 2a and
    (p^2 - slow^2) / 2a. On a short way the peak is where both ramps meet.
    """
    peak = min(speed, math.sqrt(acceleration * distance + 0.5 * slow**2))
    ramps = (2.0 * peak**2 - slow**2) / (2.0 * acceleration)
    return (2.0 * peak - slow) / acceleration + (distance - ramps) / peak


@dataclass(slots=True)
class DriveOutcome:
    """Result of a drive: the time it took, s, and worst values.

    `intrusion` is the depth of the robot's centre in the user's disc, m, negative outside; `places`
    are those after each cycle but the last.
    """

    time: float = 0.0
    arrived: bool = False
    intrusion: float = -math.inf
    speed: float = 0.0
    acceleration: float = 0.0
    turn_rate: float = 0.0
    turn_acceleration: float = 0.0
    places: list[tuple[float, float]] = field(default_factory=list)

    @property
    def cycles(self) -> int:
        """Number of control cycles."""
        return len(self.places) + self.arrived


def _polar(radius: float, degrees: float) -> Pose2:
    angle = math.radians(degrees)
    return Pose2(radius * math.cos(angle), radius * math.sin(angle))


OPEN_ROOM: Ring = ((-10.0, -10.0), (10.0, -10.0), (10.0, 10.0), (-10.0, 10.0))
"""A room whose walls are far away."""

_USER, _HAPTIC = Disc(0.0, 0.0, 1.27), Pose2(1.85, 0.0)

TRIALS = (
    Trial("S1", Pose2(0.0, 5.0), Pose2(3.0, 5.0), None, 3.3701),
    Trial("S2", _polar(2.0, 60.0), _HAPTIC, _USER, 2.6455),
    Trial("S3", _polar(2.0, 150.0), _HAPTIC, _USER, 4.1256),
    Trial("S4", _polar(3.0, 120.0), _HAPTIC, _USER, 4.2030),
)


def drive(
    driver: LocalPlanner,
    trial: Trial,
    dt: float = 0.05,
    *,
    longest: float = 40.0,
) -> DriveOutcome:
    """Drive a trial with a command every dt s."""
    driver.go_to(trial.goal)
    pose, velocity, outcome = trial.start, STILL, DriveOutcome()
    while outcome.time < longest:
        command = driver.command(pose, velocity.rotated(-pose.yaw), trial.user, dt)
        outcome.arrived = driver.status == "arrived"
        if outcome.arrived:
            break
        # an omni base gets its velocity for mid-period, a differential one for its end
        turn = 0.5 * (velocity.wz + command.wz) * dt
        look = pose.yaw + (0.5 if driver.mode == "omni" else 1.0) * turn
        following = command.rotated(look)
        pose = _moved(pose, velocity, following, dt)
        _note(outcome, pose, velocity, following, dt)
        if trial.user is not None:
            gap = math.dist((pose.x, pose.y), (trial.user.x, trial.user.y)) - trial.user.radius
            outcome.intrusion = max(outcome.intrusion, -gap)
        velocity = following
    return outcome


def _moved(pose: Pose2, before: Twist2, after: Twist2, dt: float) -> Pose2:
    x = pose.x + 0.5 * (before.vx + after.vx) * dt
    y = pose.y + 0.5 * (before.vy + after.vy) * dt
    return Pose2(x, y, wrap(pose.yaw + 0.5 * (before.wz + after.wz) * dt))


def _note(outcome: DriveOutcome, pose: Pose2, before: Twist2, after: Twist2, dt: float) -> None:
    change = math.dist((before.vx, before.vy), (after.vx, after.vy))
    outcome.time += dt
    outcome.places.append((pose.x, pose.y))
    outcome.speed = max(outcome.speed, after.speed)
    outcome.acceleration = max(outcome.acceleration, change / dt)
    outcome.turn_rate = max(outcome.turn_rate, abs(after.wz))
    outcome.turn_acceleration = max(outcome.turn_acceleration, abs(after.wz - before.wz) / dt)
