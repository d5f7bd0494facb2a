"""The observer's program: heard as long as somebody is there, and a stop however they go (R55)."""

from __future__ import annotations

import itertools
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator
from typing import IO

import pytest

from cobodeck.__main__ import main
from cobodeck.console import FAILED, OK, USAGE
from hw.links.datagrams import Datagram
from tests.hw.drivers.rigs import Chain

PATIENCE_S = 30.0


def names(told: list[Datagram]) -> list[str]:
    return [one.name for one in told]


@pytest.fixture
def chain() -> Iterator[Chain]:
    found = Chain()
    yield found
    found.close()


@pytest.fixture
def observing(chain: Chain) -> Iterator[subprocess.Popen[bytes]]:
    host, port = chain.intake.address
    call = [sys.executable, "-m", "cobodeck", "observe", f"{host}:{port}", "--no-project"]
    pipe = subprocess.PIPE
    with subprocess.Popen(call, stdin=pipe, stdout=pipe, stderr=pipe) as running:
        chain.until(lambda told: names(told).count("observer.here") >= 3)
        yield running
        running.kill()


def written(stream: IO[bytes] | None, data: bytes) -> None:
    assert stream is not None
    stream.write(data)
    stream.flush()


@pytest.mark.requirement(55)
def test_as_long_as_it_runs_the_chain_hears_that_somebody_is_there(
    chain: Chain, observing: subprocess.Popen[bytes]
) -> None:
    told = chain.until(lambda told: names(told).count("observer.here") >= 6)

    assert {(one.source, one.name, one.value) for one in told} == {
        ("observer", "observer.here", True)
    }
    gaps = [b.stamp_ns - a.stamp_ns for a, b in itertools.pairwise(told)]
    assert min(gaps) >= 50_000_000  # it does not flood the chain


@pytest.mark.requirement(55)
@pytest.mark.parametrize("typed", [b"\n", b"stop\n"])
def test_enter_stops_the_robot_and_the_observer_stays(
    chain: Chain, observing: subprocess.Popen[bytes], typed: bytes
) -> None:
    written(observing.stdin, typed)
    chain.until(lambda told: "pull" in names(told))
    after = len(chain.told)
    told = chain.until(lambda told: names(told[after:]).count("observer.here") >= 3)

    assert {one.value for one in told if one.name == "pull"} == {"the observer"}
    assert observing.poll() is None


@pytest.mark.requirement(55)
@pytest.mark.parametrize("end", ["SIGINT", "SIGTERM", "SIGHUP", "terminal"])
def test_however_the_observer_leaves_the_robot_stops(
    chain: Chain, observing: subprocess.Popen[bytes], end: str
) -> None:
    assert observing.stdin is not None
    if end == "terminal":
        observing.stdin.close()
    else:
        observing.send_signal(getattr(signal, end))
    told = chain.until(lambda told: "pull" in names(told))

    assert observing.wait(PATIENCE_S) == OK
    assert next(one.value for one in told if one.name == "pull") == "the observer has left"
    assert observing.stderr is not None
    assert b"software stop" in observing.stderr.read()


def test_it_says_what_it_is(chain: Chain, observing: subprocess.Popen[bytes]) -> None:
    observing.send_signal(signal.SIGINT)
    out, _ = observing.communicate(timeout=PATIENCE_S)

    assert b"It is no safety device" in out
    assert b"emergency" not in out


WRONG = ["nowhere", "host:0", "host:66000", ":7401", "host:ssh"]


@pytest.mark.parametrize("address", WRONG)
def test_an_address_that_is_none_is_told(address: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["observe", address]) == USAGE
    assert "is no HOST:PORT" in capsys.readouterr().err


def test_a_host_that_nobody_knows_is_told(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def unknown(host: str) -> str:
        raise socket.gaierror(-2, f"{host} is not known")

    monkeypatch.setattr("socket.gethostbyname", unknown)

    assert main(["observe", "robot:7401"]) == FAILED
    assert "robot: robot is not known" in capsys.readouterr().err
