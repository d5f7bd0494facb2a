"""The tables of `cobodeck/FIGURES.md`, made from the committed results of benchmarks."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from cobodeck.bench.result import read_result

PAGE = Path("cobodeck/FIGURES.md")
RESULTS = Path(__file__).with_name("results")
CURVES = Path(__file__).with_name("curves.svg")
BEGIN, END = "<!-- bench {} -->\n", "<!-- bench {} end -->"
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
    "cpu_study": "`study`, tier 1",
    "cpu_lab_a": "`lab_a`, tier 1, beside a walker",
    "cpu_study_tier_2": "`study`, tier 2",
}
Row = Mapping[str, Any]


def engine_table(result: Mapping[str, Any]) -> str:
    """The rows of the engine beside its peers."""
    known = {key: row["ratio"] for row in result["rows"] for key in _engine_keys(row)}
    return _markdown(
        ("", *VARIANTS),
        (
            (about, *(_ratio(known.get((*key, variant))) for variant in VARIANTS))
            for key, about in ENGINE_ROWS.items()
        ),
        f"{NOTE}\n\n{_machine(result)}",
    )


def _engine_keys(row: Row) -> tuple[tuple[Any, ...], ...]:
    name, variant = row["name"], row["variant"]
    return (name, row["value"], variant), (name, None, variant)


def runs_table(result: Mapping[str, Any]) -> str:
    """CPU of whole runs, and how many times as fast as real time they are."""
    known = {(row["name"], row["variant"]): row for row in result["rows"]}
    lines = []
    for name, about in RUNS.items():
        own, speed = known[name, "cobodeck"], known[name, "speed"]["ratio"]
        beside = _ratio(own["ratio"]) if own["ratio_to"] == "MuJoCo" else "–"
        lines.append((about, _time(own["time_us"]), f"{float(f'{speed:.2g}'):.0f}", beside))
    return _markdown(
        ("run", "CPU per 1/30 s", "× real time", "to MuJoCo's"), lines, _machine(result)
    )


def curves_table(results: Iterable[Mapping[str, Any]]) -> str:
    """The point of each curve that we use."""
    rows = [row for result in results for row in result["rows"] if row.get("default")]
    lines = [
        (
            f"{row['bench']}: {row['name']}",
            row["variant"] if row["knob"] is None else f"{row['variant']}, {_setting(row)}",
            _time(row["time_us"]),
            f"{row['ratio']:.2g}",
            "–" if row["error"] is None else f"{row['error']:.3g} {row['error_unit']}",
            row["reference"] or "–",
        )
        for row in rows
        if row["time_us"] is not None
    ]
    head = ("curve", "what we use", "time", "units", "error", "against")
    return _markdown(head, lines, "A unit is a million passes of a plain loop, timed just before.")


def missed_table(results: Iterable[Mapping[str, Any]]) -> str:
    """The goals that are missed."""
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
    return _markdown(("missed", "what", "is", "at most"), lines, "All other goals are reached.")


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


def with_tables(page: str) -> str:
    """The page's text with its tables replaced by those of the committed results."""
    found = {file.stem: read_result(file) for file in sorted(RESULTS.glob("*.json"))}
    made: dict[str, Callable[[], str]] = {
        "engine": lambda: engine_table(found["engine"]),
        "simulation": lambda: runs_table(found["simulation"]),
        "curves": lambda: curves_table(found.values()),
        "missed": lambda: missed_table(found.values()),
    }
    for name, table in made.items():
        before, rest = page.split(BEGIN.format(name))
        after = rest[rest.index(END.format(name)) :]
        page = before + BEGIN.format(name) + table() + after
    return page


def _markdown(head: Sequence[str], lines: Iterable[Sequence[str]], note: str) -> str:
    cells = [f"| {' | '.join(line)} |" for line in (head, *lines)]
    return "\n".join([cells[0], "|---" * len(head) + "|", *cells[1:], "", note]) + "\n"


def _machine(result: Mapping[str, Any]) -> str:
    machine = result["machine"]
    named = f"{machine['name']}, {machine['cores']} cores, {machine['system']}, {machine['python']}"
    return f"Machine: {named}, {result['date']}."


def _ratio(ratio: float | None) -> str:
    if ratio is None:
        return "–"
    return f"{float(f'{ratio:.2g}'):.0f}" if ratio >= 10 else f"{ratio:.2f}"


def _setting(row: Row) -> str:
    return f"{row['knob']} {round(row['value'], 3):g}"


def _time(time_us: float) -> str:
    return f"{time_us:.3g} µs" if time_us < 1e3 else f"{time_us / 1e3:.3g} ms"


if __name__ == "__main__":
    PAGE.write_text(with_tables(PAGE.read_text()))
