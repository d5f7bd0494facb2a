"""What a worker process does with a cell, whoever has started it."""

from __future__ import annotations

from functools import cache
from threading import Lock

from cobodeck.campaign.cell import CampaignCell
from cobodeck.campaign.cell_run import OTHERS, CellResult, CellRunner
from cobodeck.project import catalogue, own_files_around
from engine.files.declared import no_files, with_own_files

CellTask = tuple[CampaignCell, str]
"""A cell and its address."""
DEATHS = 3
"""A cell is given up after so many workers have died of it."""
_one_at_a_time = Lock()  # a worker of Dask may have several threads


def work(task: CellTask, own: bool) -> CellResult:
    """The result of a cell; what it has in common with earlier ones is kept in this process.

    Args:
        task: what to run.
        own: charts, states and files of projects are found, too.
    """
    cell, address = task
    with _one_at_a_time, with_own_files(own_files_around() if own else no_files):
        result = _runner(own).result(cell, address)
        if result.failure != OTHERS:
            return result
        _runner.cache_clear()  # it may know files as they were in an earlier campaign
        return _runner(own).result(cell, address)


@cache
def _runner(own: bool) -> CellRunner:
    return CellRunner(catalogue(own=own))
