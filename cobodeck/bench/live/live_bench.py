"""Benchmark of the live page: what it costs a tick, and how soon an edit is seen.

Runs of CoboDeck with 0, 1 and 10 pages, with one that reads nothing, and with a record alone, take
turns with runs that keep and show nothing, in paced virtual time; times are those of the thread
that ticks. What a page is told is what a record holds: what that costs is mostly to record it.

An edit is a save of the shipped chart with another text in its picture; its time, by the wall
clock, ends when a page has the new picture: it holds for the load that a result tells beside the
machine. What of it is reading and checking, and what the message, is measured apart.
"""

from __future__ import annotations

import json
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from datetime import datetime
from importlib.util import find_spec
from pathlib import Path
from typing import NamedTuple

from cobodeck.bench.harness import ROUNDS, BenchRow, Work, timed, times
from cobodeck.live import LivePage, PageAddress, socket_url
from cobodeck.live.charts import ChartReader, chart_message
from cobodeck.loop import Loop, Paced
from cobodeck.project import CHARTS, catalogue
from cobodeck.record.write import Recorder, recorder, unkept_recorder
from cobodeck.run import simulate
from cobodeck.setup import PROFILE, Options, Setup, open_setup, warm_up
from cobodeck.terminal import FAILED, Problem

NAME = "live"
SECONDS, SPEED = 20.0, 10.0
"""Of a run, s of its own time, and how much faster than the wall clock it goes."""
EDITS, PAUSE_S = 4, 1.0
"""Per round; between two, s: nobody saves sooner."""
PATIENCE_S = 60.0
"""Longest time until a page has a picture, s."""
GOAL_MS = 500.0
NO_ERROR = "has no error"
CHART = "cobodeck"
MARK = "A robot that follows a person"
"""Words of the chart that edits change."""
READY = b"ready\n"
"""What the process of the pages says."""
NextMessage = Callable[[float | None], str | bytes]
"""Waits for the next message, for at most so many s."""


class PageCrowd(NamedTuple):
    """The pages of a run: those that read, and those that do not."""

    reading: int
    stalled: int = 0


CROWDS = (PageCrowd(0), PageCrowd(1), PageCrowd(10), PageCrowd(0, 1))


def rows(rounds: int = ROUNDS) -> Iterator[BenchRow]:
    """Ticks beside pages, then edits; nothing without the extra `live`."""
    if find_spec("websockets") is None:
        return
    yield from tick_rows(rounds, SECONDS)
    yield from edit_rows(rounds)


def tick_rows(rounds: int, seconds: float) -> Iterator[BenchRow]:
    """Thread time of a tick, and its ratio to that of a run that keeps and shows nothing."""
    setup = open_setup()
    warm_up(setup, setup.machine())
    bare: list[float] = []
    recorded: list[float] = []
    taken: dict[PageCrowd, list[float]] = {crowd: [] for crowd in CROWDS}
    for _ in range(rounds):
        bare.append(tick_s(setup, seconds))
        recorded.append(recorded_tick_s(setup, seconds))
        for crowd, found in taken.items():
            found.append(tick_s(setup, seconds, crowd))
    yield _tick_row("tick, record alone", recorded, bare)
    for crowd, found in taken.items():
        if crowd.stalled:
            yield _tick_row("tick beside a stalled page", found, bare)
        else:
            yield _tick_row("tick beside pages", found, bare, crowd.reading)


def _tick_row(
    case: str, found: Sequence[float], bare: Sequence[float], pages: int | None = None
) -> BenchRow:
    ratios = [own / alone for own, alone in zip(found, bare, strict=True)]
    return BenchRow(
        NAME, case, "cobodeck",
        None if pages is None else "pages", None if pages is None else float(pages),
        time_us=statistics.median(found) * 1e6, ratio=statistics.median(ratios),
        ratio_to="without a page", reference=NO_ERROR, spread=_spread(ratios),
    )  # fmt: skip


def tick_s(setup: Setup, seconds: float, crowd: PageCrowd | None = None) -> float:
    """Mean thread time of a tick of a run, s, without a page or beside these."""
    options = Options(duration_s=seconds)
    if crowd is None:
        return _run(setup, options)
    page = LivePage(setup, options, PageAddress(), _nobody)
    try:
        with clients(page.url, crowd):
            told = unkept_recorder(setup, options, datetime.now(), _nobody, [page.feed])
            return _run(setup, options, told, page)
    finally:
        page.close()


def recorded_tick_s(setup: Setup, seconds: float) -> float:
    """Mean thread time of a tick of a run that keeps a record, s."""
    options = Options(duration_s=seconds)
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder, "run.mcap")
        return _run(setup, options, recorder(setup, options, file, datetime.now(), _nobody))


def _run(
    setup: Setup, options: Options, kept: Recorder | None = None, page: LivePage | None = None
) -> float:
    spent: list[int] = []

    @contextmanager
    def measured(loop: Loop) -> Iterator[None]:
        if page is not None:
            page.attend(loop)
        begin = time.thread_time_ns()
        yield
        spent.append(time.thread_time_ns() - begin)

    result = simulate(setup, options, clock=Paced(SPEED), around=measured, recorder=kept)
    ticks = round(float(result.figures["sim_s"]) * setup.tick_hz)
    return spent[0] / 1e9 / max(1, ticks)


@contextmanager
def clients(url: str, crowd: PageCrowd) -> Iterator[None]:
    """Pages of a server, in a process of their own."""
    if not any(crowd):
        yield
        return
    program = [sys.executable, "-m", "cobodeck.bench.live.page_clients", socket_url(url)]
    pipe = subprocess.PIPE
    with subprocess.Popen([*program, *map(str, crowd)], stdin=pipe, stdout=pipe) as running:
        try:
            assert running.stdout is not None
            if running.stdout.readline() != READY:
                raise Problem(f"no pages at {url}", FAILED)
            yield
        finally:
            running.communicate()


def edit_rows(rounds: int) -> Iterator[BenchRow]:
    """From a save to the picture on a page; and what of it is our own work."""
    found = edits_ms(rounds * EDITS)
    for what, value in (("median", statistics.median(found)), ("longest", max(found))):
        yield BenchRow(
            NAME, f"edit to picture, {what}", "cobodeck", time_us=1e3 * value,
            ratio=value / GOAL_MS, ratio_to=f"{GOAL_MS:g} ms", reference=NO_ERROR,
            goal=1.0 if what == "median" else None,
            spread=_spread([one / GOAL_MS for one in found]) if what == "median" else None,
        )  # fmt: skip
    reader, file = ChartReader(catalogue(own=False)), CHARTS / f"{CHART}.yaml"
    read = reader.read(file, PROFILE)

    def message() -> None:
        assert read.chart is not None
        assert read.profile is not None
        known = reader.known
        chart_message(
            read.chart, read.charts, read.profile, interfaces=known.interfaces, types=known.types,
            unfolded=(),
        )  # fmt: skip

    works = {"read and check": lambda: reader.read(file, PROFILE), "message": message}
    points = [
        (BenchRow(NAME, f"edit: {what}", "cobodeck", reference=NO_ERROR), Work(times(function)))
        for what, function in works.items()
    ]
    yield from timed(points, rounds)


def edits_ms(count: int) -> list[float]:
    """Times from a save to the picture on a page, ms."""
    from websockets.sync.client import connect

    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder, f"{CHART}.yaml")
        shutil.copy(CHARTS / file.name, file)
        text = file.read_text(encoding="utf-8")
        with _serving(file) as url, connect(socket_url(url), max_size=None) as page:
            _wait(page.recv, lambda told: told["t"] == "chart")
            words = (f"Edit {number}" for number in range(count))
            return [_edit_ms(file, text, word, page.recv) for word in words]


def _edit_ms(file: Path, text: str, word: str, receive: NextMessage) -> float:
    new = file.with_suffix(".new")
    new.write_text(text.replace(MARK, f"{word}. {MARK}"), encoding="utf-8")
    time.sleep(PAUSE_S)
    begin = time.perf_counter()
    new.replace(file)
    _wait(receive, lambda told: told["t"] == "chart" and word in told["svg"])
    return 1e3 * (time.perf_counter() - begin)


def _wait(receive: NextMessage, is_it: Callable[[dict[str, str]], bool]) -> None:
    end = time.monotonic() + PATIENCE_S
    try:
        while not is_it(json.loads(receive(end - time.monotonic()))):
            pass
    except TimeoutError:
        raise Problem(f"a page has had no picture for {PATIENCE_S:g} s", FAILED) from None


@contextmanager
def _serving(file: Path) -> Iterator[str]:
    command = [sys.executable, "-m", "cobodeck", "watch", str(file), "--no-project"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as running:
        try:
            assert running.stdout is not None
            yield running.stdout.readline().split()[1]
        finally:
            running.terminate()


def _spread(values: Sequence[float]) -> float | None:
    """The interquartile range."""
    if len(values) < 2:
        return None
    quartiles = statistics.quantiles(values, n=4)
    return quartiles[2] - quartiles[0]


def _nobody(_line: str) -> None:
    """Tell nobody."""
