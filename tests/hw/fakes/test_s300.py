"""The fake S300 by itself: golden bytes, and a client that shares nothing with the driver."""

import math
import socket
import struct
import time

import pytest

from hw.fakes.sick.s300_device import checksum, telegram
from hw.fakes.sick.scanners import S300Peer
from hw.ipc.datagrams import Door, Intake, Outlet
from hw.samples import Scan
from tests.hw.drivers.rigs import own_address

HEAD = "00000000 0000 {size} ff07 0301 0000 00000003 0003 bbbb 1111"


@pytest.mark.parametrize(("beyond", "size"), [(4, "000e"), (8, "000c"), (14, "0009")])
def test_golden_bytes(beyond, size):
    words = "6400 b40b 0a00"  # 1.00 m, nothing, 0.10 m; least significant byte first
    data = telegram((1.0, math.inf, 0.1), 3, beyond)
    assert data[:-2] == bytes.fromhex(HEAD.format(size=size) + words)
    assert data[-2:] == struct.pack("<H", checksum(data[4:-2]))


def test_the_check_is_the_one_of_the_catalogue():
    assert checksum(b"123456789") == 0x29B1


def test_standby_is_4004():
    assert telegram((1.0, 2.0), 1, standby=True)[24:-2] == bytes.fromhex("04400440")


class World:
    """As much of a world as the fake needs."""

    def __init__(self, host):
        self.intake = Intake(("scanners",), host)
        self.door = self.intake.door


def test_it_asks_a_world_for_scans_and_sends_them_when_they_are_over():
    host = own_address()
    world = World(host)
    scanners = {"front_laser": {"host": host, "port": 4001}}
    fake = S300Peer(scanners, tells=world)
    fake.wait()
    line = socket.create_connection((host, 4001), 5.0)
    heard = []
    while not heard:
        heard = world.intake.poll()
    assert (heard[0].source, heard[0].name) == ("scanners", "subscribe")
    outlet = Outlet([Door(*heard[0].value)])
    stamp = time.monotonic_ns()
    outlet.send("base.scan", stamp, Scan("front_laser", 0.0, 0.01, (1.0,) * 100, 1e-3))
    first = line.recv(1, socket.MSG_PEEK)
    assert first == b"\0"
    assert time.monotonic_ns() - stamp >= 99_000_000  # after its last beam
    data = b""
    while len(data) < 226:
        data += line.recv(4096)
    assert data[24:26] == bytes.fromhex("6400")
    line.close()
    fake.close()
    outlet.close()
    world.intake.close()


def test_a_port_in_use_is_refused():
    host = own_address()
    scanners = {"front_laser": {"host": host, "port": 4001}}
    first, second = (S300Peer(scanners) for _ in range(2))
    refused = 0
    for fake in (first, second):
        try:
            fake.wait()
        except OSError as error:
            refused += "in use" in str(error)
    assert refused == 1
    first.close()
    second.close()
