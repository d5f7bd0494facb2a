"""Runs the cells of a campaign, here or on a cluster, and leaves out what was run before."""

from __future__ import annotations

import os
from collections.abc import Generator, Iterable
from contextlib import closing
from typing import Literal, get_args

from cobodeck.campaign.cell import CampaignCell
from cobodeck.campaign.cell_run import CellResult, CellRunner
from cobodeck.campaign.dask_workers import run_on_dask
from cobodeck.campaign.local_workers import run_locally
from cobodeck.campaign.result_store import ResultStore
from cobodeck.campaign.worker import CellTask
from cobodeck.project import catalogue
from cobodeck.terminal import Problem

Executor = Literal["local", "dask"]
EXECUTORS: tuple[Executor, ...] = get_args(Executor)


def execute(
    cells: Iterable[CampaignCell],
    executor: Executor = "local",
    workers: int | None = None,
    *,
    scheduler: str | None = None,
    store: ResultStore | None = None,
    own: bool = True,
) -> Generator[CellResult, None, None]:
    """The results of cells as they are done, in any order; closing it ends the workers.

    Args:
        cells: what to run.
        executor: processes of this machine, or a Dask cluster.
        workers: number of processes; None: one per processor.
        scheduler: the address of a Dask cluster; None: one of this machine's own.
        store: has the results of earlier cells, and keeps those of new ones.
        own: charts, states and files of projects are found, too.

    Raises:
        Problem: a cell cannot run, or two would share a result; FileError: a file or value is
            wrong; before anything runs.
    """
    runner = CellRunner(catalogue(own=own))
    tasks = _apart([(cell, runner.address(cell)) for cell in cells])
    waiting = [task for task in tasks if store is None or task[1] not in store]
    if store is not None:
        yield from (store.result(*task) for task in tasks if task[1] in store)
    if not waiting:
        return
    runner.warm_up(waiting[0][0])  # compiled once, and loaded by the workers
    count = workers or os.cpu_count() or 1
    if executor == "local":
        results = run_locally(waiting, count, own)
    else:
        results = run_on_dask(waiting, count, scheduler, own)
    with closing(results):
        for result in results:
            if store is not None and result.figures is not None:
                store.keep(result)
            yield result


def _apart(tasks: list[CellTask]) -> list[CellTask]:
    """The tasks, of which no two different cells have one address.

    Raises:
        Problem: two have, as with two files of the same name and content.
    """
    first: dict[str, CampaignCell] = {}
    for cell, address in tasks:
        other = first.setdefault(address, cell)
        if other != cell:
            raise Problem(f"one result would be that of two cells: {other.key()}, {cell.key()}")
    return tasks
