"""A chart that drives does not tick more slowly than the safety chain drops velocities."""

from __future__ import annotations

import pytest

from cobodeck.loop.wiring import refuse_slow_ticks
from cobodeck.setup.setup import Uses, open_setup
from cobodeck.terminal.console import Problem

DRIVES = Uses(frozenset({"base"}), frozenset())
LOOKS = Uses(frozenset({"arm"}), frozenset({"base.pose"}))


def test_twelve_ticks_a_second_are_too_few_to_drive_and_thirteen_are_not() -> None:
    with pytest.raises(Problem, match=r"at 12 Hz .* 83\.3 ms old .* less than 80 ms"):
        refuse_slow_ticks(open_setup(tick_hz=12), DRIVES)

    refuse_slow_ticks(open_setup(tick_hz=13), DRIVES)


def test_the_way_from_a_tick_to_the_robot_counts() -> None:
    setup = open_setup(tick_hz=20)

    with pytest.raises(Problem, match=r"80\.0 ms old"):
        refuse_slow_ticks(setup, DRIVES, latency=0.03)

    refuse_slow_ticks(setup, DRIVES, latency=0.02)


def test_a_chart_that_does_not_drive_may_tick_slowly() -> None:
    refuse_slow_ticks(open_setup(tick_hz=1), LOOKS)
