"""Statistics of nodes over any number of runs: visits, times, waits, outcomes, agreement.

A node's time is the time of the run from entry to exit, pauses included. Visits that were not over
at the end of their run count in the sum alone.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass

import numpy as np

from cobodeck.review.node_visits import RUNNING, NodeVisit, visits_of
from cobodeck.review.run_events import RunEvents

LOW, HIGH = 0.1, 0.9
"""The quantiles that are told beside the median."""


@dataclass(frozen=True, slots=True)
class TransitionStatistics:
    """How often an outcome led to `to`, "" if it ended the container or was kept.

    `total_s` and `median_s` are of the visits that ended so.
    """

    outcome: str
    to: str
    count: int
    total_s: float
    median_s: float


@dataclass(frozen=True, slots=True)
class StateStatistics:
    """What is known of one node, or of all nodes that name the same; times in s.

    Attributes:
        chart: that was run, "" where nodes of several are taken together.
        path: of the node, "" where nodes are taken together, and for the chart itself.
        named: the state or the chart that it names.
        median_s: of the visits that were over; `low_s`, `high_s`: their 10 % and 90 % quantiles.
            None if none was.
        waits: how often an outcome waited for consent, `waited_s` altogether.
        agreed, differed: how often the operator's answer, or the outcome forced on a node that
            waited, was what the node wanted, and how often not.
        forced: how often a node was forced to end that did not want to.
    """

    chart: str
    path: str
    named: str
    visits: int
    total_s: float
    median_s: float | None
    low_s: float | None
    high_s: float | None
    waits: int
    waited_s: float
    agreed: int
    differed: int
    forced: int
    outcomes: dict[str, int]
    transitions: tuple[TransitionStatistics, ...]

    def as_json(self) -> dict[str, object]:
        """For programs."""
        return asdict(self)


@dataclass(frozen=True, slots=True)
class RunsReviewed:
    """Statistics of some runs: by chart and path, in the order of entry, and by what is named.

    `operated`: in all of them the operator's answers are known. `broken` names the records that end
    before their runs.
    """

    runs: int
    states: tuple[StateStatistics, ...]
    classes: tuple[StateStatistics, ...]
    operated: bool
    broken: tuple[str, ...] = ()


def review(runs: Iterable[RunEvents]) -> RunsReviewed:
    """The statistics of some runs."""
    by_path: dict[tuple[str, str], list[NodeVisit]] = {}
    by_name: dict[str, list[NodeVisit]] = {}
    broken: list[str] = []
    count, operated = 0, True
    for run in runs:
        count += 1
        operated = operated and run.operated
        if run.broken is not None:
            broken.append(f"{run.file}: {run.broken}")
        for visit in visits_of(run):
            by_path.setdefault((run.chart, visit.path), []).append(visit)
            if visit.named:
                by_name.setdefault(visit.named, []).append(visit)
    states = (_of(found, chart, path, found[-1].named) for (chart, path), found in by_path.items())
    classes = (_of(by_name[name], "", "", name) for name in sorted(by_name))
    return RunsReviewed(count, tuple(states), tuple(classes), operated, tuple(broken))


def _of(visits: Sequence[NodeVisit], chart: str, path: str, named: str) -> StateStatistics:
    over = [visit.lasted_s for visit in visits if visit.ended != RUNNING]
    low, median, high = _quantiles(over) if over else (None, None, None)
    return StateStatistics(
        chart=chart,
        path=path,
        named=named,
        visits=len(visits),
        total_s=sum(visit.lasted_s for visit in visits),
        median_s=median,
        low_s=low,
        high_s=high,
        waits=sum(bool(visit.asked) for visit in visits),
        waited_s=sum(visit.waited_ns for visit in visits) / 1e9,
        agreed=sum(visit.agreed is True for visit in visits),
        differed=sum(visit.agreed is False for visit in visits),
        forced=sum(visit.forced for visit in visits),
        outcomes=dict(Counter(visit.ended for visit in visits).most_common()),
        transitions=tuple(_transitions(visits)),
    )


def _transitions(visits: Iterable[NodeVisit]) -> Iterable[TransitionStatistics]:
    groups: dict[tuple[str, str], list[float]] = {}
    for visit in visits:
        if not visit.ended.startswith("("):
            groups.setdefault((visit.ended, visit.led), []).append(visit.lasted_s)
    for (outcome, to), times in sorted(groups.items(), key=lambda item: -len(item[1])):
        yield TransitionStatistics(outcome, to, len(times), sum(times), _quantiles(times)[1])


def _quantiles(values: Sequence[float]) -> list[float]:
    found: list[float] = np.quantile(values, (LOW, 0.5, HIGH)).tolist()
    return found
