"""A multicast group of one machine: its processes hear each other, and no other machine."""

import select
import socket
import struct
import sys

import pytest

from hw.ipc.near import keep_near

GROUP, PORT = "239.193.7.7", 26_377
pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="needs Linux")


def own_network_address():
    """An address of this machine that others reach; None if it has none."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as way:
        try:
            way.connect(("192.0.2.1", 9))  # sends nothing
        except OSError:
            return None
        found = way.getsockname()[0]
        return None if found.startswith("127.") else found


def member():
    """A socket as libraries open it."""
    made = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    made.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    made.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEPORT, 1)
    made.bind(("", PORT))
    made.setsockopt(
        socket.IPPROTO_IP,
        socket.IP_ADD_MEMBERSHIP,
        socket.inet_aton(GROUP) + struct.pack("@I", socket.INADDR_ANY),
    )
    keep_near(made.fileno(), GROUP)
    return made


@pytest.fixture
def members():
    try:
        made = [member(), member()]
    except OSError:
        pytest.skip("there is no multicast here")
    yield made
    for one in made:
        one.close()


def heard(one, within=0.02):
    found = []
    while select.select([one], [], [], within)[0]:
        found.append(one.recv(100))
    return found


def test_members_hear_each_other(members):
    first, second = members
    first.sendto(b"hello", (GROUP, PORT))
    assert heard(second) == heard(first) == [b"hello"]


def test_what_comes_from_a_network_is_dropped(members):
    address = own_network_address()
    if address is None:
        pytest.skip("there is no network here")
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger:
        stranger.bind((address, 0))
        network = socket.inet_aton(address)
        stranger.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, network)
        for to in (GROUP, address):
            stranger.sendto(b"forged", (to, PORT))
    assert heard(members[0]) == heard(members[1]) == []
