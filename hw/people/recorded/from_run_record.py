"""A person replayed from a run's record: walks, is tracked and requests touches as in that run."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

from engine.files import mistake
from hw.geometry import Pose2, Pose3, wrap
from hw.motion import PoseHistory
from hw.people.recorded.gaps import drop_out_ns
from hw.people.recorded.repeats_path import Replayed
from hw.people.walking import ATTENTIVE, Manner
from hw.samples import Sample, UserPose
from hw.scene import Room

_Walked = tuple[Pose2, float]
"""The body, and its speed, m/s."""


class Stood(NamedTuple):
    """A person's true pose at an instant, ns since the start, and their speed, m/s."""

    at_ns: int
    body: Pose2
    speed: float


class SeenPerson(NamedTuple):
    """A measured pose of a person, ns since the start."""

    at_ns: int
    pose: UserPose


class Asked(NamedTuple):
    """From this instant on, ns, a touch is requested at this DEEP (map), or none."""

    at_ns: int
    deep: Pose3 | None


@dataclass(frozen=True, slots=True)
class Past:
    """A recorded person from the start of a run to `until_ns`; the stamps of all rows rise.

    `name` is the source; `ways` has at least one row.
    """

    name: str
    until_ns: int
    ways: tuple[Stood, ...]
    seen: tuple[SeenPerson, ...]
    asked: tuple[Asked, ...]


class Recalled(Replayed):
    """Repeats what a person did in an earlier run, at the same times and places.

    Tracking gives what it gave in that run, head and hands included, with the same stamps, and
    nothing in its drop-outs; between two rows the true body moves straight. While the robot is
    shown, the person's own time slows to a standstill, and they may leave it; all that follows is
    delayed by as much: tracking sees them slow down, stand and leave, and a drop-out lasts as long
    as recorded.

    Raises:
        FileError: they would leave the free floor of this room.
    """

    def __init__(self, past: Past, room: Room, manner: Manner = ATTENTIVE, seed: int = 0) -> None:
        _check_floor(past, room)
        self._past = past
        self._true = PoseHistory(_between, poses=((at, (body, v)) for at, body, v in past.ways))
        self._drop_out_ns = drop_out_ns([row.at_ns for row in past.seen])
        self._own = 0
        self._newest, self._reported_ns = -1, 0
        super().__init__(past.ways[0].body, room, manner, seed)

    def _run(self) -> Iterator[bool]:
        while self._own + self._budget < self._past.until_ns:
            self._seek(self._own + self._budget)
            self._budget = 0
            yield True
            yield from self._return()
        self._seek(self._past.until_ns)

    def _seek(self, own_ns: int) -> None:
        self._own = own_ns
        body, self._tempo = self._true.held(own_ns)
        self._x, self._y, self._yaw = body.x, body.y, wrap(body.yaw)
        asked = _newest(self._past.asked, own_ns)
        self.request = None if asked < 0 else self._past.asked[asked].deep

    def _measure(self, now_ns: int) -> Sample | None:
        before, self._newest = self._newest, _newest(self._past.seen, self._own)
        if self._newest < 0:
            return None
        stamp, pose = self._past.seen[self._newest]
        if self._newest > before:
            self._reported_ns = now_ns - (self._own - stamp)
            if self._rate == 1.0:
                return Sample("user.pose", self._reported_ns, pose)
        elif not self._seen_late(now_ns):
            return None
        moved = _moved(pose, self._true.held(stamp)[0], self.body)
        return Sample("user.pose", now_ns, moved)

    def _seen_late(self, now_ns: int) -> bool:
        """True if tracking sees a person who is behind the recorded times."""
        seen, row = self._past.seen, self._newest
        if row + 1 == len(seen):
            return False
        lasts = seen[row + 1].at_ns - seen[row].at_ns
        if lasts > self._drop_out_ns:
            return now_ns - self._reported_ns >= lasts
        return self._rate < 1.0 or bool(self._way_back)


def _moved(seen: UserPose, before: Pose2, now: Pose2) -> UserPose:
    """The measured poses moved along with the true body."""
    if before == now:
        return seen
    turn = now.yaw - before.yaw
    motion = now.upright() @ before.upright().inverse()
    head, left, right = (
        None if part is None else motion @ part
        for part in (seen.head, seen.left_hand, seen.right_hand)
    )
    x, y, _ = motion.transform(seen.body.x, seen.body.y, 0.0)
    body = Pose2(x, y, wrap(seen.body.yaw + turn))
    return UserPose(body, wrap(seen.head_yaw + turn), head, left, right)


def _between(a: _Walked, b: _Walked, share: float) -> _Walked:
    (body, speed), (to, then) = a, b
    return body.between(to, share), speed + share * (then - speed)


def _newest(rows: Sequence[tuple[Any, ...]], at_ns: int) -> int:
    """Index of the last row that is not after an instant; -1 if there is none."""
    return bisect_left(rows, (at_ns + 1,)) - 1  # a shorter tuple is before all longer ones


def _check_floor(past: Past, room: Room) -> None:
    checked = None
    for at_ns, body, _ in past.ways:
        if body is not checked and not room.is_free(body.x, body.y):
            raise mistake(
                past.name,
                f"the person would be at ({body.x:.2f}, {body.y:.2f}) after {at_ns * 1e-9:.2f} s, "
                "which is not on the free floor",
                hint="take the scene of the record, or one with room there",
            )
        checked = body
