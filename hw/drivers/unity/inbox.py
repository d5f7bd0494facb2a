"""Converts messages of VR applications to our values, after checks.

A `user.pose` is made for each pose of the tailbone, with the head and hands that belong to it.
Before the first one, head and tailbone must be those of a person who stands upright, because
messages state neither axes nor units. Trackers on the rover, once two are visible, must match their
mounts in the robot file.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from hw.drivers import gates
from hw.drivers.clock_offsets import PeerClock, Stamps
from hw.drivers.unity.protocol import TRACKER, frame_of, is_upright, pose_of, stamp_of
from hw.geometry import Pose3
from hw.model import Tracking
from hw.samples import TrackerPose, UserPose

TellUser = Callable[[str, int, Any], None]
"""Takes a name, a stamp of our clock, ns, and a value."""
VIVE, MAP = "vive", "map"
PERSON = ("head", "tailbone", "left_hand", "right_hand")
REACH = 3.0
"""Greatest distance of a DEEP from the person, m (R15: metres, not millimetres)."""
HIGHEST, LOWEST = 3.0, -0.2
FARTHEST = 1e6
"""Greatest coordinate of a pose, m: beyond any room, even in mm, and small enough for all sums."""
SEAT, TURN = 0.15, 0.2
"""Greatest disagreement of two trackers about the rover's pose, m and rad."""
NEAR_NS = 50 * gates.MS
"""Greatest difference of stamps for comparing two trackers."""


@dataclass(frozen=True, slots=True)
class Checks:
    """How inputs are checked.

    `by_receipt`: poses without stamps are stamped by their receipt, otherwise refused. `ahead_ns`:
    how far in the future a stamp may be.
    """

    tracking: Tracking
    by_receipt: bool = False
    ahead_ns: int = gates.AHEAD_NS
    one_way_ns: int = gates.ONE_WAY_NS


@dataclass(slots=True)
class _Source:
    """The newest pose of one topic, raw and in the frame in which it is used."""

    stamps: Stamps
    raw: Pose3 | None = None
    pose: Pose3 | None = None
    at_ns: int = 0
    changed_ns: int = 0
    received_ns: int = 0

    @property
    def frozen(self) -> bool:
        """True if it has repeated bit by bit for too long."""
        return self.received_ns - self.changed_ns > gates.FROZEN_NS


@dataclass(frozen=True, slots=True)
class _Seen:
    """A person's position, m, at an instant, ns; `since_ns`: seen near there since."""

    x: float
    y: float
    at_ns: int
    since_ns: int

    def reaches(self, other: _Seen) -> bool:
        """True if a person could have moved from here to the other position."""
        way = math.hypot(other.x - self.x, other.y - self.y)
        elapsed_ns = min(max(0, other.at_ns - self.at_ns), gates.FRESH_NS)
        return way <= gates.JUMP + gates.FASTEST * elapsed_ns * 1e-9


@dataclass(slots=True)
class Inbox:
    """See the module. `tell` receives the values."""

    checks: Checks
    tell: TellUser
    request: Pose3 | None = None
    _sources: dict[str, _Source] = field(default_factory=dict)
    _believed: _Seen | None = None
    _strange: _Seen | None = None
    _upright: bool = False
    _seated: bool = False

    def on_message(self, role: str, message: Any, received_ns: int, clock: PeerClock) -> str | None:
        """Take a message; returns why it was refused, or None."""
        if role in ("release", "restart"):
            return self._event(role, message, received_ns)
        try:
            pose, frame = pose_of(message), frame_of(message)
        except ValueError as error:
            return self._unreadable(role, received_ns, str(error))
        if max(map(abs, (pose.x, pose.y, pose.z))) > FARTHEST:
            return self._unreadable(role, received_ns, f"a pose more than {FARTHEST:g} m away")
        if frame not in (None, VIVE, MAP):
            return self._unreadable(
                role, received_ns, f"frame {frame!r}; write {VIVE!r} or {MAP!r}"
            )
        if role == "haptic_request":
            return self._ask(self._in_map(pose, frame), received_ns)
        return self._track(role, message, pose, frame, received_ns, clock)

    def repeat(self, now_ns: int) -> None:
        """Repeat the request, as a level."""
        self.tell("vr.haptic_request", now_ns, self.request)

    def drop(self, role: str, now_ns: int) -> None:
        """Drop a source that is gone; its request ends."""
        self._sources.pop(role, None)
        if role == "tailbone":
            self._upright, self._believed = False, None
        elif role.startswith(TRACKER):
            self._seated = False
        elif role == "haptic_request":
            self._end(now_ns)

    def _event(self, role: str, message: Any, received_ns: int) -> str | None:
        if not getattr(message, "data", True):
            return None
        self.tell(f"vr.{role}", received_ns, True)
        if role == "release":
            self._end(received_ns)
        return None

    def _end(self, now_ns: int) -> None:
        self.request = None
        self.repeat(now_ns)

    def _unreadable(self, role: str, received_ns: int, reason: str) -> str:
        """Refuse a message; an invalid request ends the one before."""
        if role == "haptic_request":
            self._end(received_ns)
        return reason

    def _ask(self, deep: Pose3, received_ns: int) -> str | None:
        body = self._sources.get("tailbone")
        if not LOWEST <= deep.z <= HIGHEST:
            return self._unreadable("haptic_request", received_ns, f"a touch at {deep.z:g} m")
        if body is not None and body.pose is not None:
            away = math.hypot(deep.x - body.pose.x, deep.y - body.pose.y)
            if away > REACH:
                reason = f"a touch {away:.1f} m away from the person; {REACH:g} m is most"
                return self._unreadable("haptic_request", received_ns, reason)
        self.request = deep
        self.repeat(received_ns)
        return None

    def _track(
        self,
        role: str,
        message: Any,
        pose: Pose3,
        frame: str | None,
        received_ns: int,
        clock: PeerClock,
    ) -> str | None:
        source = self._sources.get(role)
        if source is None:
            source = self._sources[role] = _Source(Stamps(self.checks.ahead_ns))
        at = self._instant(source, message, received_ns, clock)
        if isinstance(at, str):
            return at or None
        if pose != source.raw:
            source.raw, source.changed_ns = pose, received_ns
        source.at_ns, source.received_ns = at, received_ns
        if role.startswith(TRACKER):
            source.pose = self._in_vive(pose, frame)
        else:
            source.pose = self._in_map(pose, frame)
        if source.frozen:
            return "the same pose bit by bit: tracking is lost"
        if role == "tailbone":
            return self._person(source)
        return self._rover(role, source) if role.startswith(TRACKER) else None

    def _instant(
        self, source: _Source, message: Any, received_ns: int, clock: PeerClock
    ) -> int | str:
        """The instant of a pose by our clock; or why it is refused, empty if that is no fault."""
        try:
            stamp = stamp_of(message)
        except ValueError as error:
            return str(error)
        if stamp is None:
            if self.checks.by_receipt:
                return received_ns - self.checks.one_way_ns
            return "it has no stamp, so that its age is unknown"
        at = clock.instant(stamp, received_ns)
        if at is None and not clock.known:
            return ""
        if not source.stamps.admit(stamp, at, received_ns):
            reason = source.stamps.refused or ""
            if source.stamps.turned_back:
                clock.reset()
                source.stamps.reset()
            return reason
        assert at is not None
        return min(at, received_ns)

    def _person(self, body: _Source) -> str | None:
        assert body.pose is not None
        head = self._beside("head", body, gates.FRESH_NS)
        if not self._upright:
            if head is None:
                return "no matching pose of the head"
            if not is_upright(head, body.pose):
                return (
                    "not the pose of a standing person: send metres in ROS axes (`To<FLU>()`), z "
                    "upwards from the floor, and stand upright at the start"
                )
            self._upright = True
        if self._jumped(body.pose, body.at_ns):
            return "it has jumped, faster than a person can move"
        there = body.pose.flat()
        view = there.yaw if head is None else head.yaw
        hands = [self._beside(hand, body, gates.HAND_NS) for hand in ("left_hand", "right_hand")]
        self.tell("user.pose", body.at_ns, UserPose(there, view, head, hands[0], hands[1]))
        return None

    def _jumped(self, body: Pose3, at_ns: int) -> bool:
        """True if the person's position has jumped, until it has persisted for FOUND_AGAIN_NS."""
        seen = _Seen(body.x, body.y, at_ns, at_ns)
        if self._believed is not None and not self._believed.reaches(seen):
            before = self._strange
            since = before.since_ns if before is not None and before.reaches(seen) else at_ns
            self._strange = _Seen(body.x, body.y, at_ns, since)
            if at_ns - since < gates.FOUND_AGAIN_NS:
                return True
        self._believed, self._strange = seen, None
        return False

    def _beside(self, role: str, body: _Source, within_ns: int) -> Pose3 | None:
        source = self._sources.get(role)
        if source is None or source.frozen or abs(source.at_ns - body.at_ns) > within_ns:
            return None
        return source.pose

    def _rover(self, role: str, source: _Source) -> str | None:
        tracker = role.removeprefix(TRACKER)
        assert source.pose is not None
        if not self._seated and self._contradicted(tracker, source):
            return "the trackers contradict their mounts on the rover: check axes, units and mounts"
        self.tell("rover.tracker", source.at_ns, TrackerPose(tracker, source.pose))
        return None

    def _contradicted(self, tracker: str, source: _Source) -> bool:
        mounts = self.checks.tracking.mounts
        for other, mount in mounts.items():
            seen = self._sources.get(TRACKER + other)
            if other == tracker or tracker not in mounts or seen is None or seen.pose is None:
                continue
            if abs(seen.at_ns - source.at_ns) > NEAR_NS or source.pose is None:
                continue
            here = source.pose @ mounts[tracker].inverse()
            there = seen.pose @ mount.inverse()
            self._seated = here.distance_to(there) <= SEAT and here.angle_to(there) <= TURN
            return not self._seated
        return False

    def _in_map(self, pose: Pose3, frame: str | None) -> Pose3:
        return pose if frame == MAP else self.checks.tracking.map_from_vive @ pose

    def _in_vive(self, pose: Pose3, frame: str | None) -> Pose3:
        return self.checks.tracking.map_from_vive.inverse() @ pose if frame == MAP else pose
