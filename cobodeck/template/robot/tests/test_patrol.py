"""The chart alone, on the simulated robot, and on the driver against its fake."""

import json
import socket
import threading
from pathlib import Path

import pytest

from cobodeck.__main__ import main
from hw.geometry import Pose2
from PROJECT.fake import FakeRover
from PROJECT.udp_base import UdpBase

FOLDER = Path(__file__).parents[1] / "PROJECT"


def test_a_low_battery_sends_it_home_with_the_lamp_on(sim):
    sim.start("patrol", script={"GoTo": ["there", "there"]}, real=["BatteryLow", "Light"])
    sim.signal("battery.level", 0.8, hold=True)  # anew at every tick
    sim.wait(10)
    assert sim.active
    sim.signal("battery.level", 0.2, hold=True)
    sim.until("home", timeout=1)
    assert ("light", True) in sim.parts["lamp"].commands


def test_a_robot_that_is_lost_is_a_failure(sim):
    sim.start("patrol", script={"GoTo": "lost"})
    sim.until("failed", timeout=1)


def test_it_patrols_on_the_simulated_robot(sim):
    sim.start("patrol", robot=str(FOLDER / "rover.yaml"))
    sim.until(lambda: sim.outcome, timeout=60)
    assert sim.outcome == "home"
    assert sim.path("out", "back").count("out") >= 2


@pytest.fixture
def fake():
    rover = FakeRover(port=0, battery_s=6.0)
    serving = threading.Thread(target=rover.run)
    serving.start()
    yield rover
    rover.over = True
    serving.join()


def test_it_patrols_through_the_driver_against_the_fake(fake, tmp_path, monkeypatch):
    text = (FOLDER / "rover_udp.yaml").read_text().replace("47101", str(fake.port))
    connection = tmp_path / "rover_udp.yaml"
    connection.write_text(text.replace("./rover.yaml", str(FOLDER / "rover.yaml")))
    run = ["run", "patrol", "--robot", str(connection), "--person-unwatched", "--duration", "30"]
    assert main(run) == 0
    assert fake.farthest > 1.0
    assert abs(fake.x) < 0.1 and abs(fake.y) < 0.1
    assert fake.velocity == (0.0, 0.0, 0.0)


NONSENSE = [
    b"", b"\xff", b"{", b"null", b"7", b'"x"', b"[" * 1000, b"{}",
    b'{"x": 0, "y": 0, "yaw": 0, "vx": 0, "vy": 0, "wz": 0, "battery": null}',
    b'{"x": NaN, "y": 0, "yaw": 0, "vx": 0, "vy": 0, "wz": 0, "battery": 1}',
    b'{"x": 1%s, "y": 0, "yaw": 0, "vx": 0, "vy": 0, "wz": 0, "battery": 1}' % (b"0" * 400),
    b'{"x": 0, "y": 0, "yaw": 0, "vx": 0, "vy": 0, "wz": 0, "battery": 1%s}' % (b"0" * 400),
]  # fmt: skip


def test_datagrams_of_others_are_not_heard():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as rover:
        rover.bind(("127.0.0.1", 0))
        base, heard = UdpBase("127.0.0.1", rover.getsockname()[1], lambda: 5), threading.Event()
        base.wake = heard.set
        _, peer = rover.recvfrom(1024)
        for datagram in NONSENSE:
            rover.sendto(datagram, peer)
        ours = b'{"x": 1, "y": 2, "yaw": 0, "vx": 0, "vy": 0, "wz": 0, "battery": 0.5}'
        rover.sendto(ours, peer)
        assert heard.wait(10.0)
        pose, _, level = base.samples(5)
        base.close()
    assert pose == ("base.pose", 5, Pose2(1.0, 2.0, 0.0))
    assert level == ("battery.level", 5, 0.5)


def test_the_fake_goes_on_whatever_it_is_sent(fake):
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as driver:
        driver.connect(("127.0.0.1", fake.port))
        driver.settimeout(10.0)
        for number in (b"NaN", b"1" + b"0" * 400):
            driver.send(b'{"vx": %s, "vy": 0, "wz": 0}' % number)
        for datagram in NONSENSE:
            driver.send(datagram)
        driver.send(b'{"vx": 0.1, "vy": 0, "wz": 0}')
        while json.loads(state := driver.recv(1024))["vx"] != 0.1:
            assert b"NaN" not in state
    assert b"NaN" not in state


def test_nobody_there_is_told(tmp_path, monkeypatch):
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    text = (FOLDER / "rover_udp.yaml").read_text().replace("47101", str(port))
    connection = tmp_path / "rover_udp.yaml"
    connection.write_text(text.replace("./rover.yaml", str(FOLDER / "rover.yaml")))
    run = ["run", "patrol", "--robot", str(connection), "--person-unwatched", "--duration", "1"]
    assert main(run) == 0  # it waits for the first pose, and drives nowhere
