"""Runs cells in worker processes of this machine; a worker that dies loses nothing.

`concurrent.futures` gives up all its work when one of its processes dies. Here each worker has a
pipe of its own and one cell at a time, so that it is known which cell a death has interrupted.
"""

from __future__ import annotations

import multiprocessing
import signal
from collections import Counter, deque
from collections.abc import Generator, Iterable
from contextlib import suppress
from multiprocessing.connection import Connection as Pipe, wait

from cobodeck.campaign.cell_run import CellResult
from cobodeck.campaign.worker import DEATHS, CellTask, work


def run_locally(
    tasks: Iterable[CellTask], workers: int, own: bool
) -> Generator[CellResult, None, None]:
    """The results of cells as they are done; closing the iterator ends the workers.

    Args:
        tasks: what to run.
        workers: number of processes.
        own: charts, states and files of projects are found, too.
    """
    waiting, deaths = deque(tasks), Counter[str]()
    busy: dict[Pipe, _Worker] = {}
    idle: list[_Worker] = []
    try:
        while waiting or busy:
            while waiting and len(busy) < workers:
                worker = idle.pop() if idle else _Worker(own)
                busy[worker.pipe] = worker
                worker.take(waiting.popleft())
            for pipe in list(wait(list(busy))):
                assert isinstance(pipe, Pipe)
                worker = busy.pop(pipe)
                result = worker.result()
                if result is not None:
                    idle.append(worker)
                    yield result
                    continue
                worker.end()
                cell, address = worker.task
                deaths[address] += 1
                if deaths[address] < DEATHS:
                    waiting.appendleft(worker.task)
                else:
                    yield CellResult(cell, address, None, failure=worker.fate)
    finally:
        for worker in (*busy.values(), *idle):
            worker.end()


class _Worker:
    """A process with a pipe to it, and the cell that it was given last."""

    task: CellTask

    def __init__(self, own: bool) -> None:
        spawn = multiprocessing.get_context("spawn")  # a fork copies locks that threads hold
        self.pipe, other = spawn.Pipe()
        self._process = spawn.Process(target=_work, args=(other, own), daemon=True)
        self._process.start()
        other.close()  # so that the pipe ends with the process

    def take(self, task: CellTask) -> None:
        """Begin a cell."""
        self.task = task
        with suppress(OSError):  # it has died meanwhile, as `result` will tell
            self.pipe.send(task)

    def result(self) -> CellResult | None:
        """The result that has arrived; None if the process has died."""
        try:
            found: CellResult = self.pipe.recv()
        except (EOFError, OSError):
            return None
        return found

    def end(self) -> None:
        """End the process, whatever it does."""
        self._process.kill()
        self._process.join()
        self.pipe.close()

    @property
    def fate(self) -> str:
        """How the process ended, in words."""
        code = self._process.exitcode or 0
        how = f"signal {signal.Signals(-code).name}" if code < 0 else f"exit code {code}"
        return f"{DEATHS} workers died of it, the last by {how}"


def _work(pipe: Pipe, own: bool) -> None:
    """Run cells until the other end of the pipe is closed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the client ends its workers
    with suppress(EOFError, OSError):
        while True:
            pipe.send(work(pipe.recv(), own))
