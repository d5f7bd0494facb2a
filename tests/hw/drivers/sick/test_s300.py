"""The S300 driver against its fake, which is another process and does wrong when told to."""

import itertools
import math
import os
import threading
import time
import tty
from concurrent.futures import ThreadPoolExecutor, wait

import pytest

from hw.drivers.sick.s300 import S300
from hw.fakes.sick.scanners import S300Peer as Fake
from hw.ipc.datagrams import Outlet
from hw.model.robot import load_robot
from hw.samples import Scan
from tests.hw.drivers.rigs import Listener, opening, own_address

MODEL = load_robot("rbkairos_ur10").sensing.lidars["front_laser"]
SWEEP_NS = round((MODEL.beams - 1) * MODEL.beam_time * 1e9)
LINE_NS = 1108 * 10 * 1_000_000_000 // 500_000
NAMES = ("front_laser", "rear_laser")


def scan(number, sensor="front_laser"):
    """A scan that is told from others by its first range, in cm."""
    ranges = (0.01 * (100 + number % 2000), *[2.5] * (MODEL.beams - 2), math.inf)
    return Scan(sensor, MODEL.start, MODEL.step, ranges, MODEL.beam_time)


class Rig:
    def __init__(self, **given):
        host = own_address()
        self.scanners = {name: {"host": host, "port": 4001 + n} for n, name in enumerate(NAMES)}
        self.fake = Fake(self.scanners)
        self.fake.wait()
        self.outlet = Outlet([self.fake.control])
        self.numbers = itertools.count()
        self.told = {}
        for name, extra in given.pop("extra", {}).items():
            self.scanners[name] |= extra
        self.part = S300(self.scanners, time.monotonic_ns, opening(), **given)
        self.listener = Listener(self.part)
        self.got = self.listener.got
        meanwhile(self.part.wait, self.tell)

    def tell(self):
        """The world has measured: a scan of each, whose last beam is over."""
        for name in NAMES:
            found = scan(next(self.numbers), name)
            stamp = time.monotonic_ns() - SWEEP_NS
            self.told[round(100 * found.ranges[0])] = stamp
            self.outlet.send("base.scan", stamp, found)

    def more(self, count):
        have = len(self.got)
        self.listener.until(lambda: len(self.got) >= have + count, self.tell)
        return self.got[have:]

    def close(self):
        self.part.close()
        self.fake.close()
        self.outlet.close()


@pytest.fixture
def rig():
    found = Rig()
    yield found
    found.close()


@pytest.mark.requirement(8)
def test_scans_of_both_scanners_come_with_the_stamp_of_their_first_beam(rig):
    rig.more(12)
    assert {sample.value.sensor for sample in rig.got} == set(NAMES)
    late = []
    for sample in rig.got:
        seen = sample.value
        assert sample.name == "base.scan"
        assert (seen.start, seen.step, seen.beam_time) == (MODEL.start, MODEL.step, MODEL.beam_time)
        assert len(seen.ranges) == 541
        assert seen.ranges[1] == 2.5
        assert seen.ranges[-1] == math.inf
        late.append(sample.stamp_ns - rig.told[round(100 * seen.ranges[0])])
    assert min(late) > -1_000_000  # never before it was taken; the byte that rounds down
    assert sorted(late)[len(late) // 2] < LINE_NS  # the time on the line is not in it


def test_an_upside_down_scanner_turns_the_other_way():
    rig = Rig(extra={"rear_laser": {"upside_down": True}})
    rig.more(4)
    rig.close()
    steps = {sample.value.sensor: sample.value.step for sample in rig.got}
    starts = {sample.value.sensor: sample.value.start for sample in rig.got}
    assert steps == {"front_laser": MODEL.step, "rear_laser": -MODEL.step}
    assert starts == {"front_laser": MODEL.start, "rear_laser": -MODEL.start}


def test_delay_makes_stamps_earlier():
    rig = Rig(delay=0.5)
    rig.more(4)
    rig.close()
    for sample in rig.got:
        assert sample.stamp_ns < rig.told[round(100 * sample.value.ranges[0])]


def test_a_frozen_scanner_is_silent_and_says_why(rig):
    rig.more(2)
    rig.fake.fault("freeze")
    rig.listener.until(lambda: rig.part.health["front_laser"] == "it repeats itself", rig.tell)
    assert rig.part.fault == "front_laser: it repeats itself"
    rig.fake.fault("")
    assert rig.more(2)
    assert rig.part.health["front_laser"] is None
    firsts = [sample.value.ranges[0] for sample in rig.got]
    assert len(set(firsts)) == len(firsts)  # each scan came once


def test_standby_is_silence_too(rig):
    rig.more(1)
    rig.fake.fault("standby")
    standby = "in standby (status 0x0000): an input of its own, or its controller, has to let it"
    rig.listener.until(lambda: str(rig.part.health["rear_laser"]).startswith(standby), rig.tell)
    rig.fake.fault("")
    assert rig.more(1)


@pytest.mark.requirement(8, 51)
@pytest.mark.parametrize(
    ("fault", "cause"),
    [("mute", "silent"), ("corrupt", "it sends no valid telegram"), ("cut", "it sends no valid")],
)
@pytest.mark.few(1)
def test_a_scanner_without_scans_is_a_fault_until_it_scans_again(rig, fault, cause):
    rig.more(2)
    assert rig.part.fault is None
    rig.fake.fault(fault)
    rig.listener.until(lambda: rig.part.fault is not None, rig.tell)
    assert rig.part.fault.startswith(f"front_laser: {cause}")
    rig.fake.fault("")
    rig.listener.until(lambda: rig.part.fault is None, rig.tell)


@pytest.mark.parametrize("fault", ["corrupt", "garbage", "cut"])
def test_no_scan_is_made_of_damaged_bytes(rig, fault):
    rig.more(1)
    rig.fake.fault(fault)
    for _ in range(5):
        rig.tell()
    rig.fake.fault("")
    rig.more(6)
    for sample in rig.got:
        assert round(100 * sample.value.ranges[0]) in rig.told
        assert set(sample.value.ranges[1:-1]) == {2.5}


def test_a_line_that_was_let_go_of_is_opened_again(rig):
    rig.more(1)
    rig.fake.fault("drop")
    gone = "the line is gone"
    rig.listener.until(lambda: str(rig.part.health["front_laser"]).startswith(gone), rig.tell)
    rig.fake.fault("")
    assert len(rig.more(4)) >= 4


@pytest.mark.slow
def test_a_scanner_that_starts_anew_is_found_again(rig):
    rig.more(1)
    rig.fake.close()
    absent = "not connected"
    rig.listener.until(lambda: str(rig.part.health["rear_laser"]).startswith(absent))
    rig.fake = Fake({n: {"host": a["host"], "port": a["port"]} for n, a in rig.scanners.items()})
    rig.fake.wait()
    rig.outlet.doors = [rig.fake.control]
    assert rig.more(4)


def test_a_silent_line_is_opened_anew(rig, monkeypatch):
    rig.more(1)
    rig.fake.fault("mute")
    monkeypatch.setattr("hw.drivers.sick.s300.SILENT_S", 0.3)
    silent = "the line is gone: silent"
    rig.listener.until(lambda: rig.part.health["front_laser"] == silent, rig.tell)
    rig.fake.fault("")
    assert rig.more(2)


def test_a_scanner_that_is_not_there_is_told_at_opening(monkeypatch):
    monkeypatch.setattr("hw.drivers.sick.s300.OPENING_S", 0.1)
    address = {"front_laser": {"host": own_address(), "port": 4001}}
    part = S300(address, time.monotonic_ns, opening())
    with pytest.raises(OSError, match=r"front_laser: not connected: .*refused"):
        part.wait()
    part.close()


@pytest.mark.parametrize(
    ("fault", "beams", "cause"),
    [
        ("", 541, "silent"),
        ("standby", 541, r"in standby \(status 0x0000\): .*"),
        ("", 270, "it sends 270 distances, and the robot file says 541 beams: correct it, .*"),
        ("garbled", 541, "it sends no valid telegram"),
    ],
)
@pytest.mark.few(2)
def test_nothing_starts_before_each_scanner_has_given_a_scan(monkeypatch, fault, beams, cause):
    monkeypatch.setattr("hw.drivers.sick.s300.OPENING_S", 0.5)
    ours, theirs = os.openpty()
    tty.setraw(theirs)
    part = S300({"front_laser": {"device": os.ttyname(theirs)}}, time.monotonic_ns, opening())
    data = _telegram(1, beams, standby=fault == "standby")
    data = data[:-1] if fault == "garbled" else data if (fault or beams != 541) else b""
    with pytest.raises(OSError, match=f"front_laser: {cause}; no scan within 0.5 s: .* 500000"):
        meanwhile(part.wait, lambda: os.write(ours, data))
    part.close()
    os.close(ours)
    os.close(theirs)


def test_threads_end_with_the_part(rig):
    rig.part.close()
    assert not {one.name for one in threading.enumerate()} & set(NAMES)


@pytest.mark.parametrize(
    ("scanners", "said"),
    [
        (
            {"lidar": {"host": "a", "port": 1}},
            "'lidar' is no scanner of rbkairos_ur10: front_laser",
        ),
        ({"front_laser": {"host": "a"}}, "front_laser: write host and port"),
        ({"front_laser": {"host": "a", "prot": 1}}, "front_laser: prot: there are device, host"),
    ],
)
def test_mistakes_in_the_file_are_told(scanners, said):
    with pytest.raises(ValueError, match=said):
        S300(scanners, time.monotonic_ns, opening())


def test_a_serial_port_that_does_not_open_says_what_would_be_right(monkeypatch):
    monkeypatch.setattr("hw.drivers.sick.s300.OPENING_S", 0.1)
    part = S300({"front_laser": {"device": "/dev/ttyUSB77"}}, time.monotonic_ns, opening())
    told = r"front_laser: not connected: /dev/ttyUSB77: there is no such device; `ls -l /dev/serial"
    with pytest.raises(OSError, match=told):
        part.wait()
    part.close()


def test_a_serial_port_does_as_well():
    ours, theirs = os.openpty()
    scanner = {"front_laser": {"device": os.ttyname(theirs)}}
    part = S300(scanner, time.monotonic_ns, opening())
    listener, numbers = Listener(part), itertools.count(1)
    listener.until(lambda: len(listener.got) > 1, lambda: os.write(ours, _telegram(next(numbers))))
    part.wait()
    part.close()
    os.close(ours)
    os.close(theirs)
    assert listener.got[0].value.ranges[:2] == (3.0, 3.0)


def _telegram(number, beams=MODEL.beams, standby=False):
    from hw.fakes.sick.s300_device import telegram

    return telegram((3.0,) * beams, number, standby=standby)


def meanwhile(call, nudge):
    """Call something that waits, and nudge in between."""
    with ThreadPoolExecutor(1) as pool:
        asked = pool.submit(call)
        while not wait([asked], 0.03).done:
            nudge()
        return asked.result()
