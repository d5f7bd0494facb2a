"""Values that are wrong only once parameters have theirs are told with their place."""

import pytest

from engine.chart.load import Library
from engine.files.declared.values import Mismatch
from engine.files.source import read
from engine.machine.machine import Machine
from tests.engine.check.some_charts import INTERFACES

INNER = """\
chart: inner
parameters: {time: {type: duration}, wait: {type: duration, default: 1 s}}
outcomes: [done]
states:
  a:
    do: Work
    timeout: $time
    retry: {times: 2, on: [failed], wait: $wait}
    next: {done: .done, failed: .done, timeout: .done, error: .done}
"""
OUTER = """\
chart: outer
parameters: {time: {type: duration, default: 1 s}, wait: {type: duration, default: 1 s}}
outcomes: [done]
states:
  b: {use: inner, with: {time: $time, wait: $wait}, next: {done: .done}}
"""


@pytest.mark.parametrize(
    ("name", "place"), [("time", "inner.yaml:7:14: b/a: timeout"), ("wait", "inner.yaml:8:12: b/a")]
)
def test_a_limit_without_a_value_is_told_where_it_is_written(name: str, place: str) -> None:
    library = Library()
    for file, text in (("inner.yaml", INNER), ("outer.yaml", OUTER)):
        library.add(read(text.encode(), file))
    assert library.findings == []
    with pytest.raises(Mismatch, match=rf"^{place}.*: nothing given"):
        Machine(library["outer"], library, INTERFACES, {name: None})
