"""What each value of a knob comes to, and how it differs from ours in the same worlds.

Runs of two values with equal seeds meet the same person. Means of their differences vary less
than differences of means do (common random numbers; Law, Simulation Modeling and Analysis, 11.2).
"""

from __future__ import annotations

import statistics
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from cobodeck.bench.system.knobs import OneRun, SystemKnob
from cobodeck.statistics import mean_bounds, proportion_bounds

RunFigures = Mapping[str, Any]


def _response(run: RunFigures) -> float | None:
    found: float | None = run["response_s"]["mean"]
    return found


def _escapes(run: RunFigures) -> float | None:
    return run["escapes"] / run["requests"] if run["requests"] else None


def _prop_error(run: RunFigures) -> float | None:
    largest = run["prop_error_m"]["max"]
    return None if largest is None else 1e3 * largest


def _pose_error(run: RunFigures) -> float | None:
    return None if run["localization"] is None else 1e3 * run["localization"]["rmse_m"]


MEASURES: Mapping[str, Callable[[RunFigures], float | None]] = {
    "response_s": _response,
    "escapes_per_request": _escapes,
    "least_gap_m": lambda run: run["min_gap_m"],
    "beside_share_3_4": lambda run: run["beside_share_3_4"],
    "travelled_m": lambda run: run["distance_m"] / run["sim_s"] * 60.0,
    "served": lambda run: float(run["served"]),
    "prop_error_mm": _prop_error,
    "pose_error_mm": _pose_error,
}
"""RunFigures of a run of which means are told; None: it has none."""
EVENTS: Mapping[str, Callable[[RunFigures], bool]] = {
    "touched_by_robot": lambda run: run["contacts_by_robot"] > 0,
    "touched": lambda run: run["contacts"] > 0,
    "stopped": lambda run: run["faults"] > 0,
    "stuck": lambda run: bool(run["stuck"]),
}
"""What runs are counted for, once each, because the events of one run are not independent."""


def compared(knob: SystemKnob, cells: Sequence[OneRun]) -> dict[str, Any]:
    """A row for each value: means, shares and costs, and mean differences from ours.

    Bounds are of 95 %: of means by bootstrap, of shares by Clopper and Pearson. Differences and
    ratios are of pairs of runs of the same world; without such pairs they are null.
    """
    groups = knob.grouped([cell for cell in cells if cell["figures"] is not None])
    ours = {_world(cell): cell for cell in groups[knob.ours]}
    return {
        "campaign": knob.campaign,
        "title": knob.title,
        "ours": knob.ours,
        "values": [{"value": name, **_row(group, ours)} for name, group in groups.items()],
    }


def _row(group: Sequence[OneRun], ours: Mapping[Any, OneRun]) -> dict[str, Any]:
    runs = [cell["figures"] for cell in group]
    pairs = [(cell, ours[_world(cell)]) for cell in group if _world(cell) in ours]
    ratios = [_cost(cell) / _cost(other) for cell, other in pairs]
    return {
        "runs": len(runs),
        "cpu_ms_per_s": statistics.median(map(_cost, group)),
        "cpu_ratio": statistics.median(ratios) if ratios else None,
        "means": {name: _mean([read(run) for run in runs]) for name, read in MEASURES.items()},
        "differences": {name: _mean(_changes(read, pairs)) for name, read in MEASURES.items()},
        "shares": {
            **{name: _share(sum(map(told, runs)), len(runs)) for name, told in EVENTS.items()},
            "escapes_failed": _of_all(runs, "escape_failures", "escapes"),
            "unserved": _unserved(group),
        },
        "least_gap_m": min(run["min_gap_m"] for run in runs if run["min_gap_m"] is not None),
        "impact_m_s": max((_closing(one) for run in runs for one in run["contact_list"]),
                          default=None),
    }  # fmt: skip


def _world(cell: OneRun) -> tuple[str, int]:
    return cell["key"]["scene"], cell["seed"]


def _cost(cell: OneRun) -> float:
    """CPU time per simulated second, ms."""
    return float(1e3 * cell["cpu_s"] / cell["figures"]["sim_s"])


def _changes(
    read: Callable[[RunFigures], float | None], pairs: Sequence[tuple[OneRun, OneRun]]
) -> list[float | None]:
    found = [(read(cell["figures"]), read(other["figures"])) for cell, other in pairs]
    return [None if None in (new, old) else new - old for new, old in found]  # type: ignore[operator]


def _mean(values: Sequence[float | None]) -> dict[str, float] | None:
    there = [value for value in values if value is not None]
    if not there:
        return None
    low, high = mean_bounds(there)
    return {"mean": statistics.fmean(there), "low": low, "high": high, "runs": len(there)}


def _share(hits: int, number: int) -> dict[str, float] | None:
    if not number:
        return None
    low, high = proportion_bounds(hits, number)
    return {"hits": hits, "of": number, "low": low, "high": high}


def _of_all(runs: Sequence[RunFigures], hits: str, number: str) -> dict[str, float] | None:
    return _share(sum(run[hits] for run in runs), sum(run[number] for run in runs))


def _unserved(group: Sequence[OneRun]) -> dict[str, float] | None:
    """Requests that were not served, or not even made before the time was over."""
    wanted = sum(cell["key"]["requests"] for cell in group)
    return _share(wanted - sum(cell["figures"]["served"] for cell in group), wanted)


def _closing(contact: Mapping[str, Any]) -> float:
    """The speed at which robot and person closed in when they touched, m/s."""
    return float(contact["robot_closing_m_s"] + contact["person_closing_m_s"])
