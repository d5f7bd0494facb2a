"""Statistics of states as tables for people."""

from __future__ import annotations

from collections.abc import Iterable

from cobodeck.review.state_statistics import RunsReviewed, StateStatistics
from cobodeck.terminal import table

ROOT_NAME = "(the chart)"
MOST_OUTCOMES = 4
"""So many outcomes are told of a node; JSON has all."""
HEAD = ("visits", "sum", "median", "10 to 90 %", "waits", "agreed", "outcomes")
RIGHT = frozenset({2, 3, 4})


def statistics_text(found: RunsReviewed) -> str:
    """Both tables: by the node's path in its chart, and by the state or chart that it names."""
    parts = []
    for chart in dict.fromkeys(one.chart for one in found.states):
        states = (one for one in found.states if one.chart == chart)
        rows = [(one.path or ROOT_NAME, one.named, *_figures(one)) for one in states]
        parts.append(table([(chart, "", *HEAD), *rows], RIGHT))
    if found.classes:
        rows = [(one.named, "", *_figures(one)) for one in found.classes]
        parts.append(table([("state or chart", "", *HEAD), *rows], RIGHT))
    if not found.operated:
        parts.append("trace files tell neither classes nor the operator's answers")
    parts += found.broken
    return "\n\n".join(parts)


def _figures(one: StateStatistics) -> Iterable[str]:
    yield str(one.visits)
    yield f"{one.total_s:.1f} s"
    yield "" if one.median_s is None else f"{one.median_s:.2f} s"
    yield "" if one.low_s is None else f"{one.low_s:.2f} to {one.high_s:.2f} s"
    yield f"{one.waits}, {one.waited_s:.1f} s" if one.waits else ""
    answers = one.agreed + one.differed
    forced = f"{one.forced} forced" if one.forced else ""
    yield ", ".join(filter(None, (f"{one.agreed} of {answers}" if answers else "", forced)))
    shown = [f"{name} {count}" for name, count in one.outcomes.items()]
    left = len(shown) - MOST_OUTCOMES
    yield ", ".join([*shown[:MOST_OUTCOMES], *([f"{left} more"] if left > 0 else [])])
