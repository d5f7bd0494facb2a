"""Which ports a run on the fakes opens, against the table of `hw/drivers/CONNECTIONS.md`."""

from __future__ import annotations

import re
import socket
import struct
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import pytest

from cobodeck.opening import own_host
from hw.connection import FOLDER
from hw.fakes.can_wire import meeting_point
from tests.hw.drivers.rigs import key_file

ROOT = Path(__file__).resolve().parents[2]
TABLE = ROOT / "hw" / "drivers" / "CONNECTIONS.md"
ROW = re.compile(
    r"\| `(?P<process>[\w.]+)` \| (?P<kind>TCP|UDP) (?P<ports>[\w, ]+) \| (?P<reach>.+?) \|"
)
PATIENCE_S = 60.0
SOCKETS = {"tcp": "0A", "tcp6": "0A", "udp": "07", "udp6": "07"}
"""Kinds of sockets, and the state of those that wait for anybody."""
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


def opened(pid: int, host: str) -> set[Port]:
    """The ports of a run."""
    owners = {}
    for one in tree(pid):
        words = Path(f"/proc/{one}/cmdline").read_text().split("\0")
        name = words[words.index("-m") + 1]
        for file in Path(f"/proc/{one}/fd").iterdir():
            owners[str(file.readlink())] = name
    bus = meeting_point(host)[1]
    found = set()
    for kind, state in SOCKETS.items():
        for line in Path(f"/proc/net/{kind}").read_text().splitlines()[1:]:
            words = line.split()
            owner = owners.get(f"socket:[{words[9]}]")
            if owner is None or words[3] != state:
                continue
            at, number = words[1].split(":")
            port = int(number, 16)
            near = len(at) == 8 and socket.inet_ntoa(struct.pack("=I", int(at, 16)))[:4] == "127."
            name = "bus" if port == bus else "any" if port >= CHOSEN else str(port)
            found.add(Port(owner, kind[:3].upper(), name, near))
    return found


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/net/udp").exists(), reason="needs Linux")
def test_every_port_of_a_run_is_in_the_table_and_the_other_way_round(tmp_path: Path) -> None:
    host, file = own_host(), tmp_path / "robot.yaml"
    text = (FOLDER / "fakes.yaml").read_text().replace("loopback", host)
    observer = f"observer: {{timeout: 0.5, key: {key_file()}}}"
    file.write_text(text.replace("    port: 7400\n", f"    port: 7400\n    {observer}\n"))
    command = [sys.executable, "-m", "cobodeck", "run", "cobodeck", "--robot", str(file),
               "--user", "brief", "--requests", "1", "--duration", "60"]  # fmt: skip
    known = {one for one in table() if one.process != "hw.fakes.kairos_process"}
    quiet = subprocess.DEVNULL
    with subprocess.Popen(command, cwd=ROOT, stdin=quiet, stdout=quiet, stderr=quiet) as running:
        try:
            end, found = time.monotonic() + PATIENCE_S, set()
            while found != known and time.monotonic() < end and running.poll() is None:
                try:
                    found = opened(running.pid, host)
                except (OSError, ValueError):  # a process has just begun, or ended
                    continue
        finally:
            running.terminate()
    assert found == known


def test_the_table_can_be_read() -> None:
    found = table()
    assert Port("hw.drivers.chain.process", "UDP", "7400", near=True) in found
    assert {one.process for one in found if not one.near} == {
        "hw.drivers.chain.process",
        "hw.fakes.can_nodes",
    }
