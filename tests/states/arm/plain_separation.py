"""The arm's separation in numpy, the oracle of the compiled rule: all pairs as arrays, at once.

Formulas and symbols are those of `states.arm.arm_separation`.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from operator import itemgetter
from typing import NamedTuple

import numpy as np

from hw import OLD_S, STILL, USER_RADIUS, Pose2, Twist2
from hw.model import LINKS
from hw.motion import Motion
from hw.safety import QUICK, STEADY
from states.arm.arm_separation import (
    AHEAD_S,
    HANDS_AHEAD_S,
    SLOW,
    STANDS,
    ArmPace,
    Brakes,
)
from states.arm.arm_situation import slimmed
from states.arm.kinematics import Array, Limb, Manipulator, approaching, approaching_limbs
from states.arm.motion import Trajectory
from states.arm.planning import TOUCH_SPEED

REACTION_S, HAND_REACTION_S, HAND_SPEED = 0.1, 0.05, 2.0
CLEARANCE, TOUCH_CLEARANCE = 0.10, 0.03
STARTING, WALKING = 0.5, 1.6
STEP_S = 0.01
_WRIST = LINKS.index("wrist_1")
_NOTHING = 1e-9


class Meeting(NamedTuple):
    """Capsules of the arm and parts of the person: k pairs at n instants ahead.

    Gap, m, closing speeds of the arm and of the person, m/s, (n, k) each; t_s at full pace and how
    much faster the arm may be by what it can still slow down until then, (n,); T of the person and,
    as far as the gaps do not show it yet, of the arm, s, C, m, and the speed below which a touch is
    harmless, m/s, (k,). Where it `slows` only, the arm has to be slow, not at rest, once the
    gap is used up.
    """

    gap: Array
    closing: Array
    coming: Array
    stopping: Array
    later: Array
    reaction: Array
    lag: Array
    clearance: Array
    floor: Array
    slows: bool = False

    def paced(self) -> tuple[float, float, Callable[[float], ArmPace]]:
        """The largest pace, how near the pair is that decides it, and what is told of it."""
        room = self.gap - self.clearance
        slow = np.minimum(1.0, self.floor / np.maximum(self.closing, _NOTHING))
        least = slow if self.slows else np.zeros_like(slow)
        share = np.maximum(self._largest(room, least), slow) + self.later[:, None]
        deciding = share if share.min() < 1.0 else room
        at = n, k = np.unravel_index(deciding.argmin(), share.shape)
        v, v_h, late = float(self.closing[at]), float(self.coming[at]), float(self.reaction[k])

        def at_pace(pace: float) -> ArmPace:
            stop = max(0.0, pace - float(least[at])) * float(self.stopping[n])
            needed = v_h * (late + stop) + pace * v * (float(self.lag[k]) + 0.5 * stop)
            needed += 0.5 * float(least[at]) * v * stop
            return ArmPace(pace, float(self.gap[at]), needed + float(self.clearance[k]))

        return min(1.0, float(share[at])), float(room[at]), at_pace

    def _largest(self, room: Array, least: Array) -> Array:
        """The largest pace, `least` to 1, for S_p <= S, with `room` = S - C; see the module.

        For s = r + e, with the pace r to slow down to, e is the root of v t_s / 2 e^2 + (v_h t_s +
        v T + r v t_s) e = S - C - v_h T - r v T, without cancellation.
        """
        stopping = self.stopping[:, None]
        left = room - self.coming * self.reaction - least * self.closing * self.lag
        slope = self.coming * stopping + self.closing * (self.lag + least * stopping)
        root = np.sqrt(slope * slope + 2.0 * self.closing * stopping * np.maximum(left, 0.0))
        more = np.where(left > 0.0, 2.0 * left / np.maximum(slope + root, _NOTHING), 0.0)
        return np.asarray(np.minimum(least + more, 1.0))


class PlainGovernor:
    """As `Governor`."""

    def __init__(
        self,
        arm: Manipulator,
        trajectory: Trajectory,
        brakes: Brakes,
        met: Pose2,
        *,
        granted: bool,
        unsure: float = 0.0,
    ) -> None:
        """Pace a trajectory.

        Args:
            arm: what moves.
            trajectory: what it follows.
            brakes: what its joints can do.
            met: where the prop meets the person, in the map: who is near it is slimmer.
            granted: True on the way to a DEEP that the person has asked for.
            unsure: how much nearer limbs may be than tracked, m.
        """
        self._body = arm.solid
        links, self._own = (a[arm.solid.first :] for a in (arm.solid.links, arm.solid.radii))
        self._radii, self._expected = self._own + USER_RADIUS, False
        self._brakes, self._met, self._granted = brakes, met, granted
        self._unsure = unsure
        count = math.ceil(trajectory.duration / STEP_S)
        times = np.linspace(0.0, STEP_S * count, count + 1)
        self._joints, self._velocities, _ = trajectory.at(times)
        self._clearance = np.where(links >= _WRIST, TOUCH_CLEARANCE, CLEARANCE)
        self._quick, self._steady = Motion(QUICK), Motion(STEADY)
        self._stamp_ns: int | None = None
        self._at, self._limbs = Pose2(0.0, 0.0), dict[int, tuple[int, Limb]]()
        self._share = 1.0

    def expect(self, body: Pose2) -> None:
        """Keep from a person who was here, in the map, when the trajectory was planned.

        Without it from one of the size that the first pose seen gives: nobody was known then.
        """
        self._radii = self._own + slimmed(body.distance_to(self._met))
        self._expected = True

    def add_user_pose(
        self, stamp_ns: int, body: Pose2, limbs: tuple[Limb | None, ...] = ()
    ) -> None:
        """Take a pose of the person and of their limbs, in the map; None: not tracked now."""
        if not self._expected:
            self.expect(body)
        if self._stamp_ns is None or stamp_ns > self._stamp_ns:
            self._stamp_ns, self._at = stamp_ns, body
            self._limbs |= {n: (stamp_ns, limb) for n, limb in enumerate(limbs) if limb is not None}
            self._quick.add_pose(stamp_ns, body.x, body.y)
            self._steady.add_pose(stamp_ns, body.x, body.y)

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
        moved = self._quick.velocity if age <= OLD_S else None
        floor = np.full(len(self._own), TOUCH_SPEED if self._granted and self._stands() else SLOW)
        met = [self._body_met(since, base, age, moved, floor)]
        if self._limbs:
            met.append(self._limbs_met(now_ns, since, base, moved, floor))
        wanted, _, told = min((one.paced() for one in met), key=itemgetter(0, 1))
        fastest = self._brakes.stop * float(met[0].stopping[0])
        self._share = min(wanted, self._share + span * self._brakes.speed_up / fastest)
        return told(self._share)

    def _ahead(self, since: float, ahead: Array) -> tuple[Array, Array, Array]:
        """Joints and their velocities, (n, 6), and t_s, (n,), so long ahead on the trajectory."""
        last = len(self._joints) - 1
        at = [min(round(time / STEP_S), last) for time in (since + ahead).tolist()]
        velocity = self._velocities[at]
        fastest = np.maximum(np.abs(velocity).max(axis=1), _NOTHING)
        return self._joints[at], velocity, fastest / self._brakes.stop

    def _stands(self) -> bool:
        moved = self._steady.velocity
        return moved is not None and moved.speed < STANDS

    def _body_met(
        self, since: float, base: Pose2, age: float, moved: Twist2 | None, floor: Array
    ) -> Meeting:
        """The arm and the body's cylinder, seen from above.

        A person whose speed is known has gone on for `age`: from where they were seen an arm that
        passes beside them would seem to close more slowly than it does.
        """
        q, velocity, stopping = self._ahead(since, AHEAD_S)
        shape = len(q), len(self._own)
        towards, distance, closing = np.empty((*shape, 2)), np.empty(shape), np.empty(shape)
        at = self._at
        if moved is not None:
            at = Pose2(at.x + moved.vx * age, at.y + moved.vy * age)
        late = np.full(len(self._own), REACTION_S if moved is not None else REACTION_S + age)
        x, y = base.inverse().transform(at.x, at.y)
        approaching(self._body, self._body.first, q, velocity, x, y, towards, distance, closing)
        return Meeting(
            distance - self._radii,
            np.maximum(closing, 0.0),
            self._coming(towards, base, age, moved),
            stopping,
            np.maximum(0.0, AHEAD_S - REACTION_S) / stopping,
            late,
            late,
            self._clearance,
            floor,
        )

    def _limbs_met(
        self, now_ns: int, since: float, base: Pose2, moved: Twist2 | None, floor: Array
    ) -> Meeting:
        """The arm and each of the person's limbs, which may have gone anywhere since then.

        Of a link that a hand may have gone along, not the nearest point is met, but a faster one:
        only prop and wrist, which are short, have TOUCH_SPEED.
        """
        floor = np.where(self._clearance == TOUCH_CLEARANCE, floor, SLOW)
        q, velocity, stopping = self._ahead(since, HANDS_AHEAD_S)
        stamps, limbs = zip(*self._limbs.values(), strict=True)
        ages = np.maximum(0.0, (now_ns - np.array(stamps)) * 1e-9)
        seen = [limb.seen_from(base) for limb in limbs]
        axes = np.array([(limb.start, limb.end) for limb in seen])
        radii = self._own[:, None] + [limb.radius + self._unsure for limb in seen]
        distance, closing, speed, along = np.empty((4, len(q), *radii.shape))
        approaching_limbs(
            self._body, self._body.first, q, velocity, axes, distance, closing, speed, along
        )
        walking = [_unknown(age) if moved is None else moved.speed for age in ages]
        coming = walking + along * (HAND_SPEED - np.array(walking))
        reaction = HAND_REACTION_S + ages
        closing = turned(closing, speed, reaction * coming / distance)
        pairs = len(q), radii.size
        return Meeting(
            (distance - radii).reshape(pairs),
            closing.reshape(pairs),
            coming.reshape(pairs),
            stopping,
            np.zeros(len(q)),
            np.tile(reaction, len(self._own)),
            np.zeros(radii.size),
            np.repeat(self._clearance, len(seen)),
            np.repeat(floor, len(seen)),
            slows=True,
        )

    def _coming(self, towards: Array, base: Pose2, age: float, moved: Twist2 | None) -> Array:
        """The person's speed towards each capsule, (n, k), m/s."""
        if moved is None:
            return np.full(towards.shape[:2], _unknown(age))
        if moved is STILL:
            return np.zeros(towards.shape[:2])
        seen = moved.rotated(-base.yaw)
        along = towards[..., 0] * seen.vx + towards[..., 1] * seen.vy  # `@` may fuse these two
        return np.asarray(np.maximum(-along, 0.0))


def _unknown(age: float) -> float:
    """Speed assumed of a person of whom only a pose of this age, s, is known, m/s."""
    return STARTING if age <= OLD_S else WALKING


def turned(closing: Array, speed: Array, off: Array) -> Array:
    """How fast points of this speed close at most on what has moved off by a share of its distance.

    That turns the direction in which they close by up to asin(off); m/s, at least 0.
    """
    sine = np.minimum(off, 1.0)
    across = np.sqrt(np.maximum(speed * speed - closing * closing, 0.0))
    most = closing * np.sqrt(1.0 - sine * sine) + across * sine
    within = across <= speed * sine  # their own direction is one of those
    return np.asarray(
        np.where((off >= 1.0) | (within & (closing > 0.0)), speed, np.maximum(most, 0.0))
    )
