"""Runs that pages start with a form: `cobodeck simulate … --live`, each in a process of its own."""

from __future__ import annotations

import asyncio
import os
import re
import signal
import sys
from asyncio.subprocess import PIPE, Process
from collections import deque
from collections.abc import AsyncIterator, Callable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cobodeck.live.access import PageAddress
from cobodeck.project import name_in

PATIENCE_S = 120.0
"""Longest time until a run tells its page, s of wall time."""
SAYING_S = 5.0
"""So often it is said how long that takes already, s of wall time."""
ENDING_S = 5.0
"""Time that a run is given to end in order, s."""
MOST_RUNS = 4
KEPT_LINES = 20
_URL = re.compile(r"https?://\S+")


@dataclass(frozen=True, slots=True)
class StartedRun:
    """A run that has begun, with the page that shows it; without `url` one that was refused."""

    url: str | None
    text: str


class StartedRuns:
    """Starts runs, and ends them when it is closed.

    Args:
        program: the command line of cobodeck.
        host: the address at which their pages are served.
    """

    def __init__(
        self,
        program: tuple[str, ...] = (sys.executable, "-m", "cobodeck"),
        host: str = PageAddress().host,
    ) -> None:
        self._program, self._host = program, host
        self.running: list[Process] = []
        self._turn, self._closed = asyncio.Lock(), False
        self._drains: set[asyncio.Task[None]] = set()

    async def start(
        self,
        chart: Path,
        profile: str,
        form: Mapping[str, Any],
        say: Callable[[str], None] = lambda _told: None,
    ) -> StartedRun:
        """Start a chart as the form says; what is wrong is told as the command line tells it.

        `say` is called with what goes on, while that takes long.
        """
        starting = asyncio.create_task(self._start(chart, profile, form))
        begin = asyncio.get_running_loop().time()
        while not (await asyncio.wait([starting], timeout=SAYING_S))[0]:
            so_far = asyncio.get_running_loop().time() - begin
            say(f"{chart.name} has not begun after {so_far:.0f} s: it is checked and drawn first")
        return starting.result()

    async def _start(self, chart: Path, profile: str, form: Mapping[str, Any]) -> StartedRun:
        try:
            given = list(arguments(chart, profile, form, self._host))
        except ValueError as error:
            return StartedRun(None, str(error))
        async with self._turn:
            self.running = [run for run in self.running if run.returncode is None]
            if len(self.running) >= MOST_RUNS or self._closed:
                return StartedRun(None, f"{MOST_RUNS} runs are under way; wait until one ends")
            process = await asyncio.create_subprocess_exec(
                *self._program, *given, stdin=asyncio.subprocess.DEVNULL, stdout=PIPE, stderr=PIPE,
                start_new_session=True, env={**os.environ, "PYTHONUNBUFFERED": "1"},
            )  # fmt: skip
            self.running.append(process)
        try:
            return await asyncio.wait_for(self._begun(process), PATIENCE_S)
        except TimeoutError:
            await self._end(process)
            return StartedRun(None, f"it has not begun within {PATIENCE_S:g} s")

    async def close(self) -> None:
        """End all of them, and start no more."""
        async with self._turn:
            self._closed = True
        for process in self.running:
            _interrupt(process)
        for process in self.running:
            await self._end(process)
        for task in self._drains:
            task.cancel()

    async def _begun(self, process: Process) -> StartedRun:
        """Read what it says up to its URL and what stands beside it, or until it ends."""
        assert process.stdout is not None
        assert process.stderr is not None
        wrong: deque[str] = deque(maxlen=KEPT_LINES)
        complaints = self._drain(process.stderr, wrong)
        async for line in _lines(process.stdout):
            found = _URL.search(line)
            if found is not None:
                self._drain(process.stdout, deque(maxlen=KEPT_LINES))
                return StartedRun(found[0], line.strip())
        await complaints
        code = await process.wait()
        told = "\n".join(line.removeprefix("cobodeck: ") for line in wrong)
        return StartedRun(None, told or f"it has ended with exit code {code}")

    def _drain(self, stream: asyncio.StreamReader, lines: deque[str]) -> asyncio.Task[None]:
        """Read on, so that it never waits for a reader."""

        async def read() -> None:
            async for line in _lines(stream):
                lines.append(line)

        task = asyncio.create_task(read())
        self._drains.add(task)
        task.add_done_callback(self._drains.discard)
        return task

    async def _end(self, process: Process) -> None:
        _interrupt(process)
        with suppress(TimeoutError):
            await asyncio.wait_for(process.wait(), ENDING_S)
        if process.returncode is None:
            process.kill()
            await process.wait()


async def _lines(stream: asyncio.StreamReader) -> AsyncIterator[str]:
    """The lines of a program, but for those that are longer than any should be."""
    while True:
        try:
            line = await stream.readline()
        except ValueError:  # the reader has dropped it
            continue
        if not line:
            return
        yield line.decode(errors="replace").rstrip("\n")


def _interrupt(process: Process) -> None:
    with suppress(ProcessLookupError):
        process.send_signal(signal.SIGINT)


def arguments(
    chart: Path, profile: str, form: Mapping[str, Any], host: str = PageAddress().host
) -> Iterator[str]:
    """The command line of a run whose page is served at `host`.

    Raises:
        ValueError: the form is not of this shape.
    """
    yield from ("simulate", f"--profile={profile}")
    for key, option in (("scene", "--scene"), ("user", "--user")):
        if form.get(key):
            yield f"{option}={_text(key, form[key])}"
    for name, value in _texts(form, "inputs"):
        yield f"--in={name}={value}"
    for name, value in _texts(form, "parameters"):
        yield f"--set=charts.{name_in(chart)}.{name}={value}"
    yield from (str(chart), "--live" if PageAddress(host).is_near else f"--live={host}:0")


def _texts(form: Mapping[str, Any], key: str) -> Iterator[tuple[str, str]]:
    """The values of one kind; those left empty are not given."""
    given = form.get(key) or {}
    if not isinstance(given, Mapping):
        raise ValueError(f"`{key}` are texts by their names")
    for name, value in given.items():
        if not isinstance(name, str) or "=" in name:
            raise ValueError(f"{name!r} is no name")
        text = _text(name, value)
        if text.strip():
            yield name, text


def _text(name: str, value: object) -> str:
    if not isinstance(value, str) or "\0" in value:
        raise ValueError(f"{name}: a value is text as in YAML")
    return value
