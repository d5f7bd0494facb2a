"""The nodes in a process of their own, in real time: what is counted is cycles."""

import logging
import select
import threading
import time

import pytest

from hw.drivers.can.can_base import CanBase
from hw.fakes.can.can_peer import CanNodes
from hw.fakes.can.can_wire import Hub
from hw.geometry import STILL, Twist2
from hw.ipc.datagrams import Door, Intake, Outlet
from hw.samples import BumperHit
from tests.hw.drivers.can.can_rig import CYCLE_NS, MODEL, WHEELS
from tests.hw.drivers.rigs import own_address
from tests.repeats import TIMES

LOG = logging.getLogger(__name__)
AHEAD = Twist2(0.5)
RATE = 0.5 / MODEL.wheel_radius


class World:
    """Stands for the world of the fakes: hears how the wheels turn, tells of touches."""

    def __init__(self, host):
        self._intake = Intake(("drives",), host)
        self.door = self._intake.door
        self._outlet = Outlet()
        self.rates, self.stamp_ns = (), 0

    def hear(self):
        for told in self._intake.poll():
            assert told.source == "drives"
            if told.name == "subscribe":
                self._outlet.doors = [Door(*told.value)]
            else:
                assert told.name == "wheels"
                self.rates, self.stamp_ns = told.value, told.stamp_ns

    def wait(self):
        select.select([self._intake], [], [], 5.0)
        self.hear()

    def bumper(self, value):
        self._outlet.send("bumper", time.monotonic_ns(), value)

    def close(self):
        self._intake.close()
        self._outlet.close()


class Running:
    """A driver that is cycled each 10 ms, and its nodes."""

    def __init__(self, bus=None, peer=None):
        host = own_address()
        self.world = World(host)
        bus = bus or {"interface": "local", "channel": host}
        self.nodes = CanNodes(peer or bus, WHEELS, tells=self.world, by_hand=0.1)
        try:
            self.nodes.wait()
            self.base = CanBase(MODEL, bus, WHEELS, bumper=True)
        except OSError:
            self.nodes.close()
            self.world.close()
            raise
        self._due_ns = time.monotonic_ns()

    def cycle(self, velocity=STILL):
        """One cycle, when it is due."""
        self._due_ns += CYCLE_NS
        left = self._due_ns - time.monotonic_ns()
        select.select([], [], [], max(0.0, 1e-9 * left))
        if left < -CYCLE_NS:
            self._due_ns = time.monotonic_ns()
        now = time.monotonic_ns()
        self.base.poll(now)
        self.base.drive(velocity, now)
        self.world.hear()

    def until(self, wanted, velocity=STILL, most=1000):
        for count in range(1, most + 1):
            self.cycle(velocity)
            if wanted():
                return count
        raise AssertionError(f"not within {most} cycles; fault: {self.base.fault}")

    def turning(self):
        """Until it drives; if this machine has no time for it, and a gate trips, once more."""

        def at_speed():
            if self.base.fault is not None:
                self.base.acknowledge()
            rates = self.world.rates
            return self.base.fault is None and rates and rates[0] == pytest.approx(RATE, rel=0.01)

        return self.until(at_speed, AHEAD)

    def stands(self):
        return self.world.rates == (0.0, 0.0, 0.0, 0.0)

    def acknowledged(self):
        self.until(self.base.acknowledge)
        self.until(lambda: self.base.fault is None)

    def close(self):
        try:
            self.base.close()
        finally:
            self.nodes.close()
            self.world.close()


@pytest.fixture
def running():
    made = Running()
    yield made
    made.close()


@pytest.mark.requirement(1, 4, 5)
def test_wheels_in_another_process_turn_stop_at_a_touch_and_turn_again(running):
    running.turning()
    running.until(lambda: running.base.odometry[1].pose.x > 0.1, AHEAD)
    touched(running)
    running.turning()


@pytest.mark.requirement(49)
def test_without_a_master_the_drives_stop_by_themselves(running):
    without_a_master(running)


def without_a_master(running):
    """How long until they brake, ms."""
    running.turning()
    since, braking = time.monotonic_ns(), None
    while not running.stands():
        running.world.wait()
        if braking is None and running.world.rates[0] < 0.98 * RATE:
            braking = running.world.stamp_ns
    for _ in range(20):
        running.cycle(AHEAD)
        assert running.stands()
    running.acknowledged()
    running.turning()
    return 1e-6 * (braking - since)


def touched(running):
    """How many cycles, and ms, until the driver stops for a touch."""
    running.turning()
    since = time.monotonic_ns()
    running.world.bumper(BumperHit(0.0))
    hits = []
    cycles = running.until(lambda: hits.extend(running.base.hits()) or hits, AHEAD)
    span = 1e-6 * (time.monotonic_ns() - since)
    assert [hit.bearing for hit in hits] == [0.0]
    assert running.base.fault is not None
    running.until(running.stands, AHEAD)
    assert not running.base.acknowledge()
    running.world.bumper(None)
    running.acknowledged()
    return span, cycles


@pytest.mark.slow
@pytest.mark.parametrize("act", [touched, without_a_master])
def test_again_and_again_in_real_time(running, act):
    found = sorted((act(running) for _ in range(TIMES)), key=str)
    LOG.info("%s: %s", act.__name__, found)
    assert len(found) == TIMES


def test_the_process_of_the_nodes_is_killed_and_all_is_a_fault(running):
    running.turning()
    running.nodes.child.kill()
    running.until(lambda: running.base.fault is not None, AHEAD, most=17)
    assert not running.base.acknowledge()


@pytest.mark.slow
def test_the_same_over_tcp_where_no_multicast_is():
    host, port = own_address(), 24_680
    running = Running(
        {"interface": "slcan", "channel": f"socket://{host}:{port}"},
        {"interface": "hub", "channel": host, "port": port},
    )
    try:
        assert running.nodes.ready["wire"] == Hub.__name__
        running.turning()
        running.nodes.fault("emcy", 2)
        running.until(lambda: running.base.fault is not None, AHEAD)
        running.until(running.stands, AHEAD)
        running.acknowledged()
        running.turning()
    finally:
        running.close()


def test_a_second_driver_in_another_process_is_refused(running):
    running.turning()
    host = running.nodes.ready["control"][0]
    over = threading.Event()

    def go_on():
        while not over.is_set():
            running.cycle(AHEAD)

    driving = threading.Thread(target=go_on)
    driving.start()
    try:
        with pytest.raises(OSError, match="another master drives there"):
            CanBase(MODEL, {"interface": "local", "channel": host}, WHEELS)
    finally:
        over.set()
        driving.join()
    assert "another master" not in str(running.base.fault)
