"""What a campaign came to, for programs and to read."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from cobodeck.campaign.campaign_file import CampaignFile
from cobodeck.campaign.cell_run import CellResult, sha256_of
from cobodeck.campaign.tally import broken, table_text, tables, tally

SHOWN = 5
"""Number of failed cells that are told."""


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
