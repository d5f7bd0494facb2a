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

from hw import USER, USER_RADIUS, Contact, Joints, Pose2, Truth, wrap
from hw.model import Footprint

Array = NDArray[np.float64]
CapsulesOf = Callable[[Joints], tuple[Array, Array]]
"""Ends (m, 2, 3) of the capsules' axes in the rover frame, and their radii (m,); m."""

LOOKS = 4
"""Number of interpolated configurations checked between two ticks."""
SLACK = 0.2
"""Margin for the arm being farther off between two ticks than it has shifted from one to the other,
m."""
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
        from states.arm.kinematics import seen_from_above

        self._seen_from_above = seen_from_above
        self.contacts: list[Contact] = []
        self._who = who
        self._others: dict[str, ArmWatch] = {}
        self._outline = outline
        self._half = outline.footprint.half_length, outline.footprint.half_width
        self._last: tuple[Pose2, Pose2, Joints] | None = None
        self._last_ns = 0
        self._capsules: tuple[Array, Array] | None = None
        self._inside = self._touching = self._met = self._meant = False

    def watch(self, now_ns: int, truth: Truth) -> None:
        """Check this instant and the motion since the previous one."""
        for who, there in truth.others:
            other = self._others.setdefault(who, ArmWatch(self._outline, who))
            other.contacts = self.contacts
            other.watch(now_ns, truth._replace(body=there, request=None, others=()))
        base, body, joints = truth.base, truth.body, truth.joints
        if base is None or body is None or joints is None:
            return
        now, granted = (base, body, joints), truth.request is not None
        if self._last != now:
            last = self._last or now
            if self._inside and joints is last[2]:
                self._met = self._touching = False
            else:
                span = self._last_ns if self._last else now_ns, now_ns
                self._look_between(_Look(*last), _Look(*now), span, granted)
        self._last, self._last_ns = now, now_ns
        self._meant = granted or (self._meant and self._met)

    def _look_between(self, last: _Look, now: _Look, span: tuple[int, int], granted: bool) -> None:
        if not self._is_near(last, now):
            self._met = self._touching = False
            return
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
        """True if the arm extends beyond the outline and may have reached the person.

        The person is at most as much nearer meanwhile as arm, base and person have moved.
        """
        before = self._capsules
        if before is None or now.joints is not last.joints:
            self._capsules = self._outline.capsules_of(now.joints)
        assert self._capsules is not None
        ends, radii = self._capsules
        x, y = now.base.inverse().transform(now.body.x, now.body.y)
        was = ends if before is None else before[0]
        beyond, gap, shift = self._seen_from_above(ends, was, radii, *self._half, x, y)
        self._inside = not beyond
        if not beyond:
            return False
        turned = abs(wrap(now.base.yaw - last.base.yaw)) * now.base.distance_to(now.body)
        travel = last.base.distance_to(now.base) + last.body.distance_to(now.body) + turned
        return gap - USER_RADIUS <= shift + travel + SLACK

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
        _, gap, _ = self._seen_from_above(ends, ends, radii, *self._half, x, y)
        if gap > USER_RADIUS + _ROUNDING:
            return []
        person = np.array((x, y))
        shares, away = _nearest(ends[:, :, :2], person)
        distances = np.hypot(*away.T)
        gaps = distances - radii - USER_RADIUS
        touching = gaps <= 0.0
        if not touching.any():
            return []
        surface = person - away * (1.0 - radii / np.maximum(distances, _NOTHING))[:, None]
        touching &= (np.abs(surface) >= np.array(self._half)).any(axis=1)
        return [_Touch(float(gaps[i]), int(i), float(shares[i])) for i in np.flatnonzero(touching)]


def _nearest(axes: Array, point: Array) -> tuple[Array, Array]:
    """The nearest point of each axis (m, 2, 2) to a point (2,), as a share of the axis, 0 to 1.

    Returns the shares (m,) and the vectors from there to the point (m, 2).
    """
    start, way = axes[:, 0], axes[:, 1] - axes[:, 0]
    square = np.maximum((way * way).sum(axis=1), _NOTHING)
    shares = np.clip(((point - start) * way).sum(axis=1) / square, 0.0, 1.0)
    return shares, point - (start + shares[:, None] * way)
