"""The data of a run's picture: poses, nodes, requests, contacts over time."""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise
from operator import attrgetter

from cobodeck.evaluate import ArmOutline
from cobodeck.project import nodes_of
from hw import Contact, Hit, Joints, Pose2, Pose3
from hw.model import Footprint
from hw.scene import Room, Thing


@dataclass(frozen=True, slots=True)
class Instant:
    """One tick: poses in the map; `gap` is between the robot's outline and the person, m.

    `joints` are the arm's, rad; None where they are unknown.
    """

    at_s: float
    robot: Pose2
    person: Pose2 | None = None
    gap: float | None = None
    joints: Joints | None = None


@dataclass(frozen=True, slots=True)
class NodeSpan:
    """A node from entry to exit; `ended` is its outcome, otherwise why it was left."""

    path: str
    start_s: float
    end_s: float
    ended: str = ""


@dataclass(frozen=True, slots=True)
class TouchRequest:
    """A requested touch at the DEEP; `served_s`: when the prop arrived, None if it did not."""

    number: int
    start_s: float
    end_s: float
    deep: Pose3
    served_s: float | None = None


@dataclass(frozen=True, slots=True)
class Phase:
    """A span of time during which one lane is in charge; `lane` is None if none is."""

    start_s: float
    end_s: float
    lane: str | None


@dataclass(frozen=True)
class Course:
    """A run, or the part of it from `start_s` to `end_s`.

    Attributes:
        title: what was run; `lines` are the details.
        room: None if there is none; `footprint` likewise for the robot.
        charts: the used charts, by the path of the node that uses them, in document order.
        instants: in order of time; empty if no pose is known.
        spans: in order of entry.
        sequences: paths of the `states` containers.
        contacts: None if they cannot be known.
        arm: None if the robot has none.
        objects: of the scene; `hits`: of walls and of these.
    """

    title: str
    lines: tuple[str, ...]
    room: Room | None
    footprint: Footprint | None
    charts: Mapping[str, str]
    start_s: float
    end_s: float
    instants: tuple[Instant, ...] = ()
    spans: tuple[NodeSpan, ...] = ()
    sequences: frozenset[str] = frozenset()
    requests: tuple[TouchRequest, ...] = ()
    contacts: tuple[Contact, ...] | None = None
    arm: ArmOutline | None = field(default=None, compare=False)
    objects: tuple[Thing, ...] = ()
    hits: tuple[Hit, ...] = ()

    def between(self, start_s: float | None, end_s: float | None) -> Course:
        """The part from `start_s` (None: the start) to `end_s` (None: the end).

        Raises:
            ValueError: that part is empty.
        """
        low = self.start_s if start_s is None else max(start_s, self.start_s)
        high = self.end_s if end_s is None else min(end_s, self.end_s)
        if low >= high:
            raise ValueError(
                f"nothing from {low:g} to {high:g} s: "
                f"the run goes from {self.start_s:g} to {self.end_s:g} s"
            )
        if (low, high) == (self.start_s, self.end_s):
            return self
        return replace(
            self,
            lines=(*self.lines, f"from {low:g} to {high:g} s of {self.end_s:.1f} s"),
            start_s=low,
            end_s=high,
            instants=self.during(low, high),
            spans=tuple(s for s in self.spans if s.start_s < high and s.end_s > low),
            requests=tuple(r for r in self.requests if r.start_s < high and r.end_s > low),
            contacts=self.contacts
            and tuple(c for c in self.contacts if low <= c.at_ns / 1e9 <= high),
            hits=tuple(h for h in self.hits if h.at_ns / 1e9 <= high and h.until_ns / 1e9 >= low),
        )

    @cached_property
    def lanes(self) -> tuple[str, ...]:
        """Paths of the outermost nodes without used charts inside: the behaviors, if any."""
        return lanes_of(self.charts, (span.path for span in self.spans))

    def spans_of(self, lane: str) -> tuple[NodeSpan, ...]:
        """The spans of a lane."""
        return tuple(span for span in self.spans if span.path == lane)

    def steps(self, lane: str) -> tuple[NodeSpan, ...]:
        """The steps of the sequences within a lane."""
        below = f"{lane}/"
        return tuple(
            span
            for span in self.spans
            if span.path.startswith(below) and span.path.rpartition("/")[0] in self.sequences
        )

    def begun(self, behaviour: str) -> tuple[NodeSpan, ...]:
        """The spans of a behaviour's charts that begin within the part shown."""
        paths = nodes_of(behaviour, self.charts)
        return tuple(s for s in self.spans if s.path in paths and s.start_s >= self.start_s)

    @cached_property
    def phases(self) -> tuple[Phase, ...]:
        """The whole time, split by the lane in charge, which is the active one entered last."""
        lanes = set(self.lanes)
        waiting = [span for span in reversed(self.spans) if span.path in lanes]
        cuts = {self.start_s, self.end_s}
        cuts |= {t for s in waiting for t in (s.start_s, s.end_s) if self.start_s < t < self.end_s}
        found: list[Phase] = []
        active: list[NodeSpan] = []
        times = sorted(cuts)
        for start, end in pairwise(times):
            while waiting and waiting[-1].start_s <= start:
                active.append(waiting.pop())
            active = [span for span in active if span.end_s > start]
            found.append(Phase(start, end, active[-1].path if active else None))
        return tuple(found)

    def during(self, start_s: float, end_s: float) -> tuple[Instant, ...]:
        """The instants from `start_s` to `end_s`, both inclusive."""
        low = bisect_left(self.instants, start_s, key=attrgetter("at_s"))
        return self.instants[low : bisect_right(self.instants, end_s, key=attrgetter("at_s"))]

    def at(self, at_s: float) -> Instant:
        """The last instant at or before `at_s`, otherwise the first."""
        after = bisect_right(self.instants, at_s, key=attrgetter("at_s"))
        return self.instants[max(0, after - 1)]


def lanes_of(charts: Iterable[str], paths: Iterable[str]) -> tuple[str, ...]:
    """The lanes among paths of nodes, those of used `charts` first; see `Course.lanes`."""
    charts = tuple(charts)
    holders = {above for path in charts for above in _above(path)} | {""}
    return tuple(
        path
        for path in dict.fromkeys((*charts, *paths))
        if path not in holders and path.rpartition("/")[0] in holders
    )


def _above(path: str) -> Iterator[str]:
    while path:
        path = path.rpartition("/")[0]
        yield path
