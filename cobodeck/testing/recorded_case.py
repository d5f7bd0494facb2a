"""A moment of a recorded run, played in a test: its samples, and today's chart, set to its place.

`cobodeck case` writes such tests. Nothing is simulated: the samples are those of the record, and
the parts answer as they did, whatever is commanded. What the operator did happens again. So what
counts is what the chart decides.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

from cobodeck.loop import Inert, Loop, Ticked, wire
from cobodeck.project import Catalogue, catalogue, chart_names, own_files_around
from cobodeck.record.format import raised_again, text, value
from cobodeck.record.read import (
    RECORD,
    Record,
    Recorded,
    RecordedClock,
    RecordFeed,
    command_of,
)
from cobodeck.run import Answers, Decision, DecisionReader, Raises, StandIn
from cobodeck.setup import Setup, open_setup
from engine import NEVER_NS, TickGrid
from engine.files import mistake
from engine.files.declared import with_own_files
from engine.operator import ChartPlace, set_place
from hw.connection import load_connection

__tracebackhide__ = True  # a failing test shows its own line

CASE_ENDING = ".mcap"


@dataclass(frozen=True, slots=True)
class CaseStart:
    """After which tick a case is played, ns in the run, and where the chart is then.

    Without `place` the chart begins, with that tick.
    """

    at_ns: int
    place: ChartPlace | None = None

    def as_values(self) -> dict[str, Any]:
        """For metadata; values of the chart as in a record."""
        place = self.place
        held = {} if place is None else {f.name: getattr(place, f.name) for f in fields(place)}
        return {"at_ns": self.at_ns, "place": text(held) if held else None}

    @classmethod
    def of_values(cls, values: Mapping[str, Any]) -> CaseStart:
        """What `as_values` has made values of."""
        place = values["place"]
        found = None if place is None else ChartPlace(**value(json.loads(place)))
        return cls(values["at_ns"], found)


class RecordedCase:
    """An excerpt of a record; see the module.

    Args:
        file: the excerpt.
        root: a folder of the project whose states and files it names, by default the current one.
    """

    def __init__(self, file: Path, root: Path | None = None) -> None:
        self.record, self._root = Record(file), root
        case = self.record.case()
        if case is None:
            raise mistake(file, "is no case", hint="`cobodeck case` writes them")
        with self.record.usable("where it begins"):
            self.start = CaseStart.of_values(case)
            self._files = {key: str(file.parent / path) for key, path in case["files"].items()}

    def assert_followed(self, expected: Sequence[str]) -> None:
        """Assert that the chart decides what followed on record; see `decision_lines`."""
        found = decision_lines(self.play())
        if found == list(expected):
            return
        alike = next((n for n, pair in enumerate(zip(found, expected)) if pair[0] != pair[1]), None)  # noqa: B905
        at = min(len(found), len(expected)) if alike is None else alike
        raise AssertionError(
            f"after {at} decisions that are as on record\n"
            f"  expected {_rest(expected, at)}\n"
            f"       got {_rest(found, at)}"
        )

    def play(self) -> list[Decision]:
        """What the chart decides after the start of the case."""
        with with_own_files(own_files_around(self._root)):
            setup = self._setup(catalogue(self._root))
            player = _Player(self.record, setup, self.start)
        player.loop.go(NEVER_NS)
        return player.decisions

    def _setup(self, known: Catalogue) -> Setup:
        """As recorded, with the files of today."""
        header, name = self.record.header, self.record.header["chart"]
        given = {**header["given"], **self._files}
        connection = given.get("connection")
        return open_setup(
            name if name in chart_names(known) else given["chart"],
            given["scene"],
            given["profile"],
            header["tick_hz"],
            given["robot"] if connection is None else load_connection(connection),
            known=known,
            sets=given.get("set", ()),
            inputs=header.get("inputs"),
        )


def decision_lines(decisions: Iterable[Decision]) -> list[str]:
    """Outcomes with their instants, s, and the nodes that they led to, as tests state them."""
    decisions = list(decisions)
    moved = {
        (one.at_ns, one.path, one.text.partition(" -> ")[0])
        for one in decisions
        if one.kind == "move"
    }
    return [
        f"{one.at_ns / 1e9:.3f} s {one}"
        for one in decisions
        if one.kind == "move"
        or (one.kind == "outcome" and (one.at_ns, one.path, one.text) not in moved)
    ]


def _rest(lines: Sequence[str], at: int) -> str:
    return "\n           ".join(lines[at : at + 3]) or "nothing more"


class _Player:
    """Plays a case: an observer that sets the chart to its place, and a tap that reads on."""

    def __init__(self, record: Record, setup: Setup, start: CaseStart) -> None:
        self.decisions: list[Decision] = []
        self._setup, self._start, self._begun = setup, start, False
        self._feed, self._answers = RecordFeed(record.groups()), Answers()
        plant = Recorded(record.header, self._feed)
        plant.paced = True  # the instants are those of the record
        for name, part in plant.parts.items():
            if name != RECORD and isinstance(part, Inert):
                plant.parts[name] = StandIn(name, tuple(part.signals), self._answers)
        self._wired = wire(setup, plant.parts, eager=record.header["options"]["eager"])
        self._reader = DecisionReader(self._wired.run)
        clock, grid = RecordedClock(self._feed), TickGrid(setup.tick_hz)
        self.loop = Loop(plant, self._wired, grid, (self,), clock, taps=(self,))
        self._wired.run.pause()

    def watch(self, now_ns: int) -> None:
        """Begin in time, and let the parts answer, and the operator act, as they did."""
        for call in self._feed.fed.calls:
            raised = call.get("raised")
            answer = value(call.get("answer")) if raised is None else Raises(raised_again(raised))
            self._answers[call["part"], call["what"]] = answer
        run, place = self._wired.run, self._start.place
        if not self._begun and now_ns >= self._start.at_ns:
            self._begun = True
            run.resume()
            run.board.paused_ns = 0
            if place is not None:
                set_place(run, place)
                return  # what the operator did in this tick has led there
        if self._begun:
            for found in self._feed.fed.commands:
                run.command(command_of(found, self._setup))

    def failed(self, part: str, error: BaseException) -> None:
        """Do nothing; parts have failed on record, too."""

    def tick(self, ticked: Ticked) -> None:
        """Read what was decided."""
        if ticked.kind != "end":
            self.decisions += self._reader.new()
