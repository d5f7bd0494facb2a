"""Tiers against the reference: how differences are told, and the committed result."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from cobodeck.bench import reference_bench as bench
from cobodeck.bench.harness import BenchRow
from cobodeck.bench.reference_bench import CORNER, TierRun, distances, driven, ideal
from cobodeck.bench.result import read_result
from cobodeck.bench.table import is_missed, missed_table
from hw.geometry import Pose2
from hw.model.robot import load_robot

ROOT = Path(__file__).parents[3]
RESULT = ROOT / "cobodeck/bench/results/reference.json"


def taken(*responses: float | None) -> TierRun:
    return TierRun({"request_list": [{"response_s": one} for one in responses]}, 1.0)


def test_a_difference_is_that_of_pairs_that_both_were_served() -> None:
    own, there = taken(5.0, None, 4.4, 9.0), taken(5.0, 7.0, 4.0, None)
    assert bench.response_difference(own, there) == pytest.approx(100.0 * 0.2 / 4.5)


def test_a_turn_counts_by_the_way_of_a_corner() -> None:
    turned = distances([Pose2(1.0, 2.0, 0.3)], [Pose2(1.0, 2.0, 0.1)])
    assert turned == [pytest.approx(2.0 * math.hypot(*CORNER) * math.sin(0.1))]


def test_a_base_is_driven_by_commands_in_ticks() -> None:
    poses = driven(ideal(load_robot("rbkairos_ur10")), bench.COMMANDS["ahead"], 3.0)
    assert poses[-1].x == pytest.approx(1.5 * 3.0 - 1.5**2 / 2.0, abs=0.01)  # speeds up at 1 m/s2


def test_the_committed_result_keeps_its_goals() -> None:
    """Responses within 3 % of tier 3, which is 20 times as fast as real time or faster.

    All but that of tier 1 on a floor that takes some of the way, which the page of figures tells.
    """
    rows = read_result(RESULT)["rows"]
    judged = [row for row in rows if row["goal"] is not None]
    assert len(judged) == 4
    missed = [(row["name"], row["variant"]) for row in judged if is_missed(row)]
    assert missed == [("response, study", "tier 1")]
    physical = [row for row in rows if row["variant"] == "tier 3" and row["time_us"] is not None]
    assert physical
    assert all(row["time_us"] <= 1e6 / 30 / 20 for row in physical)


def test_a_missed_goal_is_told() -> None:
    rows = [
        BenchRow("b", "off", "cobodeck", "step", 0.1, error=3.5, error_unit="cm", goal=3.0),
        BenchRow("b", "kept", "cobodeck", error=3.0, error_unit="cm", ratio=9.0, goal=3.0),
        BenchRow("b", "slow", "cobodeck", ratio=6.7, ratio_to="unit", goal=5.5),
        BenchRow("b", "called", "cobodeck", ratio=1.0, calls_per_tick=7.0, goal=6.0),
    ]
    table = missed_table([{"rows": [row.plain() for row in rows]}])
    assert "| b: off | cobodeck, step 0.1 | 3.5 cm | 3 |" in table
    assert "| b: slow | cobodeck | 6.7 × unit | 5.5 |" in table
    assert "| b: called | cobodeck | 7 calls per tick | 6 |" in table
    assert "kept" not in table
