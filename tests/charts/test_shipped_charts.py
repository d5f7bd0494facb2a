"""Every transition of the shipped charts is walked, by scripts that exploration finds."""

from __future__ import annotations

from functools import cache

import pytest

from cobodeck.setup.setup import open_setup
from engine.machine.exploration import Ended, active, after, explore, initial
from engine.machine.machine import Machine
from engine.machine.scripted_states import LeafScript
from engine.run.chart_run import ChartRun
from engine.signals.board import Board

BEHAVIOURS = ("cobodeck", "chase", "haptic", "escape", "inform")
CHARTS = (*BEHAVIOURS, *(f"paper_{name}" for name in BEHAVIOURS), "paper_condition_parked")
TICK_NS = 10**8
setup_of = cache(open_setup)


class Still:
    """A part that does nothing."""

    def stop(self) -> None:
        """Stand."""


def machine_of(name: str) -> Machine:
    """A shipped chart whose timeouts only fire when they are told to."""
    machine = setup_of(name).machine()
    for vertex in machine.vertices.values():
        if vertex.timeout_ns is not None:
            vertex.timeout_ns = 10**15
    return machine


def walk(name: str, script) -> None:
    """Play the steps of a script; runner and exploration agree after each of them."""
    machine = machine_of(name)
    setup = setup_of(name)
    parts = {part: Still() for leaf in machine.leaves for part in leaf.interface.commands}
    told = LeafScript(machine)
    run = ChartRun(machine, Board(setup.signals), parts, stand_ins=told.stand_ins)
    run.tick(0)
    here = initial(machine.root)
    for number, step in enumerate(script, start=1):
        for path, outcome in step:
            if outcome == "timeout":
                run.life.set_deadline(run.nodes[path], number * TICK_NS)
            else:
                told.end(path, outcome)
        here = after(machine.root, here, step, [])
        run.tick(number * TICK_NS)
        if isinstance(here, Ended):
            assert run.outcome == here.outcome
            return
        assert sorted(run.active) == sorted(leaf.path for leaf in active(machine.root, here))


@pytest.mark.parametrize("name", CHARTS)
def test_a_shipped_chart_is_explored_completely_and_nothing_in_it_is_out_of_reach(name):
    machine = open_setup(name).machine()
    found = explore(machine)
    assert found.complete
    assert found.stuck == []
    assert {leaf.path for leaf in machine.leaves} == found.entered
    assert set(found.outcomes) == set(machine.chart.outcomes)


@pytest.mark.requirement(57, 58, 60, 61, 62, 63, 64, 65, 66)
@pytest.mark.parametrize("name", CHARTS)
def test_every_transition_of_a_shipped_chart_is_walked(name):
    scripts = set(explore(open_setup(name).machine()).moves.values())
    assert scripts
    for script in sorted(scripts):
        walk(name, script)
