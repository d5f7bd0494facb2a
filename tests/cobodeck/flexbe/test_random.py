"""Behaviours by chance become charts without errors, of which each outcome is walked."""

from __future__ import annotations

import json

import pytest

from cobodeck.flexbe import Behaviour, convert, files_of_project, read_json, read_python
from engine.check.all_checks import check
from engine.machine import LeafScript, Machine, explore
from engine.run import ChartRun
from tests.cobodeck.flexbe.conftest import library_of
from tests.cobodeck.flexbe.generated import generated
from tests.cobodeck.flexbe.random_behaviours import RandomBehaviour

TICK_NS = 10**8
FEW, MANY = range(5), range(5, 210)


def walked(machine: Machine, script) -> set[tuple[str, str]]:
    """The outcomes that a run takes whose states end as the script says."""
    states = LeafScript(machine)
    run = ChartRun(machine, stand_ins=states.stand_ins)
    run.tick(0)
    for number, step in enumerate(script):
        for path, outcome in step:
            states.end(path, outcome)
        for tick in range(3):
            run.tick((3 * number + tick + 1) * TICK_NS)
    return {(r.subject, *r.detail) for r in run.trace if r.kind == "outcome"}


def holds(behaviour: Behaviour) -> None:
    conversion = convert([behaviour])
    for path, text in files_of_project("mine", [behaviour], conversion).items():
        if path.endswith(".py"):
            compile(text, path, "exec")
    library = library_of(conversion)
    findings = check(library, conversion.interfaces())
    assert [str(f) for f in findings if f.severity == "error"] == []
    for name in conversion.charts:
        machine = Machine(library[name], library, conversion.interfaces())
        found = explore(machine)
        assert found.complete
        for edge, script in found.moves.items():
            assert edge in walked(machine, script)


@pytest.mark.parametrize(
    "seed", [*FEW, *(pytest.param(seed, marks=pytest.mark.slow) for seed in MANY)]
)
def test_a_behaviour_by_chance_is_read_checked_and_walked(seed):
    chance = RandomBehaviour(seed)
    neutral = json.loads(json.dumps(chance.json()))
    version = 1 + 3 * (seed % 2)
    text = generated(neutral, "My_SelfSM", version=version, create=chance.create())
    read = read_python(text, "my_self_sm.py", "My_Self")
    assert read.json == neutral
    holds(read)
    holds(read_json(json.dumps(neutral), "my_self.json", "My_Self"))
