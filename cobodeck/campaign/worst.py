"""Which cells of a campaign are worth looking at."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from cobodeck.campaign.cell_run import CellResult

Figures = Mapping[str, Any]
BADNESS: Mapping[str, Callable[[Figures], float | None]] = {
    "contacts_by_robot": lambda run: run.get("contacts_by_robot") or None,
    "escape_failures": lambda run: run.get("escape_failures") or None,
    "unserved": lambda run: run.get("refused") or None,
    "response_s": lambda run: (run.get("response_s") or {}).get("max"),
    "least_gap_m": lambda run: None if run.get("min_gap_m") is None else -run["min_gap_m"],
}
"""In which respects a run can be bad, and how bad it is; None: not at all."""


def worst_cells(results: Sequence[CellResult], count: int) -> list[tuple[str, CellResult]]:
    """The worst cells, each with the respect in which it is: of each respect in turn the next."""
    ranked = {name: _ranked(results, badness) for name, badness in BADNESS.items()}
    found: dict[int, tuple[str, CellResult]] = {}
    for place in range(len(results)):
        for name, order in ranked.items():
            if len(found) == count:
                return list(found.values())
            if place < len(order):
                found.setdefault(order[place], (name, results[order[place]]))
    return list(found.values())


def _ranked(results: Sequence[CellResult], badness: Callable[[Figures], float | None]) -> list[int]:
    """The numbers of the results that are bad, the worst first; of equals, the first first."""
    told = {n: badness(r.figures) for n, r in enumerate(results) if r.figures is not None}
    bad = {n: value for n, value in told.items() if value is not None}
    return sorted(bad, key=lambda n: -bad[n])
