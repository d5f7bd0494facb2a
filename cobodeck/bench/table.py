"""What pages say of the committed results of benchmarks."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from cobodeck.bench.result import read_result
from cobodeck.markdown import markdown_table

RESULTS = Path(__file__).with_name("results")
CURVES = Path(__file__).with_name("curves.svg")
ENGINE_ROWS = {
    ("no new sample", None): "tick, no new sample",
    ("every tick recorded", None): "… every tick recorded",
    ("every tick recorded, long run", None): "… after 65 536 of them, the oldest leaving memory",
    ("fresh samples", 5): "… five fresh samples",
    ("in parallel", 100): "tick, 100 in parallel",
    ("edge without timeout", None): "edge without timeout",
    ("edge with timeout", None): "edge with timeout",
    ("a lock set", None): "edge, a lock set elsewhere",
    ("guard out of a two-leaf any", None): "guard out of a two-leaf `any`",
    ("guard out of a chart as in chase", None): "guard out of a chart as in `chase`",
    ("load and check", 1000): "load and check 1000 leaves (to a C-YAML parse)",
    ("read numbers", 10_000): "read an input of 10 000 numbers (to a float)",
}
"""By name and, where it is varied, value."""
NOTE = (
    "py_trees makes the 1000 leaves in Python, without a file; transitions and python-statemachine "
    "read JSON."
)
VARIANTS = ("cobodeck", "py_trees", "transitions", "python-statemachine", "sismic")
RUNS = {
    "tier_0": "`study`, tier 0",
    "cpu_study": "`study`, tier 1",
    "cpu_lab_a": "`lab_a`, tier 1, beside a walker",
    "cpu_study_tier_2": "`study`, tier 2",
}
Row = Mapping[str, Any]


def committed_result(name: str) -> dict[str, Any]:
    """The committed result of a bench."""
    return read_result(RESULTS / f"{name}.json")


def engine_block() -> str:
    """The rows of the engine beside its peers."""
    result = committed_result("engine")
    known = {key: row["ratio"] for row in result["rows"] for key in _engine_keys(row)}
    lines = (
        (about, *(_ratio(known.get((*key, variant))) for variant in VARIANTS))
        for key, about in ENGINE_ROWS.items()
    )
    return f"{markdown_table(('', *VARIANTS), lines)}\n\n{NOTE}\n\n{machine_text(result)}"


def _engine_keys(row: Row) -> tuple[tuple[Any, ...], ...]:
    name, variant = row["name"], row["variant"]
    return (name, row["value"], variant), (name, None, variant)


def runs_block() -> str:
    """CPU of whole runs, and how many times as fast as real time they are."""
    result = committed_result("simulation")
    known = {row["name"]: row for row in result["rows"] if row["variant"] == "cobodeck"}
    lines = []
    for name, about in RUNS.items():
        own = known[name]
        beside = _ratio(own["ratio"]) if own["ratio_to"] == "MuJoCo" else "–"
        lines.append((about, time_text(own["time_us"]), speed_text(own), beside))
    head = ("run", "CPU per 1/30 s", "× real time", "to MuJoCo's")
    return f"{markdown_table(head, lines)}\n\n{machine_text(result)}"


def curves_block() -> str:
    """The point of each curve that we use."""
    rows = [
        row
        for file in sorted(RESULTS.glob("*.json"))
        for row in read_result(file)["rows"]
        if row.get("default") and row["time_us"] is not None
    ]
    lines = [
        (
            f"{row['bench']}: {row['name']}",
            row["variant"] if row["knob"] is None else f"{row['variant']}, {_setting(row)}",
            time_text(row["time_us"]),
            f"{row['ratio']:.2g}",
            "–" if row["error"] is None else f"{row['error']:.3g} {row['error_unit']}",
            row["reference"] or "–",
        )
        for row in rows
    ]
    head = ("curve", "what we use", "time", "units", "error", "against")
    note = "A unit is a million passes of a plain loop, timed just before."
    return f"{markdown_table(head, lines)}\n\n{note}"


def plans_block() -> str:
    """What plans of the arm cost, which are not found, and how long the arm then moves."""
    result = committed_result("arm")
    known = {row["name"]: row for row in result["rows"]}
    lines = []
    for profile in ("tuned", "paper"):
        plan, late = known[f"plan {profile}"], known[f"plan {profile}, 99% quantile"]
        missed, touching = known[f"plan {profile}: unsolved"], known[f"plan {profile}: touching"]
        move, longest = (known[f"move {profile}, {share}% quantile"] for share in (50, 95))
        lines.append(
            (
                f"`{profile}`",
                f"{time_text(plan['time_us'])}, {time_text(late['time_us'])}",
                f"{missed['error']:.2g} %",
                f"{touching['error']:g}",
                f"{move['error']:.2f} s, {longest['error']:.2f} s",
            )
        )
    head = ("profile", "time of a plan: median, 99 %", "goals missed", "touching",
            "the arm moves for: median, 95 %")  # fmt: skip
    return f"{markdown_table(head, lines)}\n\n{machine_text(result)}"


def missed_block() -> str:
    """The goals that are missed."""
    return missed_table(map(read_result, sorted(RESULTS.glob("*.json"))))


def missed_table(results: Iterable[Mapping[str, Any]]) -> str:
    """The goals that these results miss."""
    rows = [row for result in results for row in result["rows"] if is_missed(row)]
    lines = (
        (
            f"{row['bench']}: {row['name']}",
            row["variant"] if row["knob"] is None else f"{row['variant']}, {_setting(row)}",
            f"{_judged(row):.3g} {_measure(row)}",
            f"{row['goal']:g}",
        )
        for row in rows
    )
    head = ("missed", "what", "is", "at most")
    return f"{markdown_table(head, lines)}\n\nAll other goals are reached."


def is_missed(row: Row) -> bool:
    """Whether a row has a goal that it does not reach."""
    found = _judged(row)
    return row["goal"] is not None and found is not None and found > row["goal"]


def _judged(row: Row) -> float | None:
    """What a goal is for: the error; of calls, or without any error of the ratio, these."""
    figures = (row["error"], row.get("calls_per_tick"), row["ratio"])
    return next((figure for figure in figures if figure is not None), None)


def _measure(row: Row) -> str:
    if row["error"] is not None:
        return f"{row['error_unit']}"
    return f"× {row['ratio_to']}" if row.get("calls_per_tick") is None else "calls per tick"


def machine_text(result: Mapping[str, Any]) -> str:
    """Where and when it was measured."""
    machine = result["machine"]
    named = f"{machine['name']}, {machine['cores']} cores, {machine['system']}, {machine['python']}"
    return f"Machine: {named}, {result['date']}."


def speed_text(row: Row) -> str:
    """How many times as fast as real time what is timed per 1/30 s was."""
    speed = 1e6 / 30.0 / row["time_us"]
    return f"{float(f'{speed:.2g}'):.0f}"


def time_text(time_us: float) -> str:
    """A time with its unit."""
    return f"{time_us:.3g} µs" if time_us < 1e3 else f"{time_us / 1e3:.3g} ms"


def _ratio(ratio: float | None) -> str:
    if ratio is None:
        return "–"
    return f"{float(f'{ratio:.2g}'):.0f}" if ratio >= 10 else f"{ratio:.2f}"


def _setting(row: Row) -> str:
    return f"{row['knob']} {round(row['value'], 3):g}"
