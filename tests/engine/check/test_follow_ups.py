"""A mistake in one chart has no echo in the charts around it."""

from __future__ import annotations

import pytest

from engine.chart.load import Library
from engine.check.all_checks import check
from engine.files.source import read
from tests.engine.check.some_charts import INTERFACES

INNER = """\
chart: inner
parameters: {time: {type: duration, default: 1 s}}
inputs: {at: {type: length}}
outputs: {done: {seen: length}}
data: {seen: {type: length, initial: 1 m}}
outcomes: [done, gone]
states:
  a: {do: Work, next: {done: .done, failed: .gone, error: .gone}}
"""
OUTER = """\
chart: outer
data: {place: {type: length, initial: 1 m}, found: {type: length, initial: none}}
outcomes: [done, gone]
states:
  a:
    use: inner
    with: {time: 2 s}
    in: {at: place}
    out: {seen: found}
    next: {done: .done, gone: .gone, error: .gone}
"""


def findings(inner: str, outer: str = OUTER) -> dict[str, list[str]]:
    """The codes of the findings by chart."""
    library = Library()
    for name, text in (("inner", inner), ("outer", outer)):
        library.add(read(text.encode(), name))
    found: dict[str, list[str]] = {"inner": [], "outer": []}
    for finding in check(library, INTERFACES):
        found[finding.place.file].append(finding.code)
    return found


def test_both_are_right_but_for_what_is_never_used() -> None:
    assert findings(INNER) == {"inner": ["F04", "F04"], "outer": ["F04"]}


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("outcomes: [done, gone]", "outcome: [done, gone]"),
        ("chart: inner", "chrt: inner"),
        ("states:", "statez:"),
        ("  a: {do: Work", "  a: [do: Work"),
        ("parameters: {time", "parametrs: {time"),
        ("inputs: {at", "imputs: {at"),
        ("outputs: {done", "outptus: {done"),
        ("type: length}}\noutputs", "typ: length}}\noutputs"),
        ("failed: .gone", "faild: .gone"),
        ("do: Work", "do: Wrk"),
    ],
)
def test_a_mistake_is_told_once(old: str, new: str) -> None:
    assert old in INNER
    found = findings(INNER.replace(old, new, 1))
    assert found["inner"]
    assert found["outer"] == []


@pytest.mark.parametrize(
    ("old", "new", "code"),
    [
        ("next: {done: .done", "next: {dne: .done", "N05"),
        ("time: 2 s", "tim: 2 s", "N08"),
        ("at: place", "att: place", "N10"),
        ("seen: found", "sen: found", "N10"),
    ],
)
def test_what_is_wrong_in_the_user_itself_is_told_all_the_same(
    old: str, new: str, code: str
) -> None:
    broken = INNER.replace("failed: .gone", "faild: .gone")
    assert code in findings(broken, OUTER.replace(old, new))["outer"]
