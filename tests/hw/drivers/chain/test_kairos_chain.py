"""The wheels of an RB-KAIROS behind the process of the safety chain: what its stops take."""

import os
import signal
import time
from dataclasses import replace
from itertools import pairwise

import pytest

from hw.connection.connection import RunInfo, load_connection
from hw.drivers.chain.chain_client import ChainLink
from hw.drivers.observer import ObserverLink
from hw.fakes.kairos.kairos_peer import Kairos
from hw.geometry import Pose2, Twist2
from hw.ipc.datagrams import Intake, Outlet
from hw.model.robot import MotionLimits, load_robot
from hw.model.tracking import Tracking
from hw.safety.limits import SafetyLimits
from tests.hw.drivers.chain_rig import EVERY_MS, Rig as ChainRig
from tests.hw.drivers.rigs import OBSERVER_KEY, own_address

pytest.importorskip("roslibpy", reason="the extra 'ros' is not installed")

CONNECTION = load_connection("kairos_rosbridge")
BODY = CONNECTION.limits.body(load_robot("rbkairos_ur10"))
MOTION = CONNECTION.limits.motion(MotionLimits(1.0, 2.0))
LIMITS = replace(SafetyLimits.of(BODY, MOTION), watched=True)
FULL = Twist2(0.52, 0.0, 0.0)


class Rig(ChainRig):
    """The rig of the chain, with the shipped entry of the wheels and a fake at their other end."""

    def __init__(self):
        self.begin = time.monotonic_ns()
        self.reports, self.host = Intake(("drives", "scanners")), own_address()
        given = RunInfo(self.run_time, BODY, MOTION, LIMITS, Tracking.of(BODY.sensing))
        self.fake = Kairos(self.host, given, tells=self.reports)
        self.fake.wait()
        entry = dict(CONNECTION.links["chain"].arguments["hardware"]) | {"host": self.host}
        self.chain = ChainLink(7400, entry, self.run_time, given, host=self.host)
        self.outlets = {name: Outlet([self.chain.door(name)]) for name in ("arm", "vr")}
        self.observer = ObserverLink((self.host, 7401), OBSERVER_KEY)  # nobody is there
        self.faults = Outlet()
        self.speaks, self.command = set(EVERY_MS), FULL
        self.user, self.pulled = Pose2(40.0, 0.0), []
        self._due = dict.fromkeys(EVERY_MS, 0)
        self.last = dict(self._due)
        self.speeds = []

    def take(self):
        """Instants, ns, and speeds of the wheels ahead, m/s."""
        radius = BODY.base.wheel_radius
        told = [one for one in self.reports.poll() if one.name == "wheels"]
        self.speeds += [(one.stamp_ns, radius * sum(one.value) / 4.0) for one in told]

    @property
    def speed(self):
        return self.speeds[-1][1] if self.speeds else 0.0

    def way_since(self, instant_ns):
        """m."""
        after = [(stamp, speed) for stamp, speed in self.speeds if stamp >= instant_ns]
        return sum((b - a) * 1e-9 * speed for (a, speed), (b, _) in pairwise(after))

    def full(self):
        """Until it drives as told; a machine that was too busy at first is given another try."""
        return self.until(lambda: self.speed > 0.99 * FULL.vx or (self.pulled and self.again()))

    def again(self):
        if self.speed == 0.0 and self.meanwhile(lambda: self.base.chain.reset(self.run_time())):
            self.pulled.clear()
        return False

    def go_on_stopped(self):
        """Nothing moves for 50 more messages."""
        count = len(self.speeds) + 50
        self.until(lambda: len(self.speeds) > count)
        assert all(speed == 0.0 for _, speed in self.speeds[-50:])

    def stopped(self):
        return self.until(lambda: self.speed == 0.0)

    def close(self):
        super().close()
        self.fake.close()


@pytest.fixture
def rig():
    made = Rig().start()
    yield made
    made.close()


@pytest.mark.slow
@pytest.mark.requirement(15)
def test_a_chain_that_is_killed_leaves_a_stop_of_half_a_metre(rig, record_testsuite_property):
    rig.full()
    os.kill(rig.chain.pid, signal.SIGKILL)
    killed = time.monotonic_ns()
    rig.stopped()
    way, took = rig.way_since(killed), 1e-9 * (rig.speeds[-1][0] - killed)
    record_testsuite_property("way_m", round(way, 3))
    record_testsuite_property("took_s", round(took, 3))
    assert 0.3 < way <= 0.5
    assert took > 0.1  # which is what a robot of our own takes: told as not met


@pytest.mark.slow
def test_an_engine_that_is_silent_is_a_stop_by_the_ramp(rig, record_testsuite_property):
    rig.full()
    rig.speaks.discard("engine")
    silent = time.monotonic_ns()
    rig.stopped()
    way = rig.way_since(silent)
    record_testsuite_property("way_m", round(way, 3))
    assert way < 0.45  # its own watchdog alone would take more


@pytest.mark.slow
@pytest.mark.requirement(48, 49)
def test_its_emergency_stop_stops_the_chain_until_it_is_released_and_reset(rig):
    rig.full()
    rig.fake.fault("stop")
    rig.until(lambda: rig.pulled)
    assert rig.pulled[0][1] == "the robot's emergency stop is engaged"
    rig.stopped()
    assert not rig.meanwhile(lambda: rig.base.chain.reset(rig.run_time()))
    rig.fake.fault("")
    rig.full()  # resets until it is allowed


@pytest.mark.slow
def test_a_lost_connection_is_opened_again_by_a_reset_alone(rig):
    rig.full()
    rig.fake.fault("drop")
    rig.until(lambda: rig.pulled)
    assert "the connection is lost" in rig.pulled[0][1]
    rig.stopped()
    rig.go_on_stopped()
    rig.fake.fault("")
    rig.go_on_stopped()
    rig.full()
