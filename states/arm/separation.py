"""How fast the arm may follow its trajectory beside a person: the arm's own separation (R45, R51).

In each tick the trajectory's clock gets a pace s, at most 1. For a capsule of the arm with a gap S
to the person, closing on them with v at full pace, and a person who comes towards it with v_h,

    S_p = v_h (T + s t_s) + s v T + s^2 v t_s / 2 + C

is what is left of no gap once the arm has come to rest: it reacts within T and stops within s t_s,
where t_s is the speed of the fastest joint at full pace by the deceleration of a stop (ISO/TS
15066, 5.5.4, for the arm). The pace is the largest for which S_p <= S for every capsule, now and a
little ahead on the trajectory; the person is where their speed has brought them since they were
seen. Slower than `SLOW` a capsule need not be: at that speed a touch is harmless, and a person who
stands before the DEEP does not stop the prop.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from hw.geometry import STILL, Pose2, Twist2
from hw.motion import Motion
from hw.safety.separation import QUICK, STEADY
from states.arm.approach import TOUCH_SPEED
from states.arm.collision import CollisionModel
from states.arm.kernels import Array, approaching
from states.arm.model import LINKS
from states.arm.trajectory import Trajectory

REACTION_S = 0.1
"""From a new pose of the person to an arm that slows down, s."""
CLEARANCE, TOUCH_CLEARANCE = 0.10, 0.03
"""C of S_p, m; the smaller one is for prop and wrist, which come near by purpose."""
SLOW = 0.225
"""No capsule is slowed down below this, m/s."""
AHEAD_S = (0.0, 0.15, 0.3)
"""How far ahead on the trajectory the separation is computed, s."""
STARTING = 0.5
"""Speed assumed of a person whose speed is not known yet, m/s."""
WALKING, OLD_S = 1.6, 0.15
"""Speed assumed of a person whose newest pose is older than this, m/s and s."""
STANDS = 0.1
"""A person slower than this stands still, m/s."""
STEP_S = 0.01
"""Time between two places on the trajectory that are looked at, s."""
_LATER_S = np.maximum(0.0, np.array(AHEAD_S) - REACTION_S)
_WRIST = LINKS.index("wrist_1")
_NOTHING = 1e-9


class ArmPace(NamedTuple):
    """The pace, 0 to 1, and S and S_p, m, of the capsule that decides it, else of the nearest."""

    share: float
    separation: float
    needed: float


@dataclass(frozen=True, slots=True)
class Brakes:
    """Deceleration of the fastest joint in a stop, and its acceleration afterwards, rad/s2."""

    stop: float
    speed_up: float


class Governor:
    """Paces one trajectory; call `see` for each pose of the person and `pace` in each tick."""

    def __init__(
        self,
        model: CollisionModel,
        trajectory: Trajectory,
        brakes: Brakes,
        radius: float,
        *,
        granted: bool,
    ) -> None:
        """Pace a trajectory.

        Args:
            model: the arm.
            trajectory: what it follows.
            brakes: what its joints can do.
            radius: of the person's cylinder, m.
            granted: True on the way to a DEEP that the person has asked for.
        """
        self._body, links = model.body, model.body.links[model.body.first :]
        self._radii = model.body.radii[model.body.first :] + radius
        self._brakes, self._granted = brakes, granted
        count = math.ceil(trajectory.duration / STEP_S)
        times = np.linspace(0.0, STEP_S * count, count + 1)
        self._joints, self._velocities, _ = trajectory.at(times)
        self._clearance = np.where(links >= _WRIST, TOUCH_CLEARANCE, CLEARANCE)
        self._quick, self._steady = Motion(QUICK), Motion(STEADY)
        self._stamp_ns: int | None = None
        self._at = Pose2(0.0, 0.0)
        self._share = 1.0

    def see(self, stamp_ns: int, body: Pose2) -> None:
        """Take a pose of the person, in the map."""
        if self._stamp_ns is None or stamp_ns > self._stamp_ns:
            self._stamp_ns, self._at = stamp_ns, body
            self._quick.see(stamp_ns, body.x, body.y)
            self._steady.see(stamp_ns, body.x, body.y)

    def pace(self, now_ns: int, since: float, span: float, base: Pose2) -> ArmPace | None:
        """The pace from now on; None without a person.

        Args:
            now_ns: the instant of this tick.
            since: time on the trajectory, s.
            span: time since the last call, s.
            base: map_from_rover.
        """
        if self._stamp_ns is None:
            return None
        age = max(0.0, (now_ns - self._stamp_ns) * 1e-9)
        last = len(self._joints) - 1
        at = [min(round((since + ahead) / STEP_S), last) for ahead in AHEAD_S]
        q, velocity = self._joints[at], self._velocities[at]
        fastest = np.maximum(np.abs(velocity).max(axis=1), _NOTHING)
        moved = self._quick.velocity if age <= OLD_S else None
        gap, closing, coming = self._approach(q, velocity, base, age, moved)
        floor = TOUCH_SPEED if self._granted and self._stands() else SLOW
        reaction = REACTION_S if moved is not None else REACTION_S + age
        stopping = (fastest / self._brakes.stop)[:, None]
        share = _largest(gap - self._clearance, closing, coming, reaction, stopping)
        share = np.maximum(share, np.minimum(1.0, floor / np.maximum(closing, _NOTHING)))
        # what lies ahead may be slowed down for until then
        later = _LATER_S * self._brakes.stop / fastest
        share += later[:, None]
        deciding = share if share.min() < 1.0 else gap - self._clearance
        now, which = np.unravel_index(deciding.argmin(), share.shape)
        wanted = min(1.0, float(share[now, which]))
        self._share = min(wanted, self._share + span * self._brakes.speed_up / float(fastest[0]))
        v, v_h = float(closing[now, which]), float(coming[now, which])
        stop = self._share * float(stopping[now, 0])
        needed = v_h * (reaction + stop) + self._share * v * (reaction + 0.5 * stop)
        return ArmPace(self._share, float(gap[now, which]), needed + float(self._clearance[which]))

    def _stands(self) -> bool:
        moved = self._steady.velocity
        return moved is not None and moved.speed < STANDS

    def _approach(
        self, q: Array, velocity: Array, base: Pose2, age: float, moved: Twist2 | None
    ) -> tuple[Array, Array, Array]:
        """Gap, closing speed of arm and of person, (n, k) each, m and m/s, seen from above.

        A person whose speed is known has gone on for `age`: from where they were seen an arm that
        passes beside them would seem to close more slowly than it does.
        """
        shape = len(q), len(self._radii)
        towards, distance, closing = np.empty((*shape, 2)), np.empty(shape), np.empty(shape)
        at = self._at
        if moved is not None:
            at = Pose2(at.x + moved.vx * age, at.y + moved.vy * age)
        x, y = base.inverse().transform(at.x, at.y)
        approaching(self._body, self._body.first, q, velocity, x, y, towards, distance, closing)
        gap = distance - self._radii
        return gap, np.maximum(closing, 0.0), self._coming(towards, base, age, moved)

    def _coming(self, towards: Array, base: Pose2, age: float, moved: Twist2 | None) -> Array:
        """The person's speed towards each capsule, (n, k), m/s."""
        if moved is None:
            return np.full(towards.shape[:2], STARTING if age <= OLD_S else WALKING)
        if moved is STILL:
            return np.zeros(towards.shape[:2])
        seen = moved.rotated(-base.yaw)
        return np.asarray(np.maximum(-(towards @ np.array((seen.vx, seen.vy))), 0.0))


def _largest(room: Array, closing: Array, coming: Array, reaction: float, stopping: Array) -> Array:
    """The largest pace, 0 to 1, for S_p <= S, with `room` = S - C; see the module.

    It is the root of v t_s / 2 s^2 + (v_h t_s + v T) s = S - C - v_h T, without cancellation.
    """
    left = room - coming * reaction
    lag = coming * stopping + closing * reaction
    root = np.sqrt(lag * lag + 2.0 * closing * stopping * np.maximum(left, 0.0))
    share = np.where(left > 0.0, 2.0 * left / np.maximum(lag + root, _NOTHING), 0.0)
    return np.asarray(np.minimum(share, 1.0))
