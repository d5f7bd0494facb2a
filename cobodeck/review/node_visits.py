"""The visits of a run's nodes: from entry to exit, what they led to, and what they waited for.

A further try is a visit of its own. A wait for consent follows the visit whose outcome waits.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from cobodeck.review.run_events import ANSWER, CHART, FORCE, RunEvents
from engine.run import ASKS, TraceRecord

RUNNING = "(running)"
"""What a visit ended with that was not over at the end of the run."""


@dataclass(slots=True)
class NodeVisit:
    """One visit; times are ns in the run.

    Attributes:
        path: of the node; `named` is the state or the chart that it names, "" for a container.
        ended: the outcome, or in brackets why the node was left without one.
        led: the node that followed; "" if the outcome ended the container, or was kept.
        asked: the outcome that waited for consent, "" if none did; `waited_ns`: for how long.
        agreed: the operator let the node end as it wanted to, by an answer or by force; False if
            not; None without an answer.
        forced: an outcome was forced while it ran, when it did not want to end at all.
    """

    path: str
    named: str
    start_ns: int
    end_ns: int
    ended: str = ""
    led: str = ""
    asked: str = ""
    waited_ns: int = 0
    agreed: bool | None = None
    forced: bool = False

    @property
    def lasted_s(self) -> float:
        """From entry to exit, s."""
        return (self.end_ns - self.start_ns) / 1e9


def visits_of(run: RunEvents) -> list[NodeVisit]:
    """The visits of a run, in the order of their entry."""
    return _Reading(run).visits


class _Reading:
    def __init__(self, run: RunEvents) -> None:
        self.visits: list[NodeVisit] = []
        self._named, self._until_ns = run.named, run.until_ns
        self._open: dict[str, NodeVisit] = {}
        self._last: dict[str, NodeVisit] = {}
        self._waiting: dict[str, int] = {}
        take: dict[str, Callable[[TraceRecord], None]] = {
            "enter": self._enter,
            "outcome": self._outcome,
            "exit": self._exit,
            "move": self._move,
            "note": self._note,
            ANSWER: self._answer,
            FORCE: self._force,
            CHART: self._replace,
        }
        for event in run.events:
            if event.kind in take:
                take[event.kind](event)
        for path in [*self._waiting]:
            self._end_wait(path, run.until_ns)
        for visit in self._open.values():
            visit.ended = RUNNING

    def _enter(self, event: TraceRecord) -> None:
        path = event.subject
        self._end_wait(path, event.time)  # refused, or let go on
        visit = NodeVisit(path, self._named.get(path, ""), event.time, self._until_ns)
        self._open[path] = self._last[path] = visit
        self.visits.append(visit)

    def _outcome(self, event: TraceRecord) -> None:
        self._end_wait(event.subject, event.time)
        if event.subject in self._last:
            self._last[event.subject].ended = event.detail[0]

    def _exit(self, event: TraceRecord) -> None:
        below = f"{event.subject}/" if event.subject else ""
        for path in [path for path in self._waiting if path.startswith(below)]:
            self._end_wait(path, event.time)
        visit = self._open.pop(event.subject, None)
        if visit is None:
            return
        visit.end_ns = event.time
        reason = event.detail[0]
        if reason == "lost" or not visit.ended:
            visit.ended = f"({reason})"

    def _move(self, event: TraceRecord) -> None:
        child, _, following = event.detail[:3]
        path = f"{event.subject}/{child}" if event.subject else child
        self._end_wait(path, event.time)
        if path in self._last:
            self._last[path].led = following

    def _note(self, event: TraceRecord) -> None:
        said = str(event.detail[0])
        if said.startswith(ASKS) and event.subject in self._last and self._closed(event.subject):
            self._last[event.subject].asked = said.removeprefix(ASKS)
            self._waiting[event.subject] = event.time

    def _answer(self, event: TraceRecord) -> None:
        if event.subject in self._waiting:
            self._last[event.subject].agreed = bool(event.detail[0])
            self._end_wait(event.subject, event.time)

    def _force(self, event: TraceRecord) -> None:
        visit = self._last.get(event.subject)
        if visit is None:
            return
        if event.subject in self._waiting:
            visit.agreed = event.detail[0] == visit.asked
            self._end_wait(event.subject, event.time)
        else:
            visit.forced = not self._closed(event.subject)

    def _replace(self, event: TraceRecord) -> None:
        (self._named,) = event.detail

    def _closed(self, path: str) -> bool:
        return path not in self._open

    def _end_wait(self, path: str, at_ns: int) -> None:
        since = self._waiting.pop(path, None)
        if since is not None:
            self._last[path].waited_ns += at_ns - since
