"""Telegrams of an S300: a golden one, byte by byte; cut, damaged and surrounded by noise."""

import math
import struct
from dataclasses import replace

import pytest
from hypothesis import given, strategies as st

from hw.drivers.sick.telegram import STANDBY, Telegrams

GOLDEN = bytes.fromhex(
    "00000000"  # no answer
    "0000"
    "000e"  # 14 words behind the first four bytes
    "ff07"
    "0301"
    "0000"
    "0000002a"
    "0005"
    "bbbb1111"
    "6400"  # 1.00 m
    "b42b"  # 29.96 m, and a reflector
    "0a40"  # 0.10 m in the protective field
)


def crc(data):
    """By the book, bit by bit."""
    value = 0xFFFF
    for byte in data:
        for bit in range(7, -1, -1):
            turn = (value >> 15) ^ (byte >> bit & 1)
            value = (value << 1 & 0xFFFF) ^ (0x1021 if turn else 0)
    return value


def closed(data):
    return data + struct.pack("<H", crc(data[4:]))


def telegram(words, number, beyond=4):
    size = (24 + 2 * len(words) + 2 - beyond) // 2
    head = struct.pack(">IHHBBHHIHHH", 0, 0, size, 255, 7, 0x102, 0, number, number, 0xBBBB, 0x1111)
    return closed(head + struct.pack(f"<{len(words)}H", *words))


def test_the_check_is_the_one_of_the_catalogue():
    assert crc(b"123456789") == 0x29B1


def test_a_golden_telegram():
    [found] = Telegrams().feed(closed(GOLDEN))
    assert (found.address, found.version, found.scan, found.number) == (7, 0x0301, 42, 5)
    assert (found.status, found.size) == (0, 32)
    assert found.words == (0x0064, 0x2BB4, 0x400A)
    assert found.ranges(0.05, 29.9) == (1.0, math.inf, pytest.approx(0.1))
    assert found.silence is None


def test_a_telegram_of_an_s300_has_1108_bytes_and_its_size_says_552():
    data = telegram([500] * 541, 1)
    assert len(data) == 1108
    assert int.from_bytes(data[6:8], "big") == 552
    [found] = Telegrams().feed(data)
    assert found.ranges(0.05, 29.9) == (5.0,) * 541


def test_distances_that_are_none_are_inf():
    [found] = Telegrams().feed(telegram([0, 4, 5, 2989, 2990, 0x1FFF], 1))
    ranges = found.ranges(0.05, 29.9)
    assert [math.isinf(r) for r in ranges] == [True, True, False, False, True, True]


def test_standby_measures_nothing():
    [found] = Telegrams().feed(telegram([STANDBY] * 9, 1))
    assert found.silence.startswith("in standby (status 0x0000): ")
    assert replace(found, status=1).silence.startswith("locked out (status 0x0001): ")
    assert replace(found, words=(STANDBY, 100)).silence is None


@pytest.mark.parametrize("kind", ["aaaa", "cccc"])
def test_what_holds_no_distances_has_no_words(kind):
    data = bytearray(GOLDEN)
    data[20:22] = bytes.fromhex(kind)
    [found] = Telegrams().feed(closed(bytes(data)))
    assert found.words == ()
    assert found.silence.startswith("it sends no distances ")


words = st.lists(st.integers(0, 0xFFFF), max_size=60)


@given(
    st.lists(st.tuples(words, st.integers(0, 0xFFFF)), max_size=5),
    st.sampled_from([4, 8, 14]),
    st.integers(1, 50),
)
def test_telegrams_come_out_however_they_are_cut(sent, beyond, piece):
    stream = b"".join(telegram(content, number, beyond) for content, number in sent)
    telegrams = Telegrams()
    found = []
    for start in range(0, len(stream), piece):
        found += telegrams.feed(stream[start : start + piece])
    assert [(list(one.words), one.number) for one in found] == sent
    assert telegrams.skipped == telegrams.refused == 0


@given(st.binary(max_size=40), words, st.integers(0, 600))
def test_one_turned_bit_is_seen_and_the_next_telegram_found(noise, content, place):
    telegrams, good = Telegrams(), telegram(content, 2)
    bad = bytearray(telegram([100] * 20, 1))
    bad[4 + place % (len(bad) - 4)] ^= 1 << place % 8
    last = telegram([7], 3)
    found = telegrams.feed(noise + bytes(bad) + good + last + b"\0" * 5000)
    numbers = [one.number for one in found]
    assert 1 not in numbers
    assert numbers[-2:] == [2, 3]


@given(st.binary(max_size=3000))
def test_noise_is_no_telegram_and_is_not_kept(noise):
    telegrams = Telegrams()
    assert telegrams.feed(noise) == []
    assert telegrams.feed(b"\x55" * 5000) == []
    assert telegrams.skipped >= len(noise) + 4990
