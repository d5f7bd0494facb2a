"""Frames of the ROS-TCP-Connector, byte by byte."""

import json
import random
import struct

import pytest
from hypothesis import given, strategies as st

from hw.drivers.unity.protocol.wire import (
    KEEPALIVE,
    LONGEST_BODY,
    LONGEST_NAME,
    LONGEST_SKIPPED,
    MalformedFrame,
    Parser,
    UnityFrame,
    command,
    frame,
    handshake,
)

NAMES = st.text(min_size=1, max_size=30).filter(lambda name: name.strip("\0") == name)
FRAMES = st.lists(st.tuples(NAMES, st.binary(max_size=200)), max_size=8)


def test_a_frame_is_two_sizes_a_name_and_a_body_little_endian() -> None:
    assert frame("a/b", b"\x01\x02") == b"\x03\0\0\0a/b\x02\0\0\0\x01\x02"
    assert Parser().feed(b"\x03\0\0\0a/b\x02\0\0\0\x01\x02") == [UnityFrame("a/b", b"\x01\x02")]
    assert frame("") == KEEPALIVE == bytes(8)
    assert Parser().feed(bytes(8)) == [UnityFrame("", b"")]


def test_the_handshake_is_what_the_connector_looks_for() -> None:
    [found] = Parser().feed(handshake("ros1"))

    assert found.destination == "__handshake"
    assert found.body == b'{"version": "v0.7.0", "metadata": "{\\"protocol\\": \\"ROS1\\"}"}'
    metadata = json.loads(Parser().feed(handshake("ros2"))[0].fields()["metadata"])
    assert metadata == {"protocol": "ROS2"}


def test_a_command_carries_json_and_texts_of_ros_2_end_with_nul() -> None:
    body = b'{"topic":"/tf","message_name":"tf2_msgs/TFMessage"}\0'
    data = struct.pack("<I", 12) + b"__subscribe\0" + struct.pack("<I", len(body)) + body
    [found] = Parser().feed(data)

    assert found.destination == "__subscribe"
    assert found.is_command
    assert found.fields() == {"topic": "/tf", "message_name": "tf2_msgs/TFMessage"}
    assert Parser().feed(command("log", text="hello"))[0].fields() == {"text": "hello"}


@given(frames=FRAMES, cuts=st.lists(st.integers(0, 2000), max_size=20))
def test_frames_come_out_as_they_went_in_however_the_bytes_are_cut(frames, cuts) -> None:
    data = b"".join(frame(name, body) for name, body in frames)
    parser, found, at = Parser(), [], 0
    for cut in [*sorted(cuts), len(data)]:
        found += parser.feed(data[at:cut])
        at = max(at, cut)

    assert found == [UnityFrame(name, body) for name, body in frames]
    assert parser.held == 0


@pytest.mark.parametrize(
    "data",
    [
        struct.pack("<I", LONGEST_NAME + 1),
        frame("x")[:5] + struct.pack("<I", LONGEST_SKIPPED + 1),
        struct.pack("<II", 0, 3) + b"abc",
        struct.pack("<I", 2) + b"\xff\xfe" + struct.pack("<I", 0),
    ],
)
def test_what_is_no_frame_is_refused_as_soon_as_it_can_be_known(data) -> None:
    with pytest.raises(MalformedFrame):
        Parser().feed(data)


@pytest.mark.parametrize("body", [b"{", b"[1]", b"\xff", b"[" * 5000, b"NaN"])
def test_a_command_without_an_object_is_refused(body) -> None:
    with pytest.raises(MalformedFrame):
        UnityFrame("__publish", body).fields()


@given(
    sizes=st.lists(st.sampled_from([0, 3, LONGEST_BODY, LONGEST_BODY + 1, 150_000]), max_size=4),
    piece=st.integers(1, 90_000),
)
def test_bodies_that_are_too_long_are_passed_over_and_told_at_once(sizes, piece) -> None:
    data = b"".join(frame(f"topic{n}", bytes(size)) for n, size in enumerate(sizes))
    parser, found = Parser(), []
    for at in range(0, len(data), piece):
        found += parser.feed(data[at : at + piece])
        assert parser.held <= LONGEST_BODY + LONGEST_NAME + 8
    kept = [(one.destination, len(one.body), one.skipped) for one in found]
    assert kept == [
        (f"topic{n}", *((size, 0) if size <= LONGEST_BODY else (0, size)))
        for n, size in enumerate(sizes)
    ]


def test_a_frame_that_is_skipped_is_known_before_its_body_has_come() -> None:
    size = LONGEST_SKIPPED
    head = frame("x")[:5] + struct.pack("<I", size)
    parser = Parser()
    assert parser.feed(head) == [UnityFrame("x", b"", skipped=size)]
    with pytest.raises(MalformedFrame, match=f"{size} bytes"):
        UnityFrame("__x", b"", skipped=size).fields()


@pytest.mark.parametrize(
    ("name", "ros2"), [(b"vr/head", False), (b"vr/head\0", True), (b"", False)]
)
def test_names_that_end_with_nul_are_of_ros_2(name, ros2) -> None:
    [found] = Parser().feed(struct.pack("<I", len(name)) + name + bytes(4))
    assert found.ros2 is ros2
    assert found.destination == name.decode().rstrip("\0")


@given(st.binary(max_size=400))
def test_any_bytes_are_frames_or_refused(data) -> None:
    parser = Parser()
    try:
        for frames in (parser.feed(data[:7]), parser.feed(data[7:])):
            for found in frames:
                assert isinstance(found.destination, str)
    except MalformedFrame:
        return
    assert parser.held <= len(data)


def feed_noise(seed: int, size: int) -> int:
    """Feed random bytes and damaged frames; how many parsers broke. Memory is bounded."""
    chance, fed, broken = random.Random(seed), 0, 0
    parser = Parser()
    while fed < size:
        data = bytearray(frame("vr/head", chance.randbytes(chance.randrange(200))) * 3)
        if chance.random() < 0.5:
            data = bytearray(chance.randbytes(chance.randrange(1, 400)))
        elif chance.random() < 0.5:
            data[chance.randrange(len(data))] ^= 1 << chance.randrange(8)
        else:
            del data[chance.randrange(len(data)) :]
        fed += len(data)
        try:
            parser.feed(bytes(data))
        except MalformedFrame:
            broken += 1
            parser = Parser()
        assert parser.held <= LONGEST_NAME + LONGEST_BODY + 8
    return broken


def test_damaged_frames_break_a_parser_and_nothing_else() -> None:
    assert feed_noise(1, 50_000) > 10


@pytest.mark.slow
def test_a_million_bytes_of_noise_break_parsers_and_nothing_else() -> None:
    assert feed_noise(2, 1_000_000) > 100
