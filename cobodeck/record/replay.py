"""Does a run again from its record: the record is the plant of the loop.

Samples, ticks, commands and what parts answered are fed again as they were recorded; the trace,
the kinds and times of ticks, and the calls of parts have to come out equal. The first difference
ends it.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from itertools import zip_longest
from pathlib import Path
from typing import Any, ClassVar

from cobodeck.catalogue import Catalogue, catalogue
from cobodeck.clocks import Clock, Virtual
from cobodeck.console import FAILED, Problem
from cobodeck.library import findings_of
from cobodeck.logic import wander
from cobodeck.loop import Loop, Ticked
from cobodeck.plants import Inert
from cobodeck.record.feed import ALTERED, Difference, Feed
from cobodeck.record.header import ROOT
from cobodeck.record.messages import (
    arguments_text,
    charts_again,
    command_again,
    raised_again,
)
from cobodeck.record.reader import Record
from cobodeck.record.values import Unknown, value
from cobodeck.stage import watchers
from cobodeck.wiring import Setup, Tap, open_setup, wire
from engine.clock import Grid
from engine.files.finding import FileError, mistake
from engine.files.text import instead
from engine.load import Library, load_text
from engine.machine import Machine
from engine.report import text
from engine.run import Run
from engine.state import NEVER_NS
from hw.log import Log
from hw.safety_record import SafetyRecord
from hw.samples import Sample
from hw.truth import Truth

KEPT = 4096
"""Cycles of the safety chain that wait to be read."""
RECORD = "(record)"
"""The part that gives all samples; no other has such a name."""


class Recorded:
    """A record as a plant; see `cobodeck.plants.Plant`."""

    guard = None
    latency_ns = 0

    def __init__(self, header: Mapping[str, Any], feed: Feed) -> None:
        self.paced = bool(header["real_time"])
        self.cycles: Log[SafetyRecord] | None = Log(KEPT) if header["guard"] else None
        self.parts: dict[str, Any] = {
            name: Inert(tuple(signals)) for name, signals in header["parts"].items()
        }
        self.faults: list[Any] = []
        if "operator" in self.parts:
            self.parts["operator"].faults = self.faults
        self.parts[RECORD] = Samples(tuple(header["flowing"]), feed)
        self._feed = feed
        self._failures: list[tuple[str, Exception]] = []

    @property
    def truth(self) -> Truth | None:
        """Where everything truly was."""
        return self._feed.fed.truth

    @property
    def failures(self) -> list[tuple[str, Exception]]:
        """What parts had raised by the end of this tick."""
        found, self._failures = self._failures, []
        return found

    @property
    def finished(self) -> bool:
        """Is the record at its end?"""
        return self._feed.over

    def advance(self, to_ns: int) -> None:
        """Know what was known at this instant; in virtual time it is that of the next tick."""
        feed = self._feed
        group = feed.now if self.paced else feed.move()
        if group is None or (not self.paced and group.ticked.at_ns != to_ns):
            at = "none" if group is None else f"{group.ticked.at_ns / 1e9:.9f} s"
            feed.differ("the instant of the next tick", at, f"{to_ns / 1e9:.9f} s")
        self.take()

    def take(self) -> None:
        """Know what was known in this tick, but for the truth."""
        fed = self._feed.fed
        if self.cycles is not None:
            for cycle in fed.cycles:
                self.cycles.append(cycle)
        for call in fed.calls:
            if (call["part"], call["what"]) == ("operator", "report"):
                self.faults += [fault for fault in call["args"] if isinstance(fault, str)]
        self._failures += fed.failures

    def quiet_until(self) -> int:
        """The instant of the next tick."""
        following = self._feed.next
        return NEVER_NS if following is None else following.ticked.at_ns

    def close(self) -> None:
        """Nothing is open."""


class Samples(Inert):
    """The part that gives all samples again."""

    def __init__(self, signals: tuple[str, ...], feed: Feed) -> None:
        super().__init__(signals)
        self._feed = feed

    def samples(self, now_ns: int) -> tuple[Sample, ...]:  # noqa: ARG002  the feed knows
        """Those of this tick, refused ones too."""
        return tuple(self._feed.fed.samples)


class StandIn:
    """In place of a part: answers as it was recorded, if it is called as it was recorded."""

    def __init__(self, name: str, feed: Feed) -> None:
        vars(self).update(_name=name, _feed=feed)

    def __setattr__(self, what: str, held: object) -> None:
        self._call(f".{what} =", held)

    def __getattr__(self, what: str) -> Any:
        calls = self._feed.fed.calls
        if calls and (calls[0]["part"], calls[0]["what"]) == (self._name, f".{what}"):
            return self._answer(calls.popleft())
        if what.startswith("__"):
            raise AttributeError(what)
        return partial(self._call, what)

    def _call(self, what: str, *args: Any, **named: Any) -> Any:
        feed = self._feed
        if feed.now is None or feed.difference is not None:
            return None
        given = f"{what}{arguments_text(args, named)}"
        if not feed.fed.calls:
            feed.differ(f"call of {self._name}", "no call", given)
            return None
        found = feed.fed.calls.popleft()
        if found["part"] != self._name or call_of(found) != given:
            both = {found["part"]: None, self._name: None}
            feed.differ(f"call of {', '.join(both)}", call_of(found), given)
            return None
        return self._answer(found)

    def _answer(self, found: Mapping[str, Any]) -> Any:
        if "raised" in found:
            raise raised_again(found["raised"])
        try:
            return value(found.get("answer"))
        except Unknown as unknown:
            what = f"the answer of {self._name}.{found['what']}"
            self._feed.differ(what, json.dumps(found["answer"]), unknown)
            return None


def call_of(found: Mapping[str, Any]) -> str:
    """A recorded call as text."""
    return f"{found['what']}{json.dumps(found['args'], separators=(',', ':'))}"


class Pace:
    """A clock that tells the recorded instants, one after the other."""

    waits: ClassVar[bool] = True

    def __init__(self, feed: Feed) -> None:
        self._feed = feed

    def wait(self, until_ns: int) -> int:
        """The instant of the next tick."""
        group = self._feed.move()
        return until_ns if group is None else group.ticked.at_ns

    def wake(self) -> None:
        """Nobody sleeps."""


@dataclass(slots=True)
class Checker:
    """Gives commands when they took effect, and compares what comes out.

    `ticks`, `calls` of parts and `records` of the trace are counted.
    """

    feed: Feed
    plant: Recorded
    run: Run
    setup: Setup
    ticks: int = 0
    calls: int = 0
    records: int = 0
    _read: int = 0

    def watch(self, now_ns: int) -> None:  # noqa: ARG002
        """Give the commands of this tick."""
        for found in self.feed.fed.commands:
            try:
                arguments = value(found["arguments"])
                command = command_again(found["command"], arguments, self._machine)
            except Exception as error:  # noqa: BLE001  whatever an altered message leads to
                self.feed.differ("a command", found.get("command"), repr(error))
            else:
                self.run.command(command)

    def _machine(self, arguments: Mapping[str, Any]) -> Machine:
        known, charts = self.setup.catalogue, charts_again(arguments)
        chart = charts[arguments["chart"]]
        return Machine(chart, charts, known.interfaces, arguments["parameters"], known.types)

    def failed(self, part: str, error: BaseException) -> None:
        """As recorded."""

    def tick(self, ticked: Ticked) -> None:
        """Compare a tick that is over."""
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
            feed.now = None  # what closes a run that was broken off here is not on record
        elif feed.next.ticked.kind == "end":
            feed.move()  # before the run is closed, which calls parts
            self.plant.take()

    def _compare_trace(self) -> None:
        trace = self.run.trace
        recorded = [line for line in self.feed.fed.trace if counts(line)]
        replayed = [line for line in trace.lines(self._read) if counts(line)]
        self._read = len(trace.raw)
        self.records += len(recorded)
        for then, now in zip_longest(recorded, replayed, fillvalue="nothing"):
            if then != now:
                self.feed.differ("the trace", then, now)
                return


def _shown(t: Ticked) -> str:
    return f"{t.kind} {t.number} at {t.at_ns} ns"


def counts(line: str) -> bool:
    """Is a line of the trace part of its hash?"""
    return json.loads(line)[1] not in ("note", "tick")


def written_setup(record: Record, known: Catalogue) -> Setup:
    """What was run, from the texts in the record; its charts may name what is not `known`.

    Raises:
        FileError: a text is wrong.
    """
    header, texts = record.header, record.attachments
    files = {ROOT / name: held for name, held in texts.items()}
    files |= {Path(name): held for name, held in texts.items()}
    charts = _written_charts(record)
    given = header["given"]
    with instead(files):
        return open_setup(
            header["chart"],
            given["scene"],
            given["profile"],
            header["tick_hz"],
            given["robot"],
            charts,
            known,
        )


def _written_charts(record: Record) -> Library:
    """The charts from their texts.

    Raises:
        FileError: one is wrong, or not there.
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
    """What was run, from the texts in the record and the code of today.

    What its charts may name is `known`, by default all there is around the present folder: it is
    not for a record to say what code is imported.

    Raises:
        Problem: states that it needs are not there, or others; FileError: a text is wrong.
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
        raise Problem(f"{record.path}: cannot run with the states of today\n{told}", FAILED)
    return setup


@dataclass(frozen=True, slots=True)
class Replay:
    """A replay that is ready to go."""

    loop: Loop
    checker: Checker
    setup: Setup

    @property
    def difference(self) -> Difference | None:
        """The first one, so far."""
        return self.checker.feed.difference


def stage_replay(record: Record, setup: Setup | None = None, around: Tap | None = None) -> Replay:
    """Everything for a replay, before its first tick.

    Args:
        record: what to do again.
        setup: as of `setup_of`, if it is there already.
        around: stands in front of the parts that states are given, as of `wire`.

    Raises:
        Problem, FileError: as of `setup_of`.
    """
    record.require_ticks()
    setup, feed, header = setup or setup_of(record), Feed(record.groups()), record.header
    options, plant = header["options"], Recorded(header, feed)

    def tap(name: str, part: object) -> Any:
        if name == RECORD:
            return part
        stand_in = StandIn(name, feed)
        return stand_in if around is None else around(name, stand_in)

    if options["tier"] == 0:
        wired = wander(setup, options["seed"])
    else:
        wired = wire(setup, plant.parts, eager=options["eager"], tap=tap)
    clock: Clock = Pace(feed) if header["real_time"] else Virtual()
    checker = Checker(feed, plant, wired.run, setup)
    watching = (checker, *(watchers(plant, wired, setup.robot) if options["tier"] else ()))
    loop = Loop(
        plant, wired, Grid(setup.tick_hz), watching, clock, leave_out=not options["eager"],
        taps=(checker,),
    )  # fmt: skip
    return Replay(loop, checker, setup)
