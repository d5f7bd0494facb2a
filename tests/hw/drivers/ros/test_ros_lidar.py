"""Scanners through rosbridge: their own process and websocket, against a fake."""

import itertools
import math
import os
import select
import signal
import statistics
import time
from concurrent.futures import ThreadPoolExecutor, wait
from dataclasses import replace

import pytest

from cobodeck.real.health import fault_of
from hw.drivers.ros.lidar_process import scan_of
from hw.drivers.ros.ros_lidar import RosLidar
from hw.fakes.kairos.kairos_peer import Kairos
from hw.geometry import Twist2
from hw.ipc.datagrams import Intake, Outlet
from hw.model.robot import load_robot
from hw.samples import Scan
from tests.hw.drivers.kairos.test_kairos import Rig as BaseRig
from tests.hw.drivers.rigs import Listener, opening, own_address

pytest.importorskip("roslibpy", reason="the extra 'ros' is not installed")

TOPICS = {name: {"topic": f"/robot/{name}/scan"} for name in ("front_laser", "rear_laser")}
MODEL = load_robot("rbkairos_ur10").sensing.lidars["front_laser"]
SWEEP_NS = round((MODEL.beams - 1) * MODEL.beam_time * 1e9)


class Rig:
    """Fake and driver; with `world`, its scans are those that `tell` sends."""

    def __init__(self, world=False, ros=1, **given):
        self.host, self.world = own_address(), Intake(("drives", "scanners"))
        tells = self.world if world else None
        self.fake = Kairos(self.host, opening(), ros=ros, tells=tells)
        self.fake.wait()
        self.part, self.outlet = None, Outlet([self.fake.control])
        self.told, self.numbers = {}, itertools.count()
        self.given = {"scanners": TOPICS, "ros": ros} | given

    def __enter__(self):
        self.part = RosLidar(self.host, now=time.monotonic_ns, opening=opening(), **self.given)
        self.listener = Listener(self.part)
        return self

    def __exit__(self, *_):
        self.part.close()
        self.fake.close()
        self.world.close()
        self.outlet.close()

    def more(self, count, wanted=lambda sample: True, nudge=lambda: None):
        self.part.samples(time.monotonic_ns())
        self.listener.got.clear()
        got = self.listener.got
        self.listener.until(lambda: sum(map(wanted, got)) >= count, nudge)
        return got


@pytest.mark.requirement(8)
@pytest.mark.parametrize("ros", [1, 2])
@pytest.mark.few(1)
def test_scans_of_both_scanners_come(ros):
    with Rig(ros=ros) as rig:
        rig.part.wait()
        got = rig.more(6)
    assert {sample.value.sensor for sample in got} == set(TOPICS)
    scan = got[0].value
    assert (scan.start, scan.step) == (pytest.approx(MODEL.start), pytest.approx(MODEL.step))
    assert scan.beam_time == pytest.approx(MODEL.beam_time)
    assert len(scan.ranges) == 541
    assert scan.ranges[1:3] == (math.inf, 5.0)


def test_a_scan_is_stamped_at_its_first_beam():
    with Rig(world=True) as rig:

        def tell():
            number = next(rig.numbers)
            stamp = time.monotonic_ns() - SWEEP_NS
            for name in TOPICS:
                ranges = (1.0 + 0.001 * number, *[2.0] * (MODEL.beams - 1))
                scan = Scan(name, MODEL.start, MODEL.step, ranges, MODEL.beam_time)
                rig.told[round(1000 * ranges[0])] = stamp
                rig.outlet.send("base.scan", stamp, scan)

        got = rig.more(20, nudge=tell)
        late = [one.stamp_ns - rig.told[round(1000 * one.value.ranges[0])] for one in got]
    assert min(late) > 0
    assert statistics.median(late) < SWEEP_NS


@pytest.mark.slow
def test_beams_without_a_number_do_not_come_back():
    with Rig() as rig:
        rig.part.wait()
        rig.fake.fault("nan")
        got = rig.more(1, lambda sample: set(sample.value.ranges) == {math.inf})
    assert len(got[-1].value.ranges) == 541


@pytest.mark.slow
def test_a_lost_connection_is_opened_again():
    with Rig() as rig:
        rig.part.wait()
        rig.more(1)
        rig.fake.fault("drop")
        rig.fake.fault("")
        stamp = time.monotonic_ns()
        assert rig.more(2, lambda sample: sample.stamp_ns > stamp)


@pytest.mark.slow
def test_a_topic_that_says_nothing_is_named():
    with Rig(scanners=TOPICS | {"rear_laser": {"topic": "/robot/back_laser/scan"}}) as rig:  # noqa: SIM117
        with pytest.raises(OSError, match="nothing on /robot/back_laser/scan within 2 s"):
            rig.part.wait()


def test_nobody_there_is_told():
    host = own_address()
    part = RosLidar(host, TOPICS, now=time.monotonic_ns, opening=opening())
    with pytest.raises(OSError, match=rf"rosbridge at {host}:9090: .*refused"):
        part.wait()
    part.close()


@pytest.mark.parametrize(
    ("scanners", "said"),
    [
        ({"lidar": {"topic": "/scan"}}, "'lidar' is no scanner of rbkairos_ur10: front_laser"),
        ({"front_laser": {}}, "front_laser: write its topic"),
        ({"front_laser": {"topic": "/scan", "inverted": True}}, "front_laser: write its topic"),
    ],
)
def test_mistakes_in_the_file_are_told(scanners, said):
    with pytest.raises(ValueError, match=said):
        RosLidar("127.0.0.1", scanners, now=time.monotonic_ns, opening=opening())


@pytest.mark.slow
@pytest.mark.parametrize(
    ("seconds", "told"), [(-20.0, "back by 20.0 s"), (20.0, "forward by 20.0 s")]
)
def test_a_clock_that_was_set_is_the_reason_and_scans_come_again_by_the_new_one(seconds, told):
    with Rig() as rig:
        rig.part.wait()
        rig.more(20)
        rig.fake.fault("clock", seconds)
        end = f"laser: the clock of {rig.host} was set {told}"
        rig.listener.until(lambda: str(rig.part.fault).endswith(end))
        rig.listener.until(lambda: rig.part.fault is None)
        for sample in rig.more(4):
            assert -0.2e9 < time.monotonic_ns() - SWEEP_NS - sample.stamp_ns < 0.5e9


def test_a_killed_process_shows_by_silence_and_is_named():
    with Rig() as rig:
        rig.part.wait()
        assert fault_of(rig.part) is None
        os.kill(rig.part.pid, signal.SIGKILL)
        os.waitid(os.P_PID, rig.part.pid, os.WEXITED | os.WNOWAIT)
        assert fault_of(rig.part) == (
            "the scanners' process has ended (killed by signal 9, SIGKILL); "
            "no reset helps, start the run again"
        )
        rig.part.samples(time.monotonic_ns())
        assert rig.part.samples(time.monotonic_ns()) == []


@pytest.mark.slow
@pytest.mark.requirement(8, 51)
@pytest.mark.parametrize(
    ("fault", "value", "said"),
    [
        ("silent", "rear_laser/scan", "rear_laser: silent"),
        ("mute", None, "front_laser: silent"),
        ("drop", None, "front_laser: no connection to rosbridge"),
    ],
)
def test_a_scanner_without_scans_is_a_fault_until_it_scans_again(fault, value, said):
    with Rig() as rig:
        rig.part.wait()
        rig.listener.until(lambda: rig.part.fault is None)
        rig.fake.fault(fault, value)
        rig.listener.until(lambda: rig.part.fault is not None)
        assert rig.part.fault == said
        rig.fake.fault("")
        rig.listener.until(lambda: rig.part.fault is None)


@pytest.mark.slow
@pytest.mark.requirement(8)
def test_nothing_starts_on_scans_that_are_none():
    with Rig(world=True) as rig:
        scan = Scan("front_laser", MODEL.start, 0.0, (1.0,) * MODEL.beams, MODEL.beam_time)
        said = "front_laser: what it sends is no scan: ValueError: no scan; no valid scan of it"
        with ThreadPoolExecutor(1) as pool:
            asked = pool.submit(rig.part.wait)
            while not wait([asked], 0.05).done:
                for name in TOPICS:
                    rig.outlet.send("base.scan", time.monotonic_ns(), replace(scan, sensor=name))
            with pytest.raises(OSError, match=said):
                asked.result()


GOOD = {
    "angle_min": -1.0, "angle_increment": 0.1, "time_increment": 1e-4, "range_min": 0.05,
    "range_max": 30.0, "ranges": [1.0, None, 0.01, 40.0, math.nan, math.inf, 29.0],
}  # fmt: skip


def test_a_scan_of_a_message():
    turned = scan_of("front_laser", GOOD, side=-1.0)
    assert (turned.start, turned.step) == (1.0, -0.1)
    scan = scan_of("front_laser", GOOD)
    assert scan.ranges == turned.ranges
    assert scan.ranges == (1.0, *[math.inf] * 5, 29.0)
    assert (scan.start, scan.step, scan.beam_time) == (-1.0, 0.1, 1e-4)


@pytest.mark.parametrize(
    "wrong",
    [
        {"angle_min": None},
        {"angle_min": math.nan},
        {"angle_increment": 0.0},
        {"ranges": []},
        {"ranges": None},
        {"ranges": ["a", "b"]},
    ],
)
def test_what_is_no_scan_is_refused(wrong):
    with pytest.raises((TypeError, ValueError)):
        scan_of("front_laser", GOOD | wrong)


@pytest.mark.slow
def test_the_way_there_and_back_beside_scans(record_testsuite_property):
    """From a command to the odometry that shows it, with both scanners on their own websocket."""
    with BaseRig(world=False) as rig:
        part = RosLidar(rig.host, TOPICS, now=time.monotonic_ns, opening=opening())
        part.wait()
        trips, scans = [], 0
        for number in range(300):
            wanted = Twist2(0.0, 0.0, 0.2 if number % 2 else -0.2)
            sign = math.copysign(1.0, wanted.wz)
            before = rig.base.odometry[1].twist.wz
            begun = time.monotonic_ns()
            rig.base.drive(wanted, begun)
            while sign * (rig.base.odometry[1].twist.wz - before) <= 1e-6:
                rig.base.poll(time.monotonic_ns())
                assert rig.base.fault is None
                select.select([], [], [], 1e-4)
            trips.append(1e-6 * (time.monotonic_ns() - begun))
            scans += len(part.samples(time.monotonic_ns()))
        part.close()
    trips.sort()
    record_testsuite_property("p50_ms", round(trips[150], 2))
    record_testsuite_property("p99_ms", round(trips[297], 2))
    assert scans > 20
    assert trips[0] < trips[-1]
