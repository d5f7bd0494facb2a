"""Seeds of cells depend on the world alone, addresses on all that decides the figures."""

from __future__ import annotations

import json
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, strategies as st

from cobodeck.__main__ import main
from cobodeck.campaign.cell import CampaignCell
from cobodeck.campaign.cell_run import OF_THE_MACHINE, CellRunner, run_cell, sha256_of
from cobodeck.campaign.execution import execute
from cobodeck.record.format import record_header
from cobodeck.record.format.record_header import versions
from cobodeck.terminal.console import Problem
from engine.files import FileError

WORLD = {"scene": "lab_b", "user": "demo", "requests": 3, "duration_s": 60.0, "repetition": 1}
COMPARED = {
    "chart": "patrol",
    "robot": "rbkairos_ur10",
    "profile": "paper",
    "sets": ("chase.risk=3",),
    "inputs": ("a=1",),
    "tier": 2,
    "tick_hz": 60,
    "judge": True,
}
BRIEF = CampaignCell(user="brief", requests=1)
names = st.sampled_from(["lab_a", "study", "own.yaml", "random:hasty"])
cells = st.builds(
    CampaignCell,
    scene=names,
    user=st.none() | names,
    requests=st.none() | st.integers(1, 20),
    repetition=st.integers(0, 2000),
)


def changed(name: str, value: Any) -> CampaignCell:
    return replace(BRIEF, **{name: value})


def test_each_field_is_of_the_world_or_compared() -> None:
    assert {field.name for field in fields(CampaignCell)} == WORLD.keys() | COMPARED.keys()


@pytest.mark.parametrize(("name", "value"), WORLD.items())
def test_another_world_has_another_seed(name: str, value: Any) -> None:
    assert changed(name, value).seed != BRIEF.seed


@pytest.mark.parametrize(("name", "value"), COMPARED.items())
def test_what_is_compared_meets_the_same_people(name: str, value: Any) -> None:
    assert changed(name, value).seed == BRIEF.seed


@given(cells)
def test_a_seed_has_32_bits_and_is_the_same_wherever_files_lie(cell: CampaignCell) -> None:
    elsewhere = replace(cell, scene=f"/somewhere/else/{cell.scene}")

    assert 0 <= cell.seed < 2**32
    assert elsewhere.seed == cell.seed
    assert elsewhere.content() == cell.content()


@given(cells, cells)
def test_a_key_tells_cells_apart_and_is_plain_json(one: CampaignCell, other: CampaignCell) -> None:
    assert (one.key() == other.key()) == (one == other)
    assert json.loads(json.dumps(one.key())) == one.key()


def test_seeds_of_a_thousand_repetitions_are_all_different() -> None:
    assert len({changed("repetition", n).seed for n in range(1000)}) == 1000


@pytest.mark.slow
def test_figures_are_those_of_simulate(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["simulate", "--user", "brief", "--requests", "1", "--seed", str(BRIEF.seed), "--json"]
    assert main(words) == 0
    printed = json.loads(capsys.readouterr().out)

    figures = run_cell(BRIEF)

    assert printed.keys() - figures.keys() == {"trace_file", "record_file", *OF_THE_MACHINE} & (
        printed.keys()
    )
    assert figures == {name: printed[name] for name in figures}


def test_a_runner_that_has_run_others_gives_the_same_bits() -> None:
    runner = CellRunner()
    runner.run(changed("user", "random"))

    assert sha256_of(runner.run(BRIEF)) == sha256_of(CellRunner().run(BRIEF))


@pytest.mark.parametrize(
    ("name", "value"), [*WORLD.items(), ("profile", "paper"), ("sets", ("chase.risk=3",)),
                        ("tier", 2), ("tick_hz", 60), ("chart", "inform")],
)  # fmt: skip
def test_whatever_decides_figures_is_in_the_address(name: str, value: Any) -> None:
    runner = CellRunner()

    assert runner.address(changed(name, value)) != runner.address(BRIEF)


def test_libraries_that_decide_figures_are_in_the_address() -> None:
    assert {"numpy", "numba", "mujoco"} <= versions().keys()


def test_code_that_has_changed_since_this_process_loaded_it_is_not_taken_for_what_it_runs(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    copy = folder / "program"
    (copy / "engine").mkdir(parents=True)
    file = copy / "engine" / "module.py"
    file.write_text("VALUE = 1")
    monkeypatch.setattr(record_header, "ROOT", copy)
    before = CellRunner().address(BRIEF)

    file.write_text("VALUE = 2")

    assert CellRunner().address(BRIEF) == before  # so it still runs what it then ran
    record_header._folder_sha256.cache_clear()  # as in a new process
    assert CellRunner().address(BRIEF) != before


def test_two_cells_of_one_address_are_refused(folder: Path) -> None:
    shipped = (Path(__file__).parents[3] / "hw" / "scenes" / "lab_a.yaml").read_text()
    cells = []
    for name in ("one", "two"):
        (folder / name).mkdir()
        (folder / name / "own.yaml").write_text(shipped)
        cells.append(replace(BRIEF, scene=str(folder / name / "own.yaml")))

    with pytest.raises(Problem, match="one result would be that of two cells"):
        next(execute(cells, workers=1))


def test_figures_are_the_same_wherever_files_lie(folder: Path) -> None:
    shipped = (Path(__file__).parents[3] / "hw" / "users" / "brief.yaml").read_text()
    found = []
    for name in ("one", "two"):
        (folder / name).mkdir()
        (folder / name / "own.yaml").write_text(shipped)
        user = str(folder / name / "own.yaml")
        found.append(run_cell(CampaignCell(user=user, requests=1, duration_s=1.0)))

    assert found[0]["user"] == "own.yaml"
    assert sha256_of(found[0]) == sha256_of(found[1])


@pytest.mark.parametrize(
    ("name", "value", "told"),
    [("tick_hz", 7, "at 7 Hz"), ("sets", ("plant.latency=1",), "at 30 Hz")],
)
def test_what_cannot_run_is_told_by_a_check(name: str, value: Any, told: str) -> None:
    CellRunner().check(BRIEF)

    with pytest.raises(Problem, match=told):
        CellRunner().check(changed(name, value))


def test_people_of_other_speeds_are_other_people() -> None:
    runner = CellRunner()
    slow, fast = (changed("user", f"random at {speed} m/s") for speed in (1, 2))

    assert slow.seed != fast.seed
    assert runner.address(slow) != runner.address(fast)


def test_a_changed_file_is_another_address(folder: Path) -> None:
    shipped = Path(__file__).parents[3] / "hw"
    texts = {
        "scene": (shipped / "scenes" / "lab_a.yaml").read_text(),
        "user": (shipped / "users" / "brief.yaml").read_text(),
        "profile": "profile: own\nbase: tuned\nchase: {inner: 2.7 m}\n",
    }
    changes = {
        "scene": ("x: 1.6", "x: 1.7"), "user": ("stand: 2", "stand: 3"),
        "profile": ("2.7", "2.8"),
    }  # fmt: skip
    files = {name: folder / f"{name}.yaml" for name in texts}
    for name, file in files.items():
        file.write_text(texts[name])
    cell = CampaignCell(requests=1, **{name: str(file) for name, file in files.items()})
    before = CellRunner().address(cell)
    assert CellRunner().address(cell) == before

    for name, (old, new) in changes.items():
        assert old in texts[name], name
        files[name].write_text(texts[name].replace(old, new, 1))
        assert CellRunner().address(cell) != before, name
        files[name].write_text(texts[name])


@pytest.mark.parametrize(
    ("name", "value"), [("scene", "lab_z"), ("user", "nobody"), ("sets", ("chase.rist=3",))]
)
def test_what_is_not_there_is_told_before_anything_runs(name: str, value: Any) -> None:
    with pytest.raises((FileError, Problem)):
        CellRunner().address(changed(name, value))


def test_a_cell_that_cannot_run_says_why_and_has_no_figures() -> None:
    found = CellRunner().result(BRIEF, "of other code")

    assert found.figures is None
    assert found.figures_sha256 is None
    assert found.failure is not None
    assert "other code than the client" in found.failure


def test_without_projects_their_charts_are_not_run(fatal: Path) -> None:
    with pytest.raises((FileError, Problem), match="no chart 'always'"):
        run_cell(CampaignCell(chart="always"), own=False)
