"""Repeat an evaluation, or evaluate runs that were recorded.

`states RECORD…`: visits, times, waits, outcomes and agreement of each node of their charts.

`paper` is section 5 of the paper, with its figures, tests and claims. Three conditions on `study`,
as the paper has them: between requests the robot stays near the person (Chase) or is parked in the
corner or near the center. A claim that does not hold is an answer: the exit code is 1 only if a run
failed.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator, Mapping
from contextlib import closing, contextmanager
from datetime import date
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cobodeck.campaign import EXECUTORS, ResultStore
from cobodeck.record.format import machine, versions
from cobodeck.terminal import (
    OK,
    Problem,
    ProgressLine,
    complain,
    json_options,
    positive,
    show,
    show_json,
    table,
    word,
)

if TYPE_CHECKING:
    from cobodeck.paper import EvaluationPlan
    from cobodeck.review import RunEvents

RUNS = "runs"
"""Folder below DIR in which the figures of all runs are kept."""


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument(
        "what", choices=("paper", "states"), help="section 5 of the paper; states of recorded runs"
    )
    parser.add_argument(
        "records",
        nargs="*",
        type=Path,
        metavar="RECORD",
        help="for `states`: X.mcap, or trace file",
    )
    parser.add_argument(
        "--requests", type=positive, default=100, metavar="N", help="per condition; default 100"
    )
    parser.add_argument("--profile", type=word, default="paper", help="default paper")
    parser.add_argument(
        "--tier",
        type=int,
        default=1,
        choices=(1, 2, 3),
        help="1: reduced; 2: with all sensors; 3: and physics",
    )
    parser.add_argument(
        "--seeds", type=positive, default=20, metavar="N",
        help="random routes of seven poses, walked in all conditions; default 20",
    )  # fmt: skip
    parser.add_argument(
        "--parts-requests", type=int, default=0, metavar="N",
        help="once more with all sensors and with the paper's own parts, navfn, TEB and AMCL, so "
        "many requests each; TEB is slow; default 0: not",
    )  # fmt: skip
    parser.add_argument(
        "--no-varied", action="store_true",
        help="without the runs with single values of the profile varied, which tell causes",
    )  # fmt: skip
    parser.add_argument("--executor", choices=EXECUTORS, default="local", help="default local")
    parser.add_argument(
        "--workers", type=positive, metavar="N", help="processes; default: one per processor"
    )
    parser.add_argument(
        "--out", type=Path, metavar="DIR",
        help="report.html, requests.csv, result.json, the figures, and the records they are of; "
        "runs that are kept there are not rerun",
    )  # fmt: skip
    json_options(parser)


def run(args: argparse.Namespace) -> int:
    """Run all, judge, report."""
    if args.what == "states":
        return _evaluate_states(args)
    if args.records:
        raise Problem(f"{args.records[0]}: `paper` makes its own runs; records are for `states`")
    from cobodeck.paper import EvaluationPlan, evaluate

    if args.parts_requests < 0:
        raise Problem("--parts-requests is a number of requests, 0 or more")
    plan = EvaluationPlan(args.requests, args.profile, args.tier, args.seeds, args.parts_requests)
    execution = {"executor": args.executor, "workers": args.workers, "own": args.own}
    varied = () if args.no_varied else None
    progress = ProgressLine("evaluate", 0.0)
    try:
        with _kept(args.out) as store:
            found = evaluate(plan, execution | {"store": store}, progress.at, varied)
            made = {"date": date.today().isoformat(), "machine": machine(), "versions": versions()}
            result = made | found
            files = [] if args.out is None else _write(plan, result, args.out, progress)
    finally:
        progress.done()
    if args.json:
        show_json(result)
    else:
        show(_text(result, files))
    return OK


def _evaluate_states(args: argparse.Namespace) -> int:
    """Tell the statistics of the nodes of recorded runs."""
    from cobodeck.review import events_of, review, statistics_text

    if not args.records:
        raise Problem("name the records of which to tell statistics, `evaluate states X.mcap …`")
    progress = ProgressLine("evaluate")
    try:
        found = review(_with_progress(args.records, events_of, progress))
    finally:
        progress.done()
    if args.json:
        rows = {"states": found.states, "classes": found.classes}
        told = {name: [one.as_json() for one in some] for name, some in rows.items()}
        of = {"runs": found.runs, "operated": found.operated, "broken": found.broken}
        show_json({**of, **told})
    else:
        show(statistics_text(found))
    return OK


def _with_progress(
    files: list[Path], read: Callable[[Path], RunEvents], progress: ProgressLine
) -> Iterator[RunEvents]:
    for number, file in enumerate(files):
        progress.at(file.name, number / len(files))
        yield read(file)


@contextmanager
def _kept(folder: Path | None) -> Iterator[ResultStore | None]:
    """The figures of earlier runs in a folder, which is new, empty, or an evaluation's own."""
    if folder is None:
        yield None
        return
    runs = folder / RUNS
    if folder.exists() and not runs.is_dir() and (not folder.is_dir() or any(folder.iterdir())):
        raise Problem(f"{folder}: neither an empty folder nor an evaluation's; name a new one")
    with closing(ResultStore(runs)) as store:
        try:
            yield store
        except KeyboardInterrupt:
            complain(f"{len(store)} runs are kept in {runs}; the same command goes on")
            raise


def _write(
    plan: EvaluationPlan, result: Mapping[str, Any], folder: Path, progress: ProgressLine
) -> list[Path]:
    from cobodeck.paper import draw_figures, record_conditions, write_report

    records = record_conditions(plan, folder, progress.at)
    pictures = draw_figures(result, records, folder, progress.at)
    return [*write_report(result, pictures, folder), *pictures, *records.values()]


def _text(result: Mapping[str, Any], files: list[Path]) -> str:
    from cobodeck.paper import claim_table, route_table, table_2

    parts = []
    for found in (table_2(result), claim_table(result), route_table(result)):
        rows = [found.head, *found.rows]
        if "measured cause" in found.head:  # told in the report
            rows = [row[:-1] for row in rows]
        parts += [found.title, table(rows), found.note]
    return "\n\n".join(filter(None, (*parts, "\n".join(map(str, files)))))
