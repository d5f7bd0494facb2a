"""Data of boxes whose children run at the same time (F01, F03), rule by rule."""

from __future__ import annotations

import pytest

from engine.chart.load import Library
from engine.check.all_checks import check
from engine.files.source import read
from tests.engine.check.some_charts import INTERFACES

INNER = """\
chart: inner
outcomes: [done, failed]
outputs: {done: {value: number}}
states:
  give: {do: Give, out: {value: value}, next: {done: .done, failed: .failed}}
"""


def codes(
    box: str, data: str = "data: {a: number, b: number}", ends: str = "done, failed"
) -> list[str]:
    library = Library()
    text = f"chart: c\noutcomes: [{ends}]\n{data}\n{box}"
    for number, chart in enumerate((text, INNER)):
        library.add(read(chart.encode(), f"{number}.yaml"))
    return [f.code for f in check(library, INTERFACES) if f.code != "F04"]


def then_take(box: str, outcomes: str) -> str:
    """A box, after which `a` is read if it ends with `p`."""
    return (
        f"states:\n  box: {{{box}, next: {{{outcomes}}}}}\n"
        "  take: {do: Take, in: {value: a}, next: {done: .done, failed: .failed}}\n"
    )


GIVE_P = "{do: Give, out: {value: a}, next: {done: .p, failed: .q}}"
NEAR_P = "{watch: Near, out: {value: a}, next: {near: .p, far: .q}}"


@pytest.mark.parametrize(
    ("box", "found"),
    [
        (f"any: {{x: {GIVE_P}}}", []),
        (f"any: {{x: {GIVE_P}, y: {NEAR_P}}}", []),
        (f"any: {{x: {GIVE_P}, y: {{watch: Near, next: {{near: .p, far: .q}}}}}}", ["F01"]),
        (f"any: {{x: {GIVE_P}, y: {{watch: Near, next: {{near: .q, far: .q}}}}}}", []),
        (f"any: {{x: {GIVE_P.replace('failed: .q', 'failed: .p')}, y: {NEAR_P}}}", ["F01"]),
    ],
)
def test_of_any_only_the_winner_has_written(box: str, found: list[str]) -> None:
    assert codes(then_take(box, "p: take, q: .failed")) == found


GIVE = "{do: Give, out: {value: a}}"


@pytest.mark.parametrize(
    ("rules", "found"),
    [
        ("{outcome: p, if: {x: done}}, {outcome: q, if: {x: failed}}", []),
        ("{outcome: p, if: {x: failed}}, {outcome: q, if: {x: done}}", ["F01"]),
        ("{outcome: p, if: {y: done}}, {outcome: q, if: {y: failed}}", ["F01"]),
        ("{outcome: p, if: {y: done, x: done}}, {outcome: q, if: {x: failed}}, "
         "{outcome: q, if: {y: failed}}", []),
        ("{outcome: p, if: {x: done}}, {outcome: p, if: {x: failed}}", ["F01"]),
    ],
)  # fmt: skip
def test_of_kept_outcomes_those_that_the_item_names_have_written(
    rules: str, found: list[str]
) -> None:
    box = f"all: {{x: {GIVE}, y: {{do: Work}}}}, when: [{rules}]"
    outcomes = "p: take, q: .failed" if "q" in rules else "p: take"
    assert codes(then_take(box, outcomes)) == found


def test_after_all_every_child_has_written_what_it_always_writes() -> None:
    take = "  take: {do: Take, in: {value: a}, next: {done: .done, failed: .failed}}\n"
    sometimes = f"{{all: {{x: {{do: Work}}, y: {GIVE}}}, next: {{done: take}}}}"
    always = f"{{any: {{z: {GIVE_P}}}, next: {{q: .failed}}}}"
    surely = f"{{all: {{x: {{do: Work}}, y: {always}}}, next: {{done: take, failed: .failed}}}}"
    assert codes(f"states:\n  box: {sometimes}\n{take}") == ["F01"]
    assert codes(f"states:\n  box: {surely}\n{take}") == []


def test_a_sibling_that_runs_beside_has_written_nothing() -> None:
    take = "{do: Take, in: {value: a}, next: {done: .done, failed: .failed}}"
    give = "{do: Give, out: {value: a}, next: {done: y, failed: .failed}}"
    before = f"{{states: {{x: {give}, y: {{do: Rest}}}}}}"
    assert codes(f"any:\n  give: {before}\n  take: {take}\n") == ["F01"]


def test_timeouts_and_errors_write_nothing() -> None:
    give = "{do: Give, timeout: 1 s, out: {value: a}, next: {done: take, failed: .failed, WAY}}"
    take = "  take: {do: Take, in: {value: a}, next: {done: .done, failed: .failed}}\n"
    text = f"states:\n  give: {give}\n{take}"
    assert codes(text.replace("WAY", "timeout: .failed, error: .failed")) == []
    assert codes(text.replace("WAY", "timeout: take, error: .failed")) == ["F01"]
    assert codes(text.replace("WAY", "timeout: .failed, error: take")) == ["F01"]


def test_a_used_chart_writes_the_outputs_of_its_outcome() -> None:
    use = "{use: inner, out: {value: a}, next: {done: take, failed: WAY}}"
    take = "  take: {do: Take, in: {value: a}, next: {done: .done, failed: .failed}}\n"
    assert codes(f"states:\n  use: {use}\n{take}".replace("WAY", ".failed")) == []
    assert codes(f"states:\n  use: {use}\n{take}".replace("WAY", "take")) == ["F01"]


@pytest.mark.parametrize(("way", "found"), [("failed", []), ("done", ["F01"])])
def test_an_output_of_the_chart_is_written_on_every_way_to_its_outcome(
    way: str, found: list[str]
) -> None:
    outputs = "outputs: {done: {a: number}}"
    box = f"any:\n  x: {GIVE_P.replace('.p', '.done').replace('.q', f'.{way}')}\n"
    assert codes(box, outputs, ends="done" if way == "done" else "done, failed") == found


LOOP = "{states: {n: {do: Give, out: {value: a}, next: {done: n, failed: .failed}}}}"
ONCE = "{states: {n: {do: Give, out: {value: a}, next: {done: .done, failed: .done}}}}"
ENDING = "{do: Give, out: {value: a}, next: {done: .done, failed: .failed}}"
RENAMED = "{in: {c: a}, any: {n: {do: Give, out: {value: c}, next: {done: .p, failed: .p}}}}"


@pytest.mark.parametrize(
    ("form", "one", "other", "found"),
    [
        ("any", ENDING, ENDING, []),
        ("any", LOOP, LOOP.replace(".failed", ".done"), ["F03"]),
        ("any", LOOP, ONCE, []),
        ("all", GIVE, GIVE, ["F03"]),
        ("all", GIVE, GIVE.replace("a}", "b}"), []),
        ("all", GIVE, RENAMED, ["F03"]),
    ],
)
def test_two_that_run_at_the_same_time_do_not_write_one_key(
    form: str, one: str, other: str, found: list[str]
) -> None:
    ends = "done, failed" if form == "any" else "done"
    assert codes(f"{form}:\n  x: {one}\n  y: {other}\n", ends=ends) == found
