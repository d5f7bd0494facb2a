"""Rule 9: the inputs of the chart that is run."""

from __future__ import annotations

from typing import Any

import pytest

from engine.chart.load import load_text
from engine.machine.machine import Machine
from tests.engine.written_states import AROUND, INTERFACES, TYPES, Spot

ASKS = """\
chart: c
outcomes: [x]
inputs:
  goal: Spot
  start: {type: Spot, default: {place: dock}}
  maybe: {type: Spot, default: none}
  many: {type: list of length | none}
states: {n: {do: Go, in: {goal: goal}, next: {done: .x, failed: .x, other: .x}}}
"""


def machine_of(**given: Any) -> Machine:
    library = load_text(ASKS)
    assert not library.findings, library.findings
    return Machine(library["c"], library, INTERFACES, types=TYPES, around=AROUND, **given)


def test_rule_9_inputs_of_the_chart_are_given_have_a_default_or_are_missing():
    assert machine_of().missing == ["goal"]
    machine = machine_of(inputs={"goal": {"x": "1 m"}, "many": ["1 m", "20 cm"]})
    assert machine.missing == []
    cells = machine.root.cells
    assert cells["goal"].initial == Spot(1.0)
    assert cells["start"].initial == Spot(1.0, 2.0)
    assert cells["maybe"].initial is None
    assert cells["many"].initial == (1.0, 0.2)
    assert machine_of(inputs={"start": {"x": 5}}).root.cells["start"].initial == Spot(5.0)


@pytest.mark.parametrize(
    ("inputs", "told"),
    [
        ({"gaol": {"x": 1}}, "it has no input 'gaol'; did you mean 'goal'?"),
        ({"goal": {"x": "1 s"}}, "goal.x: '1 s' is a duration; wanted: a length, in mm, cm, m, km"),
        ({"goal": {"place": "dok"}}, "goal: there is no place 'dok' here; did you mean 'dock'?"),
        ({"goal": 5}, "goal: 5 is not a Spot; wanted: {x: …, y: …} or {place: …}"),
    ],
)
def test_rule_9_an_input_that_cannot_be_is_refused_by_its_name(inputs, told):
    with pytest.raises(ValueError, match="goal") as caught:
        machine_of(inputs=inputs)
    assert str(caught.value) == told
