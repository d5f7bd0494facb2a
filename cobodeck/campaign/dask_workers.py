"""Runs cells on a Dask cluster: one of this machine, or one that is there.

Whoever reaches a Dask scheduler runs any code on its workers, because tasks are pickled functions;
Dask's own configuration can require TLS certificates (`distributed.comm`).
"""

from __future__ import annotations

import logging
from collections.abc import Generator, Iterable, Iterator
from contextlib import ExitStack
from itertools import islice
from typing import Any

from cobodeck.campaign.cell_run import CellResult
from cobodeck.campaign.worker import DEATHS, CellTask, work
from cobodeck.terminal import Problem, complain

LOOPBACK = "127.0.0.1"
CONNECT_S = 5.0


def run_on_dask(
    tasks: Iterable[CellTask], workers: int, scheduler: str | None, own: bool
) -> Generator[CellResult, None, None]:
    """The results of cells as they are done; closing the iterator cancels the others.

    Each worker has one cell at a time, so that a death is blamed on the cell that it interrupts.

    Args:
        tasks: what to run.
        workers: number of processes of a cluster on this machine.
        scheduler: the address of a cluster that is there; None: start one.
        own: charts, states and files of projects are found, too.

    Raises:
        Problem: nothing answers at the address, or the cluster fails; ModuleNotFoundError: Dask is
            not installed.
    """
    from distributed import KilledWorker, as_completed

    waiting = iter(tasks)
    with ExitStack() as open_until:
        client = _client(open_until, workers, scheduler)
        running: dict[Any, CellTask] = {}
        done = as_completed()
        while True:
            for task in _next(waiting, max(sum(client.nthreads().values()), 1) - len(running)):
                future = client.submit(work, task, own, key=task[1])
                running[future] = task
                done.add(future)
            if not running:
                return
            try:
                future = next(done)
                cell, address = running.pop(future)
                result = future.result()
            except KilledWorker as death:
                told = f"{DEATHS} workers died of it, the last one {death.last_worker.address}"
                result = CellResult(cell, address, None, failure=told)
            except Exception as error:  # noqa: BLE001  Dask's: `work` itself raises nothing
                raise Problem(f"the Dask cluster fails: {type(error).__name__}: {error}") from None
            yield result


def _next(waiting: Iterator[CellTask], count: int) -> Iterator[CellTask]:
    return islice(waiting, max(count, 0))


def _client(open_until: ExitStack, workers: int, scheduler: str | None) -> Any:
    """A client of a cluster, which is one of its own if no address is given."""
    import dask
    from distributed import Client, LocalCluster

    if scheduler is not None:
        try:
            client = open_until.enter_context(Client(scheduler, timeout=CONNECT_S))
        except (OSError, ValueError) as error:
            raise Problem(f"--scheduler {scheduler}: no Dask scheduler answers: {error}") from None
        if not client.nthreads():
            complain(f"--scheduler {scheduler}: has no workers yet; waiting for one")
        return client
    of_deaths = {
        "distributed.scheduler.allowed-failures": DEATHS - 1,
        "distributed.deploy.lost-worker-timeout": "1 day",  # else who dies often is not begun again
    }
    open_until.enter_context(dask.config.set(of_deaths))
    cluster = LocalCluster(
        n_workers=workers,
        threads_per_worker=1,
        host=LOOPBACK,
        dashboard_address=f"{LOOPBACK}:0",  # None would take 8787, and warn where it is taken
        silence_logs=logging.CRITICAL,  # deaths are told with their cells
    )
    open_until.enter_context(cluster)
    return open_until.enter_context(Client(cluster))
