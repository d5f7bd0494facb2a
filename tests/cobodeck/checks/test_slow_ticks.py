"""A chart that drives does not tick more slowly than the safety chain drops velocities."""

from __future__ import annotations

import re

import pytest

from cobodeck.checks.run_checks import tick_rate
from cobodeck.setup.options import Options
from cobodeck.setup.setup import Uses, open_setup
from cobodeck.terminal.console import Problem

DRIVES = Uses(frozenset({"base"}), frozenset())
LOOKS = Uses(frozenset({"arm"}), frozenset({"base.pose"}))


def refused(tick_hz: int, uses: Uses = DRIVES, latency_ms: int = 0, *, mock: bool = False) -> str:
    """Why so many ticks a second are too few; empty if they are not."""
    setup = open_setup(tick_hz=tick_hz, sets=(f"plant.latency={latency_ms} ms",))
    found = list(tick_rate(setup, uses, Options(mock=mock)))
    for answer in found:
        with pytest.raises(Problem, match=re.escape(answer.about)):
            answer.require()
    return "".join(answer.explanation for answer in found)


def test_twelve_ticks_a_second_are_too_few_to_drive_and_thirteen_are_not() -> None:
    assert re.search(r"at 12 Hz .* 83\.3 ms old .* less than 80 ms", refused(12))
    assert not refused(13)


def test_the_way_from_a_tick_to_the_robot_counts_where_it_is_simulated() -> None:
    assert "80.0 ms old" in refused(20, latency_ms=30)
    assert not refused(20, latency_ms=20)
    assert not refused(20, latency_ms=30, mock=True)


def test_a_chart_that_does_not_drive_may_tick_slowly() -> None:
    assert not refused(1, LOOKS)
