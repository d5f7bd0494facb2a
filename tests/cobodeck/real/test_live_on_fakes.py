"""A page beside a run on the fakes, in real time: it stops it, is missed, and resets it."""

from __future__ import annotations

import asyncio
import json
import re
import subprocess
import sys
from collections import deque
from collections.abc import AsyncIterator, Coroutine, Iterator, Mapping
from contextlib import asynccontextmanager, contextmanager, suppress
from pathlib import Path
from typing import Any

import pytest
from websockets.asyncio.client import connect
from websockets.exceptions import ConnectionClosed

from cobodeck.live.access import LOST_S
from cobodeck.live.sources.seen_room import FRAME_S
from cobodeck.live.steering.page_operator import LOOK_S
from cobodeck.record.format import TOPIC, sample_of
from cobodeck.record.read import Record
from tests.cobodeck.live.pages import Client, run
from tests.program import ROOT, python

FOUND = re.compile(r"live page: (http://127\.0\.0\.1:\d+/)  token: (\S+)")
BUSY = 0.05
"""If more of the ticks are missed than this, the machine is too busy to tell times."""
WAITING_S = 0.25
"""If the server of the page waits longer than this for a processor, in LOST_S, a page that beats is
missed all the same: the run and its devices go before it, and on fakes they leave it little of two
cores."""
STOP_S = 0.1
BEAT_S = 0.2
SEEN_S = 2 * FRAME_S
"""What a page knows of the run's time is at most so old."""
LOOKS = 6
"""At what the server has waited, in LOST_S."""
LONGEST_S = 100.0
PRESSED, MISSED = "stop by ann", "the page of ann is not heard any more"


class Operating(Client):
    """A page that controls the run and notes what it sees of its time and stop."""

    def __init__(self, socket: Any) -> None:
        super().__init__(socket)
        self.at = 0.0
        self.stopped = False
        self.acks: dict[str, dict[str, Any]] = {}
        self.children: dict[str, str] = {}

    async def listen(self) -> None:
        with suppress(asyncio.CancelledError, ConnectionClosed):
            async for text in self.socket:
                told = json.loads(text)
                self.at = max(self.at, told.get("at") or 0.0)
                self.stopped = told.get("stop", self.stopped)
                if told["t"] == "ack":
                    self.acks[told["id"]] = told
                elif told["t"] == "health":
                    self.children = {one["name"]: one["state"] for one in told.get("children", ())}

    async def beat(self) -> None:
        while True:
            await self.tell(t="beat")
            await asyncio.sleep(BEAT_S)

    async def until(self, stopped: bool, after_s: float = 0.0) -> None:
        async with asyncio.timeout(LONGEST_S):
            while self.stopped is not stopped or self.at < after_s:
                await asyncio.sleep(0.01)

    async def do(self, word: str) -> dict[str, Any]:
        self.acks.pop(word, None)
        await self.tell(t="cmd", id=word, do=word)
        return await self.answer(word)

    async def reset(self) -> None:
        """Reset the stop, once the base stands."""
        async with asyncio.timeout(LONGEST_S):
            while not (await self.do("reset"))["ok"]:
                await asyncio.sleep(0.05)

    async def answer(self, word: str) -> dict[str, Any]:
        async with asyncio.timeout(LONGEST_S):
            while word not in self.acks:
                await asyncio.sleep(0.01)
        return self.acks[word]


@asynccontextmanager
async def _operating(url: str, token: str) -> AsyncIterator[Operating]:
    """A page with control of a run that has begun; it does not beat by itself."""
    address = f"{url.replace('http', 'ws')}ws"
    more: dict[str, Any] = {"max_size": None, "ping_interval": None, "origin": url.rstrip("/")}
    async with connect(address, **more) as socket:
        page = Operating(socket)
        listening = asyncio.create_task(page.listen())
        await page.until(False, 2.0)
        await page.tell(t="auth", id="auth", token=token, name="ann")
        assert (await page.answer("auth"))["ok"]
        assert (await page.do("take"))["ok"]
        yield page
        listening.cancel()


async def _steered(url: str, token: str) -> tuple[float, float]:
    """Stop the run, and leave it alone; the instants of both, s of the run."""
    async with _operating(url, token) as page:
        beating = asyncio.create_task(page.beat())
        await page.until(False, page.at + 2.0)  # heard, it is not missed
        assert {"the safety chain", "the arm's process"} <= page.children.keys()
        assert set(page.children.values()) == {"runs"}
        pressed = page.at
        assert (await page.do("stop"))["ok"]
        await page.until(True)
        await page.reset()
        await page.until(False, page.at + 1.0)
        beating.cancel()
        left = page.at
        await page.until(True)
        assert (await page.do("take"))["ok"]
        beating = asyncio.create_task(page.beat())
        await page.reset()
        await page.until(False, page.at + 0.5)
        assert (await page.do("end"))["ok"]
        beating.cancel()
        return pressed, left


async def _stopped(url: str, token: str) -> None:
    """Stop a run on real parts, try to reset it, and end it."""
    async with _operating(url, token) as page:
        beating = asyncio.create_task(page.beat())
        assert (await page.do("stop"))["ok"]
        await page.until(True)
        told = await page.do("reset")
        assert not told["ok"]
        assert "real parts are reset at the console" in told["text"]
        await page.until(True, page.at + 1.0)
        assert (await page.do("end"))["ok"]
        beating.cancel()


REAL = """
import dataclasses
import cobodeck.live
from cobodeck.__main__ import main
from cobodeck.live.session import LivePage

class RealPage(LivePage):
    def __init__(self, setup, options, *rest):
        connection = dataclasses.replace(options.connection, real=True, peers={})
        super().__init__(setup, dataclasses.replace(options, connection=connection), *rest)

cobodeck.live.LivePage = RealPage
raise SystemExit(main())
"""
"""The command, with a page that takes the fakes for real parts, which have none beside them."""


@contextmanager
def _running(folder: Path, *program: str) -> Iterator[tuple[subprocess.Popen[str], str, str]]:
    """A run on the fakes with a page, its URL and its token."""
    command = [sys.executable, *program, "run", "cobodeck", "--robot", "fakes", "--live",
               "--user", "demo", "--scene", "lab_a", "--json", "--record", str(folder / "r.mcap"),
               "--duration", "60"]  # fmt: skip
    with subprocess.Popen(
        command, cwd=ROOT, stdin=subprocess.DEVNULL, text=True,
        stdout=subprocess.PIPE, stderr=subprocess.PIPE,
    ) as running:  # fmt: skip
        try:
            assert running.stderr is not None
            lines = iter(running.stderr.readline, "")
            found = next(filter(None, map(FOUND.match, lines)))
            yield running, *found.groups()
        finally:
            running.terminate()


def _beside(
    running: subprocess.Popen[str], page: Coroutine[Any, Any, None]
) -> tuple[dict[str, Any], str]:
    """The figures of a run beside what a page does, and what it has complained of."""
    waits = [0.0]

    async def watched() -> None:
        watching = asyncio.create_task(_watch(running.pid, waits))
        await page
        watching.cancel()

    try:
        run(watched())
    except TimeoutError:
        running.terminate()
        _skip_if_busy({**_figures(running)[0], "waited": max(waits)})
        raise
    figures, errors = _figures(running)
    assert figures["errors"] == []
    return {**figures, "waited": max(waits)}, errors


async def _watch(run_pid: int, waits: list[float]) -> None:
    """Add how long the server of the page waited for a processor in each LOST_S, s."""
    children = Path(f"/proc/{run_pid}/task/{run_pid}/children").read_text().split()
    [server] = [p for p in children if b"run_server" in Path(f"/proc/{p}/cmdline").read_bytes()]
    looks = deque[int](maxlen=LOOKS)
    with suppress(OSError):  # it has ended
        while True:
            looks.append(int(Path(f"/proc/{server}/schedstat").read_text().split()[1]))
            waits.append((looks[-1] - looks[0]) / 1e9)
            await asyncio.sleep(LOST_S / (LOOKS - 1))


def _figures(running: subprocess.Popen[str]) -> tuple[dict[str, Any], str]:
    told, errors = running.communicate(timeout=LONGEST_S)
    assert "Traceback" not in errors
    return json.loads(told), errors


def _skip_if_busy(figures: Mapping[str, Any]) -> None:
    if figures["missed"] > BUSY * figures["ticks"]:
        pytest.skip(f"this machine is too busy: {figures['missed']} ticks are missed")
    if (waited := figures["waited"]) > WAITING_S:
        pytest.skip(f"this machine is too busy: the page's server waited {waited:.1f} s for it")


@pytest.mark.slow
@pytest.mark.realtime
@pytest.mark.requirement(48, 54, 55)
def test_a_page_stops_a_run_on_fakes_is_missed_in_control_and_all_is_replayed(
    tmp_path: Path,
) -> None:
    with _running(tmp_path, "-m", "cobodeck") as (running, url, token):
        instants: list[float] = []

        async def main() -> None:
            instants.extend(await _steered(url, token))

        figures, _ = _beside(running, main())
    done = python(tmp_path, "-m", "cobodeck", "replay", "r.mcap", "--check")
    assert done.returncode == 0, done.stdout + done.stderr
    stops = [(at, why) for at, why in _stops(tmp_path / "r.mcap") if "ann" in why]
    assert {why for _, why in stops} <= {PRESSED, MISSED}
    _skip_if_busy(figures)
    assert [why for _, why in stops] == [PRESSED, MISSED]
    (pressed, _), (missed, _) = stops
    assert pressed - instants[0] <= STOP_S + SEEN_S
    assert LOST_S - BEAT_S <= missed - instants[1] <= LOST_S + LOOK_S + SEEN_S


@pytest.mark.slow
@pytest.mark.realtime
@pytest.mark.requirement(49)
def test_a_page_does_not_reset_real_parts(tmp_path: Path) -> None:
    with _running(tmp_path, "-c", REAL) as (running, url, token):
        _beside(running, _stopped(url, token))

    whys = [why for _, why in _engaged(tmp_path / "r.mcap")]
    pressed = next(n for n, why in enumerate(whys) if "ann" in str(why))
    assert None not in whys[pressed:]


def _stops(record: Path) -> list[tuple[float, str]]:
    """When the stop line was pulled, s, and why."""
    return [(at, why) for at, why in _engaged(record) if why is not None]


def _engaged(record: Path) -> list[tuple[float, str | None]]:
    """What the stop line has said, and when, s."""
    found = []
    for group in Record(record).groups():
        for told in group.told:
            if told.topic == f"{TOPIC}stop.engaged":
                sample = sample_of("stop.engaged", told.schema, told.data)
                found.append((sample.stamp_ns / 1e9, sample.value))
    return found
