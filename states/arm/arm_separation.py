"""How fast the arm may follow its trajectory beside a person: the arm's own separation (R45, R51).

In each tick the trajectory's clock gets a pace s, at most 1. For a capsule of the arm with a gap S
to the person, closing on them with v at full pace, and a person who comes towards it with v_h,

    S_p = v_h (T + s t_s) + s v T + s^2 v t_s / 2 + C

is what is left of no gap once the arm has come to rest: it reacts within T and stops within s t_s,
where t_s is the speed of the fastest joint at full pace by the deceleration of a stop (ISO/TS
15066, 5.5.4, for the arm). The pace is the largest for which S_p <= S for every capsule, now and a
little ahead on the trajectory; the person is where their speed has brought them since they were
seen.

Tracked limbs count as well, in three dimensions: the head, and the arms from the shoulder to the
hand. A hand may set off at any instant, also one that waits at the DEEP, so v_h is `HAND_SPEED`
there, less towards the shoulder, and T goes from the instant at which it was seen. So one that is
not tracked any more slows the arm down the farther around where it was last seen the longer ago.
The arm itself is known as it is now: S is taken where it will be before its next pace, and s v T is
not counted again.

Slower than `SLOW` a capsule need not be: at that speed a touch is harmless, and a person who
stands before the DEEP does not stop the prop, nor does a hand that meets it there.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from hw import OLD_S, USER_RADIUS, Pose2
from hw.motion import Motion
from hw.safety import QUICK, STEADY
from states.arm.arm_situation import slimmed
from states.arm.kinematics import Limb, Manipulator
from states.arm.motion import Trajectory
from states.arm.planning import TOUCH_SPEED
from states.arm.separation_kernels import (
    CLEARANCE,
    HAND_REACTION_S,
    SLOW,
    STEP_S,
    TOUCH_CLEARANCE,
    Rover,
    TrackedWalker,
    WatchedCourse,
    next_pace,
)

AHEAD_S = np.array((0.0, 0.15, 0.3))
"""How far ahead on the trajectory the separation is computed, s."""
HANDS_AHEAD_S = np.array((0.0, HAND_REACTION_S))
"""As `AHEAD_S`: now, and what is reached before the next pace, s."""
STANDS = 0.1
"""A person slower than this stands still, m/s."""
WRIST = 3
"""Links at the end of the chain that count as wrist, and meet the hand as the prop does."""


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
    """Paces one trajectory; `add_user_pose` for each pose of the person, `pace` in each tick."""

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
        body = arm.solid
        links, own = body.links[body.first :], body.radii[body.first :]
        count = math.ceil(trajectory.duration / STEP_S)
        joints, velocities, _ = trajectory.at(np.linspace(0.0, STEP_S * count, count + 1))
        clearance = np.where(links > arm.count - WRIST, TOUCH_CLEARANCE, CLEARANCE)
        self._course = WatchedCourse(
            body, own, clearance, joints, velocities, brakes.stop, brakes.speed_up, AHEAD_S,
            HANDS_AHEAD_S,
        )  # fmt: skip
        self._met, self._granted, self._unsure = met, granted, unsure
        self._radius, self._expected = USER_RADIUS, False
        self._quick, self._steady = Motion(QUICK), Motion(STEADY)
        self._stamp_ns: int | None = None
        self._at = self._base = Pose2(0.0, 0.0)
        self._rover = Rover(0.0, 0.0, 0.0, 0.0)
        self._rows: dict[int, int] = {}
        self._limbs, self._stamps = np.empty((0, 7)), np.empty(0, dtype=np.int64)
        self._share = 1.0

    def expect(self, body: Pose2) -> None:
        """Keep from a person who was here, in the map, when the trajectory was planned.

        Without it from one of the size that the first pose seen gives: nobody was known then.
        """
        self._radius, self._expected = slimmed(body.distance_to(self._met)), True

    def add_user_pose(
        self, stamp_ns: int, body: Pose2, limbs: tuple[Limb | None, ...] = ()
    ) -> None:
        """Take a pose of the person and of their limbs, in the map; None: not tracked now."""
        if not self._expected:
            self.expect(body)
        if self._stamp_ns is None or stamp_ns > self._stamp_ns:
            self._stamp_ns, self._at = stamp_ns, body
            for n, limb in enumerate(limbs):
                if limb is not None:
                    self._add_limb(n, stamp_ns, limb)
            self._quick.add_pose(stamp_ns, body.x, body.y)
            self._steady.add_pose(stamp_ns, body.x, body.y)

    def _add_limb(self, n: int, stamp_ns: int, limb: Limb) -> None:
        row = self._rows.setdefault(n, len(self._rows))
        if row == len(self._limbs):
            self._limbs = np.vstack((self._limbs, np.empty(7)))
            self._stamps = np.append(self._stamps, 0)
        self._limbs[row] = *limb.start, *limb.end, limb.radius + self._unsure
        self._stamps[row] = stamp_ns

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
        moved, at = self._quick.velocity, self._at
        known = moved is not None and age <= OLD_S
        vx, vy = (moved.vx, moved.vy) if moved is not None and known else (0.0, 0.0)
        floor = TOUCH_SPEED if self._granted and self._stands() else SLOW
        walker = TrackedWalker(at.x, at.y, vx, vy, known, age, self._radius, floor)
        found = next_pace(
            self._course, walker, self._placed(base), self._limbs, self._stamps, now_ns, since,
            span, self._share,
        )  # fmt: skip
        self._share = found[0]
        return ArmPace(*found)

    def _placed(self, base: Pose2) -> Rover:
        if base is not self._base:
            seen = base.inverse()
            self._base, self._rover = base, Rover(seen.x, seen.y, seen.yaw, base.yaw)
        return self._rover

    def _stands(self) -> bool:
        moved = self._steady.velocity
        return moved is not None and moved.speed < STANDS
