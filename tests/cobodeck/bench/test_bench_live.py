"""The bench of the live page measures runs beside pages, and edits that a page sees."""

from __future__ import annotations

import pytest

from cobodeck.bench.live.live_bench import CROWDS, NAME, edits_ms, tick_rows
from cobodeck.commands.bench import BENCHES


@pytest.mark.slow
@pytest.mark.realtime
def test_ticks_are_told_for_each_crowd_beside_those_without_a_page() -> None:
    rows = list(tick_rows(1, 2.0))

    assert [row.value for row in rows] == [None, 0.0, 1.0, 10.0, None]
    assert len(rows) == len(CROWDS) + 1
    assert all(row.bench == NAME in BENCHES for row in rows)
    assert all(row.time_us and row.ratio_to == "without a page" for row in rows)


@pytest.mark.slow
@pytest.mark.realtime
def test_an_edit_is_timed_until_a_page_has_its_picture() -> None:
    assert all(taken > 0.0 for taken in edits_ms(2))
