"""CAN buses by configuration: what opens, what does not and why, and what comes through."""

import errno
import os
import socket

import can
import pytest
from hypothesis import given, strategies as st

from hw.drivers import gates
from hw.drivers.can.bus import CanBus, CanFrame, local_address
from hw.fakes.can.can_wire import Hub, has_route, meeting_point, open_wire
from tests.hw.drivers.rigs import own_address

MS = 1_000_000


def needs_multicast(host):
    if not has_route(*meeting_point(host)):
        pytest.skip("no route for multicast")


def frames(bus, count):
    """The next frames, however long they take."""
    found = []
    while len(found) < count:
        assert bus.readable(10.0), found
        found += bus.poll(0)
    return found


@pytest.mark.parametrize(
    ("settings", "text"),
    [
        ({"interface": "socketcan", "channel": "nocan7"}, "ip link"),
        ({"interface": "pcan", "channel": "PCAN_USBBUS9"}, "PEAK's library"),
        ({"interface": "slcan", "channel": "/dev/no_adapter"}, "/dev/serial/by-id"),
        ({"interface": "slcan", "channel": "socket://127.0.0.1:1"}, "socket://host:port"),
        ({"interface": "udp_multicast", "channel": "10.0.0.1"}, "multicast route"),
        ({"interface": "seriall", "channel": "x"}, "interfaces: "),
        ({"interface": "virtual"}, "needs 'channel'"),
        ({"channel": "can0"}, "needs 'interface'"),
    ],
)
def test_what_does_not_open_says_what_would_be_right(settings, text):
    with pytest.raises(OSError, match="CAN bus ") as refused:
        CanBus(settings)
    assert text in str(refused.value)


class NoBus:
    """A back-end whose calls fail with an error of the system."""

    def __init__(self, number, opens):
        self._error = OSError(number, os.strerror(number))
        if not opens:
            raise self._error

    def send(self, *_, **__):
        raise can.CanOperationError(str(self._error), self._error.errno)

    def recv(self, _):
        return None

    def fileno(self):
        return -1


@pytest.mark.parametrize(
    ("number", "told"),
    [
        (errno.ENETDOWN, "sudo ip link set can0 up type can bitrate 250000"),
        (errno.ENODEV, "is its adapter plugged in?"),
        (errno.ENOBUFS, "are the other nodes on, and of 250000 bit/s?"),
        (errno.EPERM, "no right to it"),
    ],
)
@pytest.mark.parametrize("opens", [True, False])
def test_an_interface_of_linux_that_fails_says_what_would_be_right(
    monkeypatch, number, told, opens
):
    monkeypatch.setattr(can, "Bus", lambda **_: NoBus(number, opens))
    settings = {"interface": "socketcan", "channel": "can0", "bitrate": 250_000}
    if not opens:
        with pytest.raises(OSError, match="CAN bus socketcan can0 does not open: ") as refused:
            CanBus(settings)
        assert told in str(refused.value)
        return
    bus = CanBus(settings)
    bus.send(0x80, b"")
    assert bus.poll(0) == []
    assert told in bus.fault


@pytest.mark.parametrize(
    ("number", "told"),
    [
        (errno.EACCES, "sudo usermod -aG dialout $USER, then log in again"),
        (errno.ENOENT, "`ls -l /dev/serial/by-id` lists"),
        (errno.EBUSY, "another program has it open"),
    ],
)
def test_a_serial_adapter_that_does_not_open_says_what_would_be_right(monkeypatch, number, told):
    monkeypatch.setattr(can, "Bus", lambda **_: NoBus(number, opens=False))
    with pytest.raises(OSError, match="does not open") as refused:
        CanBus({"interface": "slcan", "channel": "/dev/ttyACM7"})
    assert told in str(refused.value)


@pytest.fixture
def pair(request):
    """Our bus, and somebody else's at the same wire."""
    settings = {"interface": "virtual", "channel": request.node.name}
    bus, other = CanBus(settings), can.Bus(ignore_config=True, **settings)
    yield bus, other
    bus.close()
    other.shutdown()


def error(kind, data=()):
    return can.Message(is_error_frame=True, arbitration_id=kind, data=data, is_extended_id=False)


@pytest.mark.parametrize(
    ("frame", "fault"),
    [
        (error(0x40), "bus-off"),
        (error(0x40 | 0x04, [0, 0x30]), "bus-off"),
        (error(0x04, [0, 0x10]), "error-passive"),
        (error(0x04, [0, 0x20, 0, 0, 0, 0, 130, 0]), "error-passive"),
        (error(0x04, [0, 0x08]), None),
        (error(0x80), None),
    ],
)
def test_a_controller_that_gives_up_is_told_until_the_next_poll(pair, frame, fault):
    bus, other = pair
    other.send(frame)
    other.send(can.Message(arbitration_id=0x181, is_extended_id=False, data=b"ab"))
    assert bus.poll(0) == [CanFrame(0x181, b"ab")]
    assert (bus.fault is None) == (fault is None)
    assert (bus.warning is None) == (fault is not None)
    assert fault is None or f"{bus.name}: {fault}: " in bus.fault
    assert bus.poll(0) == []
    assert bus.fault is None
    assert bus.warning is None


def test_error_frames_are_a_warning_until_they_are_many(pair):
    bus, other = pair
    for n in range(gates.CAN_ERRORS):
        other.send(error(0x08))
        bus.poll(n * MS)
        assert bus.fault is None
        assert (bus.warning is not None) == (n == 0)
    other.send(error(0x08))
    bus.poll(gates.CAN_ERRORS_NS)
    assert bus.fault == (
        f"{bus.name}: more than 16 error frames in 1 s; "
        "look at plugs, bit rate and the two terminating resistors"
    )
    bus.poll(gates.CAN_ERRORS_NS + 1)
    assert bus.fault is None


@given(st.lists(st.integers(0, 200), max_size=60))
def test_however_error_frames_come_they_stop_if_one_second_has_more_than_sixteen(gaps_ms):
    settings = {"interface": "virtual", "channel": "counted"}
    bus, other, times = CanBus(settings), can.Bus(ignore_config=True, **settings), [0]
    for gap in gaps_ms:
        times.append(times[-1] + gap * MS)
        other.send(error(0x80))
        bus.poll(times[-1])
        recent = [at for at in times[1:] if times[-1] - at <= 1000 * MS]
        assert (bus.fault is not None) == (len(recent) > 16)
    bus.close()
    other.shutdown()


def test_who_waits_for_its_turn_makes_no_error(pair):
    bus, other = pair
    for _ in range(50):
        other.send(error(0x02))
    bus.poll(0)
    assert bus.fault is bus.warning is None


def test_a_bus_that_is_gone_is_a_fault_and_raises_nothing():
    bus = CanBus({"interface": "virtual", "channel": "gone"})
    bus._bus.shutdown()
    bus.send(0x80, b"")
    assert bus.poll(0) == []
    assert bus.fault.startswith("CAN bus virtual gone: ")
    bus.close()


def test_own_frames_do_not_come_back_and_equal_ones_of_somebody_else_do():
    host = own_address()
    needs_multicast(host)
    settings = {"interface": "local", "channel": host}
    bus, other = CanBus(settings), CanBus(settings)
    try:
        bus.send(0x80, b"")
        bus.send(0x201, b"\x0f\x00")
        other.send(0x80, b"")
        other.send(0x181, b"\x01")
        assert frames(bus, 2) == [CanFrame(0x80, b""), CanFrame(0x181, b"\x01")]
        assert sorted(frames(other, 2)) == [CanFrame(0x80, b""), CanFrame(0x201, b"\x0f\x00")]
    finally:
        bus.close()
        other.close()


@given(st.integers(0, 2**24 - 1))
def test_driver_and_fakes_meet_at_the_same_group_and_port(number):
    host = f"127.{number >> 16}.{number >> 8 & 255}.{number & 255}"
    assert local_address(host) == meeting_point(host)
    assert local_address(host)[0].startswith("239.193.")


def test_without_multicast_they_meet_at_a_hub(monkeypatch):
    monkeypatch.setattr("hw.drivers.can.bus._has_route", lambda *_: False)
    monkeypatch.setattr("hw.fakes.can.can_wire.has_route", lambda *_: False)
    settings = {"interface": "local", "channel": own_address()}
    hub = open_wire(settings)
    bus = CanBus(settings)
    try:
        assert isinstance(hub, Hub)
        bus.send(0x203, bytes.fromhex("0f0000ffffff"))
        assert _of_hub(hub, 1) == [(0x203, bytes.fromhex("0f0000ffffff"))]
        hub.send(can.Message(arbitration_id=0x183, is_extended_id=False, data=[0x37, 2]))
        hub.send(can.Message(arbitration_id=0x80, is_extended_id=False))
        assert frames(bus, 2) == [CanFrame(0x183, b"\x37\x02"), CanFrame(0x80, b"")]
    finally:
        bus.close()
        hub.close()


def test_lines_of_slcan_in_pieces_nonsense_and_a_client_that_leaves():
    host, port = own_address(), 23_456
    hub = Hub(host, port)
    with socket.create_connection((host, port)) as first, socket.create_connection((host, port)):
        hub.poll()
        hub.poll()
        for piece in (b"C\rS6\rO\rt12", b"33010203\rt12\rtxyz0\rt1239\r", b"t7010\r"):
            first.sendall(piece)
        assert _of_hub(hub, 2) == [(0x123, b"\x01\x02\x03"), (0x701, b"")]
        first.setblocking(True)
        hub.send(can.Message(arbitration_id=0x123, is_extended_id=False, data=[1, 2, 3]))
        assert first.recv(64) == b"t1233010203\r"
        first.sendall(b"\xff" * 100_000)
        hub.poll()
        assert all(len(rest) <= 32 for rest in hub._clients.values())
    while hub._clients:
        hub.poll()
    hub.close()


def _of_hub(hub, count):
    found = []
    while len(found) < count:
        found += hub.poll()
    return found
