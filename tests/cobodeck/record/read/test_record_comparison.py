"""Two records side by side: what was run, what came out, and the first instant that differs."""

from __future__ import annotations

import json
import re
import shutil
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from cobodeck.__main__ import main
from cobodeck.record.read.reader import Group, Record, RecordedMessage
from cobodeck.record.read.record_comparison import (
    Comparison,
    Figure,
    FigureTolerance,
    Motions,
    Traces,
    compare,
)
from cobodeck.terminal.console import FAILED, OK, USAGE

ROOT = Path(__file__).parents[4]
RUNS = {
    "demo": (),
    "again": ("--user", "demo"),  # that of the scene
    "eager": ("--no-skip",),
    "paper": ("--profile", "paper"),
    "one": ("--user", "random", "--seed", "1"),
    "two": ("--user", "random", "--seed", "2"),
}
Shown = Callable[..., tuple[int, str]]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    found = tmp_path_factory.mktemp("records")
    for name, given in RUNS.items():
        simulated(found / f"{name}.mcap", *given)
    return found


def simulated(path: Path, *given: str) -> None:
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(path.parent)
        assert main(["simulate", "--duration", "14", "--record", path.name, *given]) == OK


@pytest.fixture
def shown(folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: Any) -> Shown:
    monkeypatch.chdir(folder)

    def show(*given: str) -> tuple[int, str]:
        capsys.readouterr()
        code = main(["compare", *given])
        return code, capsys.readouterr().out

    return show


def line_of(text: str, start: str) -> list[str]:
    [found] = [line.split() for line in text.splitlines() if line.strip().startswith(start)]
    return found


def test_the_same_run_twice_is_equal_and_only_the_machine_differs(shown: Shown) -> None:
    code, text = shown("demo.mcap", "again.mcap")

    assert code == OK
    assert "what was run: the same" in text
    assert "figures: the same" in text
    assert line_of(text, "wall_s")
    assert "traces: equal, " in text
    assert "motion: equal within 1 mm and 1 mrad" in text


def test_ticks_that_were_left_out_are_no_difference_in_what_came_out(shown: Shown) -> None:
    code, text = shown("demo.mcap", "eager.mcap")

    assert code == OK
    assert line_of(text, "eager") == ["eager", "False", "True"]
    assert line_of(text, "left_out")[2] == "0"
    assert line_of(text, "flowing") == ["flowing", "-", "only", "bumper.hit"]


def test_of_two_profiles_every_figure_that_differs_is_shown_with_its_difference(
    shown: Shown, folder: Path
) -> None:
    code, text = shown("demo.mcap", "paper.mcap")
    a, b = (figures_of(folder / name) for name in ("demo.mcap", "paper.mcap"))

    assert code == FAILED
    assert line_of(text, "profile")[1::2] == ["tuned", "paper"]
    assert line_of(text, "navigation.chase.tolerance")[1:] == ["5", "cm", "20", "cm"]
    assert re.search(r"file charts/profiles/paper.yaml +- +[0-9a-f]{12}\n", text)
    found = line_of(text, "distance_m")
    change = b["distance_m"] - a["distance_m"]
    assert float(found[1]) == pytest.approx(a["distance_m"], rel=1e-5)
    assert float(found[3]) == pytest.approx(change, rel=1e-3)
    assert float(found[4].rstrip("%")) == pytest.approx(100 * change / a["distance_m"], abs=0.06)
    assert "wall_hits" not in text
    assert "wall_hits" in shown("demo.mcap", "paper.mcap", "--all")[1]
    assert max(map(len, text.splitlines())) <= 100


def figures_of(path: Path) -> Any:
    record = Record(path)
    list(record.groups())
    return record.result


def test_of_two_seeds_the_first_instants_of_trace_and_motion_are_told(shown: Shown) -> None:
    code, text = shown("one.mcap", "two.mcap", "--json")
    found = json.loads(text)

    assert code == FAILED
    assert found["headers"] == [{"what": "seed", "a": 1, "b": 2}]
    trace = found["trace"]
    first = [json.loads(trace[name]) for name in "ab"]
    assert trace["at_s"] == min(line[0] for line in first) / 1e9
    assert trace["last_move"]["at_s"] < trace["at_s"]
    assert trace["last_move"]["next"] == "approach"
    assert found["motion"]["person"]["at_s"] < found["motion"]["base"]["at_s"] < trace["at_s"]
    assert found["figures"]["distance_m"]["same"] is False
    assert found["figures"]["wall_s"]["computing"] is True
    assert found["figures"]["cpu_us_per_tick"]["computing"] is True


def test_a_record_that_breaks_off_is_equal_up_to_there(shown: Shown, folder: Path) -> None:
    data = (folder / "demo.mcap").read_bytes()
    (folder / "cut.mcap.part").write_bytes(data[: len(data) * 2 // 3])
    code, text = shown("cut.mcap.part", "demo.mcap")

    assert code == FAILED
    end_s = list(Record(folder / "cut.mcap.part").groups())[-1].ticked.at_ns / 1e9
    assert f"A  cut.mcap.part, {end_s:.1f} s; it breaks off" in text
    assert f"over; the record ends at {end_s:.3f} s" in text
    assert "none in A, which did not come to an end" in text
    assert "motion: equal" in text
    whole = compare(Record(folder / "demo.mcap"), Record(folder / "demo.mcap")).traces
    cut = compare(Record(folder / "cut.mcap.part"), Record(folder / "demo.mcap")).traces
    assert 0 < cut.equal < whole.equal
    assert f"traces: equal for {cut.equal} records, to the end of A" in text


@pytest.mark.slow
def test_a_chart_is_compared_with_that_of_the_same_name_wherever_both_lay(
    tmp_path: Path, capsys: Any
) -> None:
    for name, still in (("here", "0.5 s"), ("there", "0.8 s")):
        shutil.copytree(ROOT / "charts", tmp_path / name)
        chart = tmp_path / name / "chase.yaml"
        chart.write_text(chart.read_text().replace("default: 0.5 s", f"default: {still}"))
        simulated(tmp_path / f"{name}.mcap", str(tmp_path / name / "cobodeck.yaml"))
    capsys.readouterr()
    main(["compare", str(tmp_path / "here.mcap"), str(tmp_path / "there.mcap")])
    told = capsys.readouterr().out.partition("what was run\n")[2].splitlines()

    assert told[0] == "  chart chase: 1 line differs"
    assert re.match(r"      A 5: still_for: .*default: 0\.5 s", told[1])
    assert re.match(r"      B 5: still_for: .*default: 0\.8 s", told[2])
    assert told[3] == ""


@pytest.mark.slow
def test_of_texts_some_lines_that_differ_are_shown(tmp_path: Path, capsys: Any) -> None:
    text = (ROOT / "tests/behaviors/profile/spelled_out.yaml").read_text()
    profile = tmp_path / "mine.yaml"
    for name, speed in (("a", "2.0"), ("b", "1.5")):
        lines = [
            f"  base_speed: {speed} m/s" if line.startswith("  base_speed:") else line
            for line in text.splitlines()
        ]
        profile.write_text("\n".join([f"profile: {name}", *lines[1:]]))
        simulated(tmp_path / f"{name}.mcap", "--profile", str(profile))
    capsys.readouterr()
    main(["compare", str(tmp_path / "a.mcap"), str(tmp_path / "b.mcap")])
    told = capsys.readouterr().out

    number = 1 + next(n for n, line in enumerate(lines) if line.startswith("  base_speed:"))
    assert re.search(r"robot\.base_speed +2\.0 m/s +1\.5 m/s\n", told)
    assert "/mine.yaml: 2 lines differ" in told
    assert "A 1: profile: a" in told
    assert f"A {number}: base_speed: 2.0 m/s" in told
    assert f"B {number}: base_speed: 1.5 m/s" in told


def test_one_figure_or_one_record_of_the_trace_is_enough_to_differ() -> None:
    def same(traces: Traces, *figures: Figure) -> bool:
        return Comparison((), figures, traces, Motions(), (0, 0), (None, None)).same

    machine = Figure("wall_s", 1.0, 2.0), Figure("signals.base.pose.evaluated", 3, 4)
    assert same(Traces(), *machine, Figure("contacts", 0, 0), Figure("outcome", None, None))
    assert not same(Traces(), Figure("contacts", 0, 1))
    assert not same(Traces(), Figure("served", 0, None))
    assert not same(Traces(at_ns=0), Figure("contacts", 0, 0))


@pytest.mark.parametrize(
    ("a", "b", "is_same"),
    [
        (2.9e-15, 4.0e-15, True),  # +37.7 %
        (0.0, 1e-15, True),
        (0.0, 1e-6, False),
        (1e6, 1e6 + 1e-4, True),
        (1e6, 1e6 + 1e-2, False),
        (3, 3.0, True),
        (1, 2, False),
        (True, 1, False),
        ([1.0, [2.0]], [1.0, [2.0 + 1e-12]], True),
        ([1.0], [1.0, 1.0], False),
        ([{"x": 1.0}], [{"x": 1.1}], False),
        ([{"x": 1.0}], [{"x": 1.0 + 1e-12}], True),
        (None, 0, False),
        ("a", "b", False),
    ],
)
def test_figures_that_differ_by_rounding_are_the_same(a: Any, b: Any, is_same: bool) -> None:
    assert Figure("distance_m", a, b).same is is_same
    assert Figure("distance_m", b, a).same is is_same


def test_how_far_figures_may_differ_can_be_said() -> None:
    assert not Figure("distance_m", 0.0, 1e-15, FigureTolerance(0.0, 0.0)).same
    assert Figure("distance_m", 5.0, 5.04, FigureTolerance(0.05, 0.0)).same
    assert not Figure("distance_m", 5.0, 5.06, FigureTolerance(0.05, 0.0)).same
    assert Figure("distance_m", 100.0, 101.0, FigureTolerance(0.0, 0.01)).same


def test_the_command_takes_the_tolerance_of_figures(shown: Shown) -> None:
    exact = json.loads(shown("one.mcap", "two.mcap", "--json")[1])["figures"]
    near = json.loads(shown("one.mcap", "two.mcap", "--json", "--tolerance", "1e9")[1])["figures"]

    assert not exact["distance_m"]["same"]
    assert near["distance_m"]["same"]


@pytest.mark.parametrize("given", ["-1", "nan", "a", "1,2,3", ""])
def test_a_tolerance_that_is_none_is_refused(
    given: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["compare", "a.mcap", "b.mcap", f"--tolerance={given}"]) == USAGE
    assert "is not ABS or ABS,REL" in capsys.readouterr().err


class Changed(Record):
    """A record of which each tick may be changed."""

    change: Callable[[Group], Group] | None = None

    def groups(self) -> Iterator[Group]:
        assert self.change is not None
        yield from map(self.change, super().groups())


def changed(path: Path, change: Callable[[Group], Group]) -> Changed:
    record = Changed(path)
    record.change = change
    return record


@pytest.mark.parametrize(("by", "from_s"), [(0.0009, None), (0.0011, 5.0)])
def test_a_base_elsewhere_by_more_than_a_millimetre_is_told(
    folder: Path, by: float, from_s: float | None
) -> None:
    def change(group: Group) -> Group:
        if group.ticked.at_ns < 5 * 10**9:
            return group
        return replace(group, told=tuple(moved(told, by) for told in group.told))

    record = Record(folder / "demo.mcap")
    motions = compare(record, changed(folder / "demo.mcap", change)).motions

    assert motions.known
    assert motions.person is None
    assert (None if motions.base is None else motions.base[0] / 1e9) == from_s


def moved(told: RecordedMessage, by: float) -> RecordedMessage:
    if told.topic != "truth":
        return told
    found = json.loads(told.data)
    found["base"]["Pose2"][0] += by
    return told._replace(data=json.dumps(found).encode())


def test_notes_do_not_count_and_altered_ticks_are_told(folder: Path) -> None:
    note = RecordedMessage(
        "trace", "cobodeck.Trace", b'{"line":[7000000000,"note","chase","seen"]}', 7 * 10**9
    )

    def change(group: Group) -> Group:
        if group.ticked.at_ns != 7 * 10**9:
            return group
        return replace(group, told=(*group.told, note), altered=True)

    found = compare(Record(folder / "demo.mcap"), changed(folder / "demo.mcap", change))

    assert found.same
    assert found.altered_ns == (None, 7 * 10**9)


def test_without_the_truth_nothing_is_said_of_the_motion(folder: Path) -> None:
    def change(group: Group) -> Group:
        return replace(group, told=tuple(t for t in group.told if t.topic != "truth"))

    found = compare(Record(folder / "demo.mcap"), changed(folder / "demo.mcap", change))

    assert not found.motions.known
    assert found.same


def test_what_is_no_record_is_told(tmp_path: Path, folder: Path, capsys: Any) -> None:
    shutil.copy(ROOT / "README.md", tmp_path / "a.mcap")

    assert main(["compare", str(tmp_path / "a.mcap"), str(folder / "demo.mcap")]) == FAILED
    assert "a.mcap: is no record of a run" in capsys.readouterr().err
