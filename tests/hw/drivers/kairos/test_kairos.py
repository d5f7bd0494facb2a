"""The wheels of an RB-KAIROS through roslibpy, against a fake in another process."""

import logging
import math
import os
import select
import signal
import subprocess
import sys
import time
from dataclasses import replace

import pytest

from hw.drivers.gates import MS, ODOMETRY_OLD_NS
from hw.drivers.kairos.kairos_base import KairosBase, fastest
from hw.drivers.ros.rosbridge import RosbridgeClient, _library, yaw_of
from hw.fakes.kairos.kairos_peer import Kairos
from hw.geometry import STILL, Pose2, Twist2
from hw.ipc.datagrams import Intake
from tests.hw.drivers.rigs import PATIENCE_S, opening, own_address

pytest.importorskip("roslibpy", reason="the extra 'ros' is not installed")

ODOM = "/robot/robotnik_base_control/odom"
STOP = "/robot/robotnik_base_hw/emergency_stop"
AHEAD = Twist2(0.4, 0.0, 0.0)


def model(speed=0.52, brakes=0.6):
    return replace(opening().body.base, max_speed=speed, brake_deceleration=brakes)


class Rig:
    """Fake and driver, and as much of a chain as cycles: poll, drive, 10 ms."""

    def __init__(self, fault=(), world=False, **given):
        self.host, self.world = own_address(), Intake(("drives", "scanners"))
        tells = self.world if world else None
        ros = given.get("ros", 1)
        stop = given.pop("stop", STOP.removeprefix("/robot/"))
        self.fake = Kairos(self.host, opening(), ros=ros, tells=tells, stop=stop)
        self.fake.wait()
        self.base = None
        if fault:
            self.fake.fault(*fault)
        self.cycles = 0
        self.given = given

    def __enter__(self):
        try:
            self.base = KairosBase(model(), self.host, **self.given)
        except BaseException:
            self.__exit__()
            raise
        return self

    def __exit__(self, *_):
        if self.base is not None:
            self.base.close()
        self.fake.close()
        self.world.close()

    def cycle(self, velocity=STILL):
        self.base.poll(time.monotonic_ns())
        self.base.drive(velocity, time.monotonic_ns())
        self.cycles += 1
        select.select([], [], [], 0.01)

    def until(self, wanted, velocity=STILL):
        until = time.monotonic() + PATIENCE_S
        while not wanted():
            assert time.monotonic() < until, f"fault: {self.base.fault}, {self.base.odometry}"
            self.cycle(velocity)

    @property
    def seen(self):
        return self.base.odometry[1]

    @property
    def speed(self):
        return self.seen.twist.speed

    def going(self):
        self.until(lambda: self.speed > 0.1, AHEAD)


@pytest.mark.requirement(10)
@pytest.mark.parametrize("ros", [1, 2])
@pytest.mark.few(1)
def test_it_drives_and_counts_its_way_from_where_it_began(ros):
    with Rig(ros=ros) as rig:
        rig.cycle()
        assert rig.base.fault is None
        assert rig.seen.pose == Pose2(0.0, 0.0, 0.0)
        assert rig.base.hits() == []
        rig.until(lambda: rig.seen.pose.x > 0.05, AHEAD)
        assert rig.seen.pose.y == pytest.approx(0.0, abs=1e-6)
        assert 0.0 < rig.seen.twist.vx <= 0.4 + 1e-9
        rig.until(lambda: rig.seen.twist.vy > 0.05, Twist2(0.0, 0.3, 0.0))
        rig.until(lambda: rig.seen.twist.wz > 0.1, Twist2(0.0, 0.0, 0.3))


def test_odometry_is_stamped_when_it_was_measured():
    with Rig() as rig:
        stamps = []
        for _ in range(20):
            rig.cycle()
            stamps.append(rig.base.odometry[0])
            assert stamps[-1] <= time.monotonic_ns()
        assert stamps == sorted(stamps)
        assert len(set(stamps)) > 5


@pytest.mark.parametrize(("timeout", "ramp"), [(0.5, 0.6), (0.1, 3.0), (1.0, 0.3)])
def test_the_speed_of_a_stop_in_half_a_metre(timeout, ramp):
    speed = fastest(timeout, ramp)
    assert speed * timeout + speed**2 / (2 * ramp) == pytest.approx(0.5)


@pytest.mark.slow
def test_no_faster_command_leaves_than_stops_in_half_a_metre():
    with Rig() as rig:
        for _ in range(110):
            rig.cycle(Twist2(3.0, 4.0, 0.0))
        assert rig.speed == pytest.approx(fastest(0.5, 0.6), abs=1e-3)
        assert rig.seen.twist.vy / rig.seen.twist.vx == pytest.approx(4.0 / 3.0, abs=1e-3)


@pytest.mark.requirement(15)
@pytest.mark.slow
def test_a_chain_that_is_gone_leaves_a_stop_of_half_a_metre():
    with Rig() as rig:
        rig.until(lambda: rig.speed > 0.515, Twist2(0.52, 0.0, 0.0))
        x = rig.seen.pose.x
        while rig.speed > 0.0:  # nothing is sent any more
            rig.base.poll(time.monotonic_ns())
            select.select([], [], [], 0.01)
        assert 0.3 < rig.seen.pose.x - x <= 0.5


def test_closing_sends_zero_first():
    with Rig(world=True) as rig:
        rig.going()
        rig.world.poll()
        rig.base.close()
        rig.base = None
        fronts = []
        while not fronts or fronts[-1] > 0.0:
            select.select([rig.world], [], [], PATIENCE_S)
            fronts += [t.value[0] for t in rig.world.poll() if t.name == "wheels"]
        still_as_fast = [rate for rate in fronts if rate >= fronts[0]]
        assert len(still_as_fast) < 20  # of 10 ms; by its own watchdog it would be 50


@pytest.mark.requirement(5)
def test_its_emergency_stop_is_a_fault_until_it_is_released_and_acknowledged():
    stop = "safety_module/emergency_stop"
    with Rig(stop=stop, topics={"emergency_stop": stop}) as rig:
        rig.going()
        rig.fake.fault("stop")
        rig.until(lambda: rig.base.fault is not None, AHEAD)
        assert rig.base.fault == "the robot's emergency stop is engaged"
        assert not rig.base.acknowledge()
        rig.until(lambda: rig.speed == 0.0, AHEAD)
        rig.fake.fault("")
        for _ in range(15):
            rig.cycle(AHEAD)
        assert rig.base.fault is not None
        assert rig.speed == 0.0
        assert rig.base.acknowledge()
        assert rig.base.fault is None
        rig.going()


@pytest.mark.parametrize(
    ("fault", "said"),
    [
        ("mute", "odometry is"),
        ("drop", "the connection is lost"),
        pytest.param("silent", "odometry is", marks=pytest.mark.slow),
        pytest.param("freeze", "odometry is", marks=pytest.mark.slow),
        pytest.param("late", "odometry is", marks=pytest.mark.slow),
        pytest.param("nan", "the last message was none: TypeError", marks=pytest.mark.slow),
    ],
)
def test_after_a_fault_nothing_moves_until_it_is_acknowledged(fault, said):
    with Rig(world=True) as rig:
        rig.going()
        rig.fake.fault(fault, "robotnik_base_control/odom")
        rig.until(lambda: rig.base.fault is not None, AHEAD)
        assert said in rig.base.fault
        rig.until(lambda: standing(rig.world), AHEAD)
        rig.fake.fault("")
        for _ in range(15):
            rig.cycle(AHEAD)
        assert rig.base.fault is not None
        assert standing(rig.world)
        rig.until(lambda: rig.base.acknowledge() and rig.base.fault is None, AHEAD)
        rig.going()


def standing(world):
    """Do the wheels stand, by what the fake told last?"""
    rates = [told.value for told in world.poll() if told.name == "wheels"]
    return bool(rates) and not any(rates[-1])


def test_a_stop_holds_until_it_is_acknowledged():
    with Rig() as rig:
        rig.going()
        rig.base.stop()
        rig.until(lambda: rig.speed == 0.0, AHEAD)
        assert rig.base.fault is None
        assert rig.base.acknowledge()
        rig.going()


def test_silence_is_seen_two_cycles_after_its_gate():
    with Rig() as rig:
        rig.going()
        rig.fake.fault("mute")
        newest, cycles = rig.base.odometry, 0
        while rig.base.fault is None:
            rig.cycle(AHEAD)  # 10 ms or more
            cycles = cycles + 1 if rig.base.odometry == newest else 0
            newest = rig.base.odometry
        assert cycles <= round(ODOMETRY_OLD_NS / (10 * MS)) + 2


@pytest.fixture
def impatient(monkeypatch):
    monkeypatch.setattr("hw.drivers.kairos.kairos_link.FIRST_S", 0.5)


@pytest.mark.parametrize(
    "given",
    [
        {"topics": {"odom": "robotnik_base_control/odometry"}},
        {"namespace": "rover"},
        {"topics": {"odom": STOP}},
    ],
)
@pytest.mark.few(1)
def test_a_silent_subscription_is_told_with_its_topic(given, impatient):
    told = (
        r"no odom on (/r\S+) within 0.5 s \(nav_msgs/Odometry\).*; rosbridge says: cannot subscribe"
    )
    with pytest.raises(OSError, match=told):
        Rig(**given).__enter__()


@pytest.mark.parametrize("fault", [("unlatched",), ("silent", STOP.removeprefix("/robot/"))])
@pytest.mark.few(1)
def test_a_robot_that_does_not_tell_of_its_stop_counts_as_stopped(impatient, fault):
    with Rig(fault=fault) as rig:
        assert rig.base.fault == (
            f"no emergency_stop on {STOP} within 0.5 s (std_msgs/Bool), which counts as stopped; "
            "if it tells changes only, press and release the button, or name another (topics: "
            "emergency_stop)"
        )
        assert not rig.base.acknowledge()
        rig.fake.fault("stop")
        rig.fake.fault("")
        rig.until(lambda: rig.base.acknowledge())
        rig.going()


@pytest.mark.parametrize("seconds", [-3600.0, 0.5])
@pytest.mark.few(1)
def test_a_clock_that_was_set_is_named_and_counts_again_after_the_operators_answer(seconds):
    with Rig(world=True) as rig:
        for _ in range(60):  # until its clock is known
            rig.cycle()
        rig.going()
        rig.fake.fault("clock", seconds)
        rig.until(lambda: rig.base.fault is not None, AHEAD)
        told = "back by 3600.0 s" if seconds < 0.0 else "forward by 500 ms"
        assert rig.base.fault.startswith(f"the clock of {rig.host} was set {told}")
        before = rig.base.odometry
        assert not rig.base.acknowledge()
        rig.until(lambda: standing(rig.world), AHEAD)
        assert rig.base.fault is not None
        rig.until(lambda: rig.base.acknowledge() and rig.base.fault is None)
        rig.cycle()
        stamp, seen = rig.base.odometry
        assert 0 <= time.monotonic_ns() - stamp <= ODOMETRY_OLD_NS
        assert seen.pose.distance_to(before[1].pose) < 0.5
        rig.going()


@pytest.mark.parametrize("seconds", [0.2, 0.5, 2.0, 2.5])
@pytest.mark.slow
def test_a_gap_in_the_wlan_is_named_and_ends_with_the_operators_answer(seconds):
    with Rig(world=True) as rig:
        rig.going()
        begun = rig.fake.fault("mute")
        rig.until(lambda: time.monotonic_ns() - begun > seconds * 1e9, AHEAD)
        assert rig.base.fault.startswith("odometry is 1")
        assert rig.base.fault.endswith(
            "ms old: nothing comes any more; is it the WLAN, or does the robot's PC hang?"
        )
        rig.fake.fault("")
        rig.until(lambda: standing(rig.world), AHEAD)
        rig.until(lambda: rig.base.acknowledge() and rig.base.fault is None)
        rig.going()


def test_what_the_server_says_and_its_end_are_no_tracebacks(capfd):
    with Rig() as rig:
        rig.fake.fault("status", "a word nobody asked for")
        rig.until(lambda: rig.base._link._bridge.said == "a word nobody asked for")
        os.kill(rig.fake.pid, signal.SIGKILL)
        rig.until(lambda: rig.base.fault is not None, AHEAD)
        remarks = rig.base.remarks()  # at most that something was sent to who had just gone
        assert not any("Traceback" in told or "\n" in told for told in remarks)
        assert len(remarks) <= 1
    out, err = capfd.readouterr()
    told = [line for line in err.splitlines() if "real-time priority" not in line]  # of this test
    assert (out, told) == ("", [])


def test_what_the_library_does_not_understand_is_a_sentence_once():
    told, odd = [], logging.getLogger("roslibpy")
    _library(told.append)
    for _ in range(2):
        try:
            raise KeyError("msg")
        except KeyError:
            odd.exception("Message skipped.")
    logging.getLogger("twisted").critical("Unhandled Error\nTraceback:\n  file\nOSError: gone")
    odd.warning("nothing")
    assert told == ["rosbridge: KeyError: 'msg'", "rosbridge: OSError: gone"]


def test_nobody_there_is_told():
    host = own_address()
    with pytest.raises(OSError, match=rf"rosbridge at {host}:9090: .*refused"):
        KairosBase(model(), host)


@pytest.mark.parametrize(
    ("body", "given", "said"),
    [
        ({"speed": 0.54}, {}, "limits: speed: 0.53 m/s at most for a stop in 0.5 m"),
        ({"brakes": 3.0}, {}, "limits: brakes: 0.6 m/s2 at most"),
        ({}, {"stops": {"timeout": 1.0, "ramp": 0.6}}, "limits: speed: 0.379 m/s at most"),
        ({}, {"stops": {"timeout": 0.0, "ramp": 0.6}}, "stops: 0.0 s and 0.6 m/s2"),
        ({}, {"topics": {"odometry": "x"}}, "topics: odometry: there are cmd_vel, odom"),
    ],
)
def test_mistakes_in_the_file_are_told(body, given, said):
    with pytest.raises(ValueError, match=said):
        KairosBase(model(**body), "127.0.0.1", **given)


def test_a_missing_package_is_one_clear_error(monkeypatch):
    monkeypatch.setitem(sys.modules, "roslibpy", None)
    with pytest.raises(OSError, match=r"roslibpy: pip install 'cobodeck\[ros\]'"):
        RosbridgeClient("127.0.0.1", 9090, print)


def test_importing_the_drivers_imports_no_vendor_library():
    modules = "hw.drivers.kairos.kairos_base, hw.drivers.ros.ros_lidar"
    code = f"import {modules}, sys; sys.exit('roslibpy' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


@pytest.mark.parametrize("yaw", [0.0, 1.0, -3.0, math.pi])
def test_yaw_of_a_quaternion(yaw):
    turned = {"x": 0.0, "y": 0.0, "z": math.sin(yaw / 2), "w": math.cos(yaw / 2)}
    assert math.cos(yaw_of(turned) - yaw) == pytest.approx(1.0)


def test_what_is_no_quaternion_is_refused():
    with pytest.raises(ValueError, match="length 1"):
        yaw_of({"x": 0.0, "y": 0.0, "z": 0.0, "w": 0.0})
