"""What happened in a run, from its record or its trace file, in order.

The records of the trace, and what the operator did to its nodes: a trace file does not have that.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cobodeck.project import catalogue
from cobodeck.record.format import charts_again, trace_record, value
from cobodeck.record.read import Record, written_setup
from cobodeck.terminal import Problem, is_record
from engine.chart import CONTAINERS, Chart, nodes_by_path
from engine.files import mistake, unreadable
from engine.run import TraceRecord

ANSWER, FORCE, CHART = "answer", "force", "chart"
"""Kinds of events beside those of the trace: an answer to a node that waits for consent, with
whether it was granted; an outcome forced on a node; a changed chart in the place of the one that
ran, with what its nodes name."""
TRACE_FORMAT = "cobodeck trace "


@dataclass(frozen=True, slots=True)
class RunEvents:
    """The events of one run, up to the instant `until_ns`.

    `named` is what the nodes name by their paths at first: a state's class, or a chart.
    `operated`: the operator's answers are among the events; if not, it is not known whether there
    were any. `broken` says where a record ends before its run, if it does.
    """

    file: Path
    chart: str
    named: Mapping[str, str]
    events: tuple[TraceRecord, ...]
    until_ns: int
    operated: bool
    broken: str | None = None


def events_of(file: Path) -> RunEvents:
    """The events of a recorded run, or of a trace file.

    Raises:
        FileError: it cannot be read; Problem: it is neither.
    """
    return _of_record(Record(file)) if is_record(file) else _of_trace_file(file)


def _of_record(record: Record) -> RunEvents:
    record.require_ticks()
    setup = written_setup(record, catalogue(own=False))
    events: list[TraceRecord] = []
    until_ns = 0
    for group in record.groups():
        until_ns = max(until_ns, group.ticked.at_ns)
        with record.understood(group):
            for told in group.messages("operator"):
                arguments = value(told["arguments"])
                events += _operated(group.ticked.at_ns, told["command"], arguments)
            events += group.traced()
    named = dict(names_of(setup.chart, setup.library))
    found, name = tuple(events), setup.chart.name
    return RunEvents(record.path, name, named, found, until_ns, True, record.broken)


def _operated(at_ns: int, command: str, arguments: Mapping[str, Any]) -> Iterator[TraceRecord]:
    if command == "Answer":
        yield TraceRecord(at_ns, ANSWER, arguments["path"], (arguments["granted"],))
    elif command == "ForceOutcome":
        yield TraceRecord(at_ns, FORCE, arguments["path"], (arguments["outcome"],))
    elif command == "Replace":
        charts = charts_again(arguments)
        named = dict(names_of(charts[arguments["chart"]], charts))
        yield TraceRecord(at_ns, CHART, "", (named,))


def _of_trace_file(file: Path) -> RunEvents:
    try:
        first, *lines = file.read_text(encoding="utf-8").splitlines()
        head = json.loads(first)
        if not str(head["format"]).startswith(TRACE_FORMAT):
            raise ValueError(head["format"])
    except OSError as error:
        raise unreadable(file, error) from None
    except (ValueError, KeyError, TypeError):
        raise Problem(f"{file}: neither a record, X.mcap, nor a trace file") from None
    events = []
    for number, line in enumerate(lines, 2):
        try:
            events.append(trace_record({"line": json.loads(line)}))
        except (ValueError, TypeError):
            raise mistake(file, f"line {number} is no record of a trace", number) from None
    last_ns = events[-1].time if events else 0
    until_ns = max(last_ns, round(float(head.get("sim_s") or 0.0) * 1e9))
    return RunEvents(file, head["chart"]["name"], {}, tuple(events), until_ns, operated=False)


def names_of(chart: Chart, library: Mapping[str, Chart]) -> Iterator[tuple[str, str]]:
    """The path of each node that names a state or a chart, and that name."""
    for path, node in nodes_by_path(chart, library):
        if node.form not in CONTAINERS:
            yield path, node.target
