"""What many runs come to: totals, shares and means with bounds, a table for each parameter."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from cobodeck.campaign.campaign_file import SHARE_OF, CampaignFile, Limit
from cobodeck.campaign.cell_run import CellResult
from cobodeck.campaign.product import value_of
from cobodeck.statistics import bounded_share, mean_bounds
from cobodeck.terminal import table

COUNTED: Mapping[str, tuple[str, ...]] = {
    "requests": ("requests",),
    "served": ("served",),
    "unserved": ("refused",),
    "contacts": ("contacts",),
    "contacts_by_robot": ("contacts_by_robot",),
    "contacts_avoidable": ("contacts_avoidable",),
    "escapes": ("escapes",),
    "escape_failures": ("escape_failures",),
    "loops": ("loops",),
    "hits": ("wall_hits", "object_hits"),
}
"""Totals, each the sum of these figures of all runs."""
Tally = dict[str, Any]


def tally(results: Sequence[CellResult]) -> Tally:
    """Totals of runs, and means and shares with bounds of 95 %; null where there is none.

    The mean of `response_s` is that of the means of runs, because requests of one run are not
    independent. A share is of requests (of Escapes: `escape_failures`), all of them at most.
    """
    found = [result.figures for result in results if result.figures is not None]
    totals = {name: _total(found, names) for name, names in COUNTED.items()}
    responses = [run["response_s"]["mean"] for run in found if run.get("response_s")]
    return {
        "cells": len(results),
        "failed": len(results) - len(found),
        "simulated_s": sum(run["sim_s"] for run in found),
        **totals,
        "errors": sum(len(run["errors"]) for run in found),
        "response_s": _mean([response for response in responses if response is not None]),
        "shares": {
            name: bounded_share(totals[name], totals[whole]) for name, whole in SHARE_OF.items()
        },
        "least_gap_m": min(_present(run.get("min_gap_m") for run in found), default=None),
        "stuck_s": max(_present(map(_stuck, found)), default=None),
        "arm_closing_m_s": max(_present(run.get("arm_closing_m_s") for run in found), default=None),
    }


def tables(campaign: CampaignFile, results: Sequence[CellResult]) -> list[dict[str, Any]]:
    """For each key of a campaign with several values: its name, and the tally of each value."""
    found = []
    for axis in campaign.axes():
        if len(axis.choices) == 1:
            continue
        groups: dict[Any, list[CellResult]] = {}
        for result in results:
            groups.setdefault(value_of(result.cell, axis), []).append(result)
        rows = [{"value": value, **tally(group)} for value, group in groups.items()]
        found.append({"name": axis.name, "values": rows})
    return found


def broken(campaign: CampaignFile, whole: Tally) -> Iterator[str]:
    """What is not as the campaign expects it, or is not known, in words."""
    for name, limit in campaign.expect.limits().items():
        found = _compared(whole, name, limit)
        if found is None:
            yield f"{name}: not known, at most {limit} is expected"
        elif found > limit.value:
            told = f"{100.0 * found:.2f} %" if limit.is_share else f"{found:g}"
            yield f"{name}: {told}, at most {limit} is expected"


def _compared(whole: Tally, name: str, limit: Limit) -> float | None:
    """What is compared with a limit: a total, or a share, which is 0 of nothing."""
    total: float | None = whole[name]
    if total is None or not limit.is_share:
        return total
    share = whole["shares"][name]
    return float(total) if share is None else share["share"]


def table_text(name: str, rows: Sequence[Mapping[str, Any]]) -> str:
    """Tallies as a table, one line for each value of a parameter."""
    heads = [name, "cells", "requests", "served", "response, s", "contacts", "by robot",
             "Escapes", "failed", "least gap, m"]  # fmt: skip
    body = [
        [
            row["value"],
            row["cells"],
            row["requests"],
            row["served"],
            _mean_text(row["response_s"]),
            _share_text(row, "contacts"),
            _share_text(row, "contacts_by_robot"),
            row["escapes"],
            _share_text(row, "escape_failures"),
            _number_text(row["least_gap_m"]),
        ]
        for row in rows
    ]
    return table([heads, *body])


def _stuck(run: Mapping[str, Any]) -> float | None:
    """The longest time for which drives came to nothing at one place, s; None if not known."""
    if run.get("stuck") is None:
        return None
    return max((one["until_s"] - one["at_s"] for one in run["stuck"]), default=0.0)


def _present(values: Iterator[Any]) -> Iterator[Any]:
    return (value for value in values if value is not None)


def _total(found: Sequence[Mapping[str, Any]], names: tuple[str, ...]) -> int | None:
    counts = list(_present(run.get(name) for run in found for name in names))
    return sum(counts) if counts else None


def _mean(values: Sequence[float]) -> dict[str, float] | None:
    if not values:
        return None
    low, high = mean_bounds(values)
    return {"mean": sum(values) / len(values), "low": low, "high": high}


def _mean_text(mean: Mapping[str, float] | None) -> str:
    return "-" if mean is None else f"{mean['mean']:.2f} [{mean['low']:.2f}, {mean['high']:.2f}]"


def _share_text(row: Mapping[str, Any], name: str) -> str:
    share = row["shares"][name]
    if share is None:
        return "-" if row[name] is None else str(row[name])
    return f"{row[name]} [{100.0 * share['low']:.2f}, {100.0 * share['high']:.2f}] %"


def _number_text(value: float | None) -> str:
    return "-" if value is None else f"{value:.3f}"
