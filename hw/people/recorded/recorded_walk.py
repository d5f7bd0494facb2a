"""A recorded person: walks as recorded, and may stop to request touches."""

from __future__ import annotations

from collections.abc import Iterator

from hw.geometry import Pose2, wrap
from hw.people.recorded.repeats_path import Replayed
from hw.people.recorded.walk_file import Heading, Recording
from hw.people.walking import ATTENTIVE, Manner, Touch
from hw.samples import Sample
from hw.scene import Room

SPARSE_NS = 100_000_000
"""Between rows farther apart than this, ns, but without a gap, tracking sees the person on the
straight line between them: a robot could not be run on so few poses (R149)."""


class Playback(Replayed):
    """Replays a recording that was already placed in the room.

    Tracking gives the newest row since the step before, with the row's own time, and nothing where
    the recording has a gap (a drop-out or a jump) or has ended; the true body moves straight across
    gaps. While the person stands (to request a touch, or shown the robot) or leaves the robot,
    tracking goes on; in a gap it returns once the gap has lasted as long as recorded. With
    `requests`, the walk is interrupted that many times, evenly spread.
    """

    def __init__(
        self,
        recording: Recording,
        room: Room,
        requests: int = 0,
        touch: Touch | None = None,
        manner: Manner = ATTENTIVE,
        seed: int = 0,
        heading: Heading = "centred",
    ) -> None:
        self._recording = recording
        self._headings, self._speeds = recording.motion(causal=heading == "causal")
        self._gaps = {gap.since_ns for gap in recording.gaps()}
        self._row = 0
        self._reported = -1
        self._own = 0
        self._seen_own = -1
        self._gap = (-1, 0)  # the row before it, and when it began, ns
        self._requests = requests
        self._touch = touch or Touch()
        start = Pose2(recording.xs[0], recording.ys[0], self._headings[0])
        super().__init__(start, room, manner, seed)

    @property
    def own_ns(self) -> int:
        """Time of the recording played so far, ns."""
        return self._own

    def _run(self) -> Iterator[bool]:
        parts = self._requests + 1
        for part in range(1, parts):
            yield from self._play(self._recording.duration_ns * part // parts)
            yield from self._ask(self._touch)
        yield from self._play(self._recording.duration_ns)

    def _play(self, until_ns: int) -> Iterator[bool]:
        yield from self._return()
        while self._own + self._budget < until_ns:
            self._seek(self._own + self._budget)
            self._budget = 0
            yield True
            yield from self._return()
        self._budget -= until_ns - self._own
        self._seek(until_ns)

    def _seek(self, own_ns: int) -> None:
        stamps, row = self._recording.stamps_ns, self._row
        while row + 2 < len(stamps) and stamps[row + 1] <= own_ns:
            row += 1
        self._own, self._row = own_ns, row
        xs, ys, headings = self._recording.xs, self._recording.ys, self._headings
        share = (own_ns - stamps[row]) / (stamps[row + 1] - stamps[row])
        self._x = xs[row] + share * (xs[row + 1] - xs[row])
        self._y = ys[row] + share * (ys[row + 1] - ys[row])
        self._yaw = wrap(headings[row] + share * wrap(headings[row + 1] - headings[row]))
        self._tempo = self._speeds[row] + share * (self._speeds[row + 1] - self._speeds[row])

    def _measure(self, now_ns: int) -> Sample | None:
        stamps, row = self._recording.stamps_ns, self._row
        standing, self._seen_own = self._own == self._seen_own, self._own
        lasts = stamps[row + 1] - stamps[row]
        in_gap = stamps[row] in self._gaps
        if in_gap and self._gap[0] != row:
            self._gap = (row, now_ns - (self._own - stamps[row]))
        over = not in_gap or now_ns - self._gap[1] >= lasts
        if standing or (over and (in_gap or lasts > SPARSE_NS)):
            return super()._measure(now_ns) if over and not self.finished else None
        newest = row + 1 if stamps[row + 1] <= self._own else row
        if newest == self._reported:
            return None
        self._reported = newest
        heading = self._headings[newest]
        place = Pose2(self._recording.xs[newest], self._recording.ys[newest], heading)
        stamp = now_ns - (self._own - stamps[newest])
        return Sample("user.pose", stamp, self._seen_at(place, heading))
