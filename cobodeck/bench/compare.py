"""What got slower or less exact since an earlier result, knob value by knob value.

Thresholds are from measuring the same code twice, see DECISIONS.md of `cobodeck`.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any

SLOWER, SPREADS = 1.6, 3.0
"""A ratio is worse if it has grown by more than this factor, and by more than so many times the
larger of both interquartile ranges."""
LESS_EXACT, ROUNDING = 1.05, 1e-9
"""An error is worse if it has grown by more than this factor, and is not mere rounding."""
MORE_CALLS = 1.02
"""Calls per tick, which are exact, are worse if they have grown by more than this factor."""
_KEYS = ("bench", "name", "variant", "knob", "value")

Row = Mapping[str, Any]


def common(rows: Iterable[Row], before: Iterable[Row]) -> list[tuple[Row, Row]]:
    """Each row of ours that was measured before, with what it was then."""
    known = {_key(row): row for row in before}
    ours = (row for row in rows if not row.get("peer"))
    return [(row, known[_key(row)]) for row in ours if _key(row) in known]


def worse(rows: Iterable[Row], before: Iterable[Row]) -> Iterator[str]:
    """A line per figure of ours that is worse than before, or an error no longer known."""
    for row, old in common(rows, before):
        for figure, is_worse in _FIGURES.items():
            now, then = row.get(figure), old.get(figure)
            if then is None:
                continue
            if now is not None and is_worse(row, old):
                yield f"worse: {_told(row)}: {figure} {now:.3g}, was {then:.3g}"
            if now is None and figure == "error":
                yield f"lost: {_told(row)}: error, was {then:.3g}"


def _slower(row: Row, old: Row) -> bool:
    spread = max(row.get("spread") or 0.0, old.get("spread") or 0.0)
    if row.get("more_is_better"):
        limit = min(old["ratio"] / SLOWER, old["ratio"] - SPREADS * spread)
        return bool(row["ratio"] < limit and row["ratio_to"] == old["ratio_to"])
    limit = max(SLOWER * old["ratio"], old["ratio"] + SPREADS * spread)
    return bool(row["ratio"] > limit and row["ratio_to"] == old["ratio_to"])


def _less_exact(row: Row, old: Row) -> bool:
    if row.get("more_is_better"):
        lost = old["error"] - row["error"]
        return bool(lost > max((LESS_EXACT - 1.0) * abs(old["error"]), ROUNDING))
    return bool(row["error"] > max(LESS_EXACT * old["error"], ROUNDING))


def _more_calls(row: Row, old: Row) -> bool:
    return bool(row["calls_per_tick"] > MORE_CALLS * old["calls_per_tick"])


_FIGURES = {"ratio": _slower, "error": _less_exact, "calls_per_tick": _more_calls}


def _key(row: Row) -> tuple[Any, ...]:
    return tuple(row[key] for key in _KEYS)


def _told(row: Row) -> str:
    what = f"{row['bench']} {row['name']}"
    what += "" if row["variant"] == "cobodeck" else f" {row['variant']}"
    return what if row["knob"] is None else f"{what}, {row['knob']} {row['value']:.6g}"
