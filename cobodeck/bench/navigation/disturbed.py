"""The drives of `trials` with disturbed poses and wheels, and beside walking users.

Each source of noise draws from its own stream of (seed, source), unaffected by the other sources.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from cobodeck.bench.navigation.drive_trials import Trial
from hw import STILL, Pose2, Twist2, UserPose, wrap
from hw.scene import Disc, Point
from states.navigation.local import LocalPlanner
from states.signals import VelocityEstimator

PARTS = 10
"""Integration steps per cycle."""
CORRELATION = 0.5
"""Correlation time of drifting noise, s."""
SEEN_BEFORE = 1.0
"""Time for which the user is tracked before the drive begins, s."""
LONGEST = 30.0
"""Time limit of a drive, s."""


@dataclass(frozen=True, slots=True)
class Disturbance:
    """Errors of poses and wheels; m, s.

    `white` and `drift` are standard deviations of the noise of each coordinate of robot and user
    (white, or first-order with `CORRELATION`); for the robot's yaw half of that figure, in rad. The
    robot's pose is off by `jump` until it jumps to the true one. Commands act after `delay`, and
    wheels follow with the time constant `lag`, or linearly within a period. The body moves less
    than the wheels by the share `slip`.
    """

    white: float = 0.0
    drift: float = 0.0
    jump: float = 0.0
    delay: float = 0.0
    lag: float = 0.0
    slip: float = 0.0

    @property
    def sigma(self) -> float:
        """Standard deviation of each coordinate, m, as an estimator would report it."""
        return math.hypot(self.white, self.drift)


@dataclass(slots=True)
class DisturbedResult:
    """Result of a drive: its time, s, and worst values.

    `intrusion` is the depth of the robot's centre in the user's disc, m, negative outside;
    `beyond` the intrusion less the error of the poses at that moment, m; `away` the true distance
    to the goal on arrival, m; `acceleration` the largest one of the velocities sent, m/s2.
    """

    time: float = 0.0
    arrived: bool = False
    intrusion: float = -math.inf
    beyond: float = -math.inf
    away: float = 0.0
    acceleration: float = 0.0

    def note(self, acceleration: float, intrusion: float, error: float) -> None:
        """Keep the worst values, with those of one cycle; `error` is that of the poses, m."""
        self.acceleration = max(self.acceleration, acceleration)
        self.intrusion = max(self.intrusion, intrusion)
        self.beyond = max(self.beyond, intrusion - error)


@dataclass(frozen=True, slots=True)
class DisturbedCase:
    """A disturbance and what is required under it.

    `over` limits the mean excess of the times over the least possible, %. The user's disc must not
    be entered; with `within_error` it may be, but no deeper than the poses' error at that moment.
    """

    name: str
    disturbance: Disturbance
    over: float
    within_error: bool = False

    def depth(self, result: DisturbedResult) -> float:
        """The intrusion that counts here, m."""
        return result.beyond if self.within_error else result.intrusion

    def held(self, result: DisturbedResult) -> bool:
        """True if the drive arrived and kept out of the disc."""
        return result.arrived and self.depth(result) <= 0.0


CASES = (
    DisturbedCase("white 1 cm", Disturbance(white=0.01), 6.0),
    DisturbedCase("delay 20 ms", Disturbance(delay=0.02), 6.0),
    DisturbedCase("lag 0.1 s", Disturbance(lag=0.1), 6.0),
    DisturbedCase("all three", Disturbance(white=0.01, delay=0.02, lag=0.1), 10.0),
    DisturbedCase("drift 5 mm", Disturbance(drift=0.005), 6.0),
    DisturbedCase(
        "drift 1 cm, jump 4 cm", Disturbance(drift=0.01, jump=0.04), 10.0, within_error=True
    ),
)


@dataclass(frozen=True, slots=True)
class WalkBy:
    """A drive beside a user walking at this constant velocity in the map, m/s."""

    name: str
    trial: Trial
    walking: Point


def _walks(speed: float) -> tuple[WalkBy, ...]:
    return tuple(
        WalkBy(f"{name} {speed:g} m/s", Trial(name, _FROM, _TO, Disc(x, y, 1.27), 5.5), walking)
        for name, x, y, walking in (
            ("from the left", 0.0, 4.0 * speed, (0.0, -speed)),
            ("from the right", 1.0, -3.5 * speed, (0.0, speed)),
            ("slantwise", 2.5 * speed, 3.0 * speed, (-0.7 * speed, -0.7 * speed)),
            ("overtaken", -2.0, 1.35, (speed, 0.0)),
            ("passing", 3.0, 1.35, (-speed, 0.0)),
            ("head on", 3.5, 0.5, (-speed, 0.0)),
        )
    )


_FROM, _TO = Pose2(-3.0, 0.0), Pose2(3.0, 0.0)
WALKS = (*_walks(0.6), *_walks(1.2))
WALKERS = (
    DisturbedCase("walkers, drift 5 mm", Disturbance(drift=0.005), math.inf),
    DisturbedCase("walkers, drift 1 cm", Disturbance(drift=0.01), math.inf, within_error=True),
)


class _Seen(NamedTuple):
    value: UserPose
    stamp: int


class _Errors:
    """Generates the errors of measured poses, cycle by cycle."""

    def __init__(self, disturbance: Disturbance, trial: Trial, seed: int, dt: float) -> None:
        self._of = disturbance
        self._keep = math.exp(-dt / CORRELATION)
        self._white = [np.random.default_rng((seed, source)) for source in (1, 2)]
        self._drift = [np.random.default_rng((seed, source)) for source in (3, 4)]
        self._drifted = [rng.normal(size=3) for rng in self._drift]
        chance = np.random.default_rng((seed, 5))
        self._jumps_at = float(chance.uniform(0.2, 0.8)) * trial.least_time
        angle = float(chance.uniform(-math.pi, math.pi))
        self._wrong = disturbance.jump * math.cos(angle), disturbance.jump * math.sin(angle)

    def next(self, time: float) -> tuple[Pose2, Point]:
        """The errors of robot and user at the next cycle."""
        found = []
        for i in range(2):
            step = self._drift[i].normal(size=3)
            kept = self._keep
            self._drifted[i] = kept * self._drifted[i] + math.sqrt(1.0 - kept * kept) * step
            white = self._of.white * self._white[i].normal(size=3)
            found.append((white + self._of.drift * self._drifted[i]).tolist())
        (x, y, yaw), (user_x, user_y, _) = found
        if time < self._jumps_at:
            x, y = x + self._wrong[0], y + self._wrong[1]
        return Pose2(x, y, 0.5 * yaw), (user_x, user_y)


class _Body:
    """True motion of the base: `pose`, and `wheels`, the velocity in the map."""

    def __init__(self, start: Pose2, disturbance: Disturbance, dt: float, look: float) -> None:
        self.pose, self.wheels = start, STILL
        self._of, self._dt, self._look = disturbance, dt, look
        self._sent: deque[tuple[float, Twist2]] = deque()
        self._since, self._from, self._target = 0.0, STILL, STILL

    def send(self, time: float, command: Twist2) -> None:
        """Send a command; it acts after the delay."""
        self._sent.append((time + self._of.delay, command))

    def move(self, time: float, h: float) -> None:
        """Integrate over h seconds."""
        while self._sent and self._sent[0][0] <= time + 1e-9:
            self._since, command = self._sent.popleft()
            self._from = self.wheels
            turn = 0.5 * (self.wheels.wz + command.wz) * self._dt
            self._target = command.rotated(self.pose.yaw + self._look * turn)
        before = self.wheels
        if self._of.lag:
            self.wheels = _blend(before, self._target, 1.0 - math.exp(-h / self._of.lag))
        else:
            part = min(1.0, (time + h - self._since) / self._dt)
            self.wheels = _blend(self._from, self._target, part)
        mean = _blend(before, self.wheels, 0.5)
        self.pose = self.pose.moved(mean, (1.0 - self._of.slip) * h)


def _blend(a: Twist2, b: Twist2, share: float) -> Twist2:
    rest = 1.0 - share
    return Twist2(
        rest * a.vx + share * b.vx, rest * a.vy + share * b.vy, rest * a.wz + share * b.wz
    )


def drive_disturbed(
    driver: LocalPlanner,
    trial: Trial,
    disturbance: Disturbance,
    seed: int,
    hz: float = 30.0,
    *,
    walking: Point = (0.0, 0.0),
    window: float | None = None,
) -> DisturbedResult:
    """Drive a trial with disturbed poses.

    Args:
        driver: a new local planner.
        trial: the drive, with the user's position at the start.
        disturbance: errors of poses and wheels.
        seed: of all noise.
        hz: cycles per second.
        walking: velocity of the user in the map, m/s.
        window: time over which the user's velocity is estimated, s; None: it is known exactly.
    """
    dt = 1.0 / hz
    errors, result, user = _Errors(disturbance, trial, seed, dt), DisturbedResult(), trial.user
    body = _Body(trial.start, disturbance, dt, 0.5 if driver.mode == "omni" else 1.0)
    estimator = None if window is None else VelocityEstimator(window)
    driver.go_to(trial.goal)
    before = STILL
    for cycle in range(-round(SEEN_BEFORE * hz), round(LONGEST * hz)):
        time = cycle * dt
        error, user_error = errors.next(time)
        seen = user and _disc_at(user, walking, time, user_error)
        velocity = walking
        if estimator is not None and seen is not None:
            velocity = _velocity(estimator, time + SEEN_BEFORE, seen)
        if cycle < 0:
            continue
        true = body.pose
        pose = Pose2(true.x + error.x, true.y + error.y, wrap(true.yaw + error.yaw))
        twist = body.wheels.rotated(-true.yaw)
        command = driver.command(pose, twist, seen, dt, velocity, sigma=disturbance.sigma)
        if driver.status == "arrived":
            result.arrived, result.away = True, true.distance_to(trial.goal)
            break
        sent = command.rotated(true.yaw + 0.25 * (before.wz + command.wz) * dt)
        change = math.dist((before.vx, before.vy), (sent.vx, sent.vy)) / dt
        inside = _advance(body, command, time, dt, lambda at: user and _disc_at(user, walking, at))
        result.note(change, inside, math.hypot(error.x, error.y) + math.hypot(*user_error))
        result.time, before = time + dt, sent
    return result


def _velocity(estimator: VelocityEstimator, time: float, seen: Disc) -> Point:
    pose = UserPose(Pose2(seen.x, seen.y), 0.0)
    estimator.update("user.pose", _Seen(pose, round(time * 1e9)))
    found = estimator.value() or STILL
    return found.vx, found.vy


def _advance(
    body: _Body, command: Twist2, time: float, dt: float, disc: Callable[[float], Disc | None]
) -> float:
    """One cycle of the body; returns its largest intrusion into the user's disc, m."""
    body.send(time, command)
    deepest, h = -math.inf, dt / PARTS
    for part in range(PARTS):
        now = time + part * h
        body.move(now, h)
        user = disc(now + h)
        if user is not None:
            away = math.dist((body.pose.x, body.pose.y), (user.x, user.y))
            deepest = max(deepest, user.radius - away)
    return deepest


def _disc_at(user: Disc, walking: Point, time: float, error: Point = (0.0, 0.0)) -> Disc:
    x, y = user.x + time * walking[0] + error[0], user.y + time * walking[1] + error[1]
    return Disc(x, y, user.radius)
