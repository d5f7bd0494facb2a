"""A Dask cluster of this machine: deaths, and the ports that it opens."""

from __future__ import annotations

import os
import signal
from pathlib import Path
from typing import Any

import pytest

from cobodeck.campaign.cell import CampaignCell
from cobodeck.campaign.cell_run import CellRunner
from cobodeck.campaign.dask_workers import run_on_dask
from cobodeck.terminal.console import Problem
from tests.cobodeck.real.test_ports import Port, table

distributed = pytest.importorskip("distributed")
psutil = pytest.importorskip("psutil")
pytestmark = pytest.mark.slow


def tasks(count: int) -> list[tuple[CampaignCell, str]]:
    runner = CellRunner()
    cells = [CampaignCell(user="brief", requests=1, repetition=n) for n in range(count)]
    return [(cell, runner.address(cell)) for cell in cells]


def listening(process: Any, name: str) -> set[Port]:
    found = set()
    for socket in process.net_connections("tcp"):
        if socket.status == psutil.CONN_LISTEN:
            found.add(Port(name, "TCP", "any", socket.laddr.ip.startswith("127.")))
    return found


def test_a_killed_worker_loses_nothing_and_ports_are_those_of_the_table() -> None:
    here, found, ports = psutil.Process(), [], set()
    for result in run_on_dask(tasks(5), 1, None, own=True):
        found.append(result)
        if len(found) == 1:
            (worker,) = (p for p in here.children(recursive=True) if p.net_connections("tcp"))
            ports = listening(here, "distributed.scheduler")
            ports |= listening(worker, "distributed.worker")
            os.kill(worker.pid, signal.SIGKILL)

    assert sorted(result.cell.repetition for result in found) == list(range(5))
    assert [result.failure for result in found] == [None] * 5
    assert ports == {port for port in table() if port.process.startswith("distributed")}


def test_a_cell_that_kills_every_worker_is_given_up_and_the_others_are_done(fatal: Path) -> None:
    runner = CellRunner()
    cells = [CampaignCell(chart="always", duration_s=5.0), CampaignCell(user="brief", requests=1)]
    some = [(cell, runner.address(cell)) for cell in cells]

    found = {result.cell: result for result in run_on_dask(some, 1, None, own=True)}

    assert "3 workers died of it" in str(found[cells[0]].failure)
    assert len((fatal / "deaths").read_text()) == 3
    assert found[cells[1]].failure is None


def test_where_nobody_answers_that_is_told(folder: Path) -> None:
    with pytest.raises(Problem, match=r"tcp://127\.0\.0\.1:9: no Dask scheduler answers"):
        list(run_on_dask(tasks(1), 1, "tcp://127.0.0.1:9", own=True))
