"""Tiers against the reference: how differences are told, and the committed result."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from cobodeck.bench import reference_bench as bench
from cobodeck.bench.reference_bench import CORNER, TierRun, distances, driven, ideal
from cobodeck.bench.result import read_result
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
    """Responses within 3 % of tier 3, which is 20 times as fast as real time or faster."""
    rows = read_result(RESULT)["rows"]
    judged = [row for row in rows if row["goal"] is not None]
    assert len(judged) == 3
    assert all(row["error"] <= row["goal"] for row in judged)
    physical = [row for row in rows if row["variant"] == "tier 3" and row["time_us"] is not None]
    assert physical
    assert all(row["time_us"] <= 1e6 / 30 / 20 for row in physical)
