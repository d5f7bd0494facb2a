"""Before parts are opened: what a connection needs and does not find, without moving anything."""

from __future__ import annotations

import errno
import json
import re
import socket
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest

from cobodeck.__main__ import main
from cobodeck.checks import device_checks
from cobodeck.checks.connection_checks import NEVER
from cobodeck.checks.device_checks import Endpoint, addresses_in
from cobodeck.checks.observer_checks import watching
from cobodeck.fitness.check import BAD, FIT, MISSING, NOTE
from cobodeck.fitness.check_list import ask
from cobodeck.real.open_connection import in_this_run, own_host
from cobodeck.terminal.console import FAILED, OK
from hw.connection.connection import connection_names, load_connection
from hw.drivers.access import can_hindrance
from hw.fakes.can.can_wire import has_route
from tests.hw.drivers.rigs import key_file

HEAD = "connection: own\nmodel: rbkairos_ur10\n"
HERE = "hw.connection.connection:Connection"
ODD = "127.93.20.7"
"""An address of this machine at which nobody listens."""


class Driver:
    """Needs what there is not."""

    needs = ("json", "nobody_has_this")


def all_checks(folder: Path, text: str) -> dict[str, list[tuple[str, str]]]:
    file = folder / "own.yaml"
    file.write_text(HEAD + text)
    found: dict[str, list[tuple[str, str]]] = {}
    for answer in ask("doctor", connection=load_connection(file), packages={"hw"}):
        found.setdefault(answer.what, []).append((answer.state, answer.explanation))
    return found


def checks(folder: Path, text: str) -> dict[str, tuple[str, str]]:
    """The first one of each that is not well, or the last."""
    found = all_checks(folder, text).items()
    return {what: next((one for one in all_ if one[0] != FIT), all_[-1]) for what, all_ in found}


@pytest.fixture
def listening() -> Iterator[socket.socket]:
    with closing(socket.socket(socket.AF_INET, socket.SOCK_STREAM)) as server:
        server.bind((ODD, 0))
        server.listen()
        yield server


def test_who_takes_connections_answers_and_who_does_not_is_named(
    tmp_path: Path, listening: socket.socket
) -> None:
    port = listening.getsockname()[1]
    entry = f"{{driver: '{HERE}', scanners: {{front: {{host: {ODD}, port: {port}}}}}}}"

    answers = checks(tmp_path, f"parts: {{lidar: {entry}}}\n")["parts.lidar"]
    listening.close()
    silent = checks(tmp_path, f"parts: {{lidar: {entry}}}\n")["parts.lidar"]

    assert answers == (FIT, f"{ODD}:{port} takes a connection; who it is was not asked")
    assert silent == (BAD, f"{ODD}:{port} is a machine that takes no connection there")


def test_who_is_out_of_reach_is_bad(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def silent(address: tuple[str, int], timeout: float) -> socket.socket:
        assert 0.0 < timeout <= 2.0
        raise TimeoutError

    monkeypatch.setattr(socket, "create_connection", silent)

    text = f"parts: {{arm: {{driver: '{HERE}', host: 10.255.0.1, port: 30004}}}}\n"

    assert checks(tmp_path, text)["parts.arm"] == (
        BAD,
        "10.255.0.1:30004 is out of reach: 1 s",
    )


CHAIN = "hw.drivers.chain.chain_client:ChainLink"


@pytest.mark.parametrize(
    ("kind", "driver", "host"),
    [(socket.SOCK_STREAM, HERE, "0.0.0.0"), (socket.SOCK_DGRAM, CHAIN, "127.0.0.1")],
)
def test_a_port_of_ours_that_somebody_has_is_bad(
    tmp_path: Path, kind: int, driver: str, host: str
) -> None:
    with closing(socket.socket(socket.AF_INET, kind)) as other:
        other.bind((host, 0))
        if kind == socket.SOCK_STREAM:
            other.listen()
        port = other.getsockname()[1]
        text = f"links: {{own: {{driver: '{driver}', port: {port}}}}}\n"
        text += f"parts: {{trackers: {{driver: '{HERE}', link: own}}}}\n"

        assert checks(tmp_path, text)["links.own"][0] == BAD
    assert checks(tmp_path, text)["links.own"][0] == FIT


def test_a_chain_takes_its_port_where_it_serves_and_nowhere_else(tmp_path: Path) -> None:
    with closing(socket.socket(socket.AF_INET, socket.SOCK_DGRAM)) as elsewhere:
        elsewhere.bind((ODD, 0))
        port = elsewhere.getsockname()[1]
        text = f"links: {{own: {{driver: '{CHAIN}', port: {port}}}}}\n"
        text += f"parts: {{trackers: {{driver: '{HERE}', link: own}}}}\n"

        assert checks(tmp_path, text)["links.own"][0] == FIT


ANY = "0.0.0.0"
ARGUMENTS: list[tuple[Any, list[Endpoint]]] = [
    ({"host": "a", "port": 1}, [Endpoint("a", 1)]),
    ({"address": "a", "port": 1}, [Endpoint("a", 1)]),
    ({"host": ANY, "port": 1}, [Endpoint(ANY, 1, own=True)]),
    ({"port": 1, "x": {"host": "b", "port": 2}}, [Endpoint("here", 1, own=True), Endpoint("b", 2)]),
    ({"scanners": {"x": {"host": "a", "port": 1}, "y": {"host": "b", "port": 2}}}, [
        Endpoint("a", 1), Endpoint("b", 2),
    ]),
    ({"observer": {"port": 3}}, [Endpoint(ANY, 3, own=True)]),
    ({"host": "a"}, []),
    ({"bus": "can0", "rate": 100}, []),
]  # fmt: skip


@pytest.mark.parametrize(("arguments", "addresses"), ARGUMENTS)
def test_addresses_are_found_wherever_they_stand(arguments: Any, addresses: list[Endpoint]) -> None:
    assert list(addresses_in(arguments, "here")) == addresses


def test_a_controller_is_asked_what_it_is(tmp_path: Path, listening: socket.socket) -> None:
    text = f"parts: {{arm: {{driver: 'hw.drivers.ur.ur_arm:UrArm', host: {ODD}}}}}\n"

    state, about = checks(tmp_path, text)["parts.arm"]

    assert state == BAD
    assert about.startswith(f"no UR controller at {ODD}: port 29999: ")


def test_who_has_to_watch_is_told_what_to_type(tmp_path: Path) -> None:
    link = f"driver: '{CHAIN}', port: 7400, observer: {{timeout: 0.5}}"
    head = f"parts: {{base: {{driver: '{HERE}', link: chain}}}}\n"

    near = checks(tmp_path, f"{head}links: {{chain: {{{link}}}}}\n")["observer"]
    far = link.replace("0.5}", f"0.5, host: 10.0.0.1, port: 7402, key: {key_file()}}}")
    anywhere = link.replace("0.5}", "0.5, host: 0.0.0.0}")

    assert near == (NOTE, "somebody has to watch: cobodeck observe 127.0.0.1:7401")
    text = f"{head}links: {{chain: {{{far}}}}}\n"
    told = checks(tmp_path, text)["observer"]
    assert told == (NOTE, "somebody has to watch: cobodeck observe 10.0.0.1:7402 --key FILE")
    text = f"{head}links: {{chain: {{{anywhere}}}}}\n"
    state, told = all_checks(tmp_path, text)["observer"][0]
    assert (state, told.partition("watch: ")[2]) == (
        NOTE,
        "cobodeck observe HOST:7401; HOST is an address of this machine",
    )
    assert "observer" not in checks(tmp_path, f"{head}links: {{chain: {{driver: '{HERE}'}}}}\n")


def test_an_observer_of_fakes_is_told_the_address_of_this_run(tmp_path: Path) -> None:
    link = f"driver: '{CHAIN}', host: loopback, port: 7400, observer: {{timeout: 0.5}}"
    text = f"parts: {{base: {{driver: '{HERE}', link: chain}}}}\nlinks: {{chain: {{{link}}}}}\n"

    [(state, told)] = all_checks(tmp_path, text)["observer"]
    [here] = watching(in_this_run(load_connection(tmp_path / "own.yaml")), {"hw"})

    assert (state, told.partition("observe ")[2][:10]) == (NOTE, "HOST:7401;")
    assert here.explanation == f"somebody has to watch: cobodeck observe {own_host()}:7401"


@pytest.mark.parametrize(
    ("observer", "told"),
    [
        ("host: 0.0.0.0", "at 0.0.0.0 anybody could speak for the observer: name the file of a"),
        ("host: 10.0.0.1", "at 10.0.0.1 anybody could speak for the observer: name the file of a"),
        ("key: /no/such/file", "No such file or directory: '/no/such/file'"),
        ("key: /dev/null", "/dev/null: others may read or change it; `chmod 600 /dev/null`"),
    ],
)
def test_an_observer_without_the_key_that_is_needed_is_bad(
    tmp_path: Path, observer: str, told: str
) -> None:
    link = f"driver: '{CHAIN}', port: 7400, observer: {{timeout: 0.5, {observer}}}"
    text = f"parts: {{base: {{driver: '{HERE}', link: chain}}}}\nlinks: {{chain: {{{link}}}}}\n"

    (_, (state, about)) = all_checks(tmp_path, text)["observer"]

    assert state == BAD
    assert told in about


VR = "hw.drivers.unity.unity_link:Unity"
OPEN = [
    (VR, "port: 10000", MISSING, "TCP port 10000 of links.own can be reached at all addresses of "
     "this machine: the VR link has no password: whoever connects first, from anywhere, is the "
     "person; write `peer: ADDRESS`"),
    (VR, "port: 10000, peer: 10.0.0.7", NOTE,
     "the VR link has no password: the first headset at 10.0.0.7/32 is the person"),
    (VR, "port: 10000, host: 127.0.0.1", None, ""),
    (CHAIN, "port: 7400", None, ""),
    (CHAIN, "port: 7400, observer: {}", None, ""),
    (CHAIN, "port: 7400, observer: {host: 0.0.0.0}", NOTE, "UDP port 7401 of links.own can be "
     "reached at all addresses of this machine: an observer who has the key"),
    (HERE, "port: 47999", NOTE, "its driver does not say whom it believes"),
]  # fmt: skip


@pytest.mark.parametrize(("driver", "values", "state", "told"), OPEN)
def test_what_other_machines_reach_is_told(
    tmp_path: Path, driver: str, values: str, state: str | None, told: str
) -> None:
    text = f"links: {{own: {{driver: '{driver}', {values}}}}}\n"
    text += f"parts: {{trackers: {{driver: '{HERE}', link: own}}}}\n"

    found = all_checks(tmp_path, text)

    assert [one[0] for one in found.get("open port", [])] == ([] if state is None else [state])
    assert state is None or told in found["open port"][0][1]
    assert not any("takes a connection" in one[1] for one in found["links.own"])


def test_fakes_are_not_called_before_they_are_started(tmp_path: Path) -> None:
    text = f"peers: {{world: {{driver: '{HERE}', host: loopback, port: 9}}}}\n"
    text += f"parts: {{base: {{driver: '{HERE}', host: loopback, port: 9}}}}\n"

    assert checks(tmp_path, text)["parts.base"] == (FIT, HERE)


BUSES = {
    "interface: socketcan, channel: can_nowhere": "there is no such interface",
    "interface: slcan, channel: /dev/nothing_there": "there is no such device",
}


@pytest.mark.parametrize("bus", BUSES)
def test_a_bus_that_cannot_be_opened_is_bad(tmp_path: Path, bus: str) -> None:
    text = f"parts: {{base: {{driver: '{HERE}', hardware: {{bus: {{{bus}}}}}}}}}\n"

    state, about = checks(tmp_path, text)["parts.base"]

    assert state == BAD
    assert BUSES[bus] in about


@pytest.mark.parametrize(
    ("flags", "told"), [("0x40080", "sudo ip link set can0 up"), ("0x40081", None)]
)
def test_an_interface_that_is_down_is_bad(tmp_path: Path, flags: str, told: str | None) -> None:
    (tmp_path / "can0").mkdir()
    (tmp_path / "can0" / "flags").write_text(f"{flags}\n")

    found = can_hindrance("can0", 250_000, tmp_path)

    assert (found is None) == (told is None)
    assert told is None or f"{told} type can bitrate 250000" in str(found)


@pytest.mark.parametrize(
    ("entry", "what"),
    [
        ("scanners: {front: {device: DEVICE}}", "DEVICE"),
        ("bus: {interface: slcan, channel: DEVICE}", "CAN by slcan DEVICE"),
    ],
)
def test_a_serial_device_without_the_right_to_it_is_bad(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, entry: str, what: str
) -> None:
    device = tmp_path / "ttyUSB7"
    device.touch()
    told = f"parts: {{lidar: {{driver: '{HERE}', {entry.replace('DEVICE', str(device))}}}}}\n"

    assert checks(tmp_path, told)["parts.lidar"][0] == FIT
    monkeypatch.setattr("hw.drivers.access.os.access", lambda *_: False)
    state, about = checks(tmp_path, told)["parts.lidar"]

    assert state == BAD
    assert about.startswith(f"{what.replace('DEVICE', str(device))}: no right to it: ")
    assert "usermod -aG dialout $USER" in about


def test_multicast_without_a_route_is_told_with_what_helps(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    bus = "interface: udp_multicast, channel: 239.74.163.2"
    text = f"parts: {{base: {{driver: '{HERE}', bus: {{{bus}}}}}}}\n"

    assert checks(tmp_path, text)["parts.base"][1].endswith(
        "can send on this bus"
    ) or not has_route(*device_checks.GROUP)

    class Unrouted(socket.socket):
        def connect(self, address: object) -> None:
            raise OSError(errno.ENETUNREACH, "Network is unreachable")

    monkeypatch.setattr(socket, "socket", Unrouted)
    state, about = checks(tmp_path, text)["parts.base"]

    assert state == BAD
    assert "ip route add 224.0.0.0/4" in about


def test_what_a_driver_imports_later_is_looked_for_now(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("hw.connection.connection.Driver", Driver, raising=False)

    missing = checks(tmp_path, "parts: {arm: {driver: 'hw.connection.connection:Driver'}}\n")
    gone = checks(tmp_path, "parts: {arm: {driver: 'hw.nothing:Arm'}}\n")
    nameless = checks(tmp_path, "parts: {arm: {driver: 'hw.connection.connection:Nobody'}}\n")
    strange = checks(tmp_path, "parts: {arm: {driver: 'os:system'}}\n")

    assert missing["parts.arm"][0] == BAD
    assert "package nobody_has_this; a simulation works without it" in missing["parts.arm"][1]
    for found in (gone, nameless, strange):
        assert found["parts.arm"][0] == BAD


def test_a_real_robot_was_never_proven_until_somebody_has_written_down_that_it_was(
    tmp_path: Path,
) -> None:
    text = f"real: true\nparts: {{arm: {{driver: '{HERE}'}}}}\n"

    assert checks(tmp_path, text)["proven"] == (MISSING, NEVER)
    proven = checks(tmp_path, f"{text}proven: 2027-01-12 hall 3 by A. Writer\n")["proven"]
    assert proven == (FIT, "on 2027-01-12 hall 3 by A. Writer")
    assert "proven" not in checks(tmp_path, text.replace("true", "false"))


def test_remarks_of_a_connection_are_told(tmp_path: Path) -> None:
    text = f"told: [its brakes squeak]\nparts: {{arm: {{driver: '{HERE}'}}}}\n"

    assert checks(tmp_path, text)["own"] == (NOTE, "its brakes squeak")


def test_the_doctor_tells_of_this_machine_too(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["doctor", "--robot", "mock", "--json"]) == OK

    checks = json.loads(capsys.readouterr().out)["checks"]
    found = {check["what"]: check for check in checks}
    assert {"connection mock", "real time", "clock"} <= set(found)
    assert found["real time"]["state"] in (FIT, MISSING)
    assert found["clock"]["state"] in (FIT, MISSING)


def test_the_doctor_fails_where_something_is_bad(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "own.yaml"
    file.write_text(f"{HEAD}parts: {{arm: {{driver: 'hw.nothing:Arm'}}}}\n")

    assert main(["doctor", "--robot", str(file)]) == FAILED
    assert "hw.nothing:Arm: ModuleNotFoundError" in capsys.readouterr().out


@pytest.mark.requirement(54)
def test_no_text_claims_to_be_more_than_a_software_stop() -> None:
    texts = [NEVER, *(t for name in connection_names() for t in load_connection(name).told)]
    for text in texts:
        assert not re.search(r"\bsafe(ly)?\b", text.lower())
    assert "software stop" in NEVER
