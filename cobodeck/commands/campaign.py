"""Run all combinations of a campaign file: settings, people, seeds; only what has not been run yet.

DIR keeps every result (cells.jsonl), what they come to (summary.json, summary.txt, a plot for each
parameter), and records of the worst runs. `--executor dask` needs the extra `cluster`. Whoever
reaches a Dask scheduler runs any code on its workers: keep it on loopback or in a closed network,
or set up TLS in Dask's own configuration.
Exit code 1: a cell failed, or something is not as the file expects it.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Mapping, Sequence
from contextlib import closing, redirect_stdout
from datetime import date
from pathlib import Path
from typing import Any

from cobodeck.campaign import (
    EXECUTORS,
    FOLDER,
    CampaignCell,
    CellResult,
    CellRunner,
    ResultStore,
    cells_of,
    check_campaign,
    execute,
    for_programs,
    run_cell,
    summarised,
    summary_text,
    worst_cells,
)
from cobodeck.project import catalogue
from cobodeck.record.format import machine, versions
from cobodeck.terminal import (
    ENDING,
    FAILED,
    OK,
    PART,
    Problem,
    ProgressLine,
    complain,
    count,
    json_options,
    positive,
    show,
    show_json,
    word,
)
from engine.files.declared import find_file, load_yaml
from hw import missing

WORST = 3
SAME = ("trace_sha256", "motion_sha256")
"""Figures that are the same whether a run is recorded or not."""
NEAR = ("127.0.0.1", "localhost", "[::1]")
"""Hosts that other machines do not reach."""


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument("campaign", type=word, metavar="CAMPAIGN", help="name or file")
    parser.add_argument(
        "--out", type=Path, required=True, metavar="DIR", help="results; those there are not rerun"
    )
    parser.add_argument(
        "--executor", choices=EXECUTORS, default="local", help="default: local, own processes"
    )
    parser.add_argument(
        "--scheduler", type=word, metavar="ADDR",
        help="with dask: a cluster that is there, as tcp://HOST:8786, whose workers have the same "
        "code; anyone who reaches it runs code on it; default: one on 127.0.0.1",
    )  # fmt: skip
    parser.add_argument("--workers", type=positive, metavar="N", help="default: one per processor")
    parser.add_argument("--cells", type=positive, metavar="N", help="only N, evenly chosen")
    parser.add_argument(
        "--worst", type=count, default=WORST, metavar="N",
        help=f"record and draw so many of the worst runs, 0: none; default {WORST}",
    )  # fmt: skip
    json_options(parser)


def run(args: argparse.Namespace) -> int:
    """Run, keep, count, draw."""
    _warn_of_scheduler(args)
    runner = CellRunner(catalogue(own=args.own))
    file = find_file(args.campaign, FOLDER, "campaign")
    campaign = load_yaml(file, lambda item: check_campaign(item, runner))
    cells, began = cells_of(campaign, args.cells), time.perf_counter()
    with closing(ResultStore(args.out)) as store:
        there = len(store)
        results = _executed(args, campaign.campaign, cells, store)
        ran = len(store) - there
    cost = {"cpu_s": sum(r.cpu_s for r in results), "wall_s": time.perf_counter() - began}
    summary = summarised(campaign, results)
    text = summary_text(summary, {**cost, "run": ran})
    made = {"date": date.today().isoformat(), "machine": machine(), "versions": versions()}
    _write(args.out / "summary.json", json.dumps({**summary, **made, "cost": cost}, indent=1))
    _write(args.out / "summary.txt", text)
    _draw(args.out, summary["parameters"])
    _look_at_worst(args, results)
    if args.json:
        show_json({**summary, "cells": [for_programs(result) for result in results]})
    else:
        show(text)
    return FAILED if summary["failed"] or summary["broken"] else OK


def _warn_of_scheduler(args: argparse.Namespace) -> None:
    if args.scheduler is None:
        return
    if args.executor != "dask":
        raise Problem("--scheduler needs --executor dask")
    host, _, port = args.scheduler.rpartition("://")[2].rpartition(":")
    if not host or not port.isdecimal():
        raise Problem(f"--scheduler {args.scheduler}: is no address, as tcp://HOST:8786")
    if host not in NEAR:
        complain(f"whoever reaches the scheduler at {args.scheduler} runs code on all its workers")


def _executed(
    args: argparse.Namespace, name: str, cells: Sequence[CampaignCell], store: ResultStore
) -> list[CellResult]:
    """The results of all cells, in their order."""
    found: dict[CampaignCell, CellResult] = {}
    progress, there, began = ProgressLine(name), len(store), time.perf_counter()
    results = execute(
        cells, args.executor, args.workers, scheduler=args.scheduler, store=store, own=args.own
    )
    try:
        with closing(results):
            for result in results:
                found[result.cell] = result
                ran = len(store) - there  # the others had results, and took no time
                rate = ran / (time.perf_counter() - began)
                share = ran / max(len(cells) - len(found) + ran, 1)
                progress.at(f"{len(found)} of {len(cells)} cells, {rate:.1f} per s", share)
    except KeyboardInterrupt:
        complain(f"{len(found)} of {len(cells)} cells are kept; the same command goes on")
        raise
    finally:
        progress.done()
    return [found[cell] for cell in cells]


def _write(path: Path, text: str) -> None:
    """Replace a file by a whole one."""
    unfinished = path.with_name(f"{path.name}{PART}")
    unfinished.write_text(f"{text}\n", encoding="utf-8")
    unfinished.replace(path)


def _draw(folder: Path, parameters: Sequence[Mapping[str, Any]]) -> None:
    """A plot for each parameter, if matplotlib is there."""
    try:
        from cobodeck.pictures import draw_parameter
    except ModuleNotFoundError as error:
        complain(f"no plots: they {missing(error)}")
        return
    for parameter in parameters:
        draw_parameter(parameter, folder / f"{parameter['name']}.svg")


def _look_at_worst(args: argparse.Namespace, results: Sequence[CellResult]) -> None:
    """Run the worst cells again, with records and pictures, if what these need is there."""
    folder: Path = args.out / "worst"
    for number, (name, result) in enumerate(worst_cells(results, args.worst), 1):
        record = folder / f"{number}_{name}_{result.address[:8]}{ENDING}"
        if record.exists():
            continue
        try:
            from cobodeck.pictures.run import draw_run

            folder.mkdir(parents=True, exist_ok=True)
            with redirect_stdout(sys.stderr):
                figures = run_cell(result.cell, record, own=args.own)
                draw_run(record, record.with_suffix(".svg"))
        except ModuleNotFoundError as error:
            complain(f"no records of the worst runs: they {missing(error)}")
            return
        if any(figures[name] != (result.figures or {})[name] for name in SAME):
            complain(f"{record}: ran otherwise than before")
