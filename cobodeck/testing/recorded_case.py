"""A moment of a recorded run, played in a test: its samples, and today's chart, set to its place.

`cobodeck case` writes such tests. Nothing is simulated: the samples are those of the record, and
the parts answer as they did, whatever is commanded. So what counts is what the chart decides.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from cobodeck.loop import Answers, Inert, Loop, StandIn, Ticked, Wired, wire
from cobodeck.project import Catalogue, catalogue, chart_names, own_files_around
from cobodeck.record.format import text, value
from cobodeck.record.read import RECORD, Record, Recorded, RecordedClock, RecordFeed
from cobodeck.run import Decision, DecisionReader
from cobodeck.setup import Setup, open_setup
from engine import TickGrid
from engine.files import mistake
from engine.files.declared import with_own_files
from engine.operator import ChartPlace, set_place
from hw.connection import load_connection

__tracebackhide__ = True  # a failing test shows its own line

CASE_ENDING = ".mcap"
FOR_EVER_NS = 1 << 61


@dataclass(frozen=True, slots=True)
class CaseStart:
    """From when on a case is played, ns in the run, and where the chart is then.

    `paused_ns` is for how long the run had been paused; without `place` the chart begins.
    """

    at_ns: int
    paused_ns: int = 0
    place: ChartPlace | None = None

    def as_values(self) -> dict[str, Any]:
        """For metadata; values of the chart as in a record."""
        p = self.place
        place = None if p is None else text((p.active, p.tries, p.kept, p.data))
        return {"at_ns": self.at_ns, "paused_ns": self.paused_ns, "place": place}

    @classmethod
    def of_values(cls, values: Mapping[str, Any]) -> CaseStart:
        """What `as_values` has made values of."""
        place = values["place"]
        found = None if place is None else ChartPlace(*value(_parsed(place)))
        return cls(values["at_ns"], values["paused_ns"], found)


def _parsed(written: str) -> Any:
    import json

    return json.loads(written)


class RecordedCase:
    """An excerpt of a record; see the module.

    Args:
        file: the excerpt.
        known: what charts may name; by default what is found around the file.
    """

    def __init__(self, file: Path, known: Catalogue | None = None) -> None:
        self.record = Record(file)
        self._known = known
        start = self.record.metadata("case")
        if start is None:
            raise mistake(file, "is no case", hint="`cobodeck case` writes them")
        with self.record.usable("where it begins"):
            self.start = CaseStart.of_values(start)

    def assert_followed(self, expected: Sequence[str]) -> None:
        """Assert that the chart decides what followed on record; see `told`."""
        found = told(self.play())
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
        folder = self.record.path.resolve().parent
        with with_own_files(own_files_around(folder)):
            setup = self._setup(self._known or catalogue(folder))
            player = _Player(self.record, setup, self.start)
        player.loop.go(FOR_EVER_NS)
        return player.decisions

    def _setup(self, known: Catalogue) -> Setup:
        """As recorded, with the files of today."""
        header = self.record.header
        name, given = header["chart"], header["given"]
        connection = given.get("connection")
        return open_setup(
            name if name in chart_names(known) else header["charts"][name],
            given["scene"],
            given["profile"],
            header["tick_hz"],
            given["robot"] if connection is None else load_connection(connection),
            known=known,
            sets=given.get("set", ()),
            inputs=header.get("inputs"),
        )


def told(decisions: Iterable[Decision]) -> list[str]:
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


@dataclass(slots=True)
class _Player:
    """Plays a case: an observer that sets the chart to its place, and a tap that reads on."""

    record: Record
    setup: Setup
    start: CaseStart
    loop: Loop = field(init=False)
    decisions: list[Decision] = field(init=False, default_factory=list)
    _feed: RecordFeed = field(init=False)
    _wired: Wired = field(init=False)
    _reader: DecisionReader = field(init=False)
    _answers: Answers = field(init=False, default_factory=dict)
    _begun: bool = field(init=False, default=False)

    def __post_init__(self) -> None:
        header = self.record.header
        self._feed = RecordFeed(self.record.groups())
        plant = Recorded(header, self._feed)
        plant.paced = True  # the instants are those of the record
        for name, part in plant.parts.items():
            if name != RECORD and isinstance(part, Inert):
                plant.parts[name] = StandIn(name, tuple(part.signals), self._answers)
        self._wired = wire(self.setup, plant.parts, eager=header["options"]["eager"])
        self._reader = DecisionReader(self._wired.run)
        clock, grid = RecordedClock(self._feed), TickGrid(self.setup.tick_hz)
        self.loop = Loop(plant, self._wired, grid, (self,), clock, taps=(self,))
        self._wired.run.pause()

    def watch(self, now_ns: int) -> None:
        """Begin in time, and let the parts answer as they did."""
        run, start = self._wired.run, self.start
        for call in self._feed.fed.calls:
            if "raised" not in call:
                self._answers[call["part"], call["what"]] = value(call.get("answer"))
        if self._begun or now_ns < start.at_ns:
            return
        self._begun = True
        run.resume()
        run.board.paused_ns = start.paused_ns
        if start.place is not None:
            set_place(run, start.place)

    def failed(self, part: str, error: BaseException) -> None:
        """Do nothing; parts have failed on record, too."""

    def tick(self, ticked: Ticked) -> None:
        """Read what was decided."""
        if ticked.kind != "end":
            self.decisions += self._reader.new()
