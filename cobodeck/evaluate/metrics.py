"""Evaluates a run independently of the charts, on true poses or on measured ones.

Figures of events that did not occur, or that cannot be known, are `None`, never 0.
"""

from __future__ import annotations

import hashlib
import math
import struct
from dataclasses import dataclass, field
from typing import Any, Protocol

from cobodeck.evaluate.arm_contact import ArmWatch
from cobodeck.evaluate.figures import MOVING, contact_figures, hit_figures, spread
from cobodeck.evaluate.proximity import WalkingGap
from cobodeck.evaluate.requests import RequestWatch
from hw import Contact, Joints, Pose2, Truth, wrap

AHEAD_M, HALF_VIEW_RAD, AROUND_M = 2.5, math.pi / 5, 1.5
"""The Escape zones: radius and half angle within the view, radius elsewhere, m, rad (R104)."""
NEAR_M, BEYOND_M, FAR_M = 1.5, 3.0, 4.0
"""Distance band of the base from a walking user, m (R90, R91, R97); best beyond BEYOND_M."""
STALE_NS = 150_000_000
"""A longer time without a tracked pose is a drop-out, ns (R149)."""
NOBODY = Truth()


class PoseSource(Protocol):
    """A source of the state of robot and person: a plant, or its measured samples."""

    @property
    def truth(self) -> Truth | None:
        """The state now; None where it is not known."""
        ...


class MotionHash:
    """SHA-256 over the exact bits of base pose, person's pose and joints where they change.

    It covers each instant at which one of the values differs from the instant before, and the last
    instant at the end: a run that leaves out instants at which nothing moves has the same hash.
    """

    def __init__(self) -> None:
        self._hash = hashlib.sha256()
        self._values: tuple[Pose2 | None, Pose2 | None, Joints | None] = (None, None, None)
        self._bits = b""
        self._now = 0

    def watch(self, now_ns: int, truth: Truth) -> None:
        """Add this instant."""
        self._now = now_ns
        base, body, joints = self._values
        if truth.base is base and truth.body is body and truth.joints is joints:
            return
        base, body, joints = self._values = truth.base, truth.body, truth.joints
        moved = () if base is None else (base.x, base.y, base.yaw)
        walked = () if body is None else (body.x, body.y, body.yaw)
        numbers = (*moved, *walked, *(joints or ()))
        sizes = len(moved), len(walked), len(numbers)
        row = struct.pack(f"<q3b{sizes[-1]}d", now_ns, *sizes, *numbers)
        if row[_STAMP:] != self._bits:
            self._bits = row[_STAMP:]
            self._hash.update(row)

    @property
    def sha256(self) -> str | None:
        """The hash of all instants so far; None if no pose was ever known."""
        if not self._bits:
            return None
        found = self._hash.copy()
        found.update(struct.pack("<q", self._now))
        return found.hexdigest()


_STAMP = 8
"""Bytes of the instant before those of the values."""


@dataclass(slots=True)
class Evaluator:
    """Evaluates a plant from outside; call `watch` once per tick.

    `person`: whether there is one. `shown`: from when until when the robot was shown to them, ns,
    in order. `arm` detects touches by the arm; None where they cannot be
    known. `measured`: the plant's state is measured, not the ground truth.
    """

    plant: PoseSource
    person: bool
    requests: RequestWatch = field(default_factory=RequestWatch)
    arm: ArmWatch | None = None
    measured: bool = False
    walking_gap: WalkingGap | None = None
    motion: MotionHash = field(default_factory=MotionHash)
    signs: int = 0
    signs_to_standing: int = 0
    shown: list[tuple[int, int]] = field(default_factory=list)
    situations: int = 0
    time_to_safety_s: list[float] = field(default_factory=list)
    dropouts: list[tuple[int, int]] = field(default_factory=list)
    walking_ns: int = 0
    beside_ns: int = 0
    beyond_ns: int = 0
    _truth: Truth = NOBODY
    _now: int = 0
    _danger_since: int | None = None
    _seen: int = 0
    _located: bool = False

    @property
    def leaps(self) -> bool:
        """See `engine/LEAPS.md`; a measured truth counts the samples."""
        return not self.measured

    def watch(self, now_ns: int) -> None:
        """Evaluate this instant."""
        truth = self.plant.truth
        elapsed, self._now = now_ns - self._now, now_ns
        if truth is None:
            return
        before, self._truth = self._truth, truth
        self.motion.watch(now_ns, truth)
        if truth.seen_ns is not None and truth.seen_ns != self._seen:
            self._watch_tracking(truth.seen_ns, truth.tracked_since_ns)
        if truth.informed or before.informed:
            self._watch_sign(before, truth)
        if truth.base is not None and truth.body is not None:
            self._located = True
            if truth.speed > MOVING or self._danger_since is not None:
                self._watch_distance(before, truth, elapsed)
        if self.arm is not None:
            self.arm.watch(now_ns, truth)
        self.requests.watch(now_ns, truth)

    def _watch_sign(self, before: Truth, truth: Truth) -> None:
        if not before.informed:
            self.signs += 1
            self.signs_to_standing += truth.speed <= MOVING
            self.shown.append((self._now, self._now))
        self.shown[-1] = self.shown[-1][0], self._now

    def _watch_tracking(self, seen_ns: int, since_ns: int | None) -> None:
        """Note a drop-out, unless tracking has gone on since the pose seen before."""
        goes_on = since_ns is not None and since_ns <= self._seen
        if seen_ns - self._seen > STALE_NS and not goes_on:
            self.dropouts.append((self._seen, seen_ns))
        self._seen = seen_ns

    def _watch_distance(self, before: Truth, truth: Truth, elapsed: int) -> None:
        base, body = truth.base, truth.body
        assert base is not None
        assert body is not None
        distance = math.hypot(body.x - base.x, body.y - base.y)
        moving = truth.speed > MOVING
        if moving:
            self.walking_ns += elapsed
            if NEAR_M <= distance <= FAR_M:
                self.beside_ns += elapsed
            if BEYOND_M <= distance <= FAR_M:
                self.beyond_ns += elapsed
            near = self.walking_gap
            if near is not None and distance < near.below:
                near.watch((before.base or base, base), (before.body or body, body), distance)
        if distance < AHEAD_M or self._danger_since is not None:
            ahead = abs(wrap(body.bearing_to(base) - truth.head_turn)) <= HALF_VIEW_RAD
            self._watch_zones(distance < (AHEAD_M if ahead else AROUND_M), moving)

    def _watch_zones(self, inside: bool, moving: bool) -> None:
        if self._danger_since is None:
            if inside and moving:
                self._danger_since = self._now
                self.situations += 1
        elif not inside:
            self.time_to_safety_s.append((self._now - self._danger_since) / 1e9)
            self._danger_since = None

    def finish(self) -> None:
        """Count a drop-out and a request that are still open at the end of the run."""
        self.requests.end(self._now, self._truth)
        if self._now - self._seen > STALE_NS:
            self.dropouts.append((self._seen, self._now))

    @property
    def contacts(self) -> list[Contact] | None:
        """All contacts so far, in order; None where they are not known."""
        if self._truth.contacts is None:
            return None
        of_arm = [] if self.arm is None else self.arm.contacts
        return sorted((*self._truth.contacts, *of_arm), key=lambda contact: contact.at_ns)

    def report(self) -> dict[str, Any]:
        """The figures by their names in JSON; without a person only those of the robot."""
        truth = self._truth
        gap = self.walking_gap
        of_robot = {
            "measured": self.measured,
            "distance_m": truth.distance_m,
            "energy_j": truth.energy_j,
            "wall_hits": truth.wall_hits,
            "object_hits": truth.object_hits,
            "hits": hit_figures(truth.hits),
            "motion_sha256": self.motion.sha256,
        }
        if not self.person:
            return of_robot
        return {
            **of_robot,
            **self.requests.report(truth.distance_m),
            **contact_figures(self.contacts),
            "signs": None if truth.informed is None else self.signs,
            "signs_to_standing": None if truth.informed is None else self.signs_to_standing,
            "situations": self.situations if self._located else None,
            "situations_open": int(self._danger_since is not None) if self._located else None,
            "time_to_safety_s": spread(self.time_to_safety_s, ("mean", "min", "max")),
            "min_gap_m": truth.min_gap,
            "least_gap_walking_m": None if gap is None else gap.least,
            "walking_s": self.walking_ns / 1e9 if self._located else None,
            "beside_share": self._share(self.beside_ns),
            "beside_share_3_4": self._share(self.beyond_ns),
            "dropouts": self._dropouts(),
        }

    def _share(self, span_ns: int) -> float | None:
        return span_ns / self.walking_ns if self.walking_ns else None

    def _dropouts(self) -> list[dict[str, float]] | None:
        if self.measured and self._truth.seen_ns is None:
            return None
        return [{"from_s": start / 1e9, "to_s": end / 1e9} for start, end in self.dropouts]
