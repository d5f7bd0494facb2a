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


def worse(rows: Iterable[Row], before: Iterable[Row]) -> Iterator[str]:
    """A line per figure of ours that is worse than before."""
    known = {_key(row): row for row in before}
    for row in rows:
        old = known.get(_key(row))
        if old is None or row.get("peer"):
            continue
        for figure, is_worse in _FIGURES.items():
            now, then = row.get(figure), old.get(figure)
            if now is not None and then is not None and is_worse(row, old):
                yield f"worse: {_told(row)}: {figure} {now:.3g}, was {then:.3g}"


def _slower(row: Row, old: Row) -> bool:
    spread = max(row.get("spread") or 0.0, old.get("spread") or 0.0)
    limit = max(SLOWER * old["ratio"], old["ratio"] + SPREADS * spread)
    return bool(row["ratio"] > limit and row["ratio_to"] == old["ratio_to"])


def _less_exact(row: Row, old: Row) -> bool:
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
