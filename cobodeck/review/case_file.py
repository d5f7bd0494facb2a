"""Writes a test that plays a moment of a recorded run, and asserts what followed on record.

It is played from the entry of a node that is active at that moment, with the chart set to where it
was: from the latest entry from which today's code decides what is on record, at worst from the
start of the run. States that were entered before begin their work anew there.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from itertools import zip_longest
from os.path import relpath
from pathlib import Path
from typing import NamedTuple

from cobodeck.loop import Ticked
from cobodeck.project import Catalogue
from cobodeck.record.format import Sink
from cobodeck.record.read import Group, Record, Replay, ReplayMismatch, setup_of, stage_replay
from cobodeck.record.write import write_excerpt
from cobodeck.run import Decision, decisions_of
from cobodeck.terminal import FAILED, Problem
from cobodeck.testing import CASE_ENDING, CaseStart, RecordedCase, decision_lines
from engine.operator import place_of

FOLLOWING = 3
"""So many instants with decisions after the moment are played."""
BEFORE_NS = 3_000_000_000
"""Samples from so long before the start, ns, are given: what is estimated from them is ready."""

TEXT = '''"""What followed {at} s of {record}: {chart}, played from {start} s on.

`cobodeck case` wrote it; the samples are in the file that it names. It fails once the chart, the
profile or a state decides otherwise.
"""

from collections.abc import Callable

FOLLOWED = [
{lines}
]


def test_what_followed_{name}(recorded_case: Callable[[str, list[str]], None]) -> None:
    recorded_case({data}, FOLLOWED)
'''


class CaseWritten(NamedTuple):
    """The test, the samples beside it, from when on it plays, s, and what it asserts."""

    test: Path
    data: Path
    start_s: float
    followed: list[str]


def write_case(record: Record, at_s: float, output: Path | None, known: Catalogue) -> CaseWritten:
    """Write a test of the moment `at_s`, s in the run, and the samples beside it.

    Raises:
        Problem: nothing follows, a file exists, or today's code does not decide what is on record.
        FileError: the record cannot be read.
    """
    record.require_ticks()
    if not record.header["options"]["tier"]:
        raise Problem(f"{record.path} is of --tier 0, where states end by chance")
    at_ns = round(at_s * 1e9)
    decisions, end_ns = _following(record, at_ns)
    name = re.sub(r"\W", "_", f"{record.path.name.partition('.')[0]}_{at_s:g}s")
    test = output or Path(f"test_{name}.py")
    data = test.with_name(test.stem.removeprefix("test_") + CASE_ENDING)
    for file in (test, data):
        if file.exists():
            raise Problem(f"{file}: exists; name another file with -o")
    starts = _starts(record, at_ns, end_ns, known)
    start, expected = _written(record, data, starts, decisions, end_ns)
    test.write_text(_text(record, at_s, start, data, name, expected), encoding="utf-8")
    return CaseWritten(test, data, start.at_ns / 1e9, expected)


def _written(
    record: Record, data: Path, starts: Iterable[CaseStart], decisions: list[Decision], end_ns: int
) -> tuple[CaseStart, list[str]]:
    """The first start from which today's code decides what is on record, and that; `data` has it.

    Raises:
        Problem: there is none.
    """
    there = here = ""
    for start in starts:
        after = (one for one in decisions if one.at_ns > start.at_ns or start.place is None)
        expected = decision_lines(after)
        _write_data(record, data, start, end_ns)
        try:
            found = decision_lines(RecordedCase(data).play())
        except BaseException:
            data.unlink()
            raise
        if found == expected:
            return start, expected
        data.unlink()
        there, here = _first_difference(expected, found)
    raise Problem(
        f"{record.path}: today's code does not decide what is on record\n"
        f"  recorded  {there}\n  decided   {here}",
        FAILED,
    )


def _first_difference(expected: list[str], found: list[str]) -> tuple[str, str]:
    pairs = zip_longest(expected, found, fillvalue="nothing")
    return next(pair for pair in pairs if pair[0] != pair[1])


def _following(record: Record, at_ns: int) -> tuple[list[Decision], int]:
    """All decisions up to the end of what follows, and that instant."""
    found: list[Decision] = []
    instants: dict[int, None] = {}
    last_ns = 0
    for group in record.groups():
        if group.ticked.kind == "end" or _replaces(record, group, at_ns):
            break
        last_ns = group.ticked.at_ns
        with record.understood(group):
            new = [one for one in decisions_of(group.traced()) if one.kind != "data"]
        found += new
        instants |= {one.at_ns: None for one in new if one.at_ns > at_ns}
        if len(instants) == FOLLOWING:
            return found, last_ns
    if not instants:
        raise Problem(
            f"{record.path}: nothing is decided after {at_ns / 1e9:g} s, up to "
            f"{last_ns / 1e9:.3f} s; name an earlier --at"
        )
    return found, last_ns


def _replaces(record: Record, group: Group, at_ns: int) -> bool:
    """Whether the chart is replaced in this tick: a case is of the chart that ran first.

    Raises:
        Problem: it was, at `at_ns` or before.
    """
    with record.understood(group):
        replaces = any(told["command"] == "Replace" for told in group.messages("operator"))
    if replaces and group.ticked.at_ns <= at_ns:
        raise Problem(
            f"{record.path}: the chart was replaced at {group.ticked.at_ns / 1e9:g} s; a case is "
            "of the chart that ran first, so name an earlier --at"
        )
    return replaces


def _starts(record: Record, at_ns: int, end_ns: int, known: Catalogue) -> Iterator[CaseStart]:
    """Where to begin: the latest entries first, at last the start of the run."""
    replay = stage_replay(record, setup_of(record, known))
    seen = _Places(replay, at_ns)
    replay.loop.taps = (*replay.loop.taps, seen)
    replay.loop.go(end_ns)
    if seen.difference is not None:
        raise Problem(f"{record.path}: today's code differs {seen.difference}", FAILED)
    yield from reversed(seen.entries())
    yield CaseStart(0)


@dataclass(slots=True)
class _Places:
    """A tap that notes where a replay is after each tick with an entry, up to an instant."""

    replay: Replay
    until_ns: int
    _found: dict[int, CaseStart] = field(default_factory=dict)  # by chart time, as entries have it
    _read: int = 0
    _last: CaseStart | None = None
    difference: ReplayMismatch | None = None

    def failed(self, part: str, error: BaseException) -> None:
        """Do nothing."""

    def tick(self, ticked: Ticked) -> None:
        """Note where the run is."""
        run = self.replay.loop.wired.run
        if ticked.kind != "end":  # closing, which the record has later, calls parts
            self.difference = self.replay.difference
        if ticked.at_ns > self.until_ns or run.over or run.paused or run.trace.end == self._read:
            return
        self._read = run.trace.end
        self._last = CaseStart(ticked.at_ns, place_of(run))
        self._found[ticked.at_ns - run.board.paused_ns] = self._last

    def entries(self) -> list[CaseStart]:
        """The entries of what was active at the end, in order."""
        if self._last is None or self._last.place is None:
            return []
        times = {since for since in self._last.place.active.values() if since}
        return [self._found[since] for since in sorted(times) if since in self._found]


def _write_data(record: Record, data: Path, start: CaseStart, end_ns: int) -> None:
    sink, case = Sink(data), {**start.as_values(), "files": _files(record, data)}
    write_excerpt(record, sink, max(0, start.at_ns - BEFORE_NS), end_ns, case)
    if sink.error is None:
        sink.finish()
    if sink.error is not None:
        sink.remove()
        raise Problem(f"{data}: {sink.error.strerror}", FAILED)


def _files(record: Record, data: Path) -> dict[str, str]:
    """The chart's file, and those that were given by their paths, as seen from the samples."""
    header = record.header
    given = {**header["given"], "chart": header["charts"][header["chart"]]}
    paths = {key: Path(path) for key, path in given.items() if isinstance(path, str)}
    return {
        key: Path(relpath(path, data.parent)).as_posix()
        for key, path in paths.items()
        if path.is_file()
    }


def _text(
    record: Record, at_s: float, start: CaseStart, data: Path, name: str, expected: list[str]
) -> str:
    return TEXT.format(
        at=f"{at_s:g}",
        record=_plain(record.path.name),
        chart=_plain(record.header["chart"]),
        start=f"{start.at_ns / 1e9:.3f}",
        data=_quoted(data.name),
        name=name,
        lines="\n".join(f"    {_quoted(line)}," for line in expected),
    )


def _plain(name: str) -> str:
    """A name as it may stand in a docstring."""
    return re.sub(r"[^\w. -]", "_", name)


def _quoted(text: str) -> str:
    """As a string of Python, which strings of JSON are."""
    return json.dumps(text, ensure_ascii=False)
