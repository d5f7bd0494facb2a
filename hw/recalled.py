"""A person out of the record of a run: walks, is seen and asks for touches as they did then."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

from engine.files.finding import mistake
from hw.geometry import Pose2, Pose3, wrap
from hw.person import Actor
from hw.recording import drop_out_ns
from hw.room import Room
from hw.samples import Sample, UserPose


class Stood(NamedTuple):
    """Where a person truly was at an instant, ns since the start, and how fast, m/s."""

    at_ns: int
    body: Pose2
    speed: float


class Seen(NamedTuple):
    """What tracking saw of a person; ns since the start."""

    at_ns: int
    pose: UserPose


class Asked(NamedTuple):
    """From this instant on, ns, they ask for a touch there (map), or for none."""

    at_ns: int
    deep: Pose3 | None


@dataclass(frozen=True, slots=True)
class Past:
    """What is known of a person from the start of a run to `until_ns`; all rows rise in time.

    `name` is where it comes from; there is at least one row of `ways`.
    """

    name: str
    until_ns: int
    ways: tuple[Stood, ...]
    seen: tuple[Seen, ...]
    asked: tuple[Asked, ...]


class Recalled(Actor):
    """Does again what a person did in an earlier run, at the same times and places.

    Tracking sees what it saw then, head and hands too, with the same stamps, and nothing in its
    drop-outs; between two rows the true body goes straight. While the robot is shown to them their
    own time slows down to a stand, and all that follows comes so much later; tracking sees them
    slow down and stand, unless it is in a drop-out, which lasts so much longer.

    Raises:
        FileError: they would leave the free floor of this room.
    """

    def __init__(self, past: Past, room: Room) -> None:
        _check_floor(past, room)
        self._past = past
        self._drop_out_ns = drop_out_ns([row.at_ns for row in past.seen])
        self._own = 0
        self._way, self._newest, self._asks = 0, -1, -1
        self._then = start = past.ways[0].body
        super().__init__(start)

    def _run(self) -> Iterator[bool]:
        while self._own + self._budget < self._past.until_ns:
            self._go(self._own + self._budget)
            self._budget = 0
            yield True
        self._go(self._past.until_ns)

    def _go(self, own_ns: int) -> None:
        past, self._own = self._past, own_ns
        self._way = max(0, _newest(past.ways, self._way, own_ns))
        at_ns, body, self._tempo = past.ways[self._way]
        if own_ns > at_ns and self._way + 1 < len(past.ways):
            until_ns, to, tempo = past.ways[self._way + 1]
            share = (own_ns - at_ns) / (until_ns - at_ns)
            body = body.between(to, share)
            self._tempo += share * (tempo - self._tempo)
        self._x, self._y, self._yaw = body.x, body.y, wrap(body.yaw)
        self._asks = _newest(past.asked, self._asks, own_ns)
        self.request = None if self._asks < 0 else past.asked[self._asks].deep

    def _measure(self, now_ns: int) -> Sample | None:
        seen, before = self._past.seen, self._newest
        self._newest = newest = _newest(seen, before, self._own)
        if newest > before:
            self._then = self.body
            stamp, pose = seen[newest]
            return Sample("user.pose", now_ns - (self._own - stamp), pose)
        if self._rate == 1.0 or not 0 <= newest < len(seen) - 1:
            return None
        stamp, pose = seen[newest]
        if seen[newest + 1].at_ns - stamp > self._drop_out_ns:
            return None
        return Sample("user.pose", now_ns, _moved(pose, self._then, self.body))


def _moved(seen: UserPose, before: Pose2, now: Pose2) -> UserPose:
    """The whole person, as far as it is seen, gone with the true body."""
    if before == now:
        return seen
    turn = now.yaw - before.yaw
    motion = _upright(now) @ _upright(before).inverse()
    head, left, right = (
        None if part is None else motion @ part
        for part in (seen.head, seen.left_hand, seen.right_hand)
    )
    x, y, _ = motion.transform(seen.body.x, seen.body.y, 0.0)
    body = Pose2(x, y, wrap(seen.body.yaw + turn))
    return UserPose(body, wrap(seen.head_yaw + turn), head, left, right)


def _upright(body: Pose2) -> Pose3:
    return Pose3.from_yaw(body.x, body.y, 0.0, body.yaw)


def _newest(rows: tuple[Stood, ...] | tuple[Seen, ...] | tuple[Asked, ...], n: int, at: int) -> int:
    """The last row that is not after `at`, ns, looked for from row n on."""
    while n + 1 < len(rows) and rows[n + 1].at_ns <= at:
        n += 1
    return n


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
