"""What a chart has decided: outcomes, where they led, and values written, from trace records."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator
from typing import NamedTuple

from engine.run import ChartRun, TraceRecord


class Decision(NamedTuple):
    """At `at_ns`, the node at `path`; `text` says what was decided, as in the trace."""

    at_ns: int
    path: str
    kind: str
    text: str

    def __str__(self) -> str:
        return f"{self.path or '(the chart)'}: {self.text}"


def decisions_of(records: Iterable[TraceRecord]) -> Iterator[Decision]:
    """The decisions among these records.

    A transition is one of the node that ended; a value written is one of the chart that has it.
    """
    for time, kind, subject, detail in records:
        if kind == "outcome":
            yield Decision(time, subject, kind, detail[0])
        elif kind == "move":
            child, outcome, target = detail
            path = f"{subject}/{child}" if subject else child
            yield Decision(time, path, kind, f"{outcome} -> {target}")
        elif kind == "data":
            key, value = detail
            written = json.dumps(value, ensure_ascii=False, separators=(",", ":"))
            yield Decision(time, subject, kind, f"{key} = {written}")


class DecisionReader:
    """Reads what a run decides, tick by tick."""

    def __init__(self, run: ChartRun) -> None:
        self._run = run
        self._read = run.trace.end

    def new(self) -> list[Decision]:
        """What was decided since the last call."""
        trace = self._run.trace
        if trace.end == self._read:
            return []
        lines = map(json.loads, trace.lines(self._read))
        self._read = trace.end
        return list(decisions_of(TraceRecord(t, k, s, tuple(d)) for t, k, s, *d in lines))
