"""A Dask cluster of this machine: deaths, and the ports that it opens."""

from __future__ import annotations

from logging import CRITICAL
from pathlib import Path
from threading import Timer
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


def listening(process: Any, name: str) -> set[Port]:
    found = set()
    for socket in process.net_connections("tcp"):
        if socket.status == psutil.CONN_LISTEN:
            found.add(Port(name, "TCP", "any", socket.laddr.ip.startswith("127.")))
    return found


def test_a_deadly_cell_is_given_up_the_others_are_done_and_ports_are_those_of_the_table(
    fatal: Path,
) -> None:
    runner, here, ports = CellRunner(), psutil.Process(), set()
    deadly = CampaignCell(chart="always", duration_s=5.0)
    first, last = (CampaignCell(user="brief", requests=1, repetition=n) for n in range(2))
    tasks = [(cell, runner.address(cell)) for cell in (first, deadly, last)]

    found = {}
    for result in run_on_dask(tasks, 1, None, own=True):
        found[result.cell] = result
        if not ports:
            ports = listening(here, "distributed.scheduler")
            for child in here.children(recursive=True):
                ports |= listening(child, "distributed.worker")

    assert "3 workers died of it" in str(found[deadly].failure)
    assert len((fatal / "deaths of 99").read_text()) == 3
    assert [found[cell].failure for cell in (first, last)] == [None, None]
    assert ports == {port for port in table() if port.process.startswith("distributed")}


def test_where_nobody_answers_that_is_told(folder: Path) -> None:
    with pytest.raises(Problem, match=r"tcp://127\.0\.0\.1:9: no Dask scheduler answers"):
        list(run_on_dask([], 1, "tcp://127.0.0.1:9", own=True))


def test_a_scheduler_without_workers_and_one_that_is_lost_are_told(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    cell = CampaignCell(user="brief", requests=1)
    with distributed.LocalCluster(
        n_workers=0, host="127.0.0.1", dashboard_address="127.0.0.1:0", silence_logs=CRITICAL
    ) as cluster:
        address = cluster.scheduler_address
        end = Timer(2.0, cluster.close)
        end.start()
        with pytest.raises(Problem, match="the Dask cluster fails"):
            list(run_on_dask([(cell, "address")], 1, address, own=False))
        end.join()

    assert f"--scheduler {address}: has no workers yet" in capsys.readouterr().err
