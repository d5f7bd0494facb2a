"""What the benchmark measures is the same work everywhere, and its figures are what they say."""

import json
import tempfile
from pathlib import Path

import pytest
from hypothesis import given, strategies as st

import cobodeck.__main__
import cobodeck.commands.bench
from cobodeck.__main__ import main
from cobodeck.bench import harness, peers
from cobodeck.bench.compare import LESS_EXACT, SLOWER, SPREADS, worse
from cobodeck.bench.engine import engine_bench, engine_works as works
from cobodeck.bench.harness import BenchRow, Work
from cobodeck.terminal.console import FAILED, OK, USAGE

STEPS_PER_TICK = {"pair": 2, "parallel": 100, "steps": 3, "guarded": 4}
NAMES = {
    "no new sample",
    "every tick recorded",
    "every tick recorded, long run",
    "fresh samples",
    "in parallel",
    "edge without timeout",
    "edge with timeout",
    "a lock set",
    "guard out of a two-leaf any",
    "guard out of a chart as in chase",
    "load and check",
    "read numbers",
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
        if kind in ("pair", "parallel"):
            assert steps == STEPS_PER_TICK[kind], name


@pytest.mark.parametrize(
    ("charts", "transitions"),
    [
        ((works.PAIR,), 0),
        ((works.parallel(100),), 0),
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

    works.sampling(run, 5).run(10)

    assert sorted(slot.evaluated for slot in run.board.inlets.values())[-6:] == [0, *[10] * 5]


@pytest.mark.parametrize("long", [False, True])
def test_records_leave_the_memory_in_a_long_run_only(long: bool) -> None:
    run = works.started(works.PAIR)
    work = works.recording(run, long)
    before = run.board.ticks, run.trace.end

    harness.seconds_of(work, 20 * len(works.NOWS) + 7)

    assert run.board.ticks - before[0] == 20 * len(works.NOWS) + 7
    assert (run.trace.gone > 0) == long
    assert (run.trace.end - before[1] > 80_000) == long


def test_the_limit_steps_the_very_generators_of_the_chart() -> None:
    run = works.started(works.parallel(100))

    generators = [leaf.generator for leaf in run.running]

    assert [step.__self__ for step in works.steps_of(run)] == generators  # type: ignore[attr-defined]


def test_the_large_chart_has_1000_leaves_and_no_mistake() -> None:
    from engine.chart.load import load_text
    from engine.check.all_checks import check
    from engine.machine.machine import Machine

    library = load_text(works.large_chart())

    assert not check(library, works.INTERFACES)
    assert len(Machine(library["large"], library, works.INTERFACES).leaves) == 1000


def test_the_rows_have_the_agreed_names() -> None:
    assert {case.name for case in engine_bench.cases({})} == NAMES


def test_times_are_medians_and_ratios_are_of_the_same_round(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    durations = iter([1.0, 2.0, 1.0, 3.0, 10.0, 50.0, 2.0, 8.0])  # first two: `_prepare`
    monkeypatch.setattr(harness, "seconds_of", lambda work, count: next(durations) * count)
    nothing = Work(lambda count: None)
    asked = BenchRow("b", "x", "cobodeck", goal=3.5)

    (row,) = harness.timed([(asked, nothing)], 3, 1.0, limit=nothing, limit_name="bare")

    assert row.time_us == pytest.approx(8e6)
    assert row.ratio == pytest.approx(4.0)  # of 3, 5 and 4
    assert row.spread == pytest.approx(2.0)  # between the quartiles of these, 3 and 5
    assert (row.bench, row.name, row.ratio_to, row.goal) == ("b", "x", "bare", 3.5)


def result(ratio: float) -> dict[str, object]:
    row = BenchRow("b", "x", "cobodeck", ratio=ratio, ratio_to="bare", time_us=1.0, goal=4.0)
    machine = {"name": "M", "cores": 2, "system": "S", "python": "P", "load": 0.5}
    peer = {**row.plain(), "variant": "other", "peer": True}
    return {"machine": machine, "rows": [row.plain(), peer]}


def test_a_ratio_that_has_grown_is_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "now.json").write_text(json.dumps(result(4.0)))
    (tmp_path / "before.json").write_text(json.dumps(result(2.0)))
    now, before = str(tmp_path / "now.json"), str(tmp_path / "before.json")

    assert main(["bench", "--show", now, "--compare", before]) == FAILED
    assert "worse: b x: ratio 4, was 2" in capsys.readouterr().out
    assert main(["bench", "--show", before, "--compare", now]) == OK
    assert not list(worse(result(2.4)["rows"], result(2.0)["rows"]))  # type: ignore[arg-type]


def point(**figures: float) -> dict[str, object]:
    return BenchRow("b", "x", "cobodeck", "step", 0.1, ratio_to="unit", **figures).plain()  # type: ignore[arg-type]


@given(
    ratio=st.floats(1e-6, 1e3), spread=st.floats(0.0, 1e3), other=st.floats(0.0, 1e3),
    growth=st.floats(1.0, 3.0),
)  # fmt: skip
def test_noise_is_no_slowness(ratio: float, spread: float, other: float, growth: float) -> None:
    """Within the spread of either result nothing is told, beyond it and the threshold all is."""
    before, now = point(ratio=ratio, spread=spread), point(ratio=growth * ratio, spread=other)
    limit = max(SLOWER * ratio, ratio + SPREADS * max(spread, other))

    told = list(worse([now], [before]))

    assert len(told) == (growth * ratio > limit)
    assert all(line.startswith("worse: b x, step 0.1: ratio") for line in told)
    assert not list(worse([before], [before]))


@given(error=st.floats(0.0, 1e3), growth=st.floats(1.0, 2.0))
def test_an_error_that_has_grown_is_told_but_rounding_is_not(error: float, growth: float) -> None:
    told = list(worse([point(error=growth * error)], [point(error=error)]))

    assert len(told) == (growth * error > max(LESS_EXACT * error, 1e-9))
    assert not list(worse([point(error=1e-15)], [point(error=0.0)]))
    assert list(worse([point(error=1e-3)], [point(error=0.0)]))


@given(error=st.floats(-1e3, 1e3), lost=st.floats(-1e3, 1e3))
def test_a_gap_that_has_grown_is_better(error: float, lost: float) -> None:
    before = {**point(error=error), "more_is_better": True}
    now = {**before, "error": error - lost}
    told = list(worse([now], [before]))

    fell = error - now["error"]  # type: ignore[operator]
    assert len(told) == (fell > max((LESS_EXACT - 1.0) * abs(error), 1e-9))


@pytest.mark.parametrize(("now", "told"), [(600.0, 0), (2000.0, 0), (100.0, 1)])
def test_a_speed_that_has_grown_is_better(now: float, told: int) -> None:
    before = {**point(ratio=500.0), "more_is_better": True}

    assert len(list(worse([{**before, "ratio": now}], [before]))) == told


def test_an_error_that_is_no_longer_known_is_told() -> None:
    before, now = point(error=0.2, ratio=1.0), point(ratio=1.0)

    assert list(worse([now], [before])) == ["lost: b x, step 0.1: error, was 0.2"]
    assert not list(worse([before], [now]))


def test_what_is_compared_is_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    here, there = tmp_path / "here.json", tmp_path / "there.json"
    other = BenchRow("c", "y", "cobodeck", error=1.0).plain()
    here.write_text(json.dumps(RESULT))
    there.write_text(json.dumps({**RESULT, "rows": [other]}))

    assert main(["bench", "--show", str(here), "--compare", str(here)]) == OK
    assert f"1 of 2 rows compared with {here}" in capsys.readouterr().out
    assert main(["bench", "--show", str(here), "--compare", str(there)]) == USAGE
    assert "there.json: it has none of these rows" in capsys.readouterr().err


def test_ratios_to_different_work_are_not_compared() -> None:
    before = {**point(ratio=1.0), "ratio_to": "another unit"}

    assert not list(worse([point(ratio=9.0)], [before]))


def test_several_results_are_shown_as_one_but_not_as_one_object(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    files = [str(tmp_path / f"{name}.json") for name in "ab"]
    for file, ratio in zip(files, (2.0, 3.0), strict=True):
        Path(file).write_text(json.dumps(result(ratio)))

    assert main(["bench", "--show", *files]) == OK
    assert capsys.readouterr().out.count("M, 2 cores, S, P, load 0.5") == 2
    assert main(["bench", "--show", *files, "--json"]) == USAGE


def test_a_unit_is_a_million_passes() -> None:
    work = harness.UNIT

    assert harness._pass() == sum(i & 7 for i in range(1_000_000))
    assert work.items == 1


def test_the_quantile_of_several_works_is_above_their_mean() -> None:
    row = BenchRow("b", "x", "cobodeck", error=1.0, error_unit="m")
    works = [Work(harness.times(lambda n=n: sum(range(n)))) for n in (10, 10, 10, 20_000)]  # type: ignore[misc]

    mean, late = harness.timed_each(row, works, 1, 0.95)

    assert (mean.name, mean.error, late.name, late.error) == ("x", 1.0, "x, 95% quantile", None)
    assert late.ratio > mean.ratio > 0.0  # type: ignore[operator]


RESULT = result(3.0)
ANYTHING = st.one_of(
    st.none(), st.booleans(), st.integers(), st.just(10**400), st.floats(), st.text(max_size=3),
    st.just([]), st.just({}), st.just([1]), st.just({"a": 1}),
)  # fmt: skip


def places(found: object, path: tuple[object, ...] = ()) -> list[tuple[object, ...]]:
    """Paths of everything in a JSON value; of lists, of the first two entries."""
    inside = found.items() if isinstance(found, dict) else ()
    inside = enumerate(found[:2]) if isinstance(found, list) else inside
    return [path, *(one for key, value in inside for one in places(value, (*path, key)))]


def damaged(data: bytes, draw: st.DataObject) -> bytes:
    how = draw.draw(st.sampled_from(["value", "left out", "cut", "flipped"]))
    if how == "cut":
        return data[: draw.draw(st.integers(0, len(data) - 1))]
    if how == "flipped":
        bit = draw.draw(st.integers(0, 8 * len(data) - 1))
        return data[: bit // 8] + bytes([data[bit // 8] ^ 1 << bit % 8]) + data[bit // 8 + 1 :]
    found = json.loads(data)
    *way, last = draw.draw(st.sampled_from(places(found)[1:]))
    inside = found
    for key in way:
        inside = inside[key]
    if how == "value":
        inside[last] = draw.draw(ANYTHING)
    else:
        del inside[last]
    return json.dumps(found).encode()


@given(draw=st.data())
def test_a_damaged_result_is_told_in_a_sentence(draw: st.DataObject) -> None:
    """Shown or compared with, it ends in order, and nothing is raised."""
    with tempfile.TemporaryDirectory() as folder, pytest.MonkeyPatch.context() as patch:
        told: list[str] = []
        patch.setattr(cobodeck.__main__, "complain", told.append)
        patch.setattr(cobodeck.commands.bench, "show", lambda _: None)
        path = Path(folder) / "result.json"
        path.write_bytes(damaged(json.dumps(RESULT).encode(), draw))
        good = Path(folder) / "good.json"
        good.write_text(json.dumps(RESULT))

        for arguments in (["--show", str(path)], ["--show", str(good), "--compare", str(path)]):
            code = main(["bench", *arguments])
            assert code in (OK, FAILED, USAGE)
            assert (code == USAGE) == bool(told)
            assert len(told) <= 1
            assert all(line.startswith(str(path)) for line in told)
            told.clear()


def with_error(text: str) -> bytes:
    """A result with this as an error in it."""
    return json.dumps(RESULT).replace('"error": null', f'"error": {text}', 1).encode()


@pytest.mark.parametrize(
    ("data", "told"),
    [
        (b"[]", "it has no list of `rows`"),
        (b'{"rows": [], "machine": {}}', "`machine` does not say name"),
        (b"[" * 100_000, "recursion"),
        (with_error("1" + "0" * 400), "which is no number"),
        (with_error("NaN"), "which is no number"),
        (with_error("-Infinity"), "which is no number"),
        (with_error("9" * 5000), "digits"),
        (json.dumps(RESULT).replace("0.5", '"much"').encode(), "load of `machine` is no number"),
    ],
)
def test_what_is_no_result_is_told(
    data: bytes, told: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "x.json").write_bytes(data)

    assert main(["bench", "--show", str(tmp_path / "x.json")]) == USAGE
    found = capsys.readouterr().err
    assert "not the output of `cobodeck bench --json`" in found
    assert told in found
