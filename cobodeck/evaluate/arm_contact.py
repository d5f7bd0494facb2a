"""Detects contacts between the arm and people, on true poses, like the metrics.

A person is the cylinder of R23 with unlimited height, the arm a set of capsules. While a touch is
requested, the held prop is meant to meet the hand, so its contact does not count, nor does it
afterwards until the prop has come away once. Any other part of the arm counts. Contact inside the
rover's outline is left to the check of the outline itself.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hw import USER, USER_RADIUS, Contact, Joints, Pose2, Truth
from hw.model import Footprint

Array = NDArray[np.float64]
CapsulesOf = Callable[[Joints], tuple[Array, Array]]
"""Ends (m, 2, 3) of the capsules' axes in the rover frame, and their radii (m,); m."""

LOOKS = 4
"""Number of interpolated configurations checked between two ticks."""
SLACK = 0.5
"""Margin for the arm reaching farther between two ticks than at either of them, m."""
_NOTHING = 1e-12
_ROUNDING = 1e-9


@dataclass(frozen=True, slots=True)
class ArmOutline:
    """The arm as capsules, on a rover with this outline.

    `parts` has a name for each capsule; `held` is the name of the prop that the arm holds.
    """

    capsules_of: CapsulesOf
    parts: tuple[str, ...]
    held: str
    footprint: Footprint


class _Look(NamedTuple):
    """Robot and person at one instant."""

    base: Pose2
    body: Pose2
    joints: Joints

    def between(self, other: _Look, share: float) -> _Look:
        joints = zip(self.joints, other.joints, strict=True)
        return _Look(
            self.base.between(other.base, share),
            self.body.between(other.body, share),
            tuple(a + share * (b - a) for a, b in joints),
        )


class _Touch(NamedTuple):
    """A capsule in contact: `gap` to the person, m, at most 0; `share` along its axis, 0 to 1."""

    gap: float
    capsule: int
    share: float


class ArmWatch:
    """Records each contact of the arm with a person once; call `watch` once per tick.

    Other people in the scene get a watch of their own, without granted touches.
    """

    def __init__(self, outline: ArmOutline, who: str = USER) -> None:
        from states.arm.kinematics import meets_disc

        self._meets_disc = meets_disc
        self.contacts: list[Contact] = []
        self._who = who
        self._others: dict[str, ArmWatch] = {}
        self._outline = outline
        self._half = np.array((outline.footprint.half_length, outline.footprint.half_width))
        self._last: tuple[int, _Look] | None = None
        self._reach: float | None = None
        self._touching = self._met = self._meant = False

    def watch(self, now_ns: int, truth: Truth) -> None:
        """Check this instant and the motion since the previous one."""
        for who, body in truth.others:
            other = self._others.setdefault(who, ArmWatch(self._outline, who))
            other.contacts = self.contacts
            other.watch(now_ns, truth._replace(body=body, request=None, others=()))
        if truth.base is None or truth.body is None or truth.joints is None:
            return
        now = _Look(truth.base, truth.body, truth.joints)
        since_ns, last = self._last or (now_ns, now)
        granted = truth.request is not None
        if self._last is None or now != last:
            self._last = now_ns, now
            self._look_between(last, now, (since_ns, now_ns), granted)
        else:
            self._last = now_ns, last
        self._meant = granted or (self._meant and self._met)

    def _look_between(self, last: _Look, now: _Look, span: tuple[int, int], granted: bool) -> None:
        found: list[list[_Touch]] = []
        looks: list[_Look] = []
        if self._is_near(last, now):
            looks = [last.between(now, k / LOOKS) for k in range(LOOKS + 1)]
            found = [self._touches(look) for look in looks[1:]]
        held = self._outline.held
        self._met = any(self._part(touch) == held for touches in found for touch in touches)
        if self._meant or granted:
            found = [[t for t in touches if self._part(t) != held] for touches in found]
        touching = any(found)
        if touching and not self._touching:
            k = next(k for k, touches in enumerate(found) if touches)
            begin, end = (span[0] + (span[1] - span[0]) * n // LOOKS for n in (k, k + 1))
            self._note(min(found[k]), (looks[k], looks[k + 1]), (begin, end), granted)
        self._touching = touching  # one touch counts once

    def _is_near(self, last: _Look, now: _Look) -> bool:
        """True if the arm extends beyond the outline and may have reached the person."""
        before = self._reach
        if before is None or now.joints != last.joints:
            self._reach = self._reach_of(now.joints)
        assert self._reach is not None
        if self._reach == 0.0:
            return False
        travel = last.base.distance_to(now.base) + last.body.distance_to(now.body)
        reach = max(self._reach, before or 0.0) + SLACK + travel
        return now.base.distance_to(now.body) - USER_RADIUS <= reach

    def _reach_of(self, joints: Joints) -> float:
        """Horizontal reach of the arm from base_link, m; 0 if it stays within the outline."""
        ends, radii = self._outline.capsules_of(joints)
        beyond = (np.abs(ends[:, :, :2]) - self._half).max(axis=(1, 2)) + radii
        if not (beyond > 0.0).any():
            return 0.0
        return float((np.hypot(ends[:, :, 0], ends[:, :, 1]).max(axis=1) + radii).max())

    def _note(
        self, touch: _Touch, looks: tuple[_Look, _Look], span: tuple[int, int], granted: bool
    ) -> None:
        (ax, ay), (bx, by) = (self._point(look, touch) for look in looks)
        before, body = looks[0].body, looks[1].body
        away = math.hypot(body.x - bx, body.y - by)
        nx, ny = ((body.x - bx) / away, (body.y - by) / away) if away > 0.0 else (1.0, 0.0)
        per_s = 1e9 / (span[1] - span[0]) if span[1] > span[0] else 0.0
        contact = Contact(
            at_ns=span[1],
            x=body.x - USER_RADIUS * nx,
            y=body.y - USER_RADIUS * ny,
            part=self._part(touch),
            robot_closing=per_s * (nx * (bx - ax) + ny * (by - ay)),
            person_closing=-per_s * (nx * (body.x - before.x) + ny * (body.y - before.y)),
            granted=granted,
            who=self._who,
        )
        self.contacts.append(contact)

    def _part(self, touch: _Touch) -> str:
        return self._outline.parts[touch.capsule]

    def _point(self, look: _Look, touch: _Touch) -> tuple[float, float]:
        """The touching point of the capsule's axis, in the map, m."""
        start, end = self._outline.capsules_of(look.joints)[0][touch.capsule]
        x, y, _ = start + touch.share * (end - start)
        return look.base.transform(float(x), float(y))

    def _touches(self, look: _Look) -> list[_Touch]:
        """Contacts of the arm with the person, except those within the rover's outline."""
        ends, radii = self._outline.capsules_of(look.joints)
        x, y = look.base.inverse().transform(look.body.x, look.body.y)
        if not self._meets_disc(ends, radii, x, y, USER_RADIUS + _ROUNDING):
            return []
        person = np.array((x, y))
        shares, away = _nearest(ends[:, :, :2], person)
        distances = np.hypot(*away.T)
        gaps = distances - radii - USER_RADIUS
        touching = gaps <= 0.0
        if not touching.any():
            return []
        surface = person - away * (1.0 - radii / np.maximum(distances, _NOTHING))[:, None]
        touching &= (np.abs(surface) >= self._half).any(axis=1)
        return [_Touch(float(gaps[i]), int(i), float(shares[i])) for i in np.flatnonzero(touching)]


def _nearest(axes: Array, point: Array) -> tuple[Array, Array]:
    """The nearest point of each axis (m, 2, 2) to a point (2,), as a share of the axis, 0 to 1.

    Returns the shares (m,) and the vectors from there to the point (m, 2).
    """
    start, way = axes[:, 0], axes[:, 1] - axes[:, 0]
    square = np.maximum((way * way).sum(axis=1), _NOTHING)
    shares = np.clip(((point - start) * way).sum(axis=1) / square, 0.0, 1.0)
    return shares, point - (start + shares[:, None] * way)
