"""The observer's program: heard as long as somebody is there, and a stop however they go (R55)."""

from __future__ import annotations

import itertools
import select
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import IO

import pytest

from cobodeck.__main__ import main
from cobodeck.terminal.console import FAILED, OK, USAGE
from hw.drivers.observer import ObserverPort
from hw.drivers.observer_key import key_in
from hw.ipc.datagrams import Datagram
from tests.hw.drivers.rigs import OBSERVER_KEY, key_file, own_address

PATIENCE_S = 30.0


def names(told: list[Datagram]) -> list[str]:
    return [one.name for one in told]


class Chain:
    """The safety chain's port for an observer: all that it is `told`."""

    def __init__(self, host: str, port: int) -> None:
        self.address = host, port
        self.told: list[Datagram] = []
        self.open()

    def open(self) -> None:
        self.port = ObserverPort(self.address, OBSERVER_KEY)

    def until(self, reached: Callable[[list[Datagram]], object]) -> list[Datagram]:
        """All that was told, once that is `reached`."""
        limit = time.monotonic() + PATIENCE_S
        while not reached(self.told):
            assert time.monotonic() < limit, self.told
            select.select([self.port], [], [], 0.1)
            self.told += self.port.poll()
        return self.told

    def hears(self, times: int) -> list[Datagram]:
        """What is told from now on, until the observer was here so often."""
        del self.told[:]
        return self.until(lambda told: names(told).count("observer.here") >= times)


@pytest.fixture
def chain() -> Iterator[Chain]:
    found = Chain(own_address(), 7401)
    yield found
    found.port.close()


@pytest.fixture
def observing(chain: Chain) -> Iterator[subprocess.Popen[bytes]]:
    host, port = chain.address
    call = [sys.executable, "-m", "cobodeck", "observe", f"{host}:{port}", "--no-project"]
    call += ["--key", key_file()]
    pipe = subprocess.PIPE
    with subprocess.Popen(call, stdin=pipe, stdout=pipe, stderr=pipe) as running:
        chain.hears(3)
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
    told = chain.hears(6)

    assert {(one.source, one.name, one.value) for one in told} == {
        ("observer", "observer.here", True)
    }
    gaps = [b.stamp_ns - a.stamp_ns for a, b in itertools.pairwise(told)]
    assert min(gaps) >= 25_000_000  # it does not flood the chain
    assert told[-1].stamp_ns <= time.monotonic_ns()


@pytest.mark.slow
@pytest.mark.requirement(55)
def test_a_chain_that_is_started_again_is_heard_of_and_told(
    chain: Chain, observing: subprocess.Popen[bytes]
) -> None:
    chain.port.close()
    chain.open()

    assert chain.hears(3)


@pytest.mark.requirement(55)
@pytest.mark.parametrize("typed", [b"\n", b"stop\n"])
def test_enter_stops_the_robot_and_the_observer_stays(
    chain: Chain, observing: subprocess.Popen[bytes], typed: bytes
) -> None:
    written(observing.stdin, typed)
    chain.until(lambda told: "pull" in names(told))
    pulls = {one.value for one in chain.told if one.name == "pull"}
    chain.hears(3)

    assert pulls == {"the observer"}
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


def test_it_says_what_it_is_and_that_it_is_heard(
    chain: Chain, observing: subprocess.Popen[bytes]
) -> None:
    chain.hears(3)
    observing.send_signal(signal.SIGINT)
    out, news = observing.communicate(timeout=PATIENCE_S)

    assert b"the robot hears you" in news

    assert b"It is no safety device" in out
    assert b"emergency" not in out


WRONG = ["nowhere", "host:0", "host:66000", ":7401", "host:ssh"]


@pytest.mark.parametrize("address", WRONG)
def test_an_invalid_address_is_reported(address: str, capsys: pytest.CaptureFixture[str]) -> None:
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


def test_an_observer_on_another_machine_needs_a_key(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["observe", "192.0.2.7:7401"]) == USAGE
    assert "192.0.2.7 is another machine: --key FILE" in capsys.readouterr().err


def test_a_key_is_made_once_for_its_owner_alone(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "observer.key"

    assert main(["observe", "--new-key", str(file)]) == OK
    assert f"{file}: carry a copy" in capsys.readouterr().out
    assert file.stat().st_mode & 0o777 == 0o600
    made = file.read_bytes()
    assert main(["observe", "--new-key", str(file)]) == FAILED
    assert "exists" in capsys.readouterr().err
    assert file.read_bytes() == made


@pytest.mark.parametrize(
    ("mode", "text", "message"),
    [
        (0o640, "00" * 32, "others may read or change it; `chmod 600"),
        (0o602, "00" * 32, "others may read or change it; `chmod 600"),
        (0o600, "00" * 31, "it has no key; remove it: `cobodeck observe --new-key"),
        (0o600, "xy" * 32, "it has no key"),
        (0o600, "", "it has no key"),
    ],
)
def test_a_key_that_is_none_or_that_others_can_read_is_refused(
    tmp_path: Path, mode: int, text: str, message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "observer.key"
    file.write_text(text)
    file.chmod(mode)

    assert main(["observe", "127.0.0.1:7401", "--key", str(file)]) == FAILED
    assert message in capsys.readouterr().err


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (("127.0.0.1:7401", "--key", "/no/such/key"), "cobodeck: /no/such/key: No such file"),
        (("255.255.255.255:7401",), "cobodeck: 255.255.255.255:7401: Permission denied"),
        (("127.0.0.1:7401", "--key", "~nobody-has-this/key"), "this user has no home; set HOME"),
    ],
)
def test_what_cannot_be_had_is_said_with_its_place(
    call: tuple[str, ...], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    key = () if "--key" in call else ("--key", key_file())

    assert main(["observe", *call, *key]) == FAILED
    assert message in capsys.readouterr().err


def test_without_a_file_the_user_has_a_key_of_their_own(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("HOME", str(tmp_path))

    key = key_in(None)

    assert len(key) == 32
    assert key_in(None) == key_in("~/.config/cobodeck/observer.key") == key
    assert (tmp_path / ".config/cobodeck/observer.key").stat().st_mode & 0o777 == 0o600


def test_where_the_robot_is_has_to_be_said(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["observe"]) == USAGE
    assert "HOST:PORT is missing" in capsys.readouterr().err
