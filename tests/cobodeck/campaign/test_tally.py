"""What many runs come to, against sums by hand and figures from tables."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import given, settings, strategies as st

from cobodeck.campaign.campaign_file import CampaignFile
from cobodeck.campaign.cell import CampaignCell
from cobodeck.campaign.cell_run import CellResult
from cobodeck.campaign.summary import summarised, summary_text
from cobodeck.campaign.tally import broken, tables, tally
from cobodeck.campaign.worst import worst_cells
from engine.files.declared.item import parse_yaml
from engine.files.declared.records import record
from tests.repeats import examples


def figures(**others: Any) -> dict[str, Any]:
    return {
        "sim_s": 60.0, "requests": 2, "served": 2, "refused": 0, "contacts": 0,
        "contacts_by_robot": 0, "escapes": 0, "escape_failures": 0, "wall_hits": 0,
        "object_hits": 0, "errors": [], "response_s": {"mean": 6.0, "max": 7.0},
        "min_gap_m": 0.5,
    } | others  # fmt: skip


def result(n: int, scene: str = "lab_a", **others: Any) -> CellResult:
    cell = CampaignCell(scene=scene, repetition=n)
    return CellResult(cell, f"address {scene} {n}", figures(**others), cpu_s=1.0)


def failed(n: int) -> CellResult:
    return CellResult(CampaignCell(repetition=n), "none", None, failure="fell over")


def campaign(lines: str) -> CampaignFile:
    return parse_yaml(f"campaign: c\n{lines}", "c", lambda item: record(item, CampaignFile))


def test_totals_are_sums_and_failed_cells_are_counted_apart() -> None:
    found = tally([
        result(0, contacts=1, wall_hits=2, errors=["x"], min_gap_m=0.2),
        result(1, contacts=2, contacts_by_robot=1, object_hits=1, served=1, refused=1),
        failed(2),
    ])  # fmt: skip

    assert {name: found[name] for name in ("cells", "failed", "requests", "served", "unserved",
            "contacts", "contacts_by_robot", "hits", "errors", "least_gap_m", "simulated_s")} == {
        "cells": 3, "failed": 1, "requests": 4, "served": 3, "unserved": 1, "contacts": 3,
        "contacts_by_robot": 1, "hits": 3, "errors": 1, "least_gap_m": 0.2, "simulated_s": 120.0,
    }  # fmt: skip


def test_shares_have_the_bounds_of_clopper_and_pearson() -> None:
    found = tally([result(n, contacts=int(n < 3)) for n in range(5)])["shares"]

    # 3 of 10 and 0 of 10, from tables of the binomial distribution
    assert found["contacts"]["share"] == pytest.approx(0.3)
    assert found["contacts"]["low"] == pytest.approx(0.0667, abs=5e-5)
    assert found["contacts"]["high"] == pytest.approx(0.6525, abs=5e-5)
    assert (found["contacts_by_robot"]["low"], found["contacts_by_robot"]["share"]) == (0.0, 0.0)
    assert found["contacts_by_robot"]["high"] == pytest.approx(0.3085, abs=5e-5)
    assert found["escape_failures"] is None


def test_what_is_not_known_is_null() -> None:
    unknown = figures(contacts=None, contacts_by_robot=None, min_gap_m=None, response_s=None)
    found = tally([CellResult(CampaignCell(), "a", unknown)])

    assert (found["contacts"], found["least_gap_m"], found["response_s"]) == (None, None, None)
    assert found["shares"]["contacts"] is None
    assert tally([])["requests"] is None


means = st.lists(st.floats(1.0, 30.0), min_size=1, max_size=6)


@settings(max_examples=examples(8), deadline=None)
@given(means)
def test_the_mean_response_is_within_its_bounds_and_theirs_within_the_runs(
    values: list[float],
) -> None:
    found = tally([result(n, response_s={"mean": mean}) for n, mean in enumerate(values)])
    response = found["response_s"]

    assert response["mean"] == pytest.approx(sum(values) / len(values))
    assert min(values) - 1e-9 <= response["low"] <= response["mean"] + 1e-9
    assert response["mean"] - 1e-9 <= response["high"] <= max(values) + 1e-9


def test_a_table_for_each_key_with_several_values() -> None:
    small = campaign("scene: [lab_a, lab_b]\nuser: random\n")
    counts = [("lab_a", 1), ("lab_b", 2), ("lab_a", 4)]
    some = [result(n, scene, contacts=contacts) for n, (scene, contacts) in enumerate(counts)]

    (found,) = tables(small, some)

    assert found["name"] == "scene"
    assert [(row["value"], row["cells"], row["contacts"]) for row in found["values"]] == [
        ("lab_a", 2, 5), ("lab_b", 1, 2),
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("expected", "told"),
    [
        ("{contacts: 3}", []),
        ("{contacts: 2}", ["contacts: 3, at most 2 is expected"]),
        ("{contacts: 30 %}", []),
        ("{contacts: 29 %}", ["contacts: 30.00 %, at most 29 % is expected"]),
        ("{escape_failures: 0 %, contacts_by_robot: 0, hits: 0}", []),
    ],
)
def test_what_is_not_as_expected(expected: str, told: list[str]) -> None:
    whole = tally([result(n, contacts=int(n < 3)) for n in range(5)])

    assert list(broken(campaign(f"expect: {expected}"), whole)) == told


def test_the_longest_time_at_one_place_is_that_of_all_drives_that_came_to_nothing() -> None:
    stuck = [{"at_s": 3.0, "until_s": 8.0}, {"at_s": 10.0, "until_s": 71.0}]
    whole = tally([result(0, stuck=[]), result(1, stuck=stuck)])

    assert whole["stuck_s"] == 61.0
    assert list(broken(campaign("expect: {stuck_s: 60}"), whole)) == [
        "stuck_s: 61, at most 60 is expected"
    ]
    assert tally([result(0, stuck=[])])["stuck_s"] == 0.0
    assert tally([result(0, stuck=None)])["stuck_s"] is None


@pytest.mark.parametrize("name", ["contacts", "contacts_by_robot", "stuck_s", "hits"])
def test_what_is_not_known_is_not_as_expected(name: str) -> None:
    unknown = dict.fromkeys(("contacts", "contacts_by_robot", "stuck", "wall_hits", "object_hits"))
    whole = tally([result(0, **unknown)])

    assert list(broken(campaign(f"expect: {{{name}: 0}}"), whole)) == [
        f"{name}: not known, at most 0 is expected"
    ]


def test_the_hash_is_the_same_wherever_files_lie() -> None:
    small = campaign("scene: lab_a")
    here, there = (result(0, f"{folder}/own.yaml") for folder in ("/here", "/there/below"))

    assert summarised(small, [here])["sha256"] == summarised(small, [there])["sha256"]


def test_the_hash_is_of_figures_and_order_alone() -> None:
    small, quiet = campaign("scene: lab_a"), {"response_s": None}
    some = [result(0, **quiet), result(1, contacts=1, **quiet)]
    same = [CellResult(r.cell, "elsewhere", r.figures, cpu_s=9.0) for r in some]
    other = [some[0], result(1, contacts=2, **quiet)]

    assert summarised(small, some)["sha256"] == summarised(small, same)["sha256"]
    assert summarised(small, some)["sha256"] != summarised(small, other)["sha256"]
    assert summarised(small, some)["sha256"] != summarised(small, some[::-1])["sha256"]


def test_a_summary_tells_bounds_cost_and_failures() -> None:
    summary = summarised(campaign("expect: {contacts: 0}"), [result(0, contacts=1), failed(1)])

    text = summary_text(summary, {"cpu_s": 4.0, "wall_s": 3.0, "run": 2})

    assert "2.00 s per cell" in text
    assert "1 [1.26, 98.74] %" in text  # 1 of 2
    assert "not as expected: contacts: 1, at most 0 is expected" in text
    assert "fell over" in text


def test_the_worst_cells_are_the_worst_in_each_respect() -> None:
    some = [
        result(0, min_gap_m=0.01),
        result(1, contacts_by_robot=1),
        result(2, response_s={"mean": 9.0, "max": 31.0}),
        result(3, contacts_by_robot=2, response_s={"mean": 9.0, "max": 40.0}),
        result(4, refused=1),
        failed(5),
    ]

    assert [(name, r.cell.repetition) for name, r in worst_cells(some, 4)] == [
        ("contacts_by_robot", 3), ("unserved", 4), ("least_gap_m", 0), ("contacts_by_robot", 1),
    ]  # fmt: skip
    assert worst_cells(some, 0) == []
    assert len(worst_cells(some, 99)) == 5


def test_no_run_is_bad_where_nothing_happened() -> None:
    quiet = result(0, response_s=None, min_gap_m=None)

    assert worst_cells([quiet], 3) == []
