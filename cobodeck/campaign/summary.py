"""What a campaign came to, for programs and to read; and what pages say of committed campaigns."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from itertools import chain
from pathlib import Path
from typing import Any

from cobodeck.campaign.campaign_file import SHARE_OF, CampaignFile, load_campaign
from cobodeck.campaign.cell_run import CellResult, sha256_of
from cobodeck.campaign.tally import (
    Tally,
    broken,
    table_text,
    tables,
    tally,
)
from cobodeck.markdown import markdown_table
from cobodeck.statistics import bounded_share

SHOWN = 5
"""Number of failed cells that are told."""
RESULTS = Path(__file__).with_name("results")
FIRST = {
    "attentive": "attentive",
    "tier_2": "attentive, all sensors (tier 2)",
    "delayed": "attentive, tracked 100 ms late, 10 cm of noise",
}
"""Campaigns that the first page tells apart; the others are told together."""
Summary = Mapping[str, Any]


def summarised(campaign: CampaignFile, results: Sequence[CellResult]) -> dict[str, Any]:
    """Totals, a table for each key with several values, what failed, and what is not as expected.

    `sha256` is that of all cells and figures in their order: equal wherever they ran, and wherever
    their files lie.
    """
    whole = tally(results)
    return {
        "campaign": campaign.campaign,
        "about": campaign.about,
        "whole": whole,
        "parameters": tables(campaign, results),
        "failed": [
            {"key": result.cell.key(), "why": result.failure}
            for result in results
            if result.failure is not None
        ],
        "broken": list(broken(campaign, whole)),
        "sha256": sha256_of([[r.cell.content(), r.figures_sha256] for r in results]),
    }


def for_programs(result: CellResult) -> dict[str, Any]:
    """A cell with its figures."""
    return {
        "key": result.cell.key(),
        "seed": result.cell.seed,
        "figures": result.figures,
        "figures_sha256": result.figures_sha256,
        "cpu_s": result.cpu_s,
    }


def summary_text(summary: Mapping[str, Any], cost: Mapping[str, float]) -> str:
    """A summary to read, with what it cost: CPU and wall time, s."""
    whole = summary["whole"]
    lines = [f"{summary['campaign']}: {summary['about']}".rstrip(" :"), ""]
    lines += [table_text("", [{"value": "all", **whole}]), ""]
    for parameter in summary["parameters"]:
        lines += [table_text(parameter["name"], parameter["values"]), ""]
    lines.append("95 % bounds: of means of runs by bootstrap, of shares by Clopper and Pearson")
    lines.append(
        f"{whole['simulated_s'] / 3600.0:.1f} simulated hours, {cost['cpu_s']:.0f} s of CPU, "
        f"{cost['cpu_s'] / max(whole['cells'], 1):.2f} s per cell; {cost['wall_s']:.0f} s for "
        f"{cost['run']:.0f} cells run now; figures {summary['sha256'][:16]}"
    )
    lines += [f"not as expected: {told}" for told in summary["broken"]]
    failed = summary["failed"]
    lines += [f"failed: {one['key']}: {one['why']}" for one in failed[:SHOWN]]
    if len(failed) > SHOWN:
        lines.append(f"failed: {len(failed) - SHOWN} more")
    return "\n".join(lines)


def campaigns_block(folder: Path = RESULTS) -> str:
    """Each campaign whose summary is kept, those of several kinds of people by kind."""
    found = _kept(folder)
    if not found:
        return ""
    head = ("", "requests", "served", "response, s", "touched by the robot", "any touch",
            "avoidable", "Escapes failed", "least gap, m", "at one place, s")  # fmt: skip
    notes = [
        f"{name}, not as expected: {told}."
        for name, one in found.items()
        for told in broken(load_campaign(name), one["whole"])
    ]
    runs, hours = _sum(found, "cells"), _sum(found, "simulated_s") / 3600.0
    days = {one["date"] for one in found.values()}
    dates = " to ".join(sorted({min(days), max(days)}))
    made = f"{_thousands(runs)} runs, {hours:.0f} h simulated, {dates}."
    return "\n\n".join([markdown_table(head, _lines(found)), made, *notes])


def campaigns_in_short(folder: Path = RESULTS) -> str:
    """The campaigns of `FIRST`, and all others together; empty if none is kept."""
    found = _kept(folder)
    rows = {about: found[name]["whole"] for name, about in FIRST.items() if name in found}
    others = {name: one for name, one in found.items() if name not in FIRST}
    if others:
        rows[", ".join(others)] = _together(others)
    head = ("random people", "requests", "served", "touched by the robot", "any touch",
            "Escapes failed")  # fmt: skip
    lines = [(about, *_counts(row), *_shares(row)) for about, row in rows.items()]
    return markdown_table(head, lines) if lines else ""


def _kept(folder: Path) -> dict[str, Summary]:
    """The summaries of campaigns, by their names, in the order of these."""
    found = (json.loads(file.read_text("utf-8")) for file in sorted(folder.glob("*.json")))
    return {one["campaign"]: one for one in found if "campaign" in one}


def _together(found: Mapping[str, Summary]) -> dict[str, Any]:
    names = ("requests", "served", "escapes", *SHARE_OF)
    totals = {name: _sum(found, name) for name in names}
    shares = {name: bounded_share(totals[name], totals[whole]) for name, whole in SHARE_OF.items()}
    return {**totals, "shares": shares}


def _sum(found: Mapping[str, Summary], name: str) -> int:
    return sum(one["whole"][name] or 0 for one in found.values())


def _lines(found: Mapping[str, Summary]) -> Iterator[tuple[str, ...]]:
    for name, one in found.items():
        yield _line(name, one["whole"])
        kinds = (axis["values"] for axis in one["parameters"] if axis["name"] == "user")
        for row in chain.from_iterable(kinds):
            yield _line(f"… {row['value']}", row)


def _line(about: str, row: Tally) -> tuple[str, ...]:
    response, avoidable, gap = (
        row[name] for name in ("response_s", "contacts_avoidable", "least_gap_m")
    )
    by_robot, touches, failed = _shares(row)
    return (
        about,
        *_counts(row),
        "–" if response is None else f"{response['mean']:.2f}",
        by_robot,
        touches,
        _thousands(avoidable),
        failed,
        "–" if gap is None else f"{gap:.2f}",
        _thousands(row["stuck_s"]),
    )


def _counts(row: Tally) -> tuple[str, str]:
    return _thousands(row["requests"]), _thousands(row["served"])


def _shares(row: Tally) -> Iterator[str]:
    """Touches by the robot, all touches, failed Escapes: how many, and the bounds of the share."""
    for name in ("contacts_by_robot", "contacts", "escape_failures"):
        share = row["shares"][name]
        told = _thousands(row[name])
        if SHARE_OF[name] == "escapes":
            told += f" of {_thousands(row['escapes'])}"
        if share is not None:
            low = f"{100.0 * share['low']:.2g} to " if share["low"] else "≤ "
            told += f" ({low}{100.0 * share['high']:.2g} %)"
        yield told


def _thousands(number: float | None) -> str:
    return "–" if number is None else f"{number:,.0f}".replace(",", " ")
