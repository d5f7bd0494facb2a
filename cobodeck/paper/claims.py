"""Every claim of section 5, whether it holds here, and where it does not, its measured cause.

A claim that does not hold is an answer. The bounds of what counts as holding are readings where
the paper says "comparable" or "around"; they stand with the claims.
"""

from __future__ import annotations

import statistics
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from cobodeck.paper.causes import (
    arm_cause,
    contact_cause,
    energy_cause,
    failure_cause,
    gap_cause,
    parking_cause,
    response_cause,
    safety_cause,
    served_cause,
    spread_cause,
)
from cobodeck.paper.conditions import CONDITIONS
from cobodeck.paper.published import ARM, EFFECTS, KRUSKAL_WALLIS_H, P_VALUES, TABLE_2, TO_SAFETY
from cobodeck.paper.tables import two_places

Result = Mapping[str, Any]
GAP_S = 2.0
"""Chase is faster by more than this, s."""
LIKE = 0.1
"""Times within this share of the paper's count as the same."""
SAFETY_LIKE = 0.2
"""The same for the mean time to safety."""
COMPARABLE = 0.15
"""Energies within this share of the mean of the others are comparable."""
AROUND = 0.02
"""Areas within this share are around the paper's."""
SURE, UNSURE = 0.001, 0.05
"""Levels below which conditions differ, and above which they do not."""


@dataclass(frozen=True, slots=True)
class Claim:
    """A claim, what the paper prints, what was found here; `holds` None: it could not be judged."""

    claim: str
    paper: str
    ours: str
    holds: bool | None
    cause: str | None = None


def claims(result: Result) -> list[dict[str, Any]]:
    """All claims, judged on the figures of a result, in the paper's order."""
    judged = [claim for judge in JUDGES for claim in judge(result)]
    return [asdict(claim) for claim in judged]


def _spaces(result: Result) -> list[Claim]:
    found = []
    for row in result["rooms"]:
        printed, ours = row["paper_usable_m2"], row["usable_m2"]
        claim = f"Floor left for the robot, inflation 1 m: {row['room']}"
        close = abs(ours - printed) <= AROUND * printed
        free = row["free_m2"]
        cause = None if close else f"{free:.1f} m2 are free before the inflation"
        shown = f"{ours:.1f} m2 ({ours / free:.0%})"
        found.append(Claim(claim, f"around {printed:g} m2", shown, close, cause))
    return found


def _responses(result: Result) -> list[Claim]:
    found = []
    for name in CONDITIONS:
        printed, ours = TABLE_2[name], result["conditions"][name]["response_s"]
        close = _is_like(ours["mean"], printed.mean_s)
        claim = f"Mean response in {name.title()}, within a tenth"
        paper = f"{printed.mean_s:.2f} s (SD {printed.sd_s:.2f})"
        shown = f"{two_places(ours['mean'])} s (SD {two_places(ours['sd'])})"
        cause = None if close else response_cause(result, name)
        found.append(Claim(claim, paper, shown, close, cause))
    return found


def _gaps(result: Result) -> list[Claim]:
    means = {name: result["conditions"][name]["response_s"]["mean"] for name in CONDITIONS}
    spreads = {name: result["conditions"][name]["response_s"]["sd"] for name in CONDITIONS}
    if None in means.values() or None in spreads.values():
        return [Claim("Chase is faster by more than 2 s", "2.54 s, 2.75 s", "-", None)]
    gaps = [means[name] - means["chase"] for name in CONDITIONS[1:]]
    faster, later = min(gaps) > GAP_S, means["center"] > means["corner"]
    steady = all(spreads["chase"] < spreads[name] for name in CONDITIONS[1:])
    return [
        Claim(
            "Chase is faster by more than 2 s than Corner and than Center",
            "2.54 s, 2.75 s",
            ", ".join(f"{gap:.2f} s" for gap in gaps),
            faster,
            None if faster else gap_cause(result),
        ),
        Claim(
            "Responses vary least in Chase (though the paper's SD of Corner is smaller)",
            "SD 1.27 s, 1.07 s, 2.92 s",
            "SD " + ", ".join(f"{spreads[name]:.2f} s" for name in CONDITIONS),
            steady,
            None if steady else spread_cause(result),
        ),
        Claim(
            "Center is slightly slower than Corner",
            "0.21 s",
            f"{means['center'] - means['corner']:.2f} s",
            later,
            None if later else gap_cause(result),
        ),
    ]


def _tests(result: Result) -> list[Claim]:
    study = result["statistics"]["study"]
    test = study["kruskal_wallis"]
    if test is None:
        return [
            Claim(
                "The condition affects the response (Kruskal-Wallis)",
                f"H = {KRUSKAL_WALLIS_H}",
                "-",
                None,
            )
        ]
    found = [
        Claim(
            "The condition affects the response (Kruskal-Wallis)",
            f"H(2) = {KRUSKAL_WALLIS_H}, p < 0.001",
            f"H({test['df']}) = {test['h']:.2f}, p = {test['p']:.2g}",
            test["p"] < SURE,
            None if test["p"] < SURE else _sequences(result),
        )
    ]
    for name, pair in study["jonckheere_terpstra"].items():
        differs = P_VALUES[name].startswith("<")
        either = min(1.0, 2.0 * min(pair["p"], 1.0 - pair["p"]))  # the order may be the other one
        p, sides = (pair["p_holm"], "Holm") if differs else (either, "both sides, unadjusted")
        holds = p < SURE if differs else p > UNSURE
        words = "differ" if differs else "do not differ"
        paper = f"r = {EFFECTS[name]:.2f}, p {P_VALUES[name]}"
        ours = f"r = {pair['r']:.2f}, z = {pair['z']:.2f}, p = {p:.2g}"
        ours += ", in the other order" if pair["z"] < 0.0 else ""
        pair_of = " and ".join(part.title() for part in name.split(" < "))
        claim = f"{pair_of} {words} (Jonckheere-Terpstra, {sides})"
        found.append(Claim(claim, paper, ours, holds, None if holds else _sequences(result)))
    return found


def _ways(result: Result) -> list[Claim]:
    runs = result["conditions"]
    ways = {name: runs[name]["distance_m"] / runs[name]["requests"] for name in CONDITIONS}
    energies = {name: runs[name]["energy_j"] / runs[name]["requests"] for name in CONDITIONS}
    least = ways["chase"] < min(ways["corner"], ways["center"])
    others = 0.5 * (energies["corner"] + energies["center"])
    alike = energies["chase"] <= (1.0 + COMPARABLE) * others
    cause = energy_cause(result)
    return [
        Claim(
            "Chase drives the least way",
            ", ".join(f"{TABLE_2[name].distance_m / 100:.1f} m" for name in CONDITIONS),
            ", ".join(f"{ways[name]:.1f} m" for name in CONDITIONS) + " per request",
            least,
            None if least else cause,
        ),
        Claim(
            "Chase takes comparable energy (at most 15 % more than the mean of the others)",
            "suggested by the way",
            ", ".join(f"{energies[name] / 1e3:.2f} kJ" for name in CONDITIONS) + " per request",
            alike,
            None if alike else cause,
        ),
    ]


def _arm(result: Result) -> list[Claim]:
    times = [
        request["arm_s"]
        for name in CONDITIONS
        for request in result["conditions"][name]["request_list"]
        if request["arm_s"] is not None
    ]
    if len(times) < 2:
        return [Claim("The arm takes 3.20 to 5.30 s", "mean 3.70 s", "-", None)]
    mean, sd = statistics.fmean(times), statistics.stdev(times)
    cause = arm_cause(result)
    inside = ARM.least <= mean <= ARM.most
    spread = 0.5 * ARM.sd <= sd <= 2.0 * ARM.sd
    ours = (
        f"{min(times):.2f} to {max(times):.2f} s, mean {mean:.2f} s, SD {sd:.2f} s, n {len(times)}"
    )
    paper = f"{ARM.least:.2f} to {ARM.most:.2f} s, mean {ARM.mean:.2f} s, SD {ARM.sd:.2f} s"
    return [
        Claim("The arm's mean time is in the paper's range", paper, ours, inside,
              None if inside else cause),
        Claim("The arm's times vary as much, SD within a factor of 2", f"SD {ARM.sd:.2f} s",
              f"SD {sd:.2f} s", spread, None if spread else cause),
    ]  # fmt: skip


def _served(result: Result) -> list[Claim]:
    runs = [result["conditions"][name] for name in CONDITIONS]
    served, asked = sum(run["served"] for run in runs), sum(run["requests"] for run in runs)
    holds = served == asked
    cause = None if holds else served_cause(result)
    return [Claim("Every request is served", "300 of 300", f"{served} of {asked}", holds, cause)]


def _escapes(result: Result) -> list[Claim]:
    runs = result["conditions"]
    share = {name: 100.0 * runs[name]["escapes"] / runs[name]["requests"] for name in CONDITIONS}
    most = share["chase"] > max(share["corner"], share["center"])
    ends = [escape["outcome"] for name in CONDITIONS for escape in runs[name]["escape_list"]]
    unsafe = len(ends) - ends.count("safe")
    return [
        Claim(
            "Escapes are most frequent in Chase",
            ", ".join(str(TABLE_2[name].escapes) for name in CONDITIONS) + " in 100",
            ", ".join(f"{share[name]:.0f}" for name in CONDITIONS) + " in 100",
            most,
            None if most else parking_cause(result),
        ),
        Claim(
            "No Escape fails",
            "0 of 51",
            f"{unsafe} of {len(ends)} did not end safe",
            unsafe == 0 if ends else None,
            failure_cause(result) if unsafe else None,
        ),
        _time_to_safety(result),
    ]


def _contacts(result: Result) -> list[Claim]:
    runs, routes = result["conditions"], result["statistics"]["routes"]["conditions"]
    holds = not any(runs[name]["contacts"] for name in CONDITIONS)
    on_study, on_routes = contact_counts(runs), contact_counts(routes)
    return [
        Claim(
            "No contact with the person on the walk of the study",
            "no Escape failed in 300",
            f"{on_study}; on random routes {on_routes}",
            holds,
            None if holds else contact_cause(result),
        )
    ]


def contact_counts(runs: Mapping[str, Mapping[str, Any]]) -> str:
    """Contacts of the three conditions, how many of them by the robot, and requests."""
    names = ("contacts", "contacts_by_robot", "requests")
    touched, by_robot, asked = (sum(runs[name][key] for name in CONDITIONS) for key in names)
    return f"{touched} ({by_robot} by the robot) in {asked}"


def _time_to_safety(result: Result) -> Claim:
    paper = f"{TO_SAFETY.least:.2f} to {TO_SAFETY.most:.2f} s, mean {TO_SAFETY.mean:.2f} s"
    claim, times = "Time to safety, mean within a fifth", safe_times(result)
    if not times:
        return Claim(claim, paper, "no Escape ended safe", None)
    close = abs(statistics.fmean(times) - TO_SAFETY.mean) <= SAFETY_LIKE * TO_SAFETY.mean
    return Claim(claim, paper, _range(times), close, None if close else safety_cause(result))


JUDGES: tuple[Callable[[Result], list[Claim]], ...] = (
    _spaces,
    _responses,
    _gaps,
    _tests,
    _ways,
    _arm,
    _served,
    _escapes,
    _contacts,
)


def safe_times(result: Result) -> list[float]:
    """Times of all Escapes that ended safe, s."""
    return [
        escape["time_s"]
        for name in CONDITIONS
        for escape in result["conditions"][name]["escape_list"]
        if escape["outcome"] == "safe"
    ]


def _sequences(result: Result) -> str:
    sums = result["statistics"]["study"]["sums_s"]
    shown = (f"{name} {min(group):.1f} to {max(group):.1f} s" for name, group in sums.items())
    return "sums of seven: " + ", ".join(shown)


def _range(times: Sequence[float]) -> str:
    mean = statistics.fmean(times)
    return f"{min(times):.2f} to {max(times):.2f} s, mean {mean:.2f} s of {len(times)}"


def _is_like(ours: float | None, printed: float) -> bool | None:
    return None if ours is None else abs(ours - printed) <= LIKE * printed
