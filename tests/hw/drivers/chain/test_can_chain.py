"""The safety chain in its process with CAN wheels in another: touches, resets, and kill -9."""

import logging
import os
import signal
import time

import pytest

from hw.drivers.chain.chain_client import ChainLink
from hw.drivers.observer import ObserverLink
from hw.fakes.can.can_peer import CanNodes
from hw.geometry import Pose2
from hw.ipc.datagrams import Door, Intake, Outlet
from hw.samples import BumperHit
from tests.hw.drivers.can.can_rig import MODEL, WHEELS
from tests.hw.drivers.chain_rig import AHEAD, EVERY_MS, Rig, opening
from tests.hw.drivers.rigs import OBSERVER_KEY, own_address
from tests.repeats import TIMES

LOG = logging.getLogger(__name__)
RATE = AHEAD.vx / MODEL.wheel_radius


class CanChain(Rig):
    """The rig of the chain, whose wheels are nodes on a bus; it stands for their world, too."""

    def __init__(self):
        self.begin = time.monotonic_ns()
        self.reports, self.host = Intake(("drives",)), own_address()
        self.door = self.reports.door
        bus = {"interface": "local", "channel": self.host}
        self.nodes = CanNodes(bus, WHEELS, tells=self, by_hand=0.1)
        self.nodes.wait()
        hardware = {
            "driver": "hw.drivers.can.can_base:CanBase",
            "bus": bus, "wheels": WHEELS, "bumper": True,
        }  # fmt: skip
        now = self.run_time
        self.chain = ChainLink(7400, hardware, now, opening(now), host=self.host)
        self.outlets = {name: Outlet([self.chain.door(name)]) for name in ("arm", "vr")}
        self.observer = ObserverLink((self.host, 7401), OBSERVER_KEY)  # nobody is there
        self.faults = Outlet()
        self.speaks, self.command, self.user = set(EVERY_MS), AHEAD, Pose2(40.0, 0.0)
        self.pulled, self.rates, self.told_ns = [], (), 0
        self._due = dict.fromkeys(EVERY_MS, 0)
        self.last = dict(self._due)

    def take(self):
        for told in self.reports.poll():
            if told.name == "subscribe":
                self.faults.doors = [Door(*told.value)]
            else:
                self.rates, self.told_ns = told.value, told.stamp_ns

    def driving(self):
        """If this machine has no time for it, and a gate trips, it is reset."""

        def at_speed():
            if self.chain.stopped is not None:
                self.meanwhile(lambda: self.base.chain.reset(self.run_time()))
            return self.rates and self.rates[0] > 0.98 * RATE

        return self.until(at_speed)

    def standing(self):
        return self.until(lambda: self.rates == (0.0, 0.0, 0.0, 0.0))

    def close(self):
        super().close()
        self.nodes.close()


@pytest.fixture
def rig():
    made = CanChain()
    try:
        yield made.start()
    finally:
        made.close()


@pytest.mark.requirement(4, 5, 48)
def test_a_touch_stops_the_wheels_until_the_operator_resets_them(rig):
    rig.driving()
    rig.order("bumper", BumperHit(0.0))
    rig.standing()
    rig.until(lambda: rig.bumper.samples(rig.run_time()))
    assert rig.chain.stopped is not None
    assert not rig.meanwhile(rig.line.reset)  # the foam is still pressed
    rig.order("bumper", None)
    rig.until(lambda: rig.meanwhile(rig.line.reset))
    rig.driving()


@pytest.mark.requirement(49)
def test_wheels_brake_by_themselves_when_the_chain_is_killed(rig):
    killed(rig)


def killed(rig):
    """How long until the wheels brake, ms."""
    rig.driving()
    os.kill(rig.chain.pid, signal.SIGKILL)
    since = time.monotonic_ns()
    rig.until(lambda: rig.rates[0] < 0.98 * RATE)
    span = 1e-6 * (rig.told_ns - since)
    rig.standing()
    rig.until(lambda: rig.chain.why is not None or rig.pulled)
    return span


@pytest.mark.slow
def test_the_chain_is_killed_again_and_again():
    found = []
    for _ in range(TIMES):
        made = CanChain()
        try:
            found.append(round(killed(made.start())))
        finally:
            made.close()
    LOG.info("chain killed, ms until the wheels brake: %s", sorted(found))
    assert len(found) == TIMES
