"""Campaign files: the product of their values in its order, and mistakes at their places."""

from __future__ import annotations

import itertools
from pathlib import Path
from typing import Any

import pytest
import yaml
from hypothesis import given, strategies as st

from cobodeck.campaign.campaign_file import (
    CampaignFile,
    Limit,
    load_campaign,
)
from cobodeck.campaign.cell import CampaignCell
from cobodeck.campaign.cell_run import CellRunner
from cobodeck.campaign.product import cells_of, check_campaign, value_of
from cobodeck.project.state_catalogue import catalogue
from engine.files.declared.item import load_yaml, parse_yaml
from engine.files.declared.records import record
from engine.files.finding import FileError

SMALL = {
    "campaign": "small",
    "scene": ["lab_a", "lab_b"],
    "user": ["random"],
    "seeds": 6,
    "requests": 1,
    "set": {"chase.risk": [3, 6]},
}


def read(content: Any) -> CampaignFile:
    text = content if isinstance(content, str) else yaml.safe_dump(content, sort_keys=False)
    return parse_yaml(text, "small.yaml", lambda item: record(item, CampaignFile))


def test_the_cells_of_a_small_campaign() -> None:
    cells = cells_of(read(SMALL))

    assert len(cells) == 2 * 2 * 6
    assert len(set(cells)) == len(cells)
    assert cells[0] == CampaignCell(
        scene="lab_a", user="random", requests=1, sets=("chase.risk=3",)
    )
    assert [cell.repetition for cell in cells] == [*range(6)] * 4
    assert [cell.sets for cell in cells[::6]] == [("chase.risk=3",), ("chase.risk=6",)] * 2
    assert [cell.scene for cell in cells[::12]] == ["lab_a", "lab_b"]


counts = st.lists(st.integers(1, 50), min_size=1, max_size=3, unique=True)
names = st.lists(st.sampled_from(["a", "b", "c"]), min_size=1, max_size=3, unique=True)


@given(names, names, counts, counts, st.integers(1, 4), st.integers(0, 9))
def test_cells_are_the_product_the_last_key_fastest_then_the_seeds(
    scenes: list[str], users: list[str], ticks: list[int], risks: list[int], seeds: int, first: int
) -> None:
    campaign = read(
        {
            "campaign": "any",
            "user": users,
            "tick_hz": ticks,
            "set": {"chase.risk": risks, "chase.outer": 4},
            "scene": scenes,
            "seeds": seeds,
            "first_seed": first,
        }
    )

    wanted = itertools.product(scenes, risks, ticks, users, range(first, first + seeds))
    found = [
        (c.scene, c.sets[0], c.tick_hz, c.user, c.repetition, c.sets[1]) for c in cells_of(campaign)
    ]
    assert found == [
        (scene, f"chase.risk={risk}", tick, user, n, "chase.outer=4")
        for scene, risk, tick, user, n in wanted
    ]


@given(st.integers(1, 60))
def test_fewer_cells_are_chosen_evenly_and_in_order(most: int) -> None:
    everything = cells_of(read(SMALL))
    chosen = cells_of(read(SMALL), most)
    places = [everything.index(cell) for cell in chosen]

    assert len(chosen) == min(most, len(everything))
    assert places[0] == 0
    gaps = {b - a for a, b in itertools.pairwise(places)}
    assert not gaps or max(gaps) - min(gaps) <= 1
    assert all(gap > 0 for gap in gaps)


def test_what_a_cell_has_on_each_axis() -> None:
    campaign = read({**SMALL, "in": {"goal": [{"x": "1 m", "y": 2}, [1, 2]]}, "duration": "2 min"})
    (*_, last) = cells_of(campaign)

    assert last.duration_s == 120.0
    assert last.inputs == ("goal=[1, 2]",)
    assert {axis.name: value_of(last, axis) for axis in campaign.axes()} == {
        "scene": "lab_b",
        "chase.risk": "6",
        "goal": "[1, 2]",
        "user": "random",
        "requests": 1,
        "duration_s": 120.0,
    }


def test_files_are_relative_to_the_campaign(tmp_path: Path) -> None:
    file = tmp_path / "c.yaml"
    file.write_text("campaign: c\nscene: [own/room.yaml, lab_a]\nuser: walk.csv\n")

    cell = cells_of(load_yaml(file, lambda item: record(item, CampaignFile)))[0]

    assert (cell.scene, cell.user) == (str(tmp_path / "own/room.yaml"), str(tmp_path / "walk.csv"))


def test_limits_are_totals_or_shares() -> None:
    expected = read({"campaign": "c", "expect": {"contacts": "1 %", "hits": 0}}).expect

    assert expected.limits() == {"contacts": Limit(0.01, is_share=True), "hits": Limit(0)}
    assert [str(limit) for limit in expected.limits().values()] == ["1 %", "0"]


@pytest.mark.parametrize(
    ("line", "told"),
    [
        ("scene: []", "scene: is an empty list"),
        ("scene: [lab_a, 3]", "scene[1]: 3 is not the name of a file"),
        ("scene: [lab_a, lab_b, lab_a]", "scene[2]: lab_a is given twice"),
        ("requests: [1, 0]", "requests[1]: 0 is out of range"),
        ("tier: 4", "tier: 4 is not one of 0, 1, 2, 3"),
        ("duration: 3 m", "wanted: a duration"),
        ("seeds: 0", "seeds: 0 is out of range"),
        ("sede: 3", "sede: unknown key; did you mean 'seeds'?"),
        ("expect: {contacts: 150 %}", "1.5 is out of range"),
        ("expect: {contacts: -1}", "3 is a total, 5 % a share"),
        ("expect: {falls: 0}", "expect.falls: unknown key"),
        ("expect: {hits: 0 %}", "expect.hits: 0 % is a share; give a total"),
        ("expect: {contacts_avoidable: 0}", "expect.contacts_avoidable: is found out only with"),
        ("set: {chase.risk: []}", "set.chase.risk: is an empty list"),
        ("requests: [1, 2]\nseeds: 600000", "has 1,200,000 cells; 1,000,000 are allowed"),
    ],
)
def test_a_wrong_value_is_told_at_its_place(line: str, told: str) -> None:
    with pytest.raises(FileError) as error:
        read(f"campaign: c\n{line}\n")

    (finding,) = error.value.findings
    assert told in str(error.value)
    assert finding.place.line == (1 if "cells" in told else 2)


@pytest.mark.parametrize(
    ("lines", "places"),
    [
        (["scene: [lab_a, lab_q]"], [(2, 16)]),
        (["chart: nothing"], [(2, 8)]),
        (["robot: [rbkairos_ur10, r2d2]"], [(2, 24)]),
        (["profile: fast"], [(2, 10)]),
        (["user: random:hastly"], [(2, 7)]),
        (["scene: lab_a", "user: [demo, nobody]"], [(3, 14)]),
        (["set: {chase.rist: 3}"], [(2, 19)]),
        (["set: {chase.risk: [3, 1e9], chase.inner: 3 kg}"], [(2, 23), (2, 42)]),
        (["set: {charts.chase.patienc: 3 s}"], [(2, 29)]),
        (["in: {goal: 3}"], [(1, 1)]),
        (["tick_hz: [30, 7]"], [(2, 15)]),
        (["tick_hz: 7"], [(1, 1)]),
    ],
)
def test_a_value_that_is_not_there_is_told_at_its_place(
    lines: list[str], places: list[tuple[int, int]]
) -> None:
    text = "\n".join(["campaign: c", *lines, ""])

    with pytest.raises(FileError) as error:
        parse_yaml(
            text, "c.yaml", lambda item: check_campaign(item, CellRunner(catalogue(own=False)))
        )

    assert [(f.place.line, f.place.column) for f in error.value.findings] == places


PROMISED = {
    "attentive": 10_000, "hasty": 500, "deaf": 500, "pursuing": 500, "delayed": 1000,
    "tier_2": 1000, "tier_2_others": 500,
}  # fmt: skip


@pytest.mark.parametrize("name", ["curious", *PROMISED])
def test_shipped_campaigns_have_the_requests_that_they_promise(name: str) -> None:
    campaign = load_campaign(name)
    cells = cells_of(campaign)

    assert campaign.campaign == name
    assert campaign.expect.contacts_by_robot == Limit(0)
    assert {cell.scene for cell in cells} == {"lab_a", "lab_b", "hall", "study"}
    if name == "curious":
        assert {cell.duration_s for cell in cells} == {1800.0}
    else:
        assert sum(cell.requests or 0 for cell in cells) == PROMISED[name]
