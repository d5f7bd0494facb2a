"""Worker processes: the same figures as in this process, also where workers die."""

from __future__ import annotations

import multiprocessing
import os
import signal
from collections.abc import Iterator
from pathlib import Path

import pytest

from cobodeck.campaign.cell import CampaignCell
from cobodeck.campaign.cell_run import CellResult, run_cell, sha256_of
from cobodeck.campaign.execution import execute

pytestmark = pytest.mark.slow
CELLS = [CampaignCell(user="brief", requests=1, duration_s=20.0, repetition=n) for n in range(6)]


def by_cell(results: Iterator[CellResult]) -> dict[CampaignCell, CellResult]:
    return {result.cell: result for result in results}


def children() -> set[int]:
    return {child.pid for child in multiprocessing.active_children() if child.pid is not None}


def test_killed_workers_lose_nothing_and_give_the_bits_that_this_process_gives() -> None:
    results, found, killed = execute(CELLS, workers=2), [], set[int]()
    for result in results:
        found.append(result)
        if len(killed) < 2:
            killed.add(max(children() - killed))
            os.kill(max(killed), signal.SIGKILL)

    assert len(killed) == 2
    assert sorted(result.cell.repetition for result in found) == list(range(6))
    for result in found:
        assert result.failure is None
        assert result.cpu_s > 0.0
        assert result.figures_sha256 == sha256_of(run_cell(result.cell))
    assert children() == set()


def test_a_cell_that_kills_every_worker_is_given_up_and_the_others_are_done(fatal: Path) -> None:
    twice, always = (CampaignCell(chart=name, duration_s=5.0) for name in ("twice", "always"))

    found = by_cell(execute([twice, always, CELLS[0]], workers=1))

    assert found[twice].figures is not None
    assert found[twice].figures["outcome"] == "survived"  # the third worker did
    assert found[always].figures is None
    assert "3 workers died of it, the last by signal SIGKILL" in str(found[always].failure)
    assert len((fatal / "deaths of 99").read_text()) == 3
    assert found[CELLS[0]].failure is None


def test_closing_the_results_ends_the_workers() -> None:
    results = execute(CELLS[:2], workers=1)
    next(results)
    assert children()

    results.close()

    assert children() == set()
