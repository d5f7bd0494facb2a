"""The results as tables of text, for the terminal and for the report."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

from cobodeck.paper.conditions import CONDITIONS
from cobodeck.paper.published import ARM, REQUESTS, TABLE_2

Result = Mapping[str, Any]
Row = tuple[str, ...]
JUDGED = {True: "yes", False: "NO", None: "not judged"}


class ResultTable(NamedTuple):
    """A table with a title, column heads, rows, and a note below it."""

    title: str
    head: Row
    rows: Sequence[Row]
    note: str = ""


def tables(result: Result) -> list[ResultTable]:
    """All tables of a result, in the paper's order."""
    found = [
        table_2(result),
        claim_table(result),
        _statistics(result),
        route_table(result),
        _rooms(result),
        _arm(result),
    ]
    return [*found, *_causes(result), *_parts(result)]


def table_2(result: Result) -> ResultTable:
    """Table 2 with the paper's figures beside ours, and what it was run with."""
    rows = []
    for name in CONDITIONS:
        run, printed = result["conditions"][name], TABLE_2[name]
        number = run["requests"]
        rows.append(
            (
                name,
                f"{printed.mean_s:.2f} ({printed.sd_s:.2f})",
                _mean_sd(run["response_s"]),
                f"{printed.distance_m / REQUESTS:.1f}",
                f"{run['distance_m'] / number:.1f}",
                f"{printed.escapes}",
                f"{100.0 * run['escapes'] / number:.0f}",
                f"{run['energy_j'] / number / 1e3:.2f}",
                f"{run['served']} of {number}",
                f"{run['contacts']} ({run['contacts_by_robot']})",
                str(run["informs"]),
                f"{run['planner']}, {run['local_planner']}, {run['localizer']}, tier {run['tier']}",
            )
        )
    head = (
        "condition",
        *("response, s (SD): paper", "here", "m per request: paper", "here"),
        *("Escapes in 100: paper", "here", "kJ per request", "served", "contacts (by robot)"),
        "Informs",
        "planner, local planner, localizer",
    )
    return ResultTable("Table 2", head, rows)


def claim_table(result: Result) -> ResultTable:
    """The claims, with their causes in the last column."""
    rows = [
        (c["claim"], c["paper"], c["ours"], JUDGED[c["holds"]], c["cause"] or "")
        for c in result["claims"]
    ]
    head = ("claim", "paper", "here", "holds", "measured cause")
    return ResultTable("Claims of section 5", head, rows)


def _statistics(result: Result) -> ResultTable:
    study = result["statistics"]["study"]
    test, rows = study["kruskal_wallis"], []
    if test is not None:
        effect = test["epsilon_squared"]
        size = "-" if effect is None else f"ε² = {effect:.3f}"
        rows.append(
            ("all three", f"H({test['df']}) = {test['h']:.2f}", "", f"{test['p']:.2g}", size)
        )
    for name, pair in study["jonckheere_terpstra"].items():
        exact = "" if pair["p_exact"] is None else f", exact {pair['p_exact']:.2g}"
        shown = f"{pair['p_holm']:.2g} (unadjusted {pair['p']:.2g}{exact})"
        rows.append((name, f"J = {pair['j']:g}", f"{pair['z']:.2f}", shown, f"r = {pair['r']:.3f}"))
    number = ", ".join(str(len(sums)) for sums in study["sums_s"].values())
    note = (
        f"Sums of {number} sequences of seven responses. Kruskal-Wallis; Jonckheere-Terpstra, "
        "one-sided, p by the normal distribution, adjusted by Holm's method. The walk repeats, so "
        "the sums are hardly independent: they speak of this walk only."
    )
    head = ("conditions", "statistic", "z", "p", "effect")
    return ResultTable("Statistics of 5.2.1", head, rows, note)


def route_table(result: Result) -> ResultTable:
    """Differences between conditions over random routes."""
    routes = result["statistics"]["routes"]
    rows = [
        (name, *(_bounds(gaps.get(key), scale) for key, scale in _GAPS.items()))
        for name, gaps in routes["differences"].items()
    ]
    orders = "; ".join(f"{order}: {number}" for order, number in routes["orders"].items())
    note = f"Mean responses in order, number of routes: {orders}." if orders else ""
    title = f"{routes['number']} random routes of seven poses, walked in all conditions"
    head = (
        *("difference, with 95 % bounds", "response, s", "m per request", "kJ per request"),
        "Escapes in 100",
    )
    return ResultTable(title, head, rows, note)


_GAPS = {"response_s": 1.0, "distance_m": 1.0, "energy_j": 1e-3, "escapes": 100.0}


def _bounds(gap: Mapping[str, float] | None, scale: float) -> str:
    if gap is None:
        return "-"
    mean, low, high = (scale * gap[key] for key in ("mean", "low", "high"))
    return f"{mean:+.2f} ({low:+.2f} to {high:+.2f})"


def _rooms(result: Result) -> ResultTable:
    rows = [
        (
            row["room"],
            f"{row['free_m2']:.1f}",
            f"{row['paper_usable_m2']:g}",
            f"{row['usable_m2']:.1f}",
            f"{row['usable_m2'] / row['free_m2']:.0%}",
        )
        for row in result["rooms"]
    ]
    head = ("room", "free, m²", "left: paper, m²", "here, m²", "share")
    return ResultTable("Floor left by an inflation of 1 m (5.1)", head, rows)


def _arm(result: Result) -> ResultTable:
    rows: list[Row] = [("paper, all", *(f"{seconds:.2f}" for seconds in ARM), "300")]
    for name in CONDITIONS:
        run = result["conditions"][name]
        rows.append((name, *_spread(run["arm_s"]), str(run["served"])))
    for row in result["arm_times"]:
        about = f"planned alone by {row['solver']}, base within {100 * row['offset_m']:.0f} cm"
        rows.append((about, *_spread(row), str(row["planned"])))
    head = ("arm's time, s", "mean", "SD", "least", "most", "n")
    return ResultTable("The arm (5.2.2)", head, rows)


def _causes(result: Result) -> Iterator[ResultTable]:
    if not result["causes"]:
        return
    rows = []
    for row in result["causes"]:
        runs = [row["conditions"][name] for name in CONDITIONS]
        rows.append(
            (
                ", ".join(row["sets"]) or "the profile itself",
                *(_mean_sd(run["response_s"]) for run in runs),
                two_places(runs[0]["arm_s"]["mean"]),
                ", ".join(str(run["escapes"]) for run in runs),
                ", ".join(two_places(run["escape_time_s"]["mean"]) for run in runs),
                ", ".join(f"{run['served']}/{run['requests']}" for run in runs),
            )
        )
    head = (
        *("values", *(f"response, s (SD): {name}" for name in CONDITIONS), "arm, s"),
        *("Escapes", "their mean time, s", "served"),
    )
    note = "One round of seven requests each; three figures are those of the three conditions."
    yield ResultTable("What the differences depend on", head, rows, note)


def _parts(result: Result) -> Iterator[ResultTable]:
    if not result["parts"]:
        return
    rows = []
    for part in result["parts"]:
        for name in CONDITIONS:
            run = part["conditions"][name]
            off = run["localization"]
            rows.append(
                (
                    part["name"],
                    name,
                    f"{run['planner']}, {run['local_planner']}, {run['localizer']}",
                    _mean_sd(run["response_s"]),
                    f"{run['served']} of {run['requests']}",
                    f"{run['distance_m'] / run['requests']:.1f}",
                    str(run["escapes"]),
                    "-" if off is None else two_places(off.get("rmse_m")),
                    ", ".join(f"{why} {number}" for why, number in run["refusals"].items()),
                )
            )
    head = (
        *("parts", "condition", "planner, local planner, localizer", "response, s (SD)", "served"),
        *("m per request", "Escapes", "error of the pose, m", "not served because"),
    )
    yield ResultTable("With all sensors (tier 2), and the paper's own parts", head, rows)


def _mean_sd(spread: Mapping[str, float | None]) -> str:
    if spread["mean"] is None:
        return "-"
    return f"{spread['mean']:.2f}" + ("" if spread["sd"] is None else f" ({spread['sd']:.2f})")


def _spread(values: Mapping[str, float | None]) -> Row:
    return tuple(two_places(values[key]) for key in ("mean", "sd", "min", "max"))


def two_places(value: float | None) -> str:
    """The text of a value in tables and claims."""
    return "-" if value is None else f"{value:.2f}"
