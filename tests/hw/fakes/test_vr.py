"""The fake VR application: what it does with a world, what it writes, and its faults."""

from __future__ import annotations

import socket
import struct
import time
from collections.abc import Iterator
from types import SimpleNamespace

import pytest

from hw.drivers.unity.protocol.wire import KEEPALIVE, Parser, handshake
from hw.fakes.peers import VrClient
from hw.fakes.unity.unity_client import POSE, Client
from hw.fakes.unity.vr_application import FAULTS
from hw.fakes.unity.vr_demo import main
from hw.geometry import Pose2, Pose3
from hw.ipc.datagrams import Door, Intake, Outlet
from hw.samples import TrackerPose, UserPose
from tests.hw.drivers.unity.unity_rig import DEEP, MAP_FROM_VIVE, Rig


class Beside:
    """A world that answers who subscribes, and a VR application in its process beside a link."""

    def __init__(self) -> None:
        self.rig = Rig()
        self.world = Intake(("vr_client",))
        self.outlet = Outlet()
        self.told: list[object] = []
        self.seen = UserPose(Pose2(3.0, 4.0, 1.0), 1.2)
        self.request: Pose3 | None = None
        host, port = self.rig.link.address
        self.client = VrClient(
            host, port, self.world, self.rig.opening,
            clock_offset=1000.5,
        )  # fmt: skip
        self.client.wait()

    def step(self) -> None:
        """What a world does: hears of what is shown, tells of the user."""
        for told in self.world.poll():
            self.told.append(told)
            if told.name == "subscribe":
                self.outlet.doors = [Door(*told.value)]
        now = time.monotonic_ns()
        self.outlet.send("user.pose", now, self.seen)
        mounts = self.rig.opening.tracking.mounts
        for name, mount in mounts.items():
            self.outlet.send("rover.tracker", now, TrackerPose(name, mount))
        self.outlet.send("vr.haptic_request", now, self.request)

    def until(self, true) -> bool:
        return self.rig.until(true, self.step)

    def close(self) -> None:
        self.client.close()
        self.rig.close()
        self.world.close()
        self.outlet.close()


@pytest.fixture
def beside() -> Iterator[Beside]:
    made = Beside()
    yield made
    made.close()


def test_what_a_world_tells_comes_through_with_its_stamps(beside) -> None:
    rig = beside.rig
    assert beside.until(lambda: rig.newest("user.pose") and rig.newest("rover.tracker"))
    person = rig.newest("user.pose")
    assert person.body.distance_to(Pose2(3.0, 4.0)) < 0.001
    assert person.head_yaw == pytest.approx(1.2, abs=0.001)
    newest = [sample for sample in rig.samples if sample.name == "user.pose"][-1]
    assert 0 <= rig.now() - newest.stamp_ns < 10**9
    beside.request = DEEP
    assert beside.until(lambda: rig.newest("vr.haptic_request"))
    assert rig.newest("vr.haptic_request").distance_to(DEEP) < 1e-6
    assert beside.until(lambda: any(clock.round_trips for clock in rig.values("vr.clock")[-1:]))
    clock = rig.newest("vr.clock")
    assert abs(clock.offset + 1000.5) <= clock.error + 0.001


def test_the_world_hears_whether_the_user_is_shown_the_robot(beside) -> None:
    rig = beside.rig
    assert beside.until(lambda: rig.newest("user.pose"))

    def informed() -> list[object]:
        return [told.value for told in beside.told if told.name == "inform"]

    assert beside.until(lambda: informed()[-2:] == [False, False])
    rig.vr.inform(True)
    assert beside.until(lambda: informed()[-1] is True)
    rig.vr.inform(False)

    def hidden() -> bool:
        rig.vr.show(rig.now())  # as in each tick
        return informed()[-1] is False

    assert beside.until(hidden)


def test_a_fault_is_told_to_its_process_and_ends_when_it_is_told(beside) -> None:
    rig = beside.rig
    assert beside.until(lambda: rig.newest("user.pose"))
    beside.client.fault("frozen")
    assert beside.until(lambda: "tracking is lost" in str(rig.newest("vr.fault")))
    beside.client.fault("none")
    count = len(rig.values("user.pose"))
    assert beside.until(lambda: len(rig.values("user.pose")) > count + 5)


def test_a_message_is_written_field_by_field() -> None:
    pieces: list[bytes] = []
    client = Client("127.0.0.1", 1, {"vr/head": POSE}, {})
    client._socket = SimpleNamespace(sendall=pieces.append)
    client.send("vr/head", [*client.header(1_500_000_000, "map"), *[struct.pack("<d", 1.0)] * 7])
    assert len(pieces) == 15
    assert b"".join(pieces) == (
        b"\x07\0\0\0vr/head" + struct.pack("<I", 4 * 4 + 3 + 56)
        + struct.pack("<IIII", 1, 1, 500_000_000, 3) + b"map" + struct.pack("<7d", *[1.0] * 7)
    )  # fmt: skip


def test_a_client_registers_anew_after_each_connection() -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        client = Client(*server.getsockname(), {"vr/head": POSE}, {"tf": "tf2_msgs/TFMessage"})
        for number in (1, 2):
            while client.connections < number:
                client.poll()
            link, _ = server.accept()
            link.settimeout(5.0)
            parser, found = Parser(), []
            while not found or found[-1].destination != "__topic_list":
                found += parser.feed(link.recv(1 << 16))
            names = [frame.destination for frame in found]
            assert names == ["", "__publish", "__subscribe", "__topic_list"]
            link.sendall(handshake("ros1") + KEEPALIVE)
            link.close()
            while client.connected:
                client.poll()
        assert [name for name, _ in client.told] == ["__handshake"] * 2


def test_the_demo_plays_a_user_until_they_have_done_all(tmp_path, capsys) -> None:
    script = tmp_path / "short.yaml"
    script.write_text("user: short\nsteps:\n  - stand: 0.3\n  - request: {hold: 0.3}\n")
    rig = Rig()
    try:
        host, port = rig.link.address
        assert main(["--host", host, "--port", str(port), "--user", str(script)]) == 0
    finally:
        rig.close()
    said = capsys.readouterr().out
    assert "asks at" in said
    assert "vr.release" in said


def test_the_faults_have_names() -> None:
    assert FAULTS[0] == "none"
    assert len(set(FAULTS)) == len(FAULTS)
    assert MAP_FROM_VIVE.x == 3.0
