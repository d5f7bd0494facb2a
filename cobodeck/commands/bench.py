"""Measure run time against error, side by side with others where they are installed.

Ratios refer to work that was timed in the same round: by default to a unit, a million passes of a
plain loop. Absolute times hold for one machine only.
`envelope` tells from where a person can be escaped at all; with records, which of their failed
Escapes and contacts could have been avoided.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from importlib import import_module
from os import getloadavg
from pathlib import Path
from typing import Any

from cobodeck.terminal import (
    FAILED,
    OK,
    Problem,
    ProgressLine,
    is_record,
    json_options,
    positive,
    show,
    show_json,
    table,
)

BENCHES = {
    "engine": "cobodeck.bench.engine.engine_bench",
    "navigation": "cobodeck.bench.navigation.navigation_bench",
    "drives": "cobodeck.bench.navigation.drives",
    "chase": "cobodeck.bench.navigation.chase_bench",
    "arm": "cobodeck.bench.arm.arm_bench",
    "localization": "cobodeck.bench.localization.localization_bench",
    "simulation": "cobodeck.bench.simulation_bench",
    "reference": "cobodeck.bench.reference_bench",
    "realtime": "cobodeck.bench.engine.realtime",
    "live": "cobodeck.bench.live.live_bench",
    "stability": "cobodeck.bench.stability",
    "envelope": "cobodeck.bench.envelope_bench",
}
ENVELOPE, STABILITY = "envelope", "stability"


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    about = f"of {', '.join(BENCHES)}; after envelope also records, X.mcap"
    parser.add_argument("names", nargs="*", metavar="NAME|RECORD", help=about)
    parser.add_argument(
        "--compare", type=Path, nargs="+", default=(), metavar="FILE",
        help="earlier --json; 1 if slower or less exact",
    )  # fmt: skip
    parser.add_argument(
        "--logs", type=Path, nargs="+", metavar="FILE",
        help="localization on these logs with corrected poses, beside a particle filter and others",
    )  # fmt: skip
    parser.add_argument(
        "--variants", type=_variant, nargs="+", default=(), metavar="NAME=VALUE",
        help="of the logs: slip=2 (times), thin=3 (every third scan), gap=30 (s), bunched=4 "
        "(scans), late=-0.2 (s, of the wheels); default: the logs as they are, and all of these",
    )  # fmt: skip
    parser.add_argument("--seed", type=int, default=0, help="of the variants; default 0")
    parser.add_argument("--rounds", type=positive, default=5, help="medians of so many; default 5")
    parser.add_argument(
        "--show", type=Path, nargs="+", metavar="FILE", help="measure nothing, show earlier --json"
    )
    parser.add_argument(
        "-o", "--output", type=Path, metavar="FILE",
        help="time against error, or what was judged, as X.svg, .png, .pdf",
    )  # fmt: skip
    json_options(parser)


def _variant(text: str) -> tuple[str, float]:
    """A variant of logs, NAME=VALUE."""
    from cobodeck.bench.localization import LEAST, VARIANTS

    name, _, value = text.partition("=")
    try:
        number = float(value)
    except ValueError:
        number = math.nan
    if name not in VARIANTS or not LEAST[name] <= number < math.inf:
        known = ", ".join(f"{name} (from {LEAST[name]:g})" for name in VARIANTS)
        raise argparse.ArgumentTypeError(f"{text!r} is not NAME=VALUE, with a name of {known}")
    return name, number


def run(args: argparse.Namespace) -> int:
    """Measure, print, compare."""
    if any(map(is_record, args.names)):
        return _judge(args)
    from cobodeck.bench import read_result

    before = {file: read_result(file)["rows"] for file in args.compare}
    if args.show:
        results = [read_result(file) for file in args.show]
    else:
        results = [_measure_logs(args) if args.logs else _measure(args)]
    if args.json and len(results) > 1:
        raise Problem("--json shows one file at a time")
    rows = [row for result in results for row in result["rows"]]
    if not args.json:
        show("\n\n".join(map(text, results)))
    found = _worse(rows, before)
    if args.json:
        show_json({**results[0], "worse": found} if before else results[0])
    elif found:
        show("\n".join(found))
    if args.output is not None:
        _draw(args, rows)
    return FAILED if found else OK


def _worse(rows: Sequence[Any], before: Mapping[Path, Any]) -> list[str]:
    """What is worse than in these files.

    Raises:
        Problem: a file has none of these rows.
    """
    from cobodeck.bench import common, worse

    found: list[str] = []
    for file, known in before.items():
        number = len(common(rows, known))
        if not number:
            raise Problem(f"{file}: it has none of these rows, so that nothing is compared")
        found += worse(rows, known)
        show(f"{number} of {len(rows)} rows compared with {file}")
    return found


def _draw(args: argparse.Namespace, rows: Sequence[Mapping[str, Any]]) -> None:
    """Draw time against error; of `envelope` alone, the distances that it is about.

    Errors of `stability` alone are drawn over what they depend on.
    """
    if {row["bench"] for row in rows} == {STABILITY}:
        from cobodeck.pictures import draw_stability

        draw_stability(rows, args.output)
        return
    if args.names != [ENVELOPE] or args.show is not None:
        from cobodeck.pictures import draw_bench

        draw_bench(rows, args.output)
        return
    from cobodeck.pictures import draw_envelope

    progress = ProgressLine("bench", 0.0)
    draw_envelope(args.output, progress.at)
    progress.done()


def _judge(args: argparse.Namespace) -> int:
    """Judge the failed Escapes and the contacts of records."""
    records = [Path(name) for name in args.names if is_record(name)]
    if [name for name in args.names if not is_record(name)] != [ENVELOPE]:
        raise Problem("records are judged by `cobodeck bench envelope X.mcap …`, alone")
    if args.output is not None:
        from cobodeck.pictures.drawing import form_of

        form_of(args.output)
    from cobodeck.avoidable import judged_run, text as told

    progress = ProgressLine("bench", 0.0)
    runs = []
    for done, path in enumerate(records):
        progress.at(str(path), done / len(records))
        runs.append(judged_run(path))
    progress.done()
    if args.json:
        show_json({"records": [found.plain() for found in runs]})
    else:
        show(told(runs))
    if args.output is not None:
        from cobodeck.pictures import draw_envelope

        draw_envelope(args.output, progress.at, runs)
        progress.done()
    return OK


def _measure(args: argparse.Namespace) -> dict[str, Any]:
    rows, load = [], getloadavg()[0]
    progress = ProgressLine("bench", 0.0)
    wanted = args.names or list(BENCHES)
    for name in wanted:
        if name not in BENCHES:
            from engine.files import did_you_mean

            raise Problem(f"no bench {name!r}; {did_you_mean(name, BENCHES)}")
    for done, name in enumerate(wanted):
        progress.at(name, done / len(wanted))
        for row in import_module(BENCHES[name]).rows(args.rounds):
            progress.at(f"{name}: {row.name} {row.variant}", done / len(wanted))
            rows.append(row.plain())
    progress.done()
    return _result(rows, load)


def _result(rows: list[dict[str, Any]], load: float) -> dict[str, Any]:
    """What was measured; `load`: the processes that ran or waited in the minute before."""
    from cobodeck.bench import own_version
    from cobodeck.record.format import machine, versions

    return {
        "date": datetime.now(UTC).date().isoformat(),
        "machine": {**machine(), "load": round(load, 1)},
        "versions": versions() | {"cobodeck": own_version()},
        "rows": rows,
    }


def _measure_logs(args: argparse.Namespace) -> dict[str, Any]:
    """Localize logs by all peers."""
    if args.names not in ([], ["localization"]):
        raise Problem("--logs are for `cobodeck bench localization`, alone")
    from cobodeck.bench.localization import rows

    found, load = [], getloadavg()[0]
    progress = ProgressLine("bench", 0.0)
    for row in rows(args.logs, args.variants, args.seed):
        found.append(row.plain())
        progress.at(f"{row.name} {row.knob or ''} {row.variant}")
    progress.done()
    return _result(found, load)


HEAD = ("what", "variant", "knob", "time", "ratio", "to", "error", "of", "calls", "goal")


LOG_HEAD = (
    *("log", "variant", "by", "rmse, cm", "max, cm", "lost", "confidently wrong", "NEES"),
    *("median", "p99", "goal"),
)


def text(result: Mapping[str, Any]) -> str:
    """The rows in columns; those of logs in columns of their own."""
    plain = [_cells(row) for row in result["rows"] if "wrong" not in row]
    logs = [_log_cells(row) for row in result["rows"] if "wrong" in row]
    tables = [table([HEAD, *plain], frozenset((3, 4, 6, 8, 9)))] if plain else []
    if logs:
        tables.append(table([LOG_HEAD, *logs], frozenset(range(3, len(LOG_HEAD)))))
    return "\n\n".join([_machine(result), *tables])


def _machine(result: Mapping[str, Any]) -> str:
    machine = result["machine"]
    told = f"{machine['name']}, {machine['cores']} cores, {machine['system']}, {machine['python']}"
    told += f", load {machine['load']:g}" if "load" in machine else ""
    return f"{told}, {result['date']}" if "date" in result else told


def _cells(row: Mapping[str, Any]) -> tuple[str, ...]:
    time = row["time_us"]
    knob = "" if row["knob"] is None else f"{row['knob']} {_number(row['value'])}"
    return (
        f"{row['bench']} {row['name']}",
        row["variant"],
        knob,
        "" if time is None else _time(time),
        _ratio(row),
        row["ratio_to"] or "",
        "" if row["error"] is None else _number(row["error"]),
        row["error_unit"] or "",
        _number(row.get("calls_per_tick")),
        "" if row["goal"] is None else f"{row['goal']:g}",
    )


def _log_cells(row: Mapping[str, Any]) -> tuple[str, ...]:
    return (
        row["name"],
        "as it is" if row["knob"] is None else f"{row['knob']} {_number(row['value'])}",
        row["variant"],
        _number(row["error"]),
        _number(row["worst"]),
        str(row["lost"]),
        f"{row['wrong']:.1%}",
        _number(row["nees"]),
        _time(row["time_us"]),
        _time(row["p99_us"]),
        "" if row["goal"] is None else f"{row['goal']:g}",
    )


def _ratio(row: Mapping[str, Any]) -> str:
    if row["ratio"] is None:
        return ""
    spread = row.get("spread")
    return _number(row["ratio"]) + (f" ±{0.5 * spread:.2g}" if spread else "")


def _time(microseconds: float) -> str:
    if microseconds < 1e3:
        return f"{microseconds:.2f} µs"
    return f"{microseconds / 1e3:.1f} ms" if microseconds < 1e6 else f"{microseconds / 1e6:.2f} s"


def _number(value: float | None) -> str:
    if value is None:
        return ""
    return f"{value:.0f}" if abs(value) >= 100 else f"{value:.3g}"
