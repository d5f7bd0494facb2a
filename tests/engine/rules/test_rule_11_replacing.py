"""Rule 11 of engine/README.md: replacing a chart while it runs."""

from __future__ import annotations

import pytest

from engine.chart.load import load_text
from engine.interfaces import interface
from engine.literals import Constant
from engine.machine.machine import Machine
from engine.machine.named_values import NamedValues
from engine.operator.operator import Operator
from engine.run.chart_run import ChartRun
from tests.engine.conftest import STATES
from tests.engine.rules.charts import DATA, NESTED, SEQUENCE, TWO_GUARDS, Listen, listening


def test_rule_11_a_running_chart_is_replaced_without_a_break(bench):
    b = bench(SEQUENCE)
    b.tick(2)
    started = b.records("enter")
    new = load_text(
        SEQUENCE.replace("a: {do: Do, next: {done: b,", "a: {do: Do, next: {done: c,")
        + "  c: {do: Do, next: {done: .x, failed: .x, other: .x}}\n"
    )
    machine = b.bind(next(iter(new.values())))
    generator = b.run.nodes["a"].generator
    assert b.operator.replace(machine) == []
    b.tick()
    assert b.records("enter") == started
    assert b.run.nodes["a"].generator is generator
    b.end("a", "done")
    b.tick()
    assert ("move", "", "a", "done", "c") in b.last()


def test_rule_11_a_replacement_that_changes_what_runs_is_refused(bench):
    b = bench(SEQUENCE)
    b.tick()
    gone = load_text(
        SEQUENCE.replace("  a: {do: Do,", "  z: {do: Do,")
        .replace("other: a", "other: z")
        .replace("done: a", "done: z")
    )
    other = load_text(SEQUENCE.replace("a: {do: Do,", "a: {do: Drive,"))
    for library in (gone, other):
        refused = b.operator.replace(b.bind(next(iter(library.values()))))
        assert refused
        assert "'a'" in refused[0]


def test_rule_11_a_replacement_that_commands_a_part_which_is_missing_is_refused(bench):
    b = bench(SEQUENCE, parts={})
    b.tick()
    assert replaced(b, SEQUENCE.replace("b: {do: Do,", "b: {do: Drive,"))[0] == [
        "'b' commands 'base', which this run does not have"
    ]


READER = """
chart: c
inputs: {start: number, by: {type: number, default: 1}}
outcomes: [x]
any:
  use: {do: Use, in: {value: start}, next: {done: .x, failed: .x, other: .x}}
"""


def begun(text, **inputs):
    """A run of one chart with inputs, before its first tick."""
    library = load_text(text)
    assert not library.findings
    states = {cls.__name__: interface(cls) for cls in STATES}
    return ChartRun(Machine(library["c"], library, states, inputs=inputs)), library


def test_rule_11_a_run_keeps_its_inputs_through_a_replacement():
    run, _ = begun(READER.replace("any:", "states:"), start=4.0)
    run.tick(0)
    new = load_text(
        READER.replace("any:", "states:").replace("{done: .x", "{done: twice")
        + "  twice: {do: Use, in: {value: start}, next: {done: .x, failed: .x, other: .x}}\n"
    )

    assert Operator(run).replace(run.machine.changed(new["c"], new)) == []
    run.tick(10**8)
    assert run.machine.inputs == {"start": 4.0}
    assert run.active == ["twice"]
    assert run.life.inputs_of(run.machine.vertices["twice"]) == {"value": 4.0}


def test_rule_11_a_replacement_that_needs_an_input_more_is_refused():
    run, _ = begun(READER, start=4.0)
    more = load_text(READER.replace("by: {type: number, default: 1}", "more: number"))
    machine = run.machine.changed(more["c"], more)

    assert machine.missing == ["more"]
    assert Operator(run).replace(machine) == ["input 'more' of 'c' has no value"]
    run.tick(0)
    assert Operator(run).replace(machine) == ["input 'more' of 'c' has no value"]


def test_rule_11_a_run_that_has_begun_has_its_inputs_itself():
    run, library = begun(READER, start=4.0)
    states = run.machine.interfaces
    without = Machine(library["c"], library, states)

    assert Operator(run).replace(without) == ["input 'start' of 'c' has no value"]
    run.tick(0)
    assert Operator(run).replace(without) == []
    run.tick(10**8)
    assert run.value_of("start") == 4.0


def test_rule_11_values_that_names_stand_for_do_not_change_in_what_runs():
    text = READER.replace("in: {value: start}", "in: {value: $profile.speed}")
    library = load_text(text)
    states = {cls.__name__: interface(cls) for cls in STATES}
    slow, fast = (
        Machine(
            library["c"],
            library,
            states,
            inputs={"start": 1},
            around=NamedValues({"profile.speed": Constant(speed)}),
        )
        for speed in (1.0, 2.0)
    )
    run = ChartRun(slow)
    run.tick(0)

    assert Operator(run).replace(slow.changed(library["c"], library)) == []
    [refused] = Operator(run).replace(fast)
    assert refused.startswith("'use' is active and differs")


def test_rule_11_new_children_of_an_active_any_are_entered_next_tick(bench):
    b = bench(TWO_GUARDS)
    b.tick()
    new = load_text(TWO_GUARDS + "  more: {do: Do, next: {done: .x, failed: .x, other: .x}}\n")
    assert b.operator.replace(b.bind(next(iter(new.values())))) == []
    b.tick()
    assert "more" in b.active


def replaced(b, text):
    """Ask for the replacement of the bench's chart by `text`; why not, and the machine."""
    machine = b.bind(next(iter(load_text(text).values())))
    return b.operator.replace(machine), machine


def test_rule_11_a_chart_can_be_replaced_before_its_first_tick_but_not_after_its_end(bench):
    b = bench(SEQUENCE)
    assert replaced(b, NESTED)[0] == []
    b.tick()
    assert b.active == ["chase/danger", "chase/inner/near", "chase/inner/drive"]
    b.operator.stop()
    b.tick()
    assert replaced(b, NESTED)[0] == ["the run has ended"]


def test_rule_11_nothing_is_replaced_while_something_is_chosen_and_not_yet_begun(bench):
    b = bench(SEQUENCE)
    b.tick()
    b.operator.pause()
    b.operator.force("a", "done")
    b.tick()
    assert replaced(b, SEQUENCE)[0] == ["'b' waits; replace when it has gone on"]


def test_rule_11_rules_that_are_replaced_are_looked_at(bench):
    text = """
chart: c
outcomes: [x, y]
any:
  a: {do: Do}
  b: {do: Do}
when:
  - {outcome: x, if: {b: done}}
"""
    b = bench(text)
    b.tick()
    b.end("a", "done")
    b.tick()
    assert replaced(b, text + "  - {outcome: y, if: {a: done}}\n")[0] == []
    b.tick()
    assert b.run.outcome == "y"


def test_rule_11_kept_outcomes_and_their_outputs_live_through_a_replacement(bench):
    text = """
chart: c
outcomes: [x]
outputs: {x: {a: number}}
data: {a: {type: number, initial: 0}, b: {type: number, initial: 0}}
states:
  both:
    all:
      one: {do: Give, out: {value: a}}
      two: {watch: Tell, out: {value: b}}
    next: {done: .x}
"""
    b = bench(text)
    b.tick()
    b.end("both/one", "done", value=1.0)
    b.tick()
    more = text.replace("    next: {done", "      three: {do: Do}\n    next: {done")
    assert replaced(b, more)[0] == []
    b.tick()
    assert b.active == ["both/two", "both/three"]
    b.end("both/two", "seen", value=2.0)
    b.tick()
    assert b.run.results == {"a": 1.0}


def test_rule_11_what_has_ended_inside_a_box_stays_so_through_a_replacement(bench):
    text = """
chart: c
outcomes: [x]
any:
  first:
    any:
      a: {do: Do}
    when: [{outcome: on, if: {a: done}}]
  second: {do: Do}
when: [{outcome: x, if: {first: on, second: done}}]
"""
    b = bench(text)
    b.tick()
    b.end("first/a", "done")
    b.tick()
    assert replaced(b, text.replace("a: {do: Do}", "a: {do: Do}\n      b: {do: Do}"))[0] == []
    b.tick()
    assert b.active == ["second"]
    b.end("second", "done")
    b.tick()
    assert b.run.outcome == "x"


def test_rule_11_data_whose_type_has_changed_is_not_carried_over(bench):
    b = bench(DATA)
    b.tick()
    refused, _ = replaced(b, DATA.replace("{type: number, initial: 0}", "{type: text, initial: a}"))
    assert refused == ["'goal' of 'c' is a number and would be a text"]


ALONE = """
chart: c
outcomes: [x]
states:
  a: {do: Do, retry: {times: 3, on: other}, next: {done: .x, failed: .x, other: .x}}
"""


LIMITED = ALONE.replace("do: Do,", "do: Do, timeout: 1 s,").replace(
    "next: {", "next: {timeout: .x, "
)


@pytest.mark.parametrize("old", [ALONE, LIMITED])
def test_rule_11_a_timeout_that_is_replaced_counts_from_the_entry_in_chart_time(bench, old):
    b = bench(old)
    b.tick()
    b.end("a", "other")
    b.tick(2)  # the second try
    b.operator.pause()
    b.tick(10)
    b.operator.resume()
    b.tick()
    refused, _ = replaced(b, LIMITED.replace("1 s", "1.5 s"))
    assert refused == []
    b.tick()
    assert b.run.nodes["a"].deadline == 1_500_000_000
    assert b.run.board.chart_now == 4 * 10**8


def test_rule_11_a_state_that_waits_for_a_signal_goes_on_waiting_through_a_replacement(bench):
    b = listening(bench)
    new = b.bind(b.chart)
    assert b.operator.replace(new) == []
    b.tick(3)
    assert Listen.heard == [(0, None)]
    b.run.board.put("voice", "hello", b.now)
    b.tick(3)
    assert [value for _, value in Listen.heard] == [None, "hello"]
