"""Rule 10 where a node's parameters name signals, parts and outcomes, or types vary."""

from __future__ import annotations

import pytest

from engine.chart.load import Library
from engine.check.all_checks import check
from engine.files.finding import Finding
from engine.files.source import read
from engine.interfaces import interface
from engine.literals import Constant
from engine.machine.named_values import NamedValues
from engine.signals.signal_kinds import types_of
from engine.state import Action, Context, Run
from tests.engine.written_states import CONSTANTS, INTERFACES, PLACES, SIGNALS, TYPES

MORE = {**CONSTANTS, "k.part": "left", "k.cases": ["red", "blue"], "k.word": "red"}
AROUND = NamedValues(
    {name: Constant(value) for name, value in MORE.items()},
    types_of(SIGNALS),
    {"place": PLACES},
)
HEAD = """\
chart: c
outcomes: [x]
parameters:
  wide: {type: length, default: 1 m}
  pace: {type: speed, default: 1 m/s}
  eye: {type: signal of length, default: s.far}
  word: {type: text, default: left}
  words: {type: list of text, default: [red]}
data:
  level: {type: length, initial: 1 m}
  count: {type: integer, initial: 1}
  quick: {type: speed, initial: 1 m/s}
  spot: {type: Spot, initial: {place: dock}}
  name: {type: text, initial: left}
"""


def findings(*texts: str) -> list[Finding]:
    library = Library()
    for number, text in enumerate(texts):
        library.add(read(text.encode(), f"{number}.yaml"))
    parts = ("left", "right", "base")
    known = {**INTERFACES, "Hold": interface(Hold)}
    found = check(library, known, types=TYPES, signals=SIGNALS, parts=parts, around=AROUND)
    return [finding for finding in found if finding.code not in ("F04", "S10", "S02")]


def told(*texts: str) -> list[str]:
    return [f"{f.code} {f.message}" for f in findings(*texts)]


def codes(*texts: str) -> list[str]:
    return [finding.code for finding in findings(*texts)]


OVER = "{watch: Over, GIVEN, next: {seen: .x, lost: .x}}"
PICK = "{do: Pick, GIVEN, in: {value: name}, next: {red: .x, blue: .x, other: .x}}"


def over(given: str) -> list[str]:
    return told(f"{HEAD}states: {{n: {OVER.replace('GIVEN', given)}}}\n")


@pytest.mark.parametrize(
    ("given", "found"),
    [
        ("with: {signal: s.far, limit: 2 m}", []),
        ("with: {signal: s.far, limit: 2}", []),
        ("with: {signal: s.pace, limit: 2 m/s, older: 1 s, for: 200 ms}", []),
        ("with: {signal: s.count, limit: 2}", []),
        ("with: {signal: $eye, limit: 20 cm}", []),
        ("with: {signal: $k.eye, limit: 20 cm}", []),
        ("with: {signal: s.far, limit: $wide}", []),
        ("with: {signal: s.far}, in: {limit: level}", []),
        ("with: {signal: s.count}, in: {limit: count}", []),
        (
            "with: {signal: s.fra, limit: 2 m}",
            ["N12 signal: there is no signal 's.fra'"],
        ),
        (
            "with: {signal: s.far, limit: 2 m/s}",
            ["N09 limit: '2 m/s' is a speed; wanted: a length, in mm, cm, m, km"],
        ),
        (
            "with: {signal: $k.eye, limit: 2 m/s}",
            ["N09 limit: '2 m/s' is a speed; wanted: a length, in mm, cm, m, km"],
        ),
        (
            "with: {signal: $eye, limit: 2 m/s}",
            ["N09 limit: '2 m/s' is a speed; wanted: a length, in mm, cm, m, km"],
        ),
        ("with: {signal: s.count, limit: 2.5}", ["N09 limit: 2.5 is not a whole number"]),
        (
            "with: {signal: s.pace, limit: $wide}",
            ["N09 limit: $wide is a length; wanted: a speed"],
        ),
        (
            "with: {signal: s.pace}, in: {limit: level}",
            ["F02 'level' holds a length; parameter 'limit' of Over is a speed"],
        ),
        (
            "with: {signal: $eye}, in: {limit: quick}",
            ["F02 'quick' holds a speed; parameter 'limit' of Over is a length"],
        ),
        (
            "with: {signal: $word, limit: 1}",
            ["N09 signal: $word is a text; wanted: a signal of number"],
        ),
        ("with: {limit: 1}", ["N08 Over needs parameter 'signal'"]),
        (
            "with: {limit: 1}, in: {signal: name}",
            ["N10 'signal' says what Over reads, commands or ends with"],
        ),
        (
            "with: {signal: s.far, limit: 1}, in: {limit: level}",
            ["N10 'limit' is given by `with` already"],
        ),
    ],
)
def test_rule_10_a_signal_that_a_node_names_is_known_and_its_values_are_of_one_type(given, found):
    assert over(given) == found


def test_rule_10_a_value_of_the_signal_goes_to_data_of_its_type():
    node = OVER.replace("GIVEN", "with: {signal: SIGNAL, limit: 1}, out: {value: level}")
    text = f"{HEAD}states: {{n: {node}}}\n"
    assert codes(text.replace("SIGNAL", "s.far")) == []
    assert codes(text.replace("SIGNAL", "$eye")) == []
    assert codes(text.replace("SIGNAL", "$k.eye")) == []
    assert codes(text.replace("SIGNAL", "s.pace")) == ["F02"]


@pytest.mark.parametrize(
    ("given", "found"),
    [
        ("with: {cases: [red, blue]}", []),
        ("with: {cases: $k.cases}", []),
        ("with: {cases: [red, green, blue]}", ["N06"]),
        ("with: {cases: [red]}", ["N05"]),
        ("with: {cases: [red, blue, red]}", ["N05"]),
        ("with: {cases: [red, blue, other]}", ["N05"]),
        ("with: {cases: [red, blue, error]}", ["N05"]),
        ("with: {cases: [red, 5]}", ["N09"]),
        ("with: {cases: $words}", ["N05"]),
        ("autonomy: {other: low}", ["N08"]),
    ],
)
def test_rule_10_outcomes_that_a_node_names_are_checked_like_any(given: str, found: list[str]):
    assert codes(f"{HEAD}states: {{n: {PICK.replace('GIVEN', given)}}}\n") == found


def test_rule_10_outcomes_are_named_by_with_and_once():
    node = PICK.replace("GIVEN, in: {value: name}", "in: {value: name, cases: words}")
    data = HEAD.replace("data:\n", "data:\n  words: {type: list of text, initial: [red]}\n")
    assert codes(f"{data}states: {{n: {node}}}\n") == ["N10"]
    both = PICK.replace("GIVEN, in: {", "with: {cases: [red, blue]}, in: {cases: words, ")
    assert codes(f"{data}states: {{n: {both}}}\n") == ["N10"]


# -- parts -----------------------------------------------------------------------------------------

PUSH = "{do: Push, with: {part: PART}, next: {done: .x, failed: .x, other: .x}}"


def beside(first: str, second: str, *more: str) -> list[str]:
    """The codes of two nodes side by side; of each, what its `part` is."""
    nodes = (PUSH.replace("PART", part) for part in (first, second))
    a, b = nodes
    return codes(f"{HEAD}any:\n  a: {a}\n  b: {b}\n", *more)


@pytest.mark.parametrize(
    ("first", "second", "found"),
    [
        ("left", "right", []),
        ("left", "left", ["S08"]),
        ("$word", "$word", ["S08"]),
        ("$word", "right", []),
        ("$k.part", "left", ["S08"]),
        ("$k.part", "right", []),
        ("$k.part", "$k.part", ["S08"]),
        ("lft", "right", ["N12"]),
    ],
)
def test_rule_10_parts_that_nodes_name_side_by_side_are_different(first, second, found):
    assert beside(first, second) == found


USED = """\
chart: used
outcomes: [x]
parameters: {part: {type: text, default: left}, other: {type: text, default: right}}
any:
  a: {do: Push, with: {part: $part}, next: {done: .x, failed: .x, other: .x}}
  b: {do: Push, with: {part: $other}, next: {done: .x, failed: .x, other: .x}}
"""
ONE = """\
chart: one
outcomes: [x]
parameters: {part: {type: text, default: left}}
states: {a: {do: Push, with: {part: $part}, next: {done: .x, failed: .x, other: .x}}}
"""
BETWEEN = """\
chart: between
outcomes: [x]
parameters: {hand: {type: text, default: right}, foot: {type: text, default: left}}
states: {a: {use: used, with: {part: $hand, other: $foot}, next: {x: .x}}}
"""


@pytest.mark.parametrize(
    ("given", "found"),
    [
        ("{part: left, other: right}", []),
        ("{part: left, other: left}", ["S08"]),
        ("{part: right}", ["S08"]),
        ("{other: left}", ["S08"]),
        ("{part: base}", []),
        ("{}", []),
        ("{part: $word, other: $word}", ["S08"]),
        ("{part: $word, other: right}", []),
        ("{part: $k.part, other: right}", []),
        ("{part: $k.part, other: left}", ["S08"]),
        ("{part: lft}", ["N12"]),
    ],
)
def test_rule_10_parts_that_a_chart_is_given_are_different_where_they_are_beside(given, found):
    text = f"{HEAD}states: {{n: {{use: used, with: {given}, next: {{x: .x}}}}}}\n"
    assert codes(text, USED) == found


@pytest.mark.parametrize(
    ("given", "found"),
    [
        ("{}", []),
        ("{hand: left}", ["S08"]),
        ("{hand: left, foot: right}", []),
        ("{foot: right}", ["S08"]),
        ("{hand: $k.part}", ["S08"]),
        ("{hand: $k.part, foot: base}", []),
    ],
)
def test_rule_10_and_where_they_are_passed_on_twice(given: str, found: list[str]):
    text = f"{HEAD}states: {{n: {{use: between, with: {given}, next: {{x: .x}}}}}}\n"
    assert codes(text, USED, BETWEEN) == found


@pytest.mark.parametrize(
    ("first", "second", "found"),
    [
        ("{}", "{}", ["S08"]),
        ("{part: right}", "{}", []),
        ("{part: left}", "{}", ["S08"]),
        ("{part: left}", "{part: right}", []),
        ("{part: $word}", "{part: $word}", ["S08"]),
        ("{part: $k.part}", "{part: left}", ["S08"]),
    ],
)
def test_rule_10_charts_side_by_side_command_different_parts(first, second, found):
    text = (
        f"{HEAD}any:\n  a: {{use: one, with: {first}, next: {{x: .x}}}}\n"
        f"  b: {{use: one, with: {second}, next: {{x: .x}}}}\n"
    )
    assert codes(text, ONE) == found


class Hold(Action):
    """Commands several parts."""

    outcomes = ("done",)
    commands = ("$parts",)

    def __init__(self, parts: tuple[str, ...] = ("left",)) -> None:
        self.parts = parts

    def run(self, ctx: Context) -> Run:
        yield
        return "done"


HOLDING = """\
chart: holding
outcomes: [x]
parameters: {hands: {type: list of text, default: [left]}}
states: {a: {do: Hold, with: {parts: $hands}, next: {done: .x}}}
"""


@pytest.mark.parametrize(
    ("node", "found"),
    [
        ("{do: Hold, next: {done: .x}}", ["S08"]),
        ("{do: Hold, with: {parts: [right, left]}, next: {done: .x}}", ["S08"]),
        ("{do: Hold, with: {parts: [right, base]}, next: {done: .x}}", []),
        ("{do: Hold, with: {parts: [right, bace]}, next: {done: .x}}", ["N12"]),
        ("{use: holding, next: {x: .x}}", ["S08"]),
        ("{use: holding, with: {hands: [right, left]}, next: {x: .x}}", ["S08"]),
        ("{use: holding, with: {hands: [right, base]}, next: {x: .x}}", []),
        ("{use: holding, with: {hands: [right, bace]}, next: {x: .x}}", ["N12"]),
        ("{use: holding, with: {hands: []}, next: {x: .x}}", []),
    ],
)
def test_rule_10_several_parts_that_one_parameter_names_count_each(node, found):
    push = PUSH.replace("PART", "left")
    text = f"{HEAD}any:\n  a: {push}\n  b: {node}\n"
    assert codes(text, HOLDING) == found


def test_rule_10_a_part_by_an_unknown_parameter_is_one_mistake():
    wrong = ONE.replace("part: $part", "part: $prat")
    text = f"{HEAD}states: {{n: {{use: one, with: {{part: left}}, next: {{x: .x}}}}}}\n"
    assert codes(text, wrong) == ["N09"]


# -- data ------------------------------------------------------------------------------------------

GO = "{do: Go, in: {goal: GOAL}, next: {done: .x, failed: .x, other: .x}}"
READER = """\
chart: reader
outcomes: [x]
inputs: {at: DECLARED}
states: {n: {do: Go, in: {goal: at}, next: {done: .x, failed: .x, other: .x}}}
"""


@pytest.mark.parametrize(
    ("goal", "found"),
    [
        ("spot", []),
        ("{x: 1 m}", []),
        ("{place: dock}", []),
        ("{place: dok}", ["N13"]),
        ("$wide", ["N09"]),
        ("{x: $wide}", []),
        ("{x: $pace}", ["N09"]),
        ("5", ["N09"]),
        ("level", ["F02"]),
        ("nothing", ["N11"]),
    ],
)
def test_rule_10_what_a_node_is_given_is_of_its_type_whether_read_or_written(goal, found):
    assert codes(f"{HEAD}states: {{n: {GO.replace('GOAL', goal)}}}\n") == found


@pytest.mark.parametrize(
    ("declared", "given", "found"),
    [
        ("Spot", "spot", []),
        ("Spot", "{x: 1}", []),
        ("Spot", "{x: 1 s}", ["N09"]),
        ("Spot", "level", ["F02"]),
        ("Spot", "", ["N10"]),
        ("{type: Spot, default: {x: 1}}", "", []),
        ("{type: Spot, default: $k.home}", "", []),
        ("{type: Spot, default: $k.hom}", "", ["N09"]),
        ("{type: Spot, default: {x: 1 s}}", "", ["N09"]),
        ("{type: Spot, default: none}", "", ["F01"]),
    ],
)
def test_rule_10_an_input_of_a_chart_is_given_or_has_a_default(declared, given, found):
    read_from = f"in: {{at: {given}}}, " if given else ""
    text = f"{HEAD}states: {{n: {{use: reader, {read_from}next: {{x: .x}}}}}}\n"
    assert codes(text, READER.replace("DECLARED", declared)) == found


@pytest.mark.parametrize(
    ("start", "found"),
    [("", ["F01"]), (", initial: none", ["F01"]), (", initial: {x: 1}", [])],
)
def test_rule_10_a_key_with_a_written_value_is_never_empty(start: str, found: list[str]):
    text = HEAD.replace(", initial: {place: dock}", start)
    assert codes(f"{text}states: {{n: {GO.replace('GOAL', 'spot')}}}\n") == found


@pytest.mark.parametrize(
    ("times", "found"),
    [("$n", []), ("$none", []), ("$wide", ["N09"]), ("$k.tries", []), ("$k.word", ["N09"])],
)
def test_rule_10_how_often_to_try_again_is_a_whole_number_from_1(times: str, found: list[str]):
    text = HEAD.replace(
        "data:\n",
        "  n: {type: integer, default: 2}\n  none: {type: integer, default: 0}\ndata:\n",
    )
    node = GO.replace("GOAL", "spot").replace(
        "next", f"retry: {{times: {times}, on: failed}}, next"
    )
    assert codes(f"{text}states: {{n: {node}}}\n") == found


@pytest.mark.parametrize("start", ["$wide", "{x: $wide}", "{x: 1, y: $wide}"])
def test_rule_10_no_part_of_a_default_is_a_parameter(start: str):
    node = f"states: {{n: {GO.replace('GOAL', 'spot')}}}\n"
    more = f"  home: {{type: Spot, default: {start}}}\ndata:\n"
    for text in (
        HEAD.replace("data:\n", more),
        HEAD.replace("initial: {place: dock}", f"initial: {start}"),
    ):
        (found,) = findings(text + node)
        assert "$wide has none before the chart starts" in found.message
        line = text.splitlines()[found.place.line - 1]
        assert line[found.place.column - 1 :].startswith("$wide")
