"""Wheels behind the process of the safety chain, as a connection opens them beside other parts."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from typing import Any

import pytest

from cobodeck.real.connected import Connected, connect
from cobodeck.setup.setup import Uses
from cobodeck.terminal.console import Problem
from hw.connection.connection import Connection, ServedPart
from hw.drivers.chain.chain_client import ChainLink
from hw.geometry import STILL
from hw.ipc.datagrams import Intake, Outlet
from hw.samples import ArmState, PoseSigma, Sample
from tests.hw.drivers.chain_rig import AHEAD, HARDWARE, PATIENCE_S, ROBOT, opening
from tests.hw.drivers.rigs import own_address
from tests.hw.drivers.wheels import SECRET

USES = Uses(frozenset(("base", "arm")), frozenset(("bumper.hit",)))
OPENED: dict[str, Any] = {}


class Arm:
    """An arm that is folded, and says whether it was stopped."""

    signals = ("arm.joints",)

    def __init__(self, now: Callable[[], int]) -> None:
        self.stopped = threading.Event()
        OPENED["arm"] = self

    def stop(self) -> None:
        self.stopped.set()

    def follow(self, points: object) -> int:
        """It stays folded."""
        return 0

    def pace(self, *how: object) -> None:
        """As it is."""

    def samples(self, now_ns: int) -> list[Sample]:
        joints = ROBOT.parked
        return [Sample("arm.joints", now_ns, ArmState(joints, (0.0,) * len(joints)))]


class Rig:
    """An engine that ticks without a chart; nobody tracks people."""

    def __init__(self) -> None:
        begin = time.monotonic_ns()
        self.now = lambda: time.monotonic_ns() - begin
        self.reports, orders = Intake(("wheels",)), Intake(("test",), secret=SECRET)
        orders.close()
        self.faults = Outlet([orders.door("test")])
        self.told: list[Any] = []
        chain = "hw.drivers.chain.chain_client"
        hardware = {
            "driver": HARDWARE,
            "tells": [self.reports.door("wheels")],
            "hears": orders.address,
        }
        values = {"port": 7400, "host": own_address(), "arm": False, "hardware": hardware}
        parts = {
            name: ServedPart(chain, driver, {"link": "chain"}, f"c.yaml:{line}:3")
            for line, (name, driver) in enumerate(
                {
                    "base": "ChainBase",
                    "stop_line": "ChainStopLine",
                    "bumper": "ChainBumper",
                }.items(),
                8,
            )
        }
        parts["arm"] = ServedPart(__name__, "Arm", {}, "c.yaml:12:3")
        links = {"chain": ServedPart(chain, "ChainLink", values, "c.yaml:3:3")}
        self.connection = Connection("c", "", "rbkairos_ur10", parts, links)
        self.plant = self.open()

    def open(self) -> Connected:
        return connect(self.connection, opening(self.now), USES)

    @property
    def chain(self) -> ChainLink:
        (chain,) = self.plant.beside
        assert isinstance(chain, ChainLink)
        return chain

    def tick(self) -> None:
        guard, now = self.plant.guard, self.now()
        assert guard is not None
        for part in self.plant.parts.values():
            for sample in part.samples(now):
                guard.hear(sample, now)
                if sample.name == "base.odometry":
                    guard.chain.locate(sample.stamp_ns, sample.value.pose, PoseSigma(0.01, 0.01))
        guard.drive(AHEAD)
        guard.tick(now)

    def until(self, reached: Callable[[], object]) -> None:
        end = time.monotonic() + PATIENCE_S
        while not reached():
            assert time.monotonic() < end
            self.tick()
            OPENED["arm"].stopped.wait(0.01)
            self.told += [one.value for one in self.reports.poll() if one.name == "cycle"]

    def driving(self) -> None:
        self.until(lambda: self.told and self.told[-1][1] == AHEAD)

    def close(self) -> None:
        self.plant.close()
        assert self.plant.failures == []
        self.reports.close()
        self.faults.close()


@pytest.fixture
def rig(monkeypatch: pytest.MonkeyPatch) -> Iterator[Rig]:
    import sys
    from types import SimpleNamespace

    monkeypatch.setitem(sys.modules, __name__, SimpleNamespace(Arm=Arm))  # type: ignore[arg-type]
    made = Rig()
    yield made
    made.close()


@pytest.mark.requirement(4, 5, 48)
def test_what_stops_the_wheels_stops_the_arm_without_a_tick(rig: Rig) -> None:
    rig.driving()
    rig.faults.send("hit", 0, 0.3)
    assert OPENED["arm"].stopped.wait(PATIENCE_S)
    rig.until(lambda: rig.told[-1][1] == STILL)
    assert rig.plant.guard is not None
    rig.tick()
    assert rig.plant.guard.selected.lock == "stop"


@pytest.mark.requirement(48, 49)
def test_who_pulls_the_line_of_the_connection_stops_the_wheels_until_it_is_reset(rig: Rig) -> None:
    rig.driving()
    line, written = rig.plant.parts["stop_line"], rig.plant.cycles
    line.pull("console")
    rig.until(lambda: rig.told[-1][1] == STILL and rig.told[-1][2] == STILL)
    OPENED["arm"].stopped.clear()
    assert line.reset()
    rig.driving()
    assert written is not None
    assert {"stop line"} <= {why for r in written.reader().read_new() for why in r.reasons}


def test_nobody_cycles_in_the_engine_and_records_come_from_the_process(rig: Rig) -> None:
    rig.driving()
    assert not any(thread.name == "chain" for thread in threading.enumerate())
    assert rig.plant.cycles is rig.chain.remote.cycles
    assert rig.plant.guard is not None
    assert not rig.plant.person_watched
    assert rig.plant.guard.chain is rig.chain.remote
    assert rig.plant.guard.chain.reckons
    assert not rig.plant.guard.cycled


def test_a_second_engine_is_told_so_in_the_words_of_its_connection(rig: Rig) -> None:
    shown = r"c\.yaml:3:3: link 'chain' by hw\.drivers\.chain\.chain_client:ChainLink: "
    with pytest.raises(Problem, match=shown):
        rig.open()
