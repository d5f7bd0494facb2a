"""The examples on the simulated robot, with ideal poses and with all sensors."""

from __future__ import annotations

from typing import NamedTuple

import pytest

from cobodeck.testing import ChartTester


class Example(NamedTuple):
    """How a chart ends, and where it runs."""

    outcome: str
    scene: str
    user: str | None = None
    robot: str | None = None
    profile: str | None = None


RUNS = {
    "tea": Example("served", "tea_house", profile="careful"),
    "patrol": Example("done", "yard"),
    "door_watch": Example("seen", "entrance"),
    "pick_and_place": Example("done", "workbench"),
    "docking": Example("docked", "yard"),
    "follow_me": Example("there", "hall", user="guide", robot="rover"),
}


def begin(sim: ChartTester, name: str, tier: int = 1) -> None:
    _, scene, user, robot, profile = RUNS[name]
    sim.start(name, scene=scene, user=user, robot=robot, profile=profile, tier=tier)


def run(sim: ChartTester, name: str, tier: int = 1) -> None:
    begin(sim, name, tier)
    sim.until(lambda: sim.outcome, timeout=300.0)
    assert sim.outcome == RUNS[name].outcome
    assert not sim.run.errors


LONG = [pytest.param(name, marks=pytest.mark.slow) if name == "tea" else name for name in RUNS]


@pytest.mark.parametrize("name", LONG)
def test_an_example_runs_to_its_end(sim: ChartTester, name: str) -> None:
    run(sim, name)


@pytest.mark.slow
@pytest.mark.parametrize("name", RUNS)
def test_an_example_runs_to_its_end_with_all_sensors(sim: ChartTester, name: str) -> None:
    run(sim, name, tier=2)


@pytest.mark.slow
def test_the_tea_waits_until_the_chair_in_the_doorway_is_gone(sim: ChartTester) -> None:
    begin(sim, "tea", tier=2)
    sim.until("offer", timeout=100.0)
    assert 40.0 < sim.now < 60.0  # the chair leaves at 40 s
    assert sim.path("fetch", "bring", "offer").count("bring") == 1


def test_the_cup_stands_where_it_was_felt(sim: ChartTester) -> None:
    run(sim, "pick_and_place")
    assert sim.loop.plant.items["cup"] == pytest.approx((2.8, 2.3, 0.7), abs=0.02)


def test_a_robot_enters_its_dock_slowly(sim: ChartTester) -> None:
    begin(sim, "docking")
    sim.until("enter", timeout=20.0)
    fastest = 0.0
    while sim.active:
        fastest = max(fastest, sim.loop.plant.base.twist.speed)
        sim.tick()
    assert fastest == pytest.approx(0.2, abs=0.01)
