"""The force of a UR arm: the driver's own reader, against the fake controller."""

import contextlib
import math
import socket
import threading
import time

import numpy as np
import pytest

from hw.drivers.ur.output_stream import OutputStream
from hw.drivers.ur.ur_wrench import NO_LOAD, OUTPUTS, UrWrench, on_flange
from hw.fakes.peers import Cb3
from hw.geometry import Pose3
from hw.model.flange import FlangeChain
from hw.samples import WrenchReading
from tests.hw.drivers.rigs import Listener, opening, own_address
from tests.hw.drivers.ur.ur_rig import PARKED, ROBOT

TCP = (0.4, -0.2, 0.5, 0.0, 0.0, 0.0)
LOAD = (3.0, -4.0, 12.0, 0.1, 0.2, -0.3)


class Rig:
    """A fake controller and the driver that reads it. `stack` closes both."""

    def __init__(self, stack):
        self.host = own_address()
        self.fake = Cb3(self.host, joints=PARKED)
        stack.callback(self.fake.close)
        self.fake.wait()
        self.part = UrWrench(self.host, opening(ROBOT), time.monotonic_ns)
        stack.callback(self.part.close)
        self.part.wait()
        self.listener = Listener(self.part)

    def until(self, wanted):
        self.listener.until(wanted)

    @property
    def newest(self):
        """The newest reading; one without load before the first."""
        return self.listener.got[-1].value if self.listener.got else NO_LOAD

    def reads(self, force):
        """Does the newest reading have so great a force?"""
        return math.hypot(*self.newest.force) == pytest.approx(force, abs=1e-9)


@pytest.fixture
def stack():
    with contextlib.ExitStack() as stack:
        yield stack


@pytest.fixture
def rig(stack):
    return Rig(stack)


@pytest.mark.requirement(150)
def test_force_and_torque_are_those_at_the_flange_in_its_frame():
    # the flange half a metre above the base, pointing ahead: its z is the base's x
    flange = Pose3.from_angles(0.5, 0.0, 0.5, (0.0, math.pi / 2, 0.0))
    found = on_flange(flange, (0.7, 0.0, 0.5, 0, 0, 0), (0.0, 0.0, -10.0, 0.0, 0.0, 0.5))

    assert found.force == pytest.approx((10.0, 0.0, 0.0))  # its x points down
    assert found.torque == pytest.approx((-0.5, 2.0, 0.0))


@pytest.mark.requirement(150)
def test_what_presses_on_the_tool_is_read_and_less_what_it_was_zeroed_at(rig):
    rig.until(lambda: len(rig.listener.got) > 5)
    assert rig.newest == NO_LOAD
    rig.fake.fault("press", (*TCP, *LOAD))
    rig.until(lambda: rig.reads(13.0))

    wanted = on_flange(FlangeChain(ROBOT.arm).on_base(PARKED), TCP, LOAD)
    assert rig.newest.force == pytest.approx(wanted.force)
    assert rig.newest.torque == pytest.approx(wanted.torque)
    rig.part.zero()
    rig.until(lambda: rig.reads(0.0))
    rig.fake.fault("press", (*TCP, *(2.0 * np.array(LOAD)).tolist()))
    rig.until(lambda: rig.reads(13.0))
    assert rig.newest == WrenchReading(pytest.approx(wanted.force), pytest.approx(wanted.torque))
    stamps = [sample.stamp_ns for sample in rig.listener.got]
    assert stamps == sorted(stamps)
    assert rig.part.fault is None


@pytest.mark.parametrize(
    ("fault", "told"),
    [
        ("mute", "silent"),
        ("freeze", "its time stands still"),
        ("close", "not connected"),
        ("drop", None),
    ],
)
def test_a_controller_that_says_nothing_is_a_fault_until_it_speaks_again(rig, fault, told):
    rig.fake.fault(fault)
    if told is not None:
        rig.until(lambda: told in (rig.part.fault or ""))
        rig.fake.fault("well")
    rig.until(lambda: rig.part.fault is None)
    before = len(rig.listener.got)
    rig.until(lambda: len(rig.listener.got) > before + 10)


def _states(host):
    """Does the controller state the force?"""
    try:
        return UrWrench.probe(host, more=1) == f"{host} states the force at its tool"
    except OSError:
        return False


def test_an_output_that_the_controller_lacks_is_named(rig):
    rig.fake.fault("refuse", "actual_TCP_force")
    rig.until(lambda: not _states(rig.host))
    with pytest.raises(OSError, match="it has no output actual_TCP_force: NOT_FOUND"):
        OutputStream(rig.host, OUTPUTS)
    rig.fake.fault("well")
    rig.until(lambda: _states(rig.host))


def test_it_says_when_nobody_is_there():
    with pytest.raises(OSError, match="refused"):
        UrWrench.probe(own_address())


@pytest.mark.parametrize(
    ("answer", "told"),
    [
        (b"HTTP/1.1 400\r\n", "closed the connection"),
        (b"\x00\x01\x02", "is not RTDE"),
        (b"\x00\x04V\x00", "does not speak RTDE 2"),
    ],
)
def test_who_speaks_something_else_is_refused(answer, told, monkeypatch):
    with socket.create_server(("127.0.0.1", 0)) as door:
        port = door.getsockname()[1]
        monkeypatch.setattr("hw.drivers.ur.output_stream.RTDE", port)
        monkeypatch.setattr("hw.drivers.ur.output_stream.TIMEOUT_S", 0.2)
        door.settimeout(5.0)

        def serve():
            link, _ = door.accept()
            with link:
                link.recv(100)
                link.sendall(answer)

        threading.Thread(target=serve, daemon=True).start()
        with pytest.raises(OSError, match=told):
            OutputStream("127.0.0.1", OUTPUTS)
