"""Blocks of figures in pages are those that the committed results make."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, strategies as st

from cobodeck.bench.table import RESULTS, speed_text
from cobodeck.campaign.campaign_file import CampaignFile, campaign_names
from cobodeck.campaign.cell import CampaignCell
from cobodeck.campaign.cell_run import CellResult
from cobodeck.campaign.summary import (
    RESULTS as CAMPAIGNS,
    campaigns_block,
    campaigns_in_short,
    summarised,
)
from cobodeck.markdown import markdown_table, with_blocks
from cobodeck.pages import PAGES, ROOT, renewed
from cobodeck.statistics import proportion_bounds
from tests.cobodeck.docs.test_readme import MARKDOWN

BLOCK = re.compile(r"<!-- (.+?) -->\n.*?<!-- \1 end -->", flags=re.S)
WRITTEN_ONCE = {"DECISIONS.md", "CHANGELOG.md"}
"""Logs of what was so at their time."""


@pytest.mark.parametrize("page", PAGES)
def test_every_block_is_that_of_the_committed_results(page: str) -> None:
    assert renewed(page) == (ROOT / page).read_text(encoding="utf-8"), "make figures writes it"


def test_no_page_has_a_marker_that_nothing_fills() -> None:
    marked = {
        page.relative_to(ROOT).as_posix()
        for page in MARKDOWN
        if "<!--" in page.read_text(encoding="utf-8")
    }

    assert marked == set(PAGES)


@pytest.mark.parametrize("page", MARKDOWN, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_outside_of_blocks_no_page_tells_dates_or_times_of_measurements(page: Path) -> None:
    if page.name in WRITTEN_ONCE:
        return
    text = BLOCK.sub("", page.read_text(encoding="utf-8"))

    assert not re.findall(r"\d ?µs|times (?:as fast as )?real time|measured on 20|Machine: ", text)


names = st.lists(st.sampled_from("abcde"), unique=True, max_size=4)
words = st.text("xyz |", min_size=1, max_size=20).filter(str.strip)


def page_of(blocks: dict[str, str], between: str) -> str:
    parts = (f"<!-- {name} -->\n{text}<!-- {name} end -->\n" for name, text in blocks.items())
    return between + between.join(parts) + between


@given(names, st.data())
def test_blocks_are_replaced_and_all_else_stays(found: list[str], data: st.DataObject) -> None:
    between = data.draw(words) + "\n"
    texts = {name: data.draw(words).strip() for name in found}
    old = page_of({name: data.draw(st.sampled_from(["", "old\n"])) for name in found}, between)

    new = with_blocks(old, texts)

    assert new == with_blocks(new, texts)
    assert BLOCK.sub("", new) == BLOCK.sub("", old)
    assert [" ".join(block.split()) for block in re.findall(r"-->\n(.*?)\n<!-- \w end", new)] == [
        " ".join(text.split()) for text in texts.values()
    ]


@pytest.mark.parametrize(
    "page",
    [
        "none",
        "<!-- a -->\n",
        "<!-- a end -->\n<!-- a -->\n",
        "<!-- a -->\n<!-- a end -->\n<!-- b -->\n<!-- b end -->\n",
        "<!-- a -->\n<!-- a end -->\n<!-- a -->\n<!-- a end -->\n",
    ],
)
def test_other_markers_than_those_of_the_blocks_are_told(page: str) -> None:
    with pytest.raises(ValueError, match="the markers are"):
        with_blocks(page, {"a": "new"})


def test_tables_keep_their_lines_and_prose_is_wrapped() -> None:
    table = markdown_table(("", "long"), [("row", "word " * 40)])
    page = with_blocks("<!-- a -->\n<!-- a end -->\n", {"a": f"{table}\n\n{'word ' * 40}"})

    assert table in page
    assert len(page.splitlines()) == 1 + 3 + 1 + 2 + 1


def test_speed_is_the_simulated_time_over_that_of_the_processor() -> None:
    """Beside the bench's own row of it."""
    rows = json.loads((RESULTS / "simulation.json").read_text(encoding="utf-8"))["rows"]
    speeds = {row["name"]: row["ratio"] for row in rows if row["variant"] == "speed"}
    told = {row["name"]: speed_text(row) for row in rows if row["variant"] == "cobodeck"
            and row["name"] in speeds}  # fmt: skip

    assert len(speeds) == 3
    assert {name: float(text) for name, text in told.items()} == {
        name: pytest.approx(speed, rel=0.05) for name, speed in speeds.items()
    }


def kept(folder: Path, name: str, *runs: dict[str, Any]) -> None:
    """A summary of a campaign as the command keeps it."""
    plain = {
        "sim_s": 1800.0, "requests": 10, "served": 9, "refused": 1, "contacts": 0,
        "contacts_by_robot": 0, "escapes": 0, "escape_failures": 0, "errors": [],
        "response_s": {"mean": 6.0}, "min_gap_m": 0.5, "wall_hits": 0, "object_hits": 0,
        "stuck": [],
    }  # fmt: skip
    results = [
        CellResult(CampaignCell(repetition=n), f"{name} {n}", plain | run, cpu_s=1.0)
        for n, run in enumerate(runs)
    ]
    found = summarised(CampaignFile(campaign=name), results)
    file = folder / f"{name}.json"
    file.write_text(json.dumps({**found, "date": "2026-01-02"}), encoding="utf-8")


def test_campaigns_are_told_with_their_bounds_and_what_was_not_expected(tmp_path: Path) -> None:
    kept(tmp_path, "attentive", *[{"contacts_avoidable": 0}] * 200)
    kept(tmp_path, "deaf", {"contacts": 2, "wall_hits": 1, "escapes": 4, "escape_failures": 1})
    kept(tmp_path, "hasty", {"contacts": 1, "contacts_avoidable": 0})
    (tmp_path / "precision.json").write_text('{"knobs": []}', encoding="utf-8")

    text = campaigns_block(tmp_path)
    low, high = (f"{100.0 * bound:.2g}" for bound in proportion_bounds(2, 10))
    assert f"| deaf | 10 | 9 | 6.00 | 0 (≤ 31 %) | 2 ({low} to {high} %) | – | 1 of 4 (" in text
    assert "| attentive | 2 000 | 1 800 | 6.00 | 0 (≤ 0.18 %) | 0 (≤ 0.18 %) | 0 | 0 of 0 |" in text
    assert "202 runs, 101 h simulated, 2026-01-02." in text
    assert text.endswith("\n\ndeaf, not as expected: hits: 1, at most 0 is expected.")

    low, high = (f"{100.0 * bound:.2g}" for bound in proportion_bounds(3, 20))
    short = campaigns_in_short(tmp_path).splitlines()
    assert short[2].startswith("| attentive | 2 000 |")
    assert short[3].startswith(f"| deaf, hasty | 20 | 18 | 0 (≤ 17 %) | 3 ({low} to {high} %) |")
    assert len(short) == 4


def test_where_no_campaign_is_kept_none_is_told(tmp_path: Path) -> None:
    assert campaigns_in_short(tmp_path) == ""
    assert campaigns_block(tmp_path) == ""


def test_committed_campaigns_are_shipped_ones() -> None:
    found = {file.stem: json.loads(file.read_text("utf-8")) for file in CAMPAIGNS.glob("*.json")}
    told = {name: one["campaign"] for name, one in found.items() if "campaign" in one}

    assert told == {name: name for name in told}
    assert set(told) <= set(campaign_names())
