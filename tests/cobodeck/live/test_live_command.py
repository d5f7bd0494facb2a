"""`simulate --live` from end to end: a page that watches and steers, and the record."""

from __future__ import annotations

import json
import os
import re
import signal
import socket
import subprocess
from collections.abc import Awaitable, Callable
from contextlib import suppress
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from websockets.asyncio.client import connect
from websockets.exceptions import ConnectionClosed

from tests.cobodeck.live.pages import Client, client, run
from tests.cobodeck.live.served import serving
from tests.cobodeck.live.test_server import BAD, raw_socket
from tests.program import python
from tests.waiting import until

SIMULATE = ["simulate", "--scene", "study", "--duration", "6", "--json"]

LONG_S, PATIENCE_S = "60", 120.0
MOST_MB = 64.0
"""So much may a server grow by all kinds of bad clients."""

Doing = Callable[[Client, str], Awaitable[None]]


@pytest.fixture(scope="module")
def alone(tmp_path_factory: pytest.TempPathFactory) -> str:
    """The hash of the run's trace without a page."""
    done = python(tmp_path_factory.mktemp("alone"), "-m", "cobodeck", *SIMULATE)
    return str(json.loads(done.stdout)["trace_sha256"])


def finished(running: subprocess.Popen[str]) -> tuple[dict[str, Any], str]:
    """The figures of a run, and what it has complained of."""
    told, errors = running.communicate(timeout=PATIENCE_S)
    assert "Traceback" not in errors
    return json.loads(told), errors


def simulated(folder: Path, doing: Doing, *more: str) -> dict[str, Any]:
    """The figures of a run whose page does something."""
    with serving(folder, *SIMULATE, "--live", *more) as (running, url, token):

        async def main() -> None:
            address = f"{url.replace('http', 'ws')}ws"
            async with connect(address, max_size=None, origin=url.rstrip("/")) as link:  # type: ignore[arg-type]
                page = Client(link)
                while "chase" not in json.loads(await link.recv()).get("active", ()):
                    pass
                await doing(page, token)

        run(main(), PATIENCE_S)
        return finished(running)[0]


async def _watch(page: Client, token: str) -> None:
    while not any(s["l"] == "robot" for s in (await page.hear("frame"))["shapes"]):
        pass  # the first one may be that of before the first tick
    while "run is over" not in (await page.hear("say"))["text"]:
        pass


@pytest.mark.slow
@pytest.mark.realtime
def test_a_run_that_is_watched_is_the_run_without_a_page(tmp_path: Path, alone: str) -> None:
    watched = simulated(tmp_path, _watch)

    assert watched["trace_sha256"] == alone


@pytest.mark.slow
@pytest.mark.realtime
@pytest.mark.skipif(not Path("/proc/net/tcp").exists(), reason="needs Linux")
def test_a_run_whose_server_is_killed_goes_on_and_says_so(tmp_path: Path, alone: str) -> None:
    with serving(tmp_path, *SIMULATE, "--live") as (running, url, _):
        os.kill(int(process_of(port_of(url)).name), signal.SIGKILL)
        figures, errors = finished(running)

    assert errors.count("no live page any more, the run goes on") == 1
    assert figures["trace_sha256"] == alone


@pytest.mark.slow
@pytest.mark.realtime
@pytest.mark.skipif(not Path("/proc/net/tcp").exists(), reason="needs Linux")
def test_a_run_that_is_killed_leaves_neither_server_nor_port(tmp_path: Path) -> None:
    with serving(tmp_path, *SIMULATE, "--live", "--duration", LONG_S) as (running, url, _):
        process = process_of(port_of(url))
        running.kill()
        running.wait()
        until(lambda: not process.exists())
        with pytest.raises(ConnectionRefusedError):
            socket.create_connection(("127.0.0.1", port_of(url)))


def port_of(url: str) -> int:
    return int(url.rstrip("/").rpartition(":")[2])


class FarServer:
    """The server of a run, as bad clients see it."""

    def __init__(self, link: Any) -> None:
        host, self.port = link.remote_address[:2]
        self.url = f"http://{host}:{self.port}/"
        self._open = ()
        self.access = SimpleNamespace(holder=None)


def process_of(port: int) -> Path:
    """The process that listens on a port, in `/proc`."""
    at = f":{port:04X} 00000000:0000 0A"
    table = Path("/proc/net/tcp").read_text().splitlines()
    inode = next(line.split()[9] for line in table if at in line)
    for process in Path("/proc").glob("[0-9]*"):
        with suppress(OSError):
            if f"socket:[{inode}]" in {str(file.readlink()) for file in (process / "fd").iterdir()}:
                return process
    raise AssertionError(f"no process has port {port}")


def memory_mb(port: int) -> float:
    """Memory that the process with this port has, MB."""
    found = re.search(r"VmRSS:\s+(\d+) kB", (process_of(port) / "status").read_text())
    assert found is not None
    return int(found[1]) / 1e3


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
    longer = json.loads(python(tmp_path, "-m", "cobodeck", *SIMULATE, *long).stdout)

    assert watched["trace_sha256"] == longer["trace_sha256"]
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
@pytest.mark.requirement(19, 57)
def test_a_run_that_was_steered_is_replayed_as_it_was(tmp_path: Path) -> None:
    figures = simulated(tmp_path, _steer, "--record", "steered.mcap")

    assert figures["errors"] == []
    done = python(tmp_path, "-m", "cobodeck", "replay", "steered.mcap", "--check")
    assert done.returncode == 0, done.stdout + done.stderr
