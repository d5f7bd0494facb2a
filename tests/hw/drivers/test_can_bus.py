"""CAN buses by configuration: what opens, what does not and why, and what comes through."""

import socket

import can
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hw.drivers.can.bus import CanBus, CanFrame, local_address
from hw.fakes.can_wire import Hub, has_route, meeting_point, open_wire
from tests.hw.drivers.rigs import own_address


def needs_multicast(host):
    if not has_route(*meeting_point(host)):
        pytest.skip("no route for multicast")


def frames(bus, count):
    """The next frames, however long they take."""
    found = []
    while len(found) < count:
        assert bus.readable(10.0), found
        found += bus.poll()
    return found


@pytest.mark.parametrize(
    ("settings", "text"),
    [
        ({"interface": "socketcan", "channel": "nocan7"}, "is the interface up"),
        ({"interface": "pcan", "channel": "PCAN_USBBUS9"}, "PEAK's library"),
        ({"interface": "slcan", "channel": "/dev/no_adapter"}, "serial device"),
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


def test_error_frames_are_told_until_the_next_poll():
    settings = {"interface": "virtual", "channel": "errors"}
    bus, other = CanBus(settings), can.Bus(ignore_config=True, **settings)
    try:
        other.send(can.Message(is_error_frame=True, arbitration_id=0x40, is_extended_id=False))
        other.send(can.Message(arbitration_id=0x181, is_extended_id=False, data=b"ab"))
        assert bus.poll() == [CanFrame(0x181, b"ab")]
        assert bus.fault == "CAN bus virtual errors: bus-off"
        assert bus.poll() == []
        assert bus.fault is None
    finally:
        bus.close()
        other.shutdown()


def test_a_bus_that_is_gone_is_a_fault_and_raises_nothing():
    bus = CanBus({"interface": "virtual", "channel": "gone"})
    bus._bus.shutdown()
    bus.send(0x80, b"")
    assert bus.poll() == []
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
    monkeypatch.setattr("hw.fakes.can_wire.has_route", lambda *_: False)
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
