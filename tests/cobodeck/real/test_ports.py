"""Which ports a run on the fakes opens, against the table of `hw/drivers/CONNECTIONS.md`."""

from __future__ import annotations

import json
import random
import re
import select
import socket
import struct
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

import pytest

from cobodeck.real.open_connection import own_host
from hw.connection.connection import FOLDER
from hw.fakes.can.can_wire import meeting_point
from tests.cobodeck.real.test_fakes_run import patient, require_served

ROOT = Path(__file__).resolve().parents[3]
TABLE = ROOT / "hw" / "drivers" / "CONNECTIONS.md"
ROW = re.compile(
    r"\| `(?P<process>[\w.]+)` \| (?P<kind>TCP|UDP) (?P<ports>[\w, ]+) \| (?P<reach>.+?) \|"
)
PATIENCE_S = 60.0
SOCKETS = {"tcp": "0A", "tcp6": "0A", "udp": "07", "udp6": "07"}
"""Kinds of sockets, and the state of those that wait for anybody."""
SERVER, WATCH = "cobodeck.live.run_server", "cobodeck"
THROWN = 100_000
CHOSEN = 32_768
"""Ports from here on are chosen by the system."""


class Port(NamedTuple):
    """A port that somebody has opened: `bus` the port of a CAN bus, `any` one of the system's."""

    process: str
    kind: str
    port: str
    near: bool


def table() -> set[Port]:
    found = set()
    for row in ROW.finditer(TABLE.read_text()):
        for port in row["ports"].split(", "):
            found.add(Port(row["process"], row["kind"], port, row["reach"].startswith("near")))
    return found


def tree(pid: int) -> Iterator[int]:
    """A process and all that it has started."""
    yield pid
    for thread in Path(f"/proc/{pid}/task").iterdir():
        for child in (thread / "children").read_text().split():
            yield from tree(int(child))


def opened(pid: int, host: str) -> dict[tuple[str, int, str], Port]:
    """The ports of a run, by address and process."""
    owners = {}
    for one in tree(pid):
        words = Path(f"/proc/{one}/cmdline").read_text().split("\0")
        name = words[words.index("-m") + 1]
        for file in Path(f"/proc/{one}/fd").iterdir():
            owners[str(file.readlink())] = name
    bus = meeting_point(host)[1]
    found = {}
    for kind, state in SOCKETS.items():
        for line in Path(f"/proc/net/{kind}").read_text().splitlines()[1:]:
            words = line.split()
            owner = owners.get(f"socket:[{words[9]}]")
            if owner is None or words[3] != state:
                continue
            at, number = words[1].split(":")
            port = int(number, 16)
            address = socket.inet_ntoa(struct.pack("=I", int(at, 16))) if len(at) == 8 else at
            name = "bus" if port == bus else "any" if port >= CHOSEN else str(port)
            near = address.startswith("127.")
            found[address, port, owner] = Port(owner, kind[:3].upper(), name, near)
    return found


def forged(chance: random.Random) -> bytes:
    """A datagram of chance, or one that somebody without a key makes up."""
    if chance.random() < 0.5:
        return chance.randbytes(chance.randrange(200))
    source = chance.choice(("engine", "arm", "vr", "observer", "chain", "world", "fault", "drives"))
    name = chance.choice(
        ("reset", "command", "pull", "follow", "stop", "here", "observer.here", "arm.link",
         "vr.link", "user.pose", "robot.view", "stop.engaged", "chain.reset", "kill", "over",
         "truth", "place", "wheels", "joints", "subscribe", "bumper", "base.scan")
    )  # fmt: skip
    told = json.dumps([source, 1, name, time.monotonic_ns(), chance.choice((None, 0, "x", [1]))])
    return told.encode() if chance.random() < 0.5 else chance.randbytes(32) + told.encode()


def thrown(ports: dict[tuple[str, int, str], Port], count: int, until: Callable[[], object]) -> int:
    """Send so many to them all, or until then; how many were sent."""
    chance, addresses = (
        random.Random(5),
        [at[:2] for at, one in ports.items() if one.kind == "UDP" and one.near],
    )
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger:
        for number in range(count):
            if number % 100 == 0 and until():
                return number
            stranger.sendto(forged(chance), chance.choice(addresses))
            if number % 20 == 0:
                select.select([], [], [], 0.002)  # others have to be heard, too
    return count


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/net/udp").exists(), reason="needs Linux")
@pytest.mark.requirement(48, 149)
def test_every_port_of_a_run_is_in_the_table_and_what_is_thrown_at_it_does_nothing(
    tmp_path: Path,
) -> None:
    host, file = own_host(), tmp_path / "robot.yaml"
    file.write_text((FOLDER / "fakes.yaml").read_text().replace("loopback", host))
    command = [sys.executable, "-m", "cobodeck", "run", "cobodeck", "--robot", str(file), "--json",
               "--user", patient(tmp_path), "--requests", "1", "--duration", "60"]  # fmt: skip
    elsewhere = ("hw.fakes.kairos.kairos_process", "distributed.scheduler", "distributed.worker",
                 SERVER)  # fmt: skip
    known = {one for one in table() if one.process not in elsewhere}
    known.remove(Port("hw.drivers.chain.process", "UDP", "7401", near=True))  # no observer here
    known.remove(Port(WATCH, "TCP", "any", near=True))  # of `cobodeck watch`
    quiet, found = subprocess.DEVNULL, dict[tuple[str, int, str], Port]()
    with subprocess.Popen(
        command, cwd=ROOT, stdin=quiet, stdout=subprocess.PIPE, stderr=quiet
    ) as running:
        try:
            end = time.monotonic() + PATIENCE_S
            while set(found.values()) != known and time.monotonic() < end:
                assert running.poll() is None, set(found.values()) ^ known
                select.select([], [], [], 0.1)
                try:
                    found = opened(running.pid, host)
                except (OSError, ValueError):  # a process has just begun, or ended
                    continue
            assert set(found.values()) == known
            assert thrown(found, THROWN, running.poll) > THROWN // 10
            assert running.stdout is not None
            figures = json.loads(running.stdout.read())
        finally:
            running.terminate()
    assert (figures["contacts"], figures["errors"]) == (0, []), figures
    require_served(figures, 1)


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/net/tcp").exists(), reason="needs Linux")
@pytest.mark.parametrize(
    ("words", "process"),
    [(["simulate", "--live", "--tier", "0"], SERVER), (["watch", "cobodeck"], WATCH)],
)
@pytest.mark.requirement(48, 149)
def test_the_port_of_a_page_is_in_the_table(tmp_path: Path, words: list[str], process: str) -> None:
    command = [sys.executable, "-m", "cobodeck", *words]
    with subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.PIPE, text=True) as running:
        try:
            assert running.stdout is not None
            assert "page: http" in running.stdout.readline()
            found = set(opened(running.pid, own_host()).values())
        finally:
            running.kill()
    assert found == {one for one in table() if (one.process, one.kind) == (process, "TCP")}


def test_the_table_can_be_read() -> None:
    found = table()
    assert Port("hw.drivers.chain.process", "UDP", "7400", near=True) in found
    assert {one.process for one in found if not one.near} == {
        "hw.drivers.chain.process",
        "hw.fakes.can.can_nodes",
    }
