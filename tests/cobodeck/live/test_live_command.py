"""`simulate --live` from end to end: a page that watches and steers, and the record."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any

import pytest
from websockets.asyncio.client import connect

from tests.cobodeck.live.pages import Client, run
from tests.program import python

ROOT = Path(__file__).resolve().parents[3]
SIMULATE = ["-m", "cobodeck", "simulate", "--scene", "study", "--duration", "6", "--json"]
FOUND = re.compile(r"live page: (http://127\.0\.0\.1:\d+/)  token: (\S+)")

Doing = Callable[[Client, str], Awaitable[None]]


def simulated(folder: Path, doing: Doing, *more: str) -> dict[str, Any]:
    """The figures of a run whose page does something."""
    command = [sys.executable, *SIMULATE, "--live", *more]
    env = {"PYTHONPATH": str(ROOT), "PATH": "/usr/bin:/bin", "HOME": str(folder)}
    with subprocess.Popen(
        command, cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=env
    ) as running:
        try:
            assert running.stderr is not None
            found = FOUND.match(running.stderr.readline())
            assert found is not None
            url, token = found.groups()

            async def main() -> None:
                address = f"{url.replace('http', 'ws')}ws"
                async with connect(address, max_size=None, origin=url.rstrip("/")) as socket:  # type: ignore[arg-type]
                    page = Client(socket)
                    while "chase" not in (await page.hear("state"))["active"]:
                        pass
                    await doing(page, token)

            run(main())
            told, errors = running.communicate(timeout=60)
        finally:
            running.kill()
    assert "Traceback" not in errors
    figures: dict[str, Any] = json.loads(told)
    return figures


async def _watch(page: Client, token: str) -> None:
    frame = await page.hear("frame")
    assert any(shape["l"] == "robot" for shape in frame["shapes"])
    while "run is over" not in (await page.hear("say"))["text"]:
        pass


@pytest.mark.slow
@pytest.mark.realtime
def test_a_run_that_is_watched_is_the_run_without_a_page(tmp_path: Path) -> None:
    watched = simulated(tmp_path, _watch)
    alone = json.loads(python(tmp_path, *SIMULATE).stdout)

    assert watched["trace_sha256"] == alone["trace_sha256"]


async def _steer(page: Client, token: str) -> None:
    assert not (await page.command("pause"))["ok"]
    await page.authorize("ann", token)
    assert (await page.command("pause"))["ok"]
    while not (await page.hear("ev")).get("paused"):
        pass
    assert (await page.command("step"))["ok"]
    assert (await page.command("resume"))["ok"]
    assert (await page.command("lock", path="chase"))["ok"]
    assert (await page.command("speed", speed=20))["ok"]
    assert (await page.command("stop"))["ok"]
    while not (await page.hear("ev")).get("stop"):
        pass
    assert (await page.command("reset"))["ok"]


@pytest.mark.slow
@pytest.mark.realtime
def test_a_run_that_was_steered_is_replayed_as_it_was(tmp_path: Path) -> None:
    figures = simulated(tmp_path, _steer, "--record", "steered.mcap")

    assert figures["errors"] == []
    done = python(tmp_path, "-m", "cobodeck", "replay", "steered.mcap", "--check")
    assert done.returncode == 0, done.stdout + done.stderr
