"""Where findings stand, what they suggest, and that one mistake is one finding."""

from __future__ import annotations

import pytest

from engine.chart.load import Library
from engine.check.all_checks import check
from engine.files.finding import Finding
from engine.files.source import read
from tests.engine.check.some_charts import INTERFACES

HEAD = "chart: c\noutcomes: [done]\n"
DATA = "data: {a: {type: number, initial: 1}, t: {type: text, initial: x}}\n"
WORK = "{do: Work, next: {done: .done, failed: .done}}"


def one_line(finding: Finding) -> str:
    """`file:line:column: error[CODE] message; hint`."""
    hint = f"; {finding.hint}" if finding.hint else ""
    return f"{finding.place}: {finding.severity}[{finding.code}] {finding.message}{hint}"


def findings(*texts: str) -> list[Finding]:
    library = Library()
    for number, text in enumerate(texts):
        library.add(read(text.encode(), f"{number}.yaml"))
    return [finding for finding in check(library, INTERFACES) if finding.code != "F04"]


def codes(*texts: str) -> list[str]:
    return [finding.code for finding in findings(*texts)]


@pytest.mark.parametrize(
    ("node", "found"),
    [
        (
            "{do: Wrok, next: {done: .done, failed: .done}}",
            ["0.yaml:4:11: error[N01] no state class 'Wrok'; did you mean 'Work'?"],
        ),
        (
            "{do: Work, next: {done: .doen, failed: .done}}",
            [
                "0.yaml:4:30: error[N07] 'doen' leads out of the chart and is not among its "
                "outcomes; did you mean '.done'?"
            ],
        ),
        (
            "{do: Work, next: {done: done, failed: .done}}",
            ["0.yaml:4:30: error[N03] no node 'done' here; did you mean '.done'?"],
        ),
        (
            "{do: Work, next: {done: .done, faild: .done}}",
            [
                "0.yaml:4:17: error[N06] 'n' can end with 'failed', which leads nowhere; "
                "`next: {failed: …}`",
                "0.yaml:4:37: error[N05] Work has no outcome 'faild'; did you mean 'failed'?",
            ],
        ),
        (
            "{do: Wait, with: {tiem: 1 s}, next: {done: .done}}",
            [
                "0.yaml:4:11: error[N08] Wait needs parameter 'time'; `with: {time: …}`",
                "0.yaml:4:24: error[N08] Wait has no parameter 'tiem'; did you mean 'time'?",
            ],
        ),
        (
            "{do: Work, timeout: 5 s, next: {done: .done, failed: .done}}",
            [
                "0.yaml:4:31: error[N06] 'n' can end with 'timeout', which leads nowhere; "
                "`next: {timeout: …}`"
            ],
        ),
        (
            "{do: Work, next: {done: .done, failed: .done, timeout: .done}}",
            ["0.yaml:4:52: error[N05] 'n' has no timeout; give it `timeout: 5 s`"],
        ),
        (
            "{do: Take, in: {value: b}, next: {done: .done, failed: .done}}",
            ["0.yaml:4:29: error[N11] no data key 'b'; allowed: a, t"],
        ),
    ],
)
def test_places_and_hints(node: str, found: list[str]) -> None:
    texts = HEAD.replace("\nout", f"\n{DATA}out") if "in:" in node else HEAD
    lines = [one_line(finding) for finding in findings(f"{texts}states:\n  n: {node}\n")]
    if "in:" in node:
        lines = [line.replace("0.yaml:5", "0.yaml:4") for line in lines]
    assert lines == found


@pytest.mark.parametrize(
    "text",
    [
        f"{HEAD}states:\n  n: {{do: Wrok, with: {{x: 1}}, in: {{y: z}}, timeout: 1 s, retry: "
        "{times: 1, on: x}, autonomy: {x: low}, next: {x: .done}}\n",
        f"{HEAD}all: {{a: {{do: Wrok}}, b: {{do: Work}}}}\n"
        "when: [{outcome: done, if: {a: x}}]\n",
        f"{HEAD}states:\n  n: {{use: nothing, with: {{x: 1}}, next: {{x: .done}}}}\n",
        f"chart: c\noutcomes: done\nstates: {{n: {WORK}}}\n",
        f"{HEAD}states: {{n: {{do: Wait, with: time, next: {{done: .done}}}}}}\n",
        f"{HEAD}states: {{n: {{do: Take, in: [a], next: {{done: .done, failed: .done}}}}}}\n",
        f"{HEAD}states: {{n: {{do: Work, next: [done]}}}}\n",
        f"{HEAD}states: {{n: {{do: Work, next: {{done: m, failed: .done}}}}, m: 5}}\n",
        f"{HEAD}all: {{a: {{do: Work}}, b: 5}}\nwhen: [{{outcome: done, if: {{b: done}}}}, "
        "{outcome: done, if: {a: done}}, {outcome: done, if: {a: failed}}]\n",
        f"{HEAD}states: {{n: {{in: {{x: y}}, states: {{m: {{do: Take, in: {{value: x}}, "
        "next: {done: .done, failed: .done}}}}}\n",
    ],
)
def test_one_mistake_is_one_finding(text: str) -> None:
    assert len(codes(text)) == 1


def test_a_chart_that_could_not_be_read_is_not_called_unknown() -> None:
    user = f"{HEAD}states: {{n: {{use: '1', next: {{done: .done}}}}}}\n"
    assert codes(user, "chart: [") == ["Y01"]
    assert codes(user, f"{HEAD}states: {{n: {WORK}}}\n".replace("chart: c", "chart: d")) == ["N02"]


@pytest.mark.parametrize(
    ("given", "found"),
    [
        ("{time: 2}", []),
        ("{time: 2 min}", []),
        ("{time: 2 m}", ["N09"]),
        ("{time: soon}", ["N09"]),
        ("{time: yes}", ["N09"]),
        ("{time: true}", ["N09"]),
        ("{time: null}", ["N09"]),
        ("{time: [1]}", ["N09"]),
        ("{time: {a: 1}}", ["N09"]),
        ("{level: 1.5}", ["N09"]),
        ("{level: 2.0}", []),
        ("{names: [a, b]}", []),
        ("{names: a}", ["N09"]),
        ("{names: [a, 1]}", ["N09"]),
        ("{names: [a, $word]}", []),
        ("{names: [a, $long]}", ["N09"]),
        ("{names: $word}", ["N09"]),
        ("{time: $long}", []),
        ("{level: $long}", ["N09"]),
        ("{level: $count}", []),
        ("{time: $count}", []),
        ("{time: $ratio}", []),
        ("{level: $ratio}", ["N09"]),
        ("{time: $what}", ["N09"]),
        ("{other: $what}", []),
        ("{other: [1, $long, {a: b}]}", ["N09"]),
        ("{time: $maybe}", ["N09"]),
        ("{time: $none}", ["N09"]),
    ],
)
def test_values_and_parameters_are_converted_as_a_machine_will(
    given: str, found: list[str]
) -> None:
    parameters = (
        "parameters: {long: {type: duration, default: 5 s}, count: {type: integer, default: 1}, "
        "ratio: {type: number, default: 0.5}, word: {type: text, default: x}, what: {default: 1}, "
        "maybe: {type: duration, default: null}}\n"
    )
    node = WORK.replace("next", f"with: {given}, next")
    assert codes(f"{HEAD}{parameters}states: {{n: {node}}}\n") == found


@pytest.mark.parametrize(
    ("declared", "found"),
    [
        ("parameters: {p: {type: duration, default: 5 m}}", ["N09"]),
        ("parameters: {p: {type: duration, default: [1]}}", ["N09"]),
        ("parameters: {p: durations}", ["N11"]),
        ("data: {k: {type: number, initial: x}}", ["N09"]),
        ("data: {k: {type: number, initial: none}}", []),
        ("data: {k: nombre}", ["N11"]),
        ("inputs: {k: number}\ndata: {k: number}", ["N11"]),
        ("outputs: {done: {k: nombre}}", ["N11"]),
        ("outputs: {dun: {k: number}}", ["N05"]),
        ("outputs: {done: {k: number}}\ndata: {k: {type: text, initial: x}}", ["F02"]),
        ("outputs: {done: {k: number}}\ninputs: {k: number}", []),
    ],
)
def test_declarations(declared: str, found: list[str]) -> None:
    assert codes(f"{HEAD}{declared}\nstates: {{n: {WORK}}}\n") == found


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("timeout: 0", ["S11"]),
        ("timeout: -1 s", ["S11"]),
        ("timeout: 1e300", ["S11"]),
        ("timeout: null", ["N09"]),
        ("timeout: $zero", ["S11"]),
        ("retry: {times: 1, on: done, wait: 0}", []),
        ("retry: {times: 1, on: done, wait: -1 s}", ["S11"]),
        ("retry: {times: 1, on: done, wait: $zero}", []),
        ("retry: {times: 1, on: timeout}", ["N05"]),
        ("retry: {times: 1, on: [error, failed]}", []),
        ("retry: {times: 1, on: lost}", ["N05"]),
        ("autonomy: {done: low, error: low}", ["N05"]),
        ("autonomy: {lost: low}", ["N05"]),
    ],
)
def test_times_tries_and_consent(text: str, found: list[str]) -> None:
    parameters = "parameters: {zero: {type: duration, default: 0 s}}\n"
    ends = "done: .done, failed: .done" + (", timeout: .done" if "timeout: " in text[:9] else "")
    node = f"{{do: Work, {text}, next: {{{ends}}}}}"
    assert codes(f"{HEAD}{parameters}states: {{n: {node}}}\n") == found


def test_a_time_that_cannot_be_is_found_where_it_is_given_to_a_used_chart() -> None:
    inner = (
        "chart: inner\noutcomes: [done]\nparameters: {limit: duration}\nstates:\n"
        "  n: {do: Work, timeout: $limit, next: {done: .done, failed: .done, timeout: .done}}\n"
    )
    between = (
        "chart: between\noutcomes: [done]\nparameters: {most: {type: duration, default: 1 s}}\n"
        "states: {n: {use: inner, with: {limit: $most}, next: {done: .done}}}\n"
    )
    outer = f"{HEAD}states: {{n: {{use: between, with: {{most: 0 s}}, next: {{done: .done}}}}}}\n"
    assert codes(inner, between) == []
    assert [finding.place.file for finding in findings(inner, between, outer)] == ["2.yaml"]
    assert codes(inner, between, outer) == ["S11"]


def test_a_number_of_tries_is_in_range_where_a_used_chart_takes_it() -> None:
    inner = (
        "chart: inner\noutcomes: [done]\nparameters: {n: {type: integer, default: 2}}\n"
        "states:\n"
        "  w: {do: Work, retry: {times: $n, on: failed}, next: {done: .done, failed: .done}}\n"
    )
    outer = f"{HEAD}states: {{n: {{use: inner, with: {{n: TIMES}}, next: {{done: .done}}}}}}\n"
    assert codes(inner, outer.replace("TIMES", "3")) == []
    assert codes(inner, outer.replace("TIMES", "-2")) == ["S11"]


def test_types_along_keys() -> None:
    take = "{do: Take, in: {value: KEY}, next: {done: .done, failed: .done}}"
    peek = "{do: Peek, in: {value: KEY}, next: {done: .done}}"
    text = f"{HEAD}{DATA}states:\n  n: "
    assert codes(text + take.replace("KEY", "a")) == []
    assert codes(text + take.replace("KEY", "t")) == ["F02"]
    maybe = text.replace("initial: 1", "initial: none")
    assert codes(maybe + peek.replace("KEY", "a")) == []
    assert codes(maybe + take.replace("KEY", "a")) == ["F01"]


def test_what_may_be_nothing_is_not_given_to_those_who_want_something() -> None:
    text = (
        f"{HEAD}data: {{a: {{type: TYPE, initial: none}}}}\nstates:\n"
        "  try: {do: Try, out: {value: a}, next: {done: n}}\n  n: NODE\n"
    )
    take = "{do: Take, in: {value: a}, next: {done: .done, failed: .done}}"
    peek = "{do: Peek, in: {value: a}, next: {done: .done}}"
    assert codes(text.replace("TYPE", "number").replace("NODE", take)) == ["F02"]
    assert codes(text.replace("TYPE", "number").replace("NODE", peek)) == []
    assert codes(text.replace("TYPE", "number | none").replace("NODE", peek)) == []
    bare = text.replace(", initial: none", "")
    assert codes(bare.replace("TYPE", "number").replace("NODE", peek)) == ["F02"]
    assert codes(bare.replace("TYPE", "number | none").replace("NODE", peek)) == []
    assert codes(bare.replace("TYPE", "number | none").replace("NODE", take)) == ["F02"]


TWO_DRIVES = (
    f"{HEAD}states:\n"
    "  go: {do: Drive, next: {done: back}}\n"
    "  back: {do: Drive, next: {done: .done}}\n"
)


def test_every_node_whose_error_nothing_handles_is_named() -> None:
    (finding,) = findings(TWO_DRIVES)
    assert (finding.code, finding.place.line) == ("S10", 4)
    assert "'go' or 'back'" in finding.message
    assert [place.line for place, _ in finding.related] == [5]


def test_every_node_that_commands_a_part_that_is_not_there_is_named_in_each_chart() -> None:
    found = Library()
    for number, name in enumerate("cd"):
        text = TWO_DRIVES.replace("chart: c", f"chart: {name}")
        found.add(read(text.encode(), f"{number}.yaml"))
    missing = [f for f in check(found, INTERFACES, parts=["arm"]) if f.code == "N12"]
    assert [f.place for f in missing] == [("0.yaml", 4, 12, 17), ("1.yaml", 4, 12, 17)]
    assert [place.line for f in missing for place, _ in f.related] == [5, 5]
