"""How fast the arm may follow its trajectory beside a person: the arm's own separation (R45, R51).

In each tick the trajectory's clock gets a pace s, at most 1. For a capsule of the arm with a gap S
to the person, closing on them with v at full pace, and a person who comes towards it with v_h,

    S_p = v_h (T + s t_s) + s v T + s^2 v t_s / 2 + C

is what is left of no gap once the arm has come to rest: it reacts within T and stops within s t_s,
where t_s is the speed of the fastest joint at full pace by the deceleration of a stop (ISO/TS
15066, 5.5.4, for the arm). The pace is the largest for which S_p <= S for every capsule, now and a
little ahead on the trajectory. Slower than `SLOW` a capsule need not be: at that speed a touch is
harmless, and a person who stands before the DEEP does not stop the prop.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from hw.geometry import STILL, Pose2
from hw.motion import Motion
from hw.safety.separation import QUICK, STEADY
from states.arm.approach import TOUCH_SPEED
from states.arm.collision import CollisionModel
from states.arm.kernels import Array, place_capsules, point_velocities
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
_WRIST = LINKS.index("wrist_1")
_NOTHING = 1e-9


class ArmPace(NamedTuple):
    """The pace, 0 to 1, and S and S_p, m, of the capsule that decides it."""

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
        """ArmPace a trajectory.

        Args:
            model: the arm.
            trajectory: what it follows.
            brakes: what its joints can do.
            radius: of the person's cylinder, m.
            granted: True on the way to a DEEP that the person has asked for.
        """
        body = model.body
        moving = np.flatnonzero(body.links >= body.links[body.first])
        self._links = body.links[moving]
        self._body, self._radii = body, body.radii[moving]
        self._ends = np.ascontiguousarray(body.ends[moving])
        self._twice = np.repeat(self._links, 2)
        self._trajectory, self._brakes = trajectory, brakes
        self._radius, self._granted = radius, granted
        self._clearance = np.where(self._links >= _WRIST, TOUCH_CLEARANCE, CLEARANCE)
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
        times = since + np.array(AHEAD_S)
        q, velocity, _ = self._trajectory.at(times)
        fastest = np.maximum(np.abs(velocity).max(axis=1), _NOTHING)
        gap, closing, coming = self._approach(q, velocity, base, age)
        floor = TOUCH_SPEED if self._granted and self._stands() else SLOW
        reaction, stopping = REACTION_S + age, (fastest / self._brakes.stop)[:, None]
        share = _largest(gap - self._clearance, closing, coming, reaction, stopping)
        share = np.maximum(share, np.minimum(1.0, floor / np.maximum(closing, _NOTHING)))
        # what lies ahead may be slowed down for until then
        later = np.maximum(0.0, np.array(AHEAD_S) - REACTION_S) * self._brakes.stop / fastest
        share += later[:, None]
        now, which = np.unravel_index(share.argmin(), share.shape)
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
        self, q: Array, velocity: Array, base: Pose2, age: float
    ) -> tuple[Array, Array, Array]:
        """Gap, closing speed of arm and of person, (n, k) each, m and m/s, seen from above."""
        ends = np.empty((len(q), len(self._links), 2, 3))
        frames = np.empty((7, 4, 4))
        for row, placed in zip(q, ends, strict=True):
            place_capsules(
                self._body.base, self._body.origins, self._links, self._ends, row, frames, placed
            )
        moved = np.empty((len(q), 2 * len(self._links), 3))
        points = self._ends.reshape(-1, 3)
        point_velocities(
            self._body.base, self._body.origins, self._twice, points, q, velocity, moved
        )
        speeds = moved.reshape(ends.shape)[..., :2]
        x, y = base.inverse().transform(self._at.x, self._at.y)
        start, way = ends[..., 0, :2], ends[..., 1, :2] - ends[..., 0, :2]
        square = np.maximum((way * way).sum(axis=-1), _NOTHING)
        along = np.clip((((x, y) - start) * way).sum(axis=-1) / square, 0.0, 1.0)[..., None]
        away = (x, y) - (start + along * way)
        distance = np.hypot(away[..., 0], away[..., 1])
        towards = away / np.maximum(distance, _NOTHING)[..., None]
        nearest = speeds[..., 0, :] + along * (speeds[..., 1, :] - speeds[..., 0, :])
        closing = np.maximum((nearest * towards).sum(axis=-1), 0.0)
        return distance - self._radii - self._radius, closing, self._coming(towards, base, age)

    def _coming(self, towards: Array, base: Pose2, age: float) -> Array:
        """The person's speed towards each capsule, (n, k), m/s."""
        if age > OLD_S:
            return np.full(towards.shape[:2], WALKING)
        moved = self._quick.velocity
        if moved is None:
            return np.full(towards.shape[:2], STARTING)
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
