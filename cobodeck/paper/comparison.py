"""The statistics of section 5.2.1, and intervals over random routes.

The paper compares the sums of each sequence of seven responses, 14 per condition from 98 of 100
requests (R137), with Kruskal and Wallis's test, and pairs of conditions in the predicted order with
Jonckheere and Terpstra's, adjusted by Holm's method (R138, R139). These sums are of one repeated
walk, which no seed changes: they tell whether the conditions differ on that walk. Whether they
differ on others is told by random routes, each walked in all conditions: bounds of the mean
differences between conditions are by bootstrap over routes.
"""

from __future__ import annotations

import statistics
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict
from itertools import combinations
from typing import Any

from cobodeck.paper.conditions import CONDITIONS, SEQUENCE
from cobodeck.statistics import (
    bounded_share,
    holm,
    jonckheere_terpstra,
    kruskal_wallis,
    mean_bounds,
)

Figures = Mapping[str, Any]
PAIRS = tuple(combinations(CONDITIONS, 2))


def on_study(conditions: Mapping[str, Figures]) -> dict[str, Any]:
    """The paper's tests; those that the sums do not allow are null."""
    sums = {name: sequence_sums(conditions[name]) for name in CONDITIONS}
    known = all(sums.values()) and len({value for group in sums.values() for value in group}) > 1
    found: dict[str, Any] = {"sums_s": sums, "kruskal_wallis": None, "jonckheere_terpstra": {}}
    if not known:
        return found
    found["kruskal_wallis"] = asdict(kruskal_wallis(list(sums.values())))
    pairs = {
        f"{first} < {second}": asdict(jonckheere_terpstra([sums[first], sums[second]]))
        for first, second in PAIRS
        if len({*sums[first], *sums[second]}) > 1
    }
    adjusted = holm({name: pair["p"] for name, pair in pairs.items()})
    found["jonckheere_terpstra"] = {
        name: pair | {"p_holm": adjusted[name]} for name, pair in pairs.items()
    }
    return found


def sequence_sums(figures: Figures) -> list[float]:
    """Sums of the responses to each sequence of seven requests, s; incomplete ones are left out."""
    responses = [request["response_s"] for request in figures["request_list"]]
    starts = range(0, len(responses) - SEQUENCE + 1, SEQUENCE)
    sequences = (responses[start : start + SEQUENCE] for start in starts)
    return [round(sum(sequence), 9) for sequence in sequences if None not in sequence]


def on_routes(routes: Mapping[str, Sequence[Figures]]) -> dict[str, Any]:
    """Order of the mean responses over random routes, and bounds of differences (95 %).

    Args:
        routes: the runs of each condition, on the same routes in the same order.
    """
    means = {name: [run["response_s"]["mean"] for run in runs] for name, runs in routes.items()}
    whole = [row for row in zip(*means.values(), strict=True) if None not in row]
    orders = Counter(" < ".join(_ranked(dict(zip(means, row, strict=True)))) for row in whole)
    return {
        "number": len(next(iter(routes.values()))),
        "means_s": means,
        "orders": dict(sorted(orders.items(), key=lambda item: (-item[1], item[0]))),
        "differences": dict(_differences(routes)),
        "conditions": {name: _totals(runs) for name, runs in routes.items()},
    }


def _ranked(values: Mapping[str, float]) -> list[str]:
    return sorted(values, key=lambda name: values[name])


PER_REQUEST: Mapping[str, Callable[[Figures], Any]] = {
    "response_s": lambda run: run["response_s"]["mean"],
    "distance_m": lambda run: run["distance_m"] / run["requests"],
    "energy_j": lambda run: run["energy_j"] / run["requests"],
    "escapes": lambda run: run["escapes"] / run["requests"],
}
"""Figures compared between conditions, per request."""


def _differences(
    routes: Mapping[str, Sequence[Figures]],
) -> Iterator[tuple[str, dict[str, dict[str, float]]]]:
    for first, second in PAIRS:
        found = {}
        for name, of in PER_REQUEST.items():
            pairs = ((of(a), of(b)) for a, b in zip(routes[first], routes[second], strict=True))
            gaps = [after - before for before, after in pairs if None not in (before, after)]
            if gaps:
                low, high = mean_bounds(gaps)
                found[name] = {"mean": statistics.fmean(gaps), "low": low, "high": high}
        yield f"{second} - {first}", found


def _totals(runs: Sequence[Figures]) -> dict[str, Any]:
    """Sums over the routes of one condition, and bounds of shares (95 %)."""
    names = ("requests", "served", "escapes", "escape_failures", "contacts", "contacts_by_robot")
    totals: dict[str, Any] = {name: sum(run[name] for run in runs) for name in names}
    times = [
        escape["time_s"]
        for run in runs
        for escape in run["escape_list"]
        if escape["outcome"] == "safe"
    ]
    totals["served_share"] = bounded_share(totals["served"], totals["requests"])
    totals["escape_failure_share"] = bounded_share(totals["escape_failures"], totals["escapes"])
    totals["escape_time_s"] = statistics.fmean(times) if times else None
    return totals
