"""Builds the course of a run from the truth of each tick and from the trace."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace

from cobodeck.evaluate import NOBODY, ArmWatch, Evaluator, RequestWatch, arm_outline, prop_of
from cobodeck.pictures.run.run_course import Course, Instant, NodeSpan, TouchRequest
from engine.chart import Chart, nodes_by_path
from engine.run import TraceRecord
from hw import Pose3, Truth
from hw.model import RobotModel
from hw.scene import Scene
from hw.sim.contact import gap


class CourseWatch:
    """Follows a run; call `watch` once per tick. Requests and contacts count as in the figures."""

    def __init__(self, robot: RobotModel) -> None:
        self.truth: Truth = NOBODY
        self._footprint = robot.footprint
        self._arm = None if robot.arm is None else arm_outline(robot)
        self._instants: list[Instant] = []
        self._requests: list[TouchRequest] = []
        self._deep: Pose3 | None = None
        self._end_s = 0.0
        self._judge = Evaluator(self, True)
        if self._arm is not None:
            self._judge.requests = RequestWatch(prop_of(robot))
            self._judge.arm = ArmWatch(self._arm)

    def watch(self, now_ns: int, truth: Truth | None) -> None:
        """Take an instant with its truth; None if the truth is unknown."""
        self._end_s = at_s = now_ns / 1e9
        if truth is None:
            return
        self.truth = truth
        served = len(self._judge.requests.response_s)
        self._judge.watch(now_ns)
        self._watch_request(at_s, truth.request, len(self._judge.requests.response_s) > served)
        base, body = truth.base, truth.body
        if base is not None:
            apart = None if body is None else gap(self._footprint, base, body.x, body.y)
            self._instants.append(Instant(at_s, base, body, apart, truth.joints))

    def _watch_request(self, at_s: float, deep: Pose3 | None, served: bool) -> None:
        if self._deep is not None:
            self._requests[-1] = replace(self._requests[-1], end_s=at_s)
        if deep is not None and deep != self._deep:
            self._requests.append(TouchRequest(len(self._requests) + 1, at_s, at_s, deep))
        self._deep = deep
        if served:
            self._requests[-1] = replace(self._requests[-1], served_s=at_s)

    def course(
        self,
        title: str,
        lines: tuple[str, ...],
        scene: Scene | None,
        charts: Mapping[str, str],
        records: Iterable[TraceRecord],
    ) -> Course:
        """The course up to the last instant; `charts` as from `used_charts`."""
        records = list(records)
        contacts = self._judge.contacts
        return Course(
            title,
            lines,
            None if scene is None else scene.room,
            self._footprint,
            charts,
            0.0,
            self._end_s,
            tuple(self._instants),
            spans_of(records, self._end_s),
            frozenset(record.subject for record in records if record.kind == "move"),
            tuple(self._requests),
            None if contacts is None else tuple(contacts),
            self._arm,
            () if scene is None else scene.objects,
            self.truth.hits or (),
        )


def used_charts(chart: Chart, library: Mapping[str, Chart]) -> dict[str, str]:
    """Names of the used charts by the paths of the nodes that use them, in document order."""
    nodes = nodes_by_path(chart, library)
    return {path: node.target for path, node in nodes if node.form == "use"}


class Visits:
    """The visits of nodes, from one record of the trace after the other.

    `open`: those that have not ended, by path: the number of the visit, and its start, s.
    """

    def __init__(self) -> None:
        self.open: dict[str, tuple[int, float]] = {}
        self._outcomes: dict[str, str] = {}
        self._count = 0

    def add(self, record: TraceRecord) -> tuple[int, NodeSpan] | None:
        """Take a record; returns the visit that it ends, with its number."""
        time_ns, kind, path, detail = record
        if kind == "enter":
            self.open[path] = self._count, time_ns / 1e9
            self._count += 1
        elif kind == "outcome":
            self._outcomes[path] = detail[0]
        elif kind == "exit" and path in self.open:
            number, start_s = self.open.pop(path)
            outcome = self._outcomes.pop(path, detail[0])
            ended = outcome if detail[0] == "outcome" else detail[0]
            return number, NodeSpan(path, start_s, time_ns / 1e9, ended)
        return None


def spans_of(records: Iterable[TraceRecord], end_s: float) -> tuple[NodeSpan, ...]:
    """The span of each visit of a node, from entry to exit; nodes still active end at `end_s`."""
    visits = Visits()
    found = dict(filter(None, map(visits.add, records)))
    for path, (number, start_s) in visits.open.items():
        found[number] = NodeSpan(path, start_s, end_s)
    return tuple(found[number] for number in sorted(found))
