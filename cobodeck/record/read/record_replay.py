"""Replays a run from its record, which is the plant of the loop.

Samples, ticks, commands and answers of parts are fed as they were recorded; the trace, the kinds
and times of ticks, and the calls of parts must come out equal. The first difference ends a replay.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial
from itertools import zip_longest
from pathlib import Path
from typing import Any, Protocol

from behaviors import ESTIMATE
from cobodeck.evaluate import watchers
from cobodeck.loop import Clock, Loop, Ticked, ValueTap, Virtual, wander, wire
from cobodeck.project import Catalogue, catalogue, findings_of
from cobodeck.record.format import ROOT, charts_again, command_again, value
from cobodeck.record.read.reader import Record
from cobodeck.record.read.replayed_plant import (
    RECORD,
    Recorded,
    RecordedClock,
    RecordedPart,
    call_of,
)
from cobodeck.record.read.sample_feed import ALTERED, RecordFeed, ReplayMismatch
from cobodeck.setup import Setup, open_setup
from cobodeck.terminal import FAILED, Problem
from engine import TickGrid, text
from engine.chart import Library, load_text
from engine.files import FileError, instead, mistake
from engine.files.declared import with_own_files
from engine.machine import Machine
from engine.run import ChartRun
from hw.connection import load_connection


@dataclass(slots=True)
class ReplayChecker:
    """Issues the operator's commands at the ticks at which they took effect; compares the results.

    It counts `ticks`, `calls` of parts and `records` of the trace.
    """

    feed: RecordFeed
    plant: Recorded
    run: ChartRun
    setup: Setup
    ticks: int = 0
    calls: int = 0
    records: int = 0
    _read: int = 0

    def watch(self, now_ns: int) -> None:  # noqa: ARG002
        """Issue the commands of this tick."""
        for found in self.feed.fed.commands:
            try:
                arguments = value(found["arguments"])
                by = str(found.get("by", ""))
                command = command_again(found["command"], arguments, self._machine, by)
            except Exception as error:  # noqa: BLE001  an altered message may cause anything
                self.feed.differ("a command", found.get("command"), repr(error))
            else:
                self.run.command(command)

    def _machine(self, arguments: Mapping[str, Any]) -> Machine:
        known, charts = self.setup.catalogue, charts_again(arguments)
        chart = charts[arguments["chart"]]
        return Machine(
            chart,
            charts,
            known.interfaces,
            arguments["parameters"],
            known.types,
            inputs=arguments.get("inputs"),
            around=self.setup.named_values,
        )

    def failed(self, part: str, error: BaseException) -> None:
        """Do nothing; failures of parts are fed from the record."""

    def tick(self, ticked: Ticked) -> None:
        """Compare a finished tick."""
        feed, group = self.feed, self.feed.now
        if group is None:
            return
        self.calls += sum(told.topic == "parts" for told in group.told)
        self.ticks += ticked.kind != "end"
        told = group.ticked
        if (told.kind, told.number, told.at_ns) != (ticked.kind, ticked.number, ticked.at_ns):
            feed.differ("the tick", _shown(told), _shown(ticked))
        self._compare_trace()
        for found in feed.fed.calls:
            feed.differ(f"call of {found['part']}", call_of(found), "no call")
        if group.altered:
            feed.differ(ALTERED, "as their checksum says", "others")
        if feed.next is None:
            feed.now = None  # the record is cut off here, so the closing of the run is not on it
        elif feed.next.ticked.kind == "end":
            feed.move()  # closing the run, next, calls parts
            self.plant.read_tick()
            self.watch(ticked.at_ns)

    def _compare_trace(self) -> None:
        trace = self.run.trace
        recorded = [line for line in self.feed.fed.trace if counts(line)]
        replayed = [line for line in trace.lines(self._read) if counts(line)]
        self._read = trace.end
        self.records += len(recorded)
        for then, now in zip_longest(recorded, replayed, fillvalue="nothing"):
            if then != now:
                self.feed.differ("the trace", then, now)
                return


def _shown(t: Ticked) -> str:
    return f"{t.kind} {t.number} at {t.at_ns} ns"


def counts(line: str) -> bool:
    """Whether a line of the trace is part of the trace's hash."""
    return json.loads(line)[1] not in ("note", "tick")


class RunTexts(Protocol):
    """What was run, as a record has it in its header and in the attached texts."""

    @property
    def path(self) -> Path:
        """Where it is from."""
        ...

    @property
    def header(self) -> Mapping[str, Any]:
        """See `FORMAT.md`."""
        ...

    @property
    def attachments(self) -> Mapping[str, bytes]:
        """Texts by the names of their files."""
        ...


def written_setup(record: RunTexts, known: Catalogue) -> Setup:
    """The recorded setup, from the texts in the record; its charts may name unknown states.

    Raises:
        FileError: a text is missing or malformed.
    """
    header = record.header
    charts = _written_charts(record)
    given = header["given"]
    with instead(texts_of(record)), with_own_files(partial(_own_files, header)):
        connection = given.get("connection")
        setup = open_setup(
            header["chart"],
            given["scene"],
            given["profile"],
            header["tick_hz"],
            given["robot"] if connection is None else load_connection(connection),
            charts,
            known,
            given.get("set", ()),
            header.get("inputs"),
        )
    localizing = header["options"]["seed"] if ESTIMATE in header["signals"] else None
    return replace(setup, localizing=localizing)


def _own_files(header: Mapping[str, Any], kind: str) -> Mapping[str, Path]:
    """The files that names meant in the project when the run was recorded."""
    return {name: Path(file) for name, file in header.get("named", {}).get(kind, {}).items()}


def texts_of(record: RunTexts) -> dict[Path, bytes]:
    """The contents of a run's files, by today's paths and by the recorded ones."""
    texts = record.attachments
    files = {ROOT / name: held for name, held in texts.items()}
    return files | {Path(name): held for name, held in texts.items()}


def _written_charts(record: RunTexts) -> Library:
    """The charts, from their texts in the record.

    Raises:
        FileError: one is malformed or missing.
    """
    library = Library()
    for name, file in record.header["charts"].items():
        try:
            found = load_text(record.attachments[file].decode(), file)
            library[name] = found[name]
        except (KeyError, UnicodeDecodeError):
            raise mistake(record.path, f"holds no chart {name!r}") from None
        library.findings += found.findings
        library.sources |= found.sources
    if library.findings:
        raise FileError(library.findings)
    return library


def setup_of(record: Record, known: Catalogue | None = None) -> Setup:
    """The recorded setup, from the texts in the record and with today's code.

    `known` is what its charts may name, by default everything found from the current folder: a
    record does not decide which code is imported.

    Raises:
        Problem: states that it needs are missing or have changed; FileError: a text is malformed.
    """
    known = known or catalogue()
    setup = written_setup(record, known)
    nodes = (node for chart in setup.library.values() for node in chart.root.walk())
    used = {node.target for node in nodes if node.form in ("do", "watch")}
    if used - known.classes.keys():
        lacking = ", ".join(sorted(used - known.classes.keys()))
        raise Problem(
            f"{record.path}: no states {lacking}; go to the folder of their project", FAILED
        )
    library = _written_charts(record)
    files = [Path(chart.file) for chart in library.values()]
    errors = [f for f in findings_of(library, known, files) if f.severity == "error"]
    if errors:
        told = text(errors, library.sources).rstrip()
        raise Problem(f"{record.path}: cannot run with the present states\n{told}", FAILED)
    return setup


@dataclass(frozen=True, slots=True)
class Replay:
    """A replay, ready to run."""

    loop: Loop
    checker: ReplayChecker
    setup: Setup

    @property
    def difference(self) -> ReplayMismatch | None:
        """The first difference so far."""
        return self.checker.feed.difference


def stage_replay(
    record: Record, setup: Setup | None = None, around: ValueTap | None = None
) -> Replay:
    """Set up a replay, ready for its first tick.

    Args:
        record: what to replay.
        setup: the result of `setup_of`, if it was called already.
        around: wraps the parts that states are given, like `tap` of `wire`.

    Raises:
        Problem, FileError: as for `setup_of`.
    """
    record.require_ticks()
    setup, feed, header = setup or setup_of(record), RecordFeed(record.groups()), record.header
    options, plant = header["options"], Recorded(header, feed)

    def tap(name: str, part: object) -> Any:
        if name == RECORD:
            return part
        stand_in = RecordedPart(name, feed)
        return stand_in if around is None else around(name, stand_in)

    if options["tier"] == 0:
        wired = wander(setup, options["seed"])
    else:
        wired = wire(setup, plant.parts, eager=options["eager"], tap=tap)
    clock: Clock = RecordedClock(feed) if header["real_time"] else Virtual()
    checker = ReplayChecker(feed, plant, wired.run, setup)
    watching = (
        checker,
        *(watchers(plant, wired, setup.robot, setup.scene) if options["tier"] else ()),
    )
    loop = Loop(
        plant, wired, TickGrid(setup.tick_hz), watching, clock, leave_out=not options["eager"],
        taps=(checker,),
    )  # fmt: skip
    return Replay(loop, checker, setup)
