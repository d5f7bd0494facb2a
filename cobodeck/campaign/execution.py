"""Runs the cells of a campaign, here or on a cluster."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from typing import Literal, get_args

from cobodeck.campaign.cell import CampaignCell
from cobodeck.campaign.cell_run import CellResult, CellRunner
from cobodeck.campaign.local_workers import run_locally

Executor = Literal["local", "dask"]
EXECUTORS: tuple[Executor, ...] = get_args(Executor)


def execute(
    cells: Iterable[CampaignCell], workers: int | None = None, own: bool = True
) -> Iterator[CellResult]:
    """The results of cells as they are done, each with its cell; closing it ends the workers.

    Args:
        cells: what to run.
        workers: number of processes; None: one per processor.
        own: charts, states and files of projects are found, too.

    Raises:
        Problem: a cell cannot run; FileError: a file or value is wrong; before anything runs.
    """
    runner = CellRunner(own)
    tasks = [(cell, runner.address(cell)) for cell in cells]
    if not tasks:
        return
    runner.warm_up(tasks[0][0])
    yield from run_locally(tasks, workers or os.cpu_count() or 1, own)
