"""The modules of states that an import writes are Python that runs, whatever names it has."""

from __future__ import annotations

import pytest

from cobodeck.flexbe import convert, files_of_project, found_in
from engine import Action

BEHAVIOUR = """\
class OneSM(Behavior):
    def __init__(self):
        self.add_parameter("run", 2)

    def create(self):
        _state_machine = OperatableStateMachine(outcomes=["yes", "no"])
        _state_machine.userdata.x = 3
        with _state_machine:
            OperatableStateMachine.add(
                "One", {state},
                transitions={{"true": "yes", "false": "no"}}, autonomy={{}},
                remapping={{"input_value": "x"}})
        return _state_machine
"""


def modules(tmp_path, state):
    """The names in the modules of the project made of a behaviour with one state."""
    file = tmp_path / "one_sm.py"
    file.write_text(BEHAVIOUR.format(state=state), encoding="utf-8")
    behaviours = found_in(file).behaviours
    files = files_of_project("one", behaviours, convert(behaviours, {}, {}))
    names = {}
    for path in ("one/stubs.py", "one/ready.py"):
        exec(compile(files.get(path, ""), path, "exec"), names)
    return names


def check(predicate):
    return f"CheckConditionState(predicate={predicate})"


@pytest.mark.parametrize(
    ("predicate", "value", "outcome"),
    [
        ("lambda x: True if x > 1 else False", 2, "true"),
        ("lambda x: True if x > 1 else False", 1, "false"),
        ("lambda x: x > 1 or x < -1", -2, "true"),
    ],
)
def test_a_translated_predicate_decides_as_it_did(tmp_path, predicate, value, outcome):
    assert modules(tmp_path, check(predicate))["One"]().run(None, input_value=value) == outcome


@pytest.mark.parametrize("name", ["freeze", "str", "self"])
def test_an_argument_with_the_name_of_what_is_used_around_it_is_left_to_write(tmp_path, name):
    with pytest.raises(NotImplementedError, match="stub"):
        list(modules(tmp_path, check(f"lambda {name}: {name} > 1"))["One"]().run(None))


def test_parameters_hide_nothing_that_a_state_has(tmp_path):
    found = modules(tmp_path, "Odd(run=self.run, outcomes=['a'], reads=1, faults=2, speed=3)")
    state = found["Odd"](run=1, outcomes=("a",), reads=1, faults=2, speed=3)
    assert isinstance(state, Action)
    assert state.outcomes == ("true", "false")
    with pytest.raises(NotImplementedError, match="Odd is a stub"):
        list(state.run(None))
    assert (state.speed, state.run_) == (3, 1)
