"""A page beside a run on the fakes, in real time: it stops it, is missed, and resets it."""

from __future__ import annotations

import asyncio
import json
import re
import subprocess
import sys
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest
from websockets.asyncio.client import connect

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
STOP_S = 0.1
BEAT_S = 0.2
SEEN_S = 2 * FRAME_S
"""What a page knows of the run's time is at most so old."""
LONGEST_S = 100.0


class Operating(Client):
    """A page that controls the run and notes what it sees of its time and stop."""

    def __init__(self, socket: Any) -> None:
        super().__init__(socket)
        self.at = 0.0
        self.stopped = False
        self.acks: dict[str, dict[str, Any]] = {}

    async def listen(self) -> None:
        with suppress(asyncio.CancelledError):
            async for text in self.socket:
                told = json.loads(text)
                self.at = max(self.at, told.get("at") or 0.0)
                self.stopped = told.get("stop", self.stopped)
                if told["t"] == "ack":
                    self.acks[told["id"]] = told

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

    async def answer(self, word: str) -> dict[str, Any]:
        async with asyncio.timeout(LONGEST_S):
            while word not in self.acks:
                await asyncio.sleep(0.01)
        return self.acks[word]


async def _steered(url: str, token: str) -> tuple[float, float]:
    """Stop the run, and leave it alone; the instants of both, s of the run."""
    address = f"{url.replace('http', 'ws')}ws"
    async with connect(address, max_size=None, origin=url.rstrip("/")) as socket:  # type: ignore[arg-type]
        page = Operating(socket)
        listening = asyncio.create_task(page.listen())
        await page.until(False, 2.0)
        await page.tell(t="auth", id="auth", token=token, name="ann")
        assert (await page.answer("auth"))["ok"]
        assert (await page.do("take"))["ok"]
        beating = asyncio.create_task(page.beat())
        await page.until(False, page.at + 2.0)  # heard, it is not missed
        pressed = page.at
        assert (await page.do("stop"))["ok"]
        await page.until(True)
        assert (await page.do("reset"))["ok"]
        await page.until(False, page.at + 1.0)
        beating.cancel()
        left = page.at
        await page.until(True)
        assert (await page.do("take"))["ok"]
        beating = asyncio.create_task(page.beat())
        assert (await page.do("reset"))["ok"]
        await page.until(False, page.at + 0.5)
        assert (await page.do("end"))["ok"]
        beating.cancel()
        listening.cancel()
        return pressed, left


@pytest.mark.slow
@pytest.mark.realtime
@pytest.mark.requirement(54, 55)
def test_a_page_stops_a_run_on_fakes_is_missed_in_control_and_all_is_replayed(
    tmp_path: Path,
) -> None:
    command = [sys.executable, "-m", "cobodeck", "run", "cobodeck", "--robot", "fakes", "--live",
               "--user", "demo", "--scene", "lab_a", "--json", "--record", str(tmp_path / "r.mcap"),
               "--duration", "60"]  # fmt: skip
    with subprocess.Popen(
        command, cwd=ROOT, stdin=subprocess.DEVNULL, text=True,
        stdout=subprocess.PIPE, stderr=subprocess.PIPE,
    ) as running:  # fmt: skip
        try:
            assert running.stderr is not None
            lines = iter(running.stderr.readline, "")
            found = next(filter(None, map(FOUND.match, lines)))
            instants: list[float] = []

            async def main() -> None:
                instants.extend(await _steered(*found.groups()))

            run(main())
            told, errors = running.communicate(timeout=LONGEST_S)
        finally:
            running.terminate()
    assert "Traceback" not in errors
    figures = json.loads(told)
    assert figures["errors"] == []
    done = python(tmp_path, "-m", "cobodeck", "replay", "r.mcap", "--check")
    assert done.returncode == 0, done.stdout + done.stderr
    stops = [(at, why) for at, why in _stops(tmp_path / "r.mcap") if "ann" in why]
    assert stops, errors
    if figures["missed"] > BUSY * figures["ticks"]:
        pytest.skip(f"this machine is too busy: {figures['missed']} ticks are missed")
    (pressed, why), (missed, lost) = stops
    assert why == "ann on a page"
    assert "the page of ann is" in lost
    assert pressed - instants[0] <= STOP_S + SEEN_S
    assert LOST_S - BEAT_S <= missed - instants[1] <= LOST_S + LOOK_S + SEEN_S


def _stops(record: Path) -> list[tuple[float, str]]:
    """When the stop line was pulled, s, and why."""
    found = []
    for group in Record(record).groups():
        for told in group.told:
            if told.topic == f"{TOPIC}stop.engaged":
                sample = sample_of("stop.engaged", told.schema, told.data)
                if sample.value is not None:
                    found.append((sample.stamp_ns / 1e9, str(sample.value)))
    return found
