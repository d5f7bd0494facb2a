"""The command `campaign`: nothing is run twice, and what it came to is told alike everywhere."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from collections import Counter
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from cobodeck.__main__ import main
from cobodeck.campaign.campaign_file import FOLDER, campaign_names, load_campaign
from cobodeck.campaign.cell_run import CellResult, CellRunner, run_cell, sha256_of
from cobodeck.campaign.product import cells_of
from cobodeck.campaign.result_store import NAME, ResultStore
from cobodeck.terminal.console import FAILED, OK, USAGE
from tests.program import ROOT
from tests.waiting import until

FILE = """campaign: tiny
about: for a test
scene: [lab_a, lab_b]
user: brief
set: {chase.risk: [3, 6]}
requests: 1
duration: 20 s
seeds: 5
"""


@pytest.fixture
def file(folder: Path) -> Path:
    path = folder / "tiny.yaml"
    path.write_text(FILE)
    return path


def keep(file: Path, out: Path, count: int) -> None:
    """Run these cells in this process, as an earlier campaign would have."""
    runner, store = CellRunner(), ResultStore(out)
    for cell in cells_of(load_campaign(file), count):
        store.keep(runner.result(cell, runner.address(cell)))
    store.close()


def printed(capsys: pytest.CaptureFixture[str], *words: str) -> dict[str, Any]:
    capsys.readouterr()
    assert main(["campaign", *words, "--json"]) == OK
    found: dict[str, Any] = json.loads(capsys.readouterr().out)
    return found


def lines(out: Path) -> list[str]:
    return (out / NAME).read_text().splitlines() if (out / NAME).exists() else []


@pytest.mark.slow
def test_a_campaign_that_was_run_is_told_and_not_run_again(
    file: Path, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = folder / "out"
    keep(file, out, 2)
    before = lines(out)

    found = printed(capsys, str(file), "--out", str(out), "--cells", "2", "--worst", "0")

    assert lines(out) == before
    assert found["campaign"] == "tiny"
    assert [cell["key"]["scene"] for cell in found["cells"]] == ["lab_a", "lab_b"]
    for cell in found["cells"]:
        assert cell["figures_sha256"] == sha256_of(cell["figures"])
        assert cell["figures"]["seed"] == cell["seed"]
    assert [table["name"] for table in found["parameters"]] == ["scene", "chase.risk"]
    assert found["failed"] == found["broken"] == []
    summary = json.loads((out / "summary.json").read_text())
    assert summary["sha256"] == found["sha256"]
    assert summary["cost"]["cpu_s"] > 0.0
    assert {"date", "machine", "versions"} <= summary.keys()
    assert "by robot" in (out / "summary.txt").read_text()
    for plot in ("scene.svg", "chase.risk.svg"):
        assert "<svg" in (out / plot).read_text()


@pytest.mark.slow
def test_what_is_not_as_expected_is_a_failure(
    file: Path, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    one = FILE.replace("[lab_a, lab_b]", "lab_a").replace("[3, 6]", "3")  # draws no plots
    file.write_text(one)
    keep(file, folder / "out", 1)
    words = ["campaign", str(file), "--out", "out", "--cells", "1", "--worst", "0"]
    file.write_text(f"{one}expect: {{unserved: 0}}\n")
    assert main(words) == OK

    kept = json.loads(lines(folder / "out")[0])
    (cell,) = cells_of(load_campaign(file), 1)
    store = ResultStore(folder / "out")
    store.keep(CellResult(cell, kept["address"], {**kept["figures"], "refused": 1}))
    store.close()
    assert main(words) == FAILED
    assert "not as expected: unserved: 1, at most 0 is expected" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["nothing"], "no such campaign"),
        (["hast"], "did you mean 'hasty'?"),
        (["hasty", "--scheduler", "tcp://127.0.0.1:1"], "--scheduler needs --executor dask"),
        (["hasty", "--executor", "dask", "--scheduler", "foo"], "foo: is no address"),
        (["hasty", "--worst", "-1"], "-1 is below 0"),
        (["hasty", "--executor", "slurm"], "invalid choice: 'slurm'"),
        (["hasty", "--cells", "0"], "0 is not above 0"),
    ],
)
def test_wrong_arguments_are_told(
    words: list[str], told: str, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["campaign", *words, "--out", str(folder / "out")]) == USAGE
    assert told in capsys.readouterr().err
    assert lines(folder / "out") == []


def test_a_wrong_file_runs_nothing(
    file: Path, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file.write_text(FILE.replace("lab_b", "lab_q"))

    assert main(["campaign", str(file), "--out", "out"]) == FAILED

    assert "tiny.yaml:3:16: scene[1]: lab_q: no such scene" in capsys.readouterr().err
    assert not (folder / "out").exists()


@pytest.mark.slow
def test_local_processes_and_dask_give_the_same_bits(
    file: Path, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("distributed")
    local = printed(capsys, str(file), "--out", "local", "--workers", "2", "--worst", "1")
    dask = printed(
        capsys, str(file), "--out", "dask", "--executor", "dask", "--workers", "2", "--worst", "0"
    )

    assert len(local["cells"]) == 20
    assert local["sha256"] == dask["sha256"]
    assert [c["figures_sha256"] for c in local["cells"]] == [
        c["figures_sha256"] for c in dask["cells"]
    ]
    (record,) = (folder / "local" / "worst").glob("*.mcap")
    assert "<svg" in record.with_suffix(".svg").read_text()


@pytest.mark.slow
def test_a_killed_campaign_goes_on_where_it_was(file: Path, folder: Path) -> None:
    out = folder / "out"
    command = [sys.executable, "-m", "cobodeck", "campaign", str(file), "--out", str(out),
               "--workers", "1", "--worst", "0", "--cells", "6"]  # fmt: skip
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    with subprocess.Popen(command, env=environment, start_new_session=True) as running:
        for _ in range(30):  # each for as long as `until` has patience
            try:
                until(lambda: len(lines(out)) >= 2)
                break
            except AssertionError:
                continue
        running.send_signal(signal.SIGKILL)
    before = lines(out)
    assert 2 <= len(before) < 6

    assert subprocess.run(command, env=environment, check=False).returncode == OK

    after = lines(out)
    whole = [json.loads(line)["address"] for line in after if line]
    assert after[: len(before) - 1] == before[:-1]
    assert set(Counter(whole).values()) == {1}
    assert len(whole) == 6


@pytest.mark.slow
@pytest.mark.parametrize("name", campaign_names())
def test_the_shipped_campaigns_in_a_short_form(name: str, folder: Path) -> None:
    campaign = load_campaign(FOLDER / f"{name}.yaml")
    (cell,) = cells_of(campaign, 1)
    short = replace(cell, requests=1, duration_s=90.0)

    figures = run_cell(short)

    assert figures["contacts_by_robot"] == 0
    assert figures["errors"] == []
    assert figures["wall_hits"] == figures["object_hits"] == 0
