"""What the benchmark measures is the same work everywhere, and its figures are what they say."""

import json
from pathlib import Path

import pytest

from cobodeck.__main__ import main
from cobodeck.bench import engine, harness, peers
from cobodeck.bench import engine_works as works
from cobodeck.bench.harness import BenchCase, BenchRow, Work
from cobodeck.commands.bench import slower
from cobodeck.console import FAILED, OK

STEPS_PER_TICK = {"pair": 2, "hundred": 100, "steps": 3, "guarded": 4}
NAMES = {
    "no new sample",
    "every tick recorded",
    "five fresh samples",
    "100 in parallel",
    "edge without timeout",
    "edge with timeout",
    "a lock set",
    "guard out of a two-leaf any",
    "guard out of a chart as in chase",
    "load and check 1000 leaves",
    "read 10000 numbers",
}


@pytest.mark.parametrize("kind", STEPS_PER_TICK)
def test_peers_step_no_oftener_than_ours_and_at_least_what_ends(kind: str) -> None:
    found = peers.found()
    if not found:
        pytest.skip("no peers are installed; pip install cobodeck[peers]")
    for name, peer in found.items():
        work = getattr(peer, kind)()
        work.run(10)
        calls = work.run.calls
        before = calls.count
        work.run(100)

        steps = (calls.count - before) / 100
        assert 1 <= steps <= STEPS_PER_TICK[kind], name
        if kind in ("pair", "hundred"):
            assert steps == STEPS_PER_TICK[kind], name


@pytest.mark.parametrize(
    ("charts", "transitions"),
    [
        ((works.PAIR,), 0),
        ((works.HUNDRED,), 0),
        ((works.STEPS,), 1),
        ((works.TIMED,), 1),
        ((works.GUARDED,), 1),
        ((works.CHASING, works.CHASE), 1),
    ],
)
def test_our_charts_take_as_many_transitions_per_tick_as_they_should(
    charts: tuple[str, ...], transitions: int
) -> None:
    run = works.started(*charts)
    run.trace.raw.clear()

    for now in works.NOWS[4:104]:
        run.tick(now)

    moves = sum(record.kind == "move" for record in run.trace)
    assert moves == 100 * transitions
    assert run.outcome is None


def test_a_lock_is_set_while_edges_are_taken() -> None:
    run = works.started(works.STEPS, lock="guard")

    assert run.judge.locks == {"guard"}
    assert sum(record.kind == "move" for record in run.trace) == 3


def test_five_signals_are_fresh_in_each_tick() -> None:
    run = works.started(works.PAIR)

    works.sampling(run).run(10)

    assert sorted(slot.evaluated for slot in run.board.inlets.values())[-6:] == [0, *[10] * 5]


def test_the_limit_steps_the_very_generators_of_the_chart() -> None:
    run = works.started(works.HUNDRED)

    generators = [leaf.generator for leaf in run.running]

    assert [step.__self__ for step in works.steps_of(run)] == generators  # type: ignore[attr-defined]


def test_the_large_chart_has_1000_leaves_and_no_mistake() -> None:
    from engine.check import check
    from engine.load import load_text
    from engine.machine import Machine

    library = load_text(works.large_chart())

    assert not check(library, works.INTERFACES)
    assert len(Machine(library["large"], library, works.INTERFACES).leaves) == 1000


def test_the_rows_have_the_agreed_names() -> None:
    assert {case.name for case in engine.cases({})} == NAMES


def test_times_are_medians_and_ratios_are_of_the_same_round(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    durations = iter([1.0, 2.0, 1.0, 3.0, 10.0, 50.0, 2.0, 8.0])  # first two: `_prepare`
    monkeypatch.setattr(harness, "seconds_of", lambda work, count: next(durations) * count)
    nothing = Work(lambda count: None)
    case = BenchCase("x", nothing, "bare", {"cobodeck": nothing}, goal=3.5)

    (row,) = harness.measure("b", case, rounds=3, round_s=1.0)

    assert row.time_us == pytest.approx(8e6)
    assert row.ratio == pytest.approx(4.0)  # of 3, 5 and 4
    assert row.spread == pytest.approx(2.0)  # between the quartiles of these, 3 and 5
    assert (row.bench, row.name, row.ratio_to, row.goal) == ("b", "x", "bare", 3.5)


def result(ratio: float) -> dict[str, object]:
    row = BenchRow("b", "x", "cobodeck", ratio=ratio, ratio_to="bare", time_us=1.0, goal=4.0)
    machine = {"name": "M", "cores": 2, "system": "S", "python": "P"}
    return {"machine": machine, "rows": [row.plain(), {**row.plain(), "variant": "peer"}]}


def test_a_ratio_that_has_grown_is_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "now.json").write_text(json.dumps(result(3.0)))
    (tmp_path / "before.json").write_text(json.dumps(result(2.0)))
    now, before = str(tmp_path / "now.json"), str(tmp_path / "before.json")

    assert main(["bench", "--show", now, "--compare", before]) == FAILED
    assert "worse: b x: ratio 3, was 2" in capsys.readouterr().out
    assert main(["bench", "--show", before, "--compare", now]) == OK
    assert not list(slower(result(2.4)["rows"], result(2.0)["rows"]))  # type: ignore[arg-type]
