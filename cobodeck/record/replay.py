"""Does a run again from its record: the record is the plant of the loop.

Samples, ticks, commands and what parts answered are fed again as they were recorded; the trace,
the kinds and times of ticks, and the calls of parts have to come out equal. The first difference
ends it.
"""

from __future__ import annotations

import json
from collections import deque
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from itertools import zip_longest
from pathlib import Path
from typing import Any, ClassVar, NamedTuple

from cobodeck.clocks import Clock, Virtual
from cobodeck.console import FAILED, Problem
from cobodeck.logic import wander
from cobodeck.loop import Loop, Ticked
from cobodeck.plants import Inert
from cobodeck.record.header import ROOT
from cobodeck.record.messages import (
    arguments_text,
    charts_again,
    command_again,
    cycle_again,
    raised_again,
    truth_again,
)
from cobodeck.record.reader import Group, Record, Told
from cobodeck.record.samples import TOPIC, SampleReader
from cobodeck.record.values import Opaque, Unknown, value
from cobodeck.stage import watchers
from cobodeck.wiring import Setup, Tap, open_setup, wire
from engine.clock import Grid
from engine.files.text import instead
from engine.load import load_text
from engine.machine import Machine
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


class Difference(NamedTuple):
    """The first thing that was not as recorded: when (ns), what, as it was, as it is."""

    at_ns: int
    what: str
    recorded: str
    replayed: str

    def __str__(self) -> str:
        told = f"at {self.at_ns / 1e9:.3f} s, {self.what}"
        return f"{told}\n  recorded: {self.recorded}\n  replayed: {self.replayed}"


class Cursor:
    """Where a replay has got to in its record: the tick that is under way, and the next one."""

    def __init__(self, groups: Iterator[Group]) -> None:
        self._groups = groups
        self.now: Group | None = None
        self.next: Group | None = next(groups, None)
        self.calls: deque[Mapping[str, Any]] = deque()
        self.difference: Difference | None = None

    def move(self) -> Group | None:
        """Go on to the next tick."""
        self.now, self.next = self.next, next(self._groups, None)
        if self.now is not None:
            self.calls = deque(self.now.of("parts"))
            if self.now.altered:
                told = "the messages of this tick"
                self.differ(told, "as their checksum says", "something else: they were altered")
        return self.now

    @property
    def over(self) -> bool:
        """Is nothing left but the end, or is there a difference already?"""
        at_end = self.now is not None and self.now.ticked.kind == "end"
        return self.difference is not None or self.next is None or at_end

    def differ(self, what: str, recorded: object, replayed: object) -> None:
        """Something is not as recorded; only the first counts."""
        group = self.now or self.next
        if self.difference is None:
            at = 0 if group is None else group.ticked.at_ns
            self.difference = Difference(at, what, str(recorded), str(replayed))


class Recorded:
    """A record as a plant; see `cobodeck.plants.Plant`."""

    guard = None
    latency_ns = 0

    def __init__(self, header: Mapping[str, Any], cursor: Cursor) -> None:
        self.paced = bool(header["real_time"])
        self.cycles: Log[SafetyRecord] | None = Log(KEPT) if header["guard"] else None
        self.truth: Truth | None = None
        self.parts: dict[str, Any] = {
            name: Inert(tuple(signals)) for name, signals in header["parts"].items()
        }
        self.faults: list[Any] = []
        if "operator" in self.parts:
            self.parts["operator"].faults = self.faults
        self.parts[RECORD] = Samples(cursor, tuple(header["flowing"]))
        self._cursor = cursor
        self._failures: list[tuple[str, Exception]] = []
        if cursor.next is not None:
            self._look(cursor.next)  # how things are before the first tick

    @property
    def failures(self) -> list[tuple[str, Exception]]:
        """What parts had raised by the end of this tick."""
        found, self._failures = self._failures, []
        return found

    @property
    def finished(self) -> bool:
        """Is the record at its end?"""
        return self._cursor.over

    def advance(self, to_ns: int) -> None:
        """Know what was known at this instant; in virtual time it is that of the next tick."""
        group = self._cursor.now if self.paced else self._cursor.move()
        if group is None or (not self.paced and group.ticked.at_ns != to_ns):
            at = "none" if group is None else f"{group.ticked.at_ns / 1e9:.9f} s"
            self._cursor.differ("the instant of the next tick", at, f"{to_ns / 1e9:.9f} s")
        else:
            self.take(group)

    def take(self, group: Group) -> None:
        """Know what was known in this tick."""
        self._look(group)
        for found in group.of("safety"):
            assert self.cycles is not None, "there is no chain"
            self.cycles.append(cycle_again(found))
        for found in group.of("parts"):
            if (found["part"], found["what"]) == ("operator", "report"):
                self.faults += value(found["args"])
        for found in group.of("failures"):
            self._failures.append((found["part"], raised_again(found["raised"])))

    def _look(self, group: Group) -> None:
        for found in group.of("truth"):
            self.truth = truth_again(found, self.truth)

    def quiet_until(self) -> int:
        """The instant of the next tick."""
        following = self._cursor.next
        return NEVER_NS if following is None else following.ticked.at_ns

    def close(self) -> None:
        """Nothing is open."""


class Samples(Inert):
    """The part that gives all samples again."""

    def __init__(self, cursor: Cursor, signals: tuple[str, ...]) -> None:
        super().__init__(signals)
        self._cursor = cursor
        self._readers: dict[str, SampleReader] = {}

    def samples(self, now_ns: int) -> tuple[Sample, ...]:  # noqa: ARG002  the cursor knows
        """Those of this tick, refused ones too."""
        group = self._cursor.now
        found = []
        for told in group.told if group is not None else ():
            try:
                if told.topic.startswith(TOPIC):
                    found.append(self._sample(told))
                elif told.topic == "refused":
                    found.append(_refused(told))
            except Unknown as unknown:
                self._cursor.differ(f"a sample on {told.topic}", "a value", unknown)
        return tuple(found)

    def _sample(self, told: Told) -> Sample:
        name = told.topic.removeprefix(TOPIC)
        reader = self._readers.get(name)
        if reader is None:
            reader = self._readers[name] = SampleReader(name)
        return reader.read(told.schema, told.data)


def _refused(told: Told) -> Sample:
    found = json.loads(told.data)
    return Sample(found["signal"], value(found["stamp"]), value(found["value"]))


class StandIn:
    """In place of a part: answers as it was recorded, if it is called as it was recorded."""

    def __init__(self, name: str, cursor: Cursor) -> None:
        self._name, self._cursor = name, cursor

    def __getattr__(self, what: str) -> Any:
        calls = self._cursor.calls
        if calls and (calls[0]["part"], calls[0]["what"]) == (self._name, f".{what}"):
            return self._answer(calls.popleft())
        if what.startswith("__"):
            raise AttributeError(what)
        return partial(self._call, what)

    def _call(self, what: str, *args: Any, **named: Any) -> Any:
        cursor = self._cursor
        if cursor.now is None or cursor.difference is not None:
            return None
        given = f"{what}{arguments_text(args, named)}"
        if not cursor.calls:
            cursor.differ(f"calls of {self._name}", "no call", given)
            return None
        found = cursor.calls.popleft()
        recorded = f"{found['what']}{json.dumps(found['args'], separators=(',', ':'))}"
        if found["part"] != self._name or recorded != given:
            both = self._name if found["part"] == self._name else f"{found['part']}, {self._name}"
            cursor.differ(f"call of {both}", recorded, given)
            return None
        return self._answer(found)

    def _answer(self, found: Mapping[str, Any]) -> Any:
        if "raised" in found:
            raise raised_again(found["raised"])
        try:
            answer = value(found.get("answer"))
        except Unknown as unknown:
            answer = Opaque(self._name, str(unknown))
        if isinstance(answer, Opaque):
            called = f"the answer of {self._name}.{found['what']}"
            self._cursor.differ(called, "given", f"not to be had again: {answer.text}")
            return None
        return answer


class Pace:
    """A clock that tells the recorded instants, one after the other."""

    waits: ClassVar[bool] = True

    def __init__(self, cursor: Cursor) -> None:
        self._cursor = cursor

    def wait(self, until_ns: int) -> int:
        """The instant of the next tick."""
        group = self._cursor.move()
        return until_ns if group is None else group.ticked.at_ns

    def wake(self) -> None:
        """Nobody sleeps."""


@dataclass(slots=True)
class Checker:
    """Gives commands when they took effect, and compares what comes out."""

    cursor: Cursor
    plant: Recorded
    run: Run
    setup: Setup
    ticks: int = 0
    calls: int = 0
    records: int = 0
    _read: int = 0

    def watch(self, now_ns: int) -> None:  # noqa: ARG002
        """Give the commands of this tick."""
        group = self.cursor.now
        for found in group.of("operator") if group is not None else ():
            try:
                arguments = value(found["arguments"])
                command = command_again(found["command"], arguments, self._machine)
            except Unknown as unknown:
                self.cursor.differ("a command", found["command"], unknown)
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
        cursor, group = self.cursor, self.cursor.now
        if group is None:
            return
        self.ticks += ticked.kind != "end"
        told = group.ticked
        if (told.kind, told.number) != (ticked.kind, ticked.number):
            cursor.differ(
                "the tick", f"{told.kind} {told.number}", f"{ticked.kind} {ticked.number}"
            )
        elif told.at_ns != ticked.at_ns:
            cursor.differ("the instant of the tick, ns", told.at_ns, ticked.at_ns)
        self._compare_trace(group)
        if cursor.calls:
            found = cursor.calls[0]
            called = f"{found['what']}{json.dumps(found['args'])}"
            cursor.differ(f"call of {found['part']}", called, "no call")
        self.calls += len(group.of("parts"))
        if cursor.next is None:
            cursor.now = None  # it was broken off here; what closes the run now is not on record
        elif cursor.next.ticked.kind == "end" and cursor.move() is not None:
            self.plant.take(cursor.now or group)

    def _compare_trace(self, group: Group) -> None:
        recorded = [
            t.data[len(b'{"line":') : -1].decode() for t in group.told if t.topic == "trace"
        ]
        raw = self.run.trace.raw
        replayed = list(self.run.trace.lines(self._read))
        self._read = len(raw)
        recorded, replayed = (
            [line for line in lines if not _is_note(line)] for lines in (recorded, replayed)
        )
        self.records += len(recorded)
        for then, now in zip_longest(recorded, replayed, fillvalue="nothing"):
            if then != now:
                self.cursor.differ("the trace", then, now)
                return


def _is_note(line: str) -> bool:
    kind = json.loads(line)[1]
    return kind in ("note", "tick")


def setup_of(record: Record) -> Setup:
    """What was run, from the texts in the record and the code of today.

    Raises:
        FileError: a text is wrong.
    """
    header, texts = record.header, record.attachments
    files = {ROOT / name: text for name, text in texts.items()}
    files |= {Path(name): text for name, text in texts.items()}
    charts = {}
    for name, file in header["charts"].items():
        charts[name] = load_text(texts[file].decode(), file)[name]
    given = header["given"]
    with instead(files):
        return open_setup(
            header["chart"],
            given["scene"],
            given["profile"],
            header["tick_hz"],
            given["robot"],
            charts,
        )


def _require_states(record: Record, setup: Setup) -> None:
    """Refuse what cannot be done again with the code of today.

    Raises:
        Problem: states are not there.
    """
    known, charts = setup.catalogue.classes, setup.library.values()
    used = {node.target for chart in charts for node in chart.root.walk() if node.form == "do"}
    if used - known.keys():
        lacking = ", ".join(sorted(used - known.keys()))
        raise Problem(
            f"{record.path}: no states {lacking}; go to the folder of their project", FAILED
        )


@dataclass(frozen=True, slots=True)
class Replay:
    """A replay that is ready to go."""

    loop: Loop
    checker: Checker
    setup: Setup

    @property
    def difference(self) -> Difference | None:
        """The first one, so far."""
        return self.checker.cursor.difference


def stage_replay(record: Record, around: Tap | None = None) -> Replay:
    """Everything for a replay, before its first tick.

    Args:
        record: what to do again.
        around: stands in front of the parts that states are given, as of `wire`.

    Raises:
        Problem: states that it needs are not there; FileError: as of `setup_of`.
    """
    setup, cursor, header = setup_of(record), Cursor(record.groups()), record.header
    _require_states(record, setup)
    options, plant = header["options"], Recorded(header, cursor)

    def tap(name: str, part: object) -> Any:
        if name == RECORD:
            return part
        stand_in = StandIn(name, cursor)
        return stand_in if around is None else around(name, stand_in)

    if options["tier"] == 0:
        wired = wander(setup, options["seed"])
    else:
        wired = wire(setup, plant.parts, eager=options["eager"], tap=tap)
    clock: Clock = Pace(cursor) if header["real_time"] else Virtual()
    checker = Checker(cursor, plant, wired.run, setup)
    watching = (checker, *(watchers(plant, wired, setup.robot) if options["tier"] else ()))
    loop = Loop(
        plant, wired, Grid(setup.tick_hz), watching, clock, leave_out=not options["eager"],
        taps=(checker,),
    )  # fmt: skip
    return Replay(loop, checker, setup)
