"""Measured causes, in words: what the varied keys, the arm alone and other parts give."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from cobodeck.paper.conditions import CONDITIONS
from cobodeck.paper.published import ARM, TABLE_2

Result = Mapping[str, Any]


def response_causes(result: Result) -> str:
    """Which part of the response differs, and with which values it would not."""
    arms = {name: result["conditions"][name]["arm_s"]["mean"] for name in CONDITIONS}
    parts = [
        f"{result['conditions'][name]['response_s']['mean'] - arms[name]:.2f}"
        for name in CONDITIONS
        if arms[name] is not None
    ]
    theirs = [f"{TABLE_2[name].mean_s - ARM.mean:.2f}" for name in CONDITIONS]
    rows = [row for row in result["causes"] if _responses(row) != _responses(result["causes"][0])]
    largest = sorted(rows, key=_of_chase, reverse=True)[:4]
    nearest = min(result["causes"], key=_miss)
    return (
        f"without the arm the base takes {', '.join(parts)} s, the paper's {', '.join(theirs)} s; "
        f"{_told('slower', largest, _responses)}; "
        f"nearest to all three: {_told('', [nearest], _responses)}"
    )


def escape_causes(result: Result) -> str:
    """What the number of Escapes and their times depend on."""
    rows = [row for row in result["causes"] if _escapes(row) != _escapes(result["causes"][0])]
    first = _told("", result["causes"][:1], _escapes)
    return f"Escapes in seven requests and their mean times: {first}; {_told('', rows, _escapes)}"


def arm_causes(result: Result) -> str:
    """What the arm's time and its spread depend on."""
    rows = (
        f"{row['solver']}, base within {100 * row['offset_m']:.0f} cm: "
        f"{row['min']:.2f} to {row['max']:.2f} s, SD {row['sd']:.2f} s"
        for row in result["arm_times"]
        if row["sd"] is not None
    )
    slower = [row for row in result["causes"] if _varies(row, "robot.arm_acceleration")]
    means = (f"{', '.join(row['sets'])}: mean {_arm(row)}" for row in slower)
    return (
        "the base stands at the same pose before the DEEP, so the motion is the same; planned "
        f"alone {'; '.join(rows)}; in the conditions {'; '.join(means)}; the time that planning "
        "takes is no part of simulated time"
    )


def energy_causes(result: Result) -> str:
    """What the ways and energies consist of."""
    shown = []
    for name in CONDITIONS:
        run = result["conditions"][name]
        energy, way = run["energy_j"] / run["distance_m"], run["distance_m"] / run["requests"]
        shown.append(f"{name} {way:.1f} m per request at {energy:.0f} J/m")
    return "; ".join(shown)


def served_causes(result: Result) -> str:
    """What the requests of each condition met."""
    shown = []
    for name in CONDITIONS:
        run = result["conditions"][name]
        refused = ", ".join(f"{why} {number}" for why, number in run["refusals"].items())
        shown.append(
            f"{name}: {run['distance_m'] / run['requests']:.1f} m per request, {run['escapes']} "
            f"Escapes, {run['informs']} Informs, not served: {refused or 'none'}"
        )
    return "; ".join(shown)


def _responses(row: Mapping[str, Any]) -> str:
    means = (row["conditions"][name]["response_s"]["mean"] for name in CONDITIONS)
    return ", ".join("-" if mean is None else f"{mean:.2f}" for mean in means) + " s"


def _escapes(row: Mapping[str, Any]) -> str:
    shown = []
    for name in CONDITIONS:
        run = row["conditions"][name]
        time = run["escape_time_s"]["mean"]
        shown.append(f"{run['escapes']}" + ("" if time is None else f" ({time:.2f} s)"))
    return ", ".join(shown)


def _arm(row: Mapping[str, Any]) -> str:
    means = (row["conditions"][name]["arm_s"]["mean"] for name in CONDITIONS)
    return ", ".join("-" if mean is None else f"{mean:.2f}" for mean in means) + " s"


def _of_chase(row: Mapping[str, Any]) -> float:
    mean: float | None = row["conditions"]["chase"]["response_s"]["mean"]
    return mean or 0.0


def _miss(row: Mapping[str, Any]) -> float:
    """Sum over the conditions of how far the response is from the paper's, s."""
    means = (row["conditions"][name]["response_s"]["mean"] or 0.0 for name in CONDITIONS)
    printed = (TABLE_2[name].mean_s for name in CONDITIONS)
    return float(sum(abs(a - b) for a, b in zip(means, printed, strict=True)))


def _varies(row: Mapping[str, Any], key: str) -> bool:
    return any(text.startswith(f"{key}=") for text in row["sets"])


def _told(head: str, rows: Iterable[Mapping[str, Any]], of: Any) -> str:
    shown = (f"{', '.join(row['sets']) or 'the profile itself'}: {of(row)}" for row in rows)
    return (f"{head}: " if head else "") + "; ".join(shown)
