"""Worker processes: the same figures as in this process, also where workers die."""

from __future__ import annotations

import multiprocessing
import os
import signal
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from cobodeck.campaign.cell import CampaignCell
from cobodeck.campaign.cell_run import CellResult, run_cell, sha256_of
from cobodeck.campaign.execution import execute

pytestmark = pytest.mark.slow
CELLS = [CampaignCell(user="brief", requests=1, duration_s=20.0, repetition=n) for n in range(6)]
STATES = '''import os
import signal
from pathlib import Path

from engine import Action, Context, Run


class Fatal(Action):
    """Kills its process, so many times."""

    outcomes = ("survived",)

    def __init__(self, times: int) -> None:
        self.times = times

    def run(self, ctx: Context) -> Run:
        deaths = Path("deaths")
        count = len(deaths.read_text()) if deaths.exists() else 0
        if count < self.times:
            deaths.write_text("x" * (count + 1))
            os.kill(os.getpid(), signal.SIGKILL)
        yield
        return "survived"
'''
CHART = """chart: {name}
about: Kills its process.
outcomes: [survived]
states:
  only: {{do: Fatal, with: {{times: {times}}}, next: {{survived: .survived}}}}
"""


@pytest.fixture
def fatal(folder: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A project whose charts `twice` and `always` kill the process that runs them."""
    monkeypatch.setattr(sys, "path", sys.path.copy())
    package = folder / "fatal"
    package.mkdir()
    (folder / "pyproject.toml").write_text(
        '[project]\nname = "fatal"\n[project.entry-points."cobodeck.states"]\nf = "fatal.states"\n'
    )
    (package / "__init__.py").write_text("")
    (package / "states.py").write_text(STATES)
    for name, times in {"twice": 2, "always": 99}.items():
        (package / f"{name}.yaml").write_text(CHART.format(name=name, times=times))
    return folder


def by_cell(results: Iterator[CellResult]) -> dict[CampaignCell, CellResult]:
    return {result.cell: result for result in results}


def children() -> set[int]:
    return {child.pid for child in multiprocessing.active_children() if child.pid is not None}


def test_workers_give_the_bits_that_this_process_gives() -> None:
    found = by_cell(execute(CELLS, workers=2))

    assert found.keys() == set(CELLS)
    for cell, result in found.items():
        assert result.failure is None
        assert result.cpu_s > 0.0
        assert result.figures_sha256 == sha256_of(run_cell(cell))
    assert children() == set()


def test_killed_workers_lose_nothing() -> None:
    results, found, killed = execute(CELLS, workers=2), [], set()
    for result in results:
        found.append(result)
        if len(killed) < 2:
            pid = max(children())
            os.kill(pid, signal.SIGKILL)
            killed.add(pid)

    assert len(killed) == 2
    assert sorted(result.cell.repetition for result in found) == list(range(6))
    assert [result.failure for result in found] == [None] * 6


def test_a_cell_that_kills_two_workers_is_done_by_the_third(fatal: Path) -> None:
    (result,) = execute([CampaignCell(chart="twice", duration_s=5.0)], workers=1)

    assert result.failure is None
    assert result.figures is not None
    assert result.figures["outcome"] == "survived"


def test_a_cell_that_kills_every_worker_is_given_up_and_the_others_are_done(fatal: Path) -> None:
    deadly = CampaignCell(chart="always", duration_s=5.0)

    found = by_cell(execute([deadly, *CELLS[:2]], workers=1))

    assert found[deadly].figures is None
    assert "3 workers died of it, the last by signal SIGKILL" in str(found[deadly].failure)
    assert len((fatal / "deaths").read_text()) == 3
    assert [found[cell].failure for cell in CELLS[:2]] == [None, None]


def test_closing_the_results_ends_the_workers() -> None:
    results = execute(CELLS, workers=2)
    next(results)
    assert children()

    results.close()

    assert children() == set()
