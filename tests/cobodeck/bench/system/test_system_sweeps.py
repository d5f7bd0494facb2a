"""Campaigns of one knob: their comparison with ours, and the page and pictures made from it."""

from __future__ import annotations

import json
import re
import statistics
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings, strategies as st
from scipy import stats

from cobodeck.bench.system.comparison import compared
from cobodeck.bench.system.drawn import COST, FIGURES, NOTES
from cobodeck.bench.system.knobs import DISTURBED, KEYS, PRECISION, SystemKnob
from cobodeck.bench.system.page import RESULTS
from cobodeck.campaign import (
    FOLDER,
    CampaignCell,
    CellResult,
    for_programs,
    load_campaign,
    run_cell,
)
from cobodeck.pictures import draw_knobs
from engine.files import written_text

KNOB = SystemKnob("x", "grain", "chase.cell", "5 cm")
ROOT = Path(__file__).parents[4]
responses = st.floats(0.5, 60.0)


def ran(value: str, seed: int, response: float | None = 5.0, **figures: Any) -> dict[str, Any]:
    """A cell of KNOB as `campaign --json` prints it."""
    served = 0 if response is None else 2
    plain = {
        "sim_s": 100.0, "response_s": {"mean": response}, "requests": 2, "served": served,
        "escapes": 1, "escape_failures": 0, "min_gap_m": 0.1, "prop_error_m": {"max": 0.001},
        "localization": None, "contacts": 0, "contacts_by_robot": 0, "contact_list": [],
        "faults": 0, "stuck": [], "distance_m": 50.0, "beside_share_3_4": 0.4,
    }  # fmt: skip
    key = {"scene": "study", "sets": ["chase.risk=3", f"chase.cell={value}"], "requests": 2}
    return {"key": key, "seed": seed, "cpu_s": 0.5, "figures": {**plain, **figures}}


def rows(*cells: dict[str, Any], knob: SystemKnob = KNOB) -> dict[str, Any]:
    return {row["value"]: row for row in compared(knob, cells)["values"]}


@settings(max_examples=20)
@given(st.lists(st.tuples(responses, responses), min_size=1, max_size=8))
def test_differences_are_of_runs_of_the_same_world(pairs: list[tuple[float, float]]) -> None:
    ours = [ran("5 cm", seed, old) for seed, (old, _) in enumerate(pairs)]
    other = [ran("1 cm", seed, new) for seed, (_, new) in enumerate(pairs)]

    found = rows(*ours, *reversed(other), ran("1 cm", 99, 1e3))["1 cm"]["differences"]

    changes = [new - old for old, new in pairs]
    told = found["response_s"]
    assert told["runs"] == len(pairs)
    assert told["mean"] == pytest.approx(statistics.fmean(changes), abs=1e-9)
    assert min(changes) - 1e-9 <= told["low"] <= told["mean"] + 1e-9
    assert told["mean"] - 1e-9 <= told["high"] <= max(changes) + 1e-9


def test_what_is_missing_on_one_side_has_no_difference() -> None:
    cells = ran("5 cm", 1, 4.0), ran("5 cm", 2, None), ran("1 cm", 1, None), ran("1 cm", 2, 6.0)

    fine = rows(*cells)["1 cm"]

    assert fine["differences"]["response_s"] is None
    assert fine["means"]["response_s"]["mean"] == 6.0
    assert fine["shares"]["unserved"]["hits"] == 2
    assert fine["differences"]["least_gap_m"]["mean"] == 0.0


@given(st.integers(0, 7), st.integers(1, 7))
def test_runs_with_a_touch_are_counted_once_with_exact_bounds(hits: int, others: int) -> None:
    touch = {"robot_closing_m_s": -0.5, "person_closing_m_s": 1.5}
    touched: dict[str, Any] = {"contacts": 3, "contacts_by_robot": 2, "contact_list": [touch]}
    cells = [ran("5 cm", n, **touched) for n in range(hits)]

    ours = rows(*cells, *(ran("5 cm", hits + n) for n in range(others)))["5 cm"]

    share = ours["shares"]["touched_by_robot"]
    exact = stats.binomtest(hits, hits + others).proportion_ci(method="exact")
    assert (share["hits"], share["of"]) == (hits, hits + others)
    assert (share["low"], share["high"]) == pytest.approx((exact.low, exact.high), abs=1e-9)
    assert ours["impact_m_s"] == (1.0 if hits else None)


def test_costs_are_ratios_of_pairs_and_failed_cells_do_not_count() -> None:
    broken = {**ran("1 cm", 4), "figures": None}
    cells = [ran("5 cm", n) for n in range(3)] + [ran("1 cm", n, sim_s=50.0) for n in range(3)]

    found = rows(*cells, broken)

    assert found["1 cm"]["runs"] == 3
    assert found["1 cm"]["cpu_ratio"] == pytest.approx(2.0)
    assert found["5 cm"]["cpu_ms_per_s"] == pytest.approx(5.0)


def test_a_run_has_every_figure_that_is_compared() -> None:
    knob = SystemKnob("x", "ticks per second", "tick_hz", "30")
    cell = CampaignCell(user="brief", requests=1)
    found = for_programs(CellResult(cell, "address", run_cell(cell), cpu_s=0.1))

    ours = rows(json.loads(json.dumps(found)), knob=knob)["30"]

    assert ours["means"]["response_s"]["mean"] > 1.0
    assert ours["shares"]["unserved"]["hits"] == 0
    assert ours["least_gap_m"] == found["figures"]["min_gap_m"]


def test_values_are_named_in_the_order_of_the_campaign() -> None:
    named = replace(KNOB, names=("coarse", "ours"), ours="ours")

    assert list(rows(ran("9 cm", 1), ran("5 cm", 1), knob=named)) == ["coarse", "ours"]


@pytest.mark.parametrize("knob", PRECISION + DISTURBED + KEYS, ids=lambda knob: knob.campaign)
def test_each_campaign_varies_its_knob_alone_in_four_rooms(knob: SystemKnob) -> None:
    axes = {axis.name: axis for axis in load_campaign(knob.campaign).axes()}
    varied = {name for name, axis in axes.items() if len(axis.choices) > 1}
    values = [written_text(choice.value) for choice in axes[knob.key].choices]

    assert varied == {"scene", knob.key}
    assert len(axes["scene"].choices) == 4
    assert knob.ours in (knob.names or values)
    assert not knob.names or len(knob.names) == len(values)


def test_every_campaign_of_this_kind_is_compared() -> None:
    shipped = {
        path.stem
        for path in FOLDER.glob("*.yaml")
        if re.match("precision|disturbed|key_", path.stem)
    }

    assert shipped == {knob.campaign for knob in PRECISION + DISTURBED + KEYS}


@pytest.mark.parametrize(
    ("name", "knobs"), [("precision", PRECISION), ("disturbed", DISTURBED), ("keys", KEYS)]
)
def test_results_are_of_the_campaigns_and_make_the_pictures(
    name: str, knobs: tuple[SystemKnob, ...], tmp_path: Path
) -> None:
    if not (RESULTS / f"{name}.json").is_file():
        pytest.skip("not measured yet")
    result = json.loads((RESULTS / f"{name}.json").read_text(encoding="utf-8"))
    picture = tmp_path / f"{name}.svg"
    draw_knobs(result["knobs"][:1], FIGURES[name], NOTES[name], picture, {COST})
    text = picture.read_text(encoding="utf-8")

    assert [one["campaign"] for one in result["knobs"]] == [knob.campaign for knob in knobs]
    assert all(str(row["value"]) in text for row in result["knobs"][0]["values"])
    assert knobs[0].title.partition("\n")[0] in text
