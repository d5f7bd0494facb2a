"""What a run keeps is bounded: the newest records, errors and commands, and the hash of all."""

from __future__ import annotations

from typing import Any

import pytest

from engine.run.errors import Newest
from engine.state import Action, Context, Run
from tests.engine.conftest import Bench

ROUND = """
chart: c
outcomes: [x]
data: {goal: {type: number, initial: 0}}
states:
  a: {do: Give, out: {value: goal}, next: {done: b, failed: b, other: .x}}
  b: {do: Do, next: {done: a, failed: .x, other: .x}}
"""
KEPT, BATCH = 12, 4


class Lines(list[str]):
    """An archive; there is no room in it after so many lines."""

    room = 10**9

    def append(self, line: str) -> None:
        if len(self) >= self.room:
            raise OSError(28, "no space left on device")
        super().append(line)


@pytest.fixture
def small(monkeypatch: pytest.MonkeyPatch) -> None:
    for module in ("engine.run.trace", "engine.run.life"):
        monkeypatch.setattr(f"{module}.KEPT", KEPT)
    for module in ("engine.run.trace", "engine.run.chart_run"):
        monkeypatch.setattr(f"{module}.BATCH", BATCH)


def went_round(archive: Any = None) -> tuple[Bench, list[str], int]:
    """A run of some rounds, what somebody read of it meanwhile, and the most records it held."""
    bench = Bench(ROUND)
    bench.run.trace.archive = archive
    read, most, seen = 0, 0, []
    for number in range(60):
        bench.end("a", "done", value=number / 3.0)
        bench.end("b", "done")
        bench.tick()
        seen += list(bench.run.trace.lines(read))
        read = bench.run.trace.end
        most = max(most, len(bench.run.trace.raw))
    return bench, seen, most


def test_rule_15_the_hash_and_the_archive_have_what_is_no_longer_kept(small: None):
    small_run, seen, most = went_round(Lines())
    assert most <= KEPT + BATCH
    assert small_run.run.trace.gone > 200
    with pytest.MonkeyPatch.context() as patch:
        for module in ("engine.run.trace", "engine.run.life"):
            patch.setattr(f"{module}.KEPT", 10**6)
        whole, _, _ = went_round()
    assert whole.run.trace.gone == 0
    assert small_run.run.trace.sha256() == whole.run.trace.sha256()
    assert list(small_run.run.trace.lines()) == list(whole.run.trace.lines()) == seen
    assert list(small_run.run.trace) == list(whole.run.trace)
    assert small_run.run.trace.path() == whole.run.trace.path()


def test_rule_15_without_an_archive_the_newest_are_there(small: None):
    bench, seen, _ = went_round()
    lines = list(bench.run.trace.lines())
    assert lines == seen[-len(lines) :]
    assert len(lines) < len(seen)
    assert bench.run.trace.sha256() == went_round(Lines())[0].run.trace.sha256()


def test_rule_15_a_full_archive_is_told_once_and_the_run_goes_on(small: None):
    archive = Lines()
    archive.room = 10
    bench, seen, most = went_round(archive)
    assert most <= KEPT + BATCH
    assert archive == seen[:10]
    assert [(error.path, error.kind) for error in bench.run.errors] == [("trace", "OSError")]
    assert bench.run.trace.sha256() == went_round()[0].run.trace.sha256()


@pytest.mark.parametrize("what", ["ticks", "notes", "errors"])
def test_rule_15_what_comes_without_an_entry_is_bounded_too(small: None, what: str):
    bench = Bench(ROUND)
    bench.tick()
    for number in range(1, 100):
        if what == "ticks":
            bench.run.recorded_tick(number * 10**8)  # in which nothing is entered
        elif what == "notes":
            bench.run.note(bench.run.nodes["a"], "so")
        else:
            bench.run.life.report(bench.run.life.root, ValueError("so"))
    assert len(bench.run.trace.raw) <= KEPT + 2 * BATCH
    assert bench.run.trace.end >= 100


def test_the_newest_are_kept_and_all_are_counted(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr("engine.run.errors.MOST", 3)
    found: Newest[int] = Newest()
    for number in range(5):
        assert found.since(number) == []
        found.append(number)
        assert found.since(number) == [number]
    assert (found, found.total) == ([2, 3, 4], 5)
    assert [found.since(n) for n in (0, 1, 2, 3, 5)] == [
        [2, 3, 4],
        [2, 3, 4],
        [2, 3, 4],
        [3, 4],
        [],
    ]


class Untidy(Action):
    """Fails to clean up."""

    outcomes = ("done",)

    def run(self, ctx: Context) -> Run:
        try:
            while True:
                yield
        finally:
            raise OSError("stuck")


def test_rule_7_a_clean_up_that_raises_is_known_by_its_leaf_after_any_number_of_errors(
    monkeypatch: pytest.MonkeyPatch,
):
    monkeypatch.setattr("engine.run.errors.MOST", 2)
    text = "chart: c\noutcomes: [x]\nstates:\n  a: {do: Untidy, next: {done: .x, error: a}}\n"
    bench = Bench(text, states=(Untidy,), scripted=False)
    for number in range(6):
        bench.tick()
        assert bench.run.errors.total == number
        assert bench.operator.force("a", "done") is None
    assert bench.run.outcome is None
    bench.run.close()
