"""`simulate --live` from end to end: a page that watches and steers, and the record."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from collections.abc import Awaitable, Callable
from contextlib import suppress
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from websockets.asyncio.client import connect
from websockets.exceptions import ConnectionClosed

from tests.cobodeck.live.pages import Client, client, run
from tests.cobodeck.live.test_server import BAD, raw_socket
from tests.program import python

ROOT = Path(__file__).resolve().parents[3]
SIMULATE = ["-m", "cobodeck", "simulate", "--scene", "study", "--duration", "6", "--json"]
FOUND = re.compile(r"live page: (http://127\.0\.0\.1:\d+/)  token: (\S+)")

LONG_S, PATIENCE_S = "60", 120.0
MOST_MB = 64.0
"""So much may a server grow by all kinds of bad clients."""

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
            lines = iter(running.stderr.readline, "")
            found = next(filter(None, map(FOUND.match, lines)))  # libraries may warn before
            url, token = found.groups()

            async def main() -> None:
                address = f"{url.replace('http', 'ws')}ws"
                async with connect(address, max_size=None, origin=url.rstrip("/")) as socket:  # type: ignore[arg-type]
                    page = Client(socket)
                    while "chase" not in json.loads(await socket.recv()).get("active", ()):
                        pass
                    await doing(page, token)

            run(main(), PATIENCE_S)
            told, errors = running.communicate(timeout=PATIENCE_S)
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


class FarServer:
    """The server of a run, as bad clients see it."""

    def __init__(self, socket: Any) -> None:
        host, self.port = socket.remote_address[:2]
        self.url = f"http://{host}:{self.port}/"
        self._open = ()
        self.access = SimpleNamespace(holder=None)


def memory_mb(port: int) -> float:
    """Memory that the process with this port has, MB."""
    at = f":{port:04X} 00000000:0000 0A"
    table = Path("/proc/net/tcp").read_text().splitlines()
    inode = next(line.split()[9] for line in table if at in line)
    for process in Path("/proc").glob("[0-9]*"):
        with suppress(OSError):
            held = {str(file.readlink()) for file in (process / "fd").iterdir()}
            if f"socket:[{inode}]" in held:
                found = re.search(r"VmRSS:\s+(\d+) kB", (process / "status").read_text())
                assert found is not None
                return int(found[1]) / 1e3
    raise AssertionError(f"no process has port {port}")


async def _misbehave(page: Client, token: str) -> None:
    server: Any = FarServer(page.socket)
    before = memory_mb(server.port)
    unread = await raw_socket(server)  # gets all that pages get, and reads none of it
    for bad in BAD:
        with suppress(ConnectionClosed):
            async with client(server) as other:
                await bad(server, Client(other))
    grown = memory_mb(server.port) - before
    assert grown < MOST_MB, f"the server has grown by {grown:.1f} MB"
    await page.hear("frame")
    unread.close()


@pytest.mark.slow
@pytest.mark.realtime
@pytest.mark.requirement(54)
@pytest.mark.skipif(not Path("/proc/net/tcp").exists(), reason="needs Linux")
def test_a_run_beside_bad_clients_is_the_run_without_a_page(tmp_path: Path) -> None:
    long = ("--duration", LONG_S)
    watched = simulated(tmp_path, _misbehave, *long)
    alone = json.loads(python(tmp_path, *SIMULATE, *long).stdout)

    assert watched["trace_sha256"] == alone["trace_sha256"]
    assert watched["errors"] == []


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
