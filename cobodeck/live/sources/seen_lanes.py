"""What a run's timeline shows: visits of charts as lanes, and what is marked on it."""

from __future__ import annotations

from bisect import bisect_right
from collections import deque
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

from cobodeck.live.clients import PageMessage
from cobodeck.live.feed import Whole
from cobodeck.live.model import STOP_TOPIC, is_request, stop_reason
from cobodeck.pictures.run import NodeSpan, Visits, lanes_of
from cobodeck.project import behaviour_of
from cobodeck.record.format import value
from cobodeck.record.read import Group
from engine.run import TraceRecord

MOST_SPANS = 20_000
"""Visits of lanes that are kept; older ones are not shown any more."""
MOST_DIFFERENCES = 2000
"""From a shadow, that are kept; older ones are not shown any more."""
UNSEEN = ("",)
"""How a visit has ended whose end was in dropped ticks."""


class SeenLanes:
    """Lanes, marks and differences from a shadow; `used`: the charts by the paths that use them."""

    def __init__(self, used: Mapping[str, str]) -> None:
        self._used = dict(used)
        self._visits, self._spans = Visits(), deque[NodeSpan](maxlen=MOST_SPANS)
        self._marks: deque[PageMessage] = deque(maxlen=MOST_SPANS)
        self._rows: deque[PageMessage] = deque(maxlen=MOST_DIFFERENCES)
        self._new = _News()
        self._escapes: list[float] = []
        self._end_s = 0.0

    def go_on_with(self, used: Mapping[str, str]) -> None:
        """Go on with other charts; the lanes of those before stay."""
        self._used |= used

    def add(self, group: Group) -> None:
        """Take the messages of a tick."""
        self._end_s = max(0, group.ticked.at_ns) / 1e9
        for told in group.told:
            if is_request(told):
                self._mark(told.log_ns / 1e9, "request", "the person asks for a touch")
            elif told.topic == STOP_TOPIC and (why := stop_reason(told)) is not None:
                self._mark(told.log_ns / 1e9, "stop", why)
        if group.ticked.missed:
            self._mark(self._end_s, "missed", f"{group.ticked.missed} ticks missed")
        for record in group.traced():
            self._visit(record)
        for told in group.messages("operator"):
            self._mark(self._end_s, "command", _said(told))
        for told in group.messages("shadow"):
            row = {"at": told.pop("at_ns") / 1e9, **told}
            self._rows.append(row)
            self._new.rows.append(row)

    def renew(self, whole: Whole) -> None:
        """Take what is active now, after ticks were dropped."""
        self._end_s = whole.at_ns / 1e9
        for path in tuple(self._visits.open):
            if path not in whole.active or whole.active[path] is not None:
                self._visit(TraceRecord(whole.at_ns, "exit", path, UNSEEN))
        for path, since in whole.active.items():
            if path not in self._visits.open:
                since = whole.at_ns if since is None else since
                self._visit(TraceRecord(since, "enter", path, ()))

    def _visit(self, record: TraceRecord) -> None:
        time_ns, kind, path, detail = record
        if kind == "enter" and behaviour_of(self._used.get(path, "")) == "escape":
            self._escapes.append(time_ns / 1e9)
            self._mark(time_ns / 1e9, "escape", path)
        elif kind == "error":
            self._mark(time_ns / 1e9, "error", f"{path}: {detail[0]}")
        ended = self._visits.add(record)
        if ended is not None and self._is_lane(path):
            self._spans.append(ended[1])
            self._new.spans.append(ended[1])

    def _mark(self, at: float, kind: str, text: str) -> None:
        mark = {"at": at, "kind": kind, "text": text}
        self._marks.append(mark)
        self._new.marks.append(mark)

    def _is_lane(self, path: str) -> bool:
        return path in lanes_of(self._used, (path,))

    # what is told

    def escapes(self, until_s: float) -> int:
        """How many have begun until an instant."""
        return bisect_right(self._escapes, until_s)

    def all(self) -> Iterator[PageMessage]:
        """Everything, whole."""
        self._new = _News()
        yield self._lanes("lanes", self._spans, list(self._marks))
        if self._rows:
            yield {"t": "shadow", "rows": list(self._rows), "more": False}

    def news(self) -> Iterator[PageMessage]:
        """What is new since the last call."""
        new, self._new = self._new, _News()
        if new.spans or new.marks:
            yield self._lanes("lanes+", new.spans, list(new.marks))
        if new.rows:
            yield {"t": "shadow", "rows": list(new.rows), "more": True}

    def _lanes(
        self, kind: str, spans: Iterable[NodeSpan], marks: Sequence[PageMessage]
    ) -> PageMessage:
        spans = tuple(spans)
        begun = [path for path in self._visits.open if self._is_lane(path)]
        paths = lanes_of(self._used, (*(span.path for span in spans), *begun))
        if kind == "lanes+":
            paths = tuple(dict.fromkeys((*(s.path for s in spans), *begun)))
        rows: dict[str, list[Any]] = {path: [] for path in paths}
        for span in spans:
            rows.setdefault(span.path, []).append([span.start_s, span.end_s, span.ended])
        for path in begun:
            rows[path].append([self._visits.open[path][1], None, ""])
        lanes = [{"path": p, "name": self._used.get(p, p), "spans": s} for p, s in rows.items()]
        return {"t": kind, "lanes": lanes, "marks": marks, "to": self._end_s}


def _said(told: Mapping[str, Any]) -> str:
    """A command as its mark has it."""
    by, name, given = told.get("by") or "operator", told["command"], value(told["arguments"])
    return f"{by}: {given['text'] if name == 'Remark' else name} {given.get('path', '')}".rstrip()


class _News:
    """What nobody was told yet; bounded, as nobody may ask."""

    def __init__(self) -> None:
        self.spans: deque[NodeSpan] = deque(maxlen=MOST_SPANS)
        self.marks: deque[PageMessage] = deque(maxlen=MOST_SPANS)
        self.rows: deque[PageMessage] = deque(maxlen=MOST_DIFFERENCES)
