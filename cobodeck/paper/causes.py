"""Measured causes, in words: what the varied keys, the arm alone and the parking places give."""

from __future__ import annotations

import math
import statistics
from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise
from typing import Any

from cobodeck.paper.conditions import CONDITIONS, SCENE, SEQUENCE
from cobodeck.paper.published import ARM, REQUESTS, TABLE_2, TO_SAFETY
from cobodeck.paper.tables import two_places
from hw.scene import load_scene

Result = Mapping[str, Any]
Row = Mapping[str, Any]
MOST = 3
"""Varied values that are told with a claim; the table of the report has all."""
AWAY = 0.1
"""Who asks farther than this from all seven poses asks elsewhere, m."""
ZONE = 2.5
"""Distance at which a robot ahead of a walking person raises Escape, m (R104)."""


def response_cause(result: Result, name: str) -> str:
    """Which part of a condition's response differs, and with which values it would not."""
    run, printed = result["conditions"][name], TABLE_2[name].mean_s
    if run["arm_s"]["mean"] is None:
        return f"{run['served']} of {run['requests']} requests were served"
    base = run["response_s"]["mean"] - run["arm_s"]["mean"]
    told = f"without the arm the base takes {base:.2f} s, the paper's {printed - ARM.mean:.2f} s"
    rows = _answered(result, name)
    own = next((_mean(row, name) for row in rows if not row["sets"]), run["response_s"]["mean"])
    single = [row for row in rows if len(row["sets"]) == 1]
    largest = sorted(single, key=lambda row: abs(_mean(row, name) - own))[: -MOST - 1 : -1]
    if largest:
        told += f"; most depends on {_listed(largest, lambda row: f'{_mean(row, name):.2f} s')}"
    nearest = min(rows, key=lambda row: abs(_mean(row, name) - printed), default=None)
    if nearest is not None:
        told += f"; nearest: {_sets(nearest)} ({_mean(nearest, name):.2f} s)"
    return told


def gap_cause(result: Result) -> str:
    """Gaps to Chase with the values that come nearest to all three responses, and the ways."""
    nearest = nearest_row(result)
    if nearest is None:
        return _ways(result)
    gaps = [_mean(nearest, name) - _mean(nearest, "chase") for name in CONDITIONS[1:]]
    shown = ", ".join(f"{gap:.2f} s" for gap in gaps)
    return f"{_ways(result)}; with {_sets(nearest)} the gaps are {shown}"


def spread_cause(result: Result) -> str:
    """SDs with the values that come nearest to all three responses."""
    nearest = nearest_row(result)
    if nearest is None:
        return _ways(result)
    spreads = (nearest["conditions"][name]["response_s"]["sd"] or 0.0 for name in CONDITIONS)
    shown = ", ".join(f"{spread:.2f} s" for spread in spreads)
    return f"{_ways(result)}; with {_sets(nearest)} the SDs are {shown}"


def nearest_row(result: Result) -> Row | None:
    """The varied values whose three responses are nearest to the paper's; None without any."""

    def miss(row: Row) -> float:
        return sum(abs(_mean(row, name) - TABLE_2[name].mean_s) for name in CONDITIONS)

    return min(_answered(result, *CONDITIONS), key=miss, default=None)


def arm_cause(result: Result) -> str:
    """What the arm's time and its spread depend on."""
    alone = {(row["solver"], row["offset_m"]): row for row in result["arm_times"]}
    told = (
        f"{solver} with the base within {100 * offset:.0f} cm of its pose: "
        f"{row['min']:.2f} to {row['max']:.2f} s"
        for (solver, offset), row in alone.items()
        if row["mean"] is not None
    )
    slower = [row for row in result["causes"] if _varies(row, "robot.arm_acceleration")]
    means = _listed(
        slower[:1], lambda row: f"mean {two_places(row['conditions']['chase']['arm_s']['mean'])} s"
    )
    also = f"; {means}" if means else ""
    return (
        f"equal poses have equal motions; planned alone, {', '.join(told)}{also}; planning itself "
        "takes no simulated time"
    )


def energy_cause(result: Result) -> str:
    """What the energies consist of."""
    shown = []
    for name in CONDITIONS:
        run = result["conditions"][name]
        shown.append(f"{name} {run['energy_j'] / run['distance_m']:.0f} J/m")
    return f"{_ways(result)}; {', '.join(shown)}"


def served_cause(result: Result) -> str:
    """Why requests were not served, and how many were asked elsewhere than at the seven poses."""
    poses = [asked["user"] for asked in result["conditions"]["chase"]["request_list"][:SEQUENCE]]
    shown = []
    for name in CONDITIONS:
        run = result["conditions"][name]
        if run["served"] == run["requests"]:
            continue
        refusals = ", ".join(f"{why}: {number}" for why, number in run["refusals"].items())
        users = [asked["user"] for asked in run["request_list"] if asked["user"] is not None]
        away = sum(min(math.dist(user[:2], pose[:2]) for pose in poses) > AWAY for user in users)
        shown.append(
            f"{name}: {refusals}; {away} of {run['requests']} were asked elsewhere than at the "
            f"seven poses, by a person who had been shown the robot ({run['informs']} Informs)"
        )
    return "; ".join(shown)


def parking_cause(result: Result) -> str:
    """How near the person's ways pass the parking places."""
    shown = []
    for name in CONDITIONS[1:]:
        place = load_scene(SCENE).places[name]
        users = [asked["user"] for asked in result["conditions"]["chase"]["request_list"]]
        ways = [_distance(a, b, (place.x, place.y)) for a, b in pairwise(users[: SEQUENCE + 1])]
        near = sum(way < ZONE for way in ways)
        if ways:
            shown.append(
                f"{near} of {len(ways)} ways of the person pass the place {name} within "
                f"{ZONE} m, the nearest within {min(ways):.2f} m"
            )
    return "; ".join(shown)


def safety_cause(result: Result) -> str:
    """Which values bring the mean time of Escapes nearest to the paper's."""
    rows = [row for row in result["causes"] if _times(row)]
    rows.sort(key=lambda row: abs(max(_times(row)) - TO_SAFETY.mean))
    told = _listed(rows[:MOST], lambda row: ", ".join(f"{time:.2f} s" for time in _times(row)))
    with_values = f"; mean times with {told}" if rows else ""
    return f"an Escape ends as soon as it is safe, on its way{with_values}"


def failure_cause(result: Result) -> str:
    """How the Escapes that were not safe ended."""
    shown = []
    for name in CONDITIONS:
        run = result["conditions"][name]
        ends = [escape["outcome"] for escape in run["escape_list"]]
        counts = {end: ends.count(end) for end in dict.fromkeys(ends) if end != "safe"}
        told = ", ".join(f"{end or 'left'} {number}" for end, number in counts.items())
        if told:
            shown.append(f"{name}: {told}, contacts {run['contacts']}")
    return "; ".join(shown)


def contact_cause(result: Result) -> str:
    """How fast robot and person closed in on each other, by who touched whom."""
    shown = []
    for name in CONDITIONS:
        met = result["conditions"][name]["contact_list"]
        for by in dict.fromkeys(contact["by"] for contact in met):
            own = [contact for contact in met if contact["by"] == by]
            robot, person = (
                statistics.fmean(contact[f"{who}_closing_m_s"] for contact in own)
                for who in ("robot", "person")
            )
            shown.append(
                f"{name}: {len(own)} by the {by}, mean closing speed of the robot {robot:.2f} m/s, "
                f"of the person {person:.2f} m/s"
            )
    return "; ".join(shown)


def _ways(result: Result) -> str:
    runs = result["conditions"]
    shown = (f"{runs[name]['distance_m'] / runs[name]['requests']:.1f}" for name in CONDITIONS)
    theirs = (f"{TABLE_2[name].distance_m / REQUESTS:.1f}" for name in CONDITIONS)
    return f"ways of {', '.join(shown)} m per request, the paper's {', '.join(theirs)} m"


def _times(row: Row) -> list[float]:
    means = (row["conditions"][name]["escape_time_s"]["mean"] for name in CONDITIONS)
    return [mean for mean in means if mean is not None]


def _answered(result: Result, *names: str) -> list[Row]:
    """The varied values with which requests were served in all of these conditions."""
    return [
        row
        for row in result["causes"]
        if all(row["conditions"][name]["response_s"]["mean"] is not None for name in names)
    ]


def _mean(row: Row, name: str) -> float:
    mean: float = row["conditions"][name]["response_s"]["mean"]
    return mean


def _sets(row: Row) -> str:
    return ", ".join(row["sets"]) or "the profile itself"


def _listed(rows: Sequence[Row], of: Callable[[Row], str]) -> str:
    return ", ".join(f"{_sets(row)} ({of(row)})" for row in rows)


def _varies(row: Row, key: str) -> bool:
    return any(text.startswith(f"{key}=") for text in row["sets"])


def _distance(start: Sequence[float], end: Sequence[float], place: tuple[float, float]) -> float:
    """Distance of a place from a segment, m."""
    dx, dy = end[0] - start[0], end[1] - start[1]
    along = (place[0] - start[0]) * dx + (place[1] - start[1]) * dy
    share = min(1.0, max(0.0, along / (dx * dx + dy * dy or 1.0)))
    return math.dist(place, (start[0] + share * dx, start[1] + share * dy))
