"""Runs a chart as `simulate` and `run` do: with a record, a page and a shadow, if they are wanted.

Then the figures are printed.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from datetime import datetime
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

from cobodeck.fitness import require
from cobodeck.terminal import (
    FAILED,
    OK,
    Problem,
    ProgressLine,
    complain,
    is_record,
    show,
    show_json,
)
from engine.files import FileError, in_order
from engine.files.declared import notes
from engine.run import Raised
from hw import missing

if TYPE_CHECKING:
    from cobodeck.live import LivePage
    from cobodeck.loop import Clock, Loop
    from cobodeck.record.write import Recorder
    from cobodeck.run import RunResult
    from cobodeck.setup import Options, Setup
    from hw.connection import Connection

BLOCKED_S = 5.0
"""Ticks longer than this, s of wall time, are reported with the node that blocks them."""
FAILURES = ("error", "failed")
"""Outcomes of a chart that make the command fail."""


def report_on(
    args: argparse.Namespace,
    options: Options,
    clock: Clock | None = None,
    blocked_s: float = BLOCKED_S,
    before: Callable[[Setup], None] | None = None,
) -> int:
    """Run, write the trace file, print the figures; `before` is called once all files are read."""
    _possible(args, options)
    from cobodeck.run import explain, summary, topics_of

    began = datetime.now()
    setup = _setup(args)
    if before is not None:
        before(setup)
    result = _run(setup, args, options, clock, blocked_s, began)
    not_recorded = _keeps_record(args, clock) and result.record_file is None
    path = _write_trace(setup, options, result, args.record, began, told=not_recorded)
    figures = {**result.figures, "trace_file": path and str(path)}
    figures["record_file"] = result.record_file and str(result.record_file)
    if getattr(args, "judge", False) and figures["contacts"] is not None:
        figures["contacts_avoidable"] = _avoidable(figures["contacts"], result.record_file)
    if args.json:
        show_json(figures)
    else:
        show(summary(figures, result.wired.run.ended_by, topics_of(setup)))
    if getattr(args, "explain", False):
        show(explain(result))
    wanted = args.record is not None
    lacking = wanted and (not_recorded or (path is None and not _keeps_record(args, clock)))
    failed = figures["outcome"] in FAILURES or figures["errors"]
    return FAILED if lacking or failed else OK


def _possible(args: argparse.Namespace, options: Options) -> None:
    """Refuse what cannot be, before anything is read.

    Raises:
        Problem: no signals for a shadow; ModuleNotFoundError: no package for a page.
    """
    if args.shadow is not None and options.tier == 0:
        raise Problem("--shadow: a second chart sees the same signals; --tier 0 has none")
    if args.live is not None and find_spec("websockets") is None:
        raise ModuleNotFoundError("No module named 'websockets'", name="websockets")


def _avoidable(contacts: int, record: Path | None) -> int | None:
    """How many of the contacts were avoidable; None if there is no record to judge them by."""
    if not contacts or record is None:
        return None if contacts else 0
    from cobodeck.avoidable import contacts_avoidable

    return contacts_avoidable(record)


def _keeps_record(args: argparse.Namespace, clock: Clock | None) -> bool:
    """A run is always recorded, a simulation on request."""
    return clock is not None if args.record is None else is_record(args.record)


def _write_trace(
    setup: Setup,
    options: Options,
    result: RunResult,
    wanted: Path | None,
    began: datetime,
    *,
    told: bool,
) -> Path | None:
    """Write the trace file; returns its path, None if it cannot be written.

    `told`: a failure to keep the run was reported already; do not report it again.
    """
    from cobodeck.record.format import FOLDER, default_name, open_free
    from cobodeck.run import trace_file

    named, ending = wanted, None
    if named is None or is_record(named):
        ending = trace_file.ENDING
        named = FOLDER / (default_name(setup, options, began) + ending)
    path, error = None, None
    try:
        sink = open_free(named, ending)
        path, error = trace_file.write(sink, setup, result), sink.error
    except OSError as found:
        error = found
    if error is not None and not told:
        complain(f"no trace file: {error.filename or named}: {error.strerror}")
    return path


def _recorder(
    args: argparse.Namespace,
    setup: Setup,
    options: Options,
    clock: Clock | None,
    began: datetime,
    page: LivePage | None,
) -> Recorder | None:
    """The recorder of the run, in a file, for a page, or both; None if only its trace is kept.

    Raises:
        Problem: a requested file exists; ModuleNotFoundError: it cannot be written here.
    """
    from cobodeck.record.format import Taken, require_free

    watching = [] if page is None else [page.feed]
    if _keeps_record(args, clock):
        try:
            from cobodeck.record.write import recorder
        except ModuleNotFoundError as error:
            needed = missing(error)
            if args.record is not None or needed is None:
                raise
            complain(f"no record: it {needed}")
            return None
        return recorder(setup, options, args.record, began, complain, watching)
    try:
        if args.record is not None:
            require_free(args.record)
    except Taken as taken:
        raise Problem(str(taken)) from None
    if not watching:
        return None
    from cobodeck.record.write import unkept_recorder

    return unkept_recorder(setup, options, began, complain, watching)


def _page(args: argparse.Namespace, setup: Setup, options: Options) -> LivePage | None:
    """The live page, if one is wanted; its URL is printed first.

    Raises:
        Problem: it cannot be served.
    """
    if args.live is None:
        return None
    from cobodeck.live import LivePage, PageAddress

    def say(line: str) -> None:
        show(line)
        sys.stdout.flush()

    return LivePage(setup, options, PageAddress(*args.live), say)


def _setup(args: argparse.Namespace) -> Setup:
    from cobodeck.project import catalogue, reached, replacements
    from cobodeck.setup import of_other_policy, open_setup, read_inputs

    known, body = catalogue(own=args.own), _robot_of(args)
    with notes() as old:
        setup = open_setup(
            args.chart,
            args.scene,
            args.profile,
            args.tick_hz,
            body,
            known=known,
            sets=args.sets,
            inputs=read_inputs(args.inputs),
        )
    require("begin", setup=setup)
    charts = reached({setup.chart.name}, setup.library)
    about_place = () if setup.place is None else setup.place.remarks
    replaced = replacements(setup.library, known, charts)
    told = (str(FileError([note])) for note in in_order(old))
    for remark in (*told, *replaced, *of_other_policy(setup), *about_place):
        complain(remark)
    return setup


def _run(
    setup: Setup,
    args: argparse.Namespace,
    options: Options,
    clock: Clock | None,
    blocked_s: float,
    began: datetime,
) -> RunResult:
    from cobodeck.run import Shadow, simulate

    shadow = None if args.shadow is None else Shadow(setup.beside(args.shadow), complain)
    page = _page(args, setup, options)
    result = None
    try:
        recorder = _recorder(args, setup, options, clock, began, page)
        progress = ProgressLine("simulate")
        devices = options.connection is not None
        if page is not None and clock is None:
            from cobodeck.loop import Paced

            clock = Paced()
        try:
            result = simulate(
                setup,
                options,
                progress.at,
                clock,
                partial(_looked_after, blocked_s, devices, page),
                _error_once(),
                recorder,
                shadow,
            )
        finally:
            progress.done()
    finally:
        if page is not None:
            page.close(None if result is None else result.record_file)
    return result


def _robot_of(args: argparse.Namespace) -> str | Connection | None:
    """The robot: a body by name, or a connection, whose body and limits a simulation uses."""
    from cobodeck.project import kind_of
    from hw.connection import connection_names, load_connection

    named: str | None = args.robot
    if named is None:
        return None
    if named in connection_names() or kind_of(Path(named)) == "connection":
        return load_connection(named)
    return named


@contextmanager
def _looked_after(
    blocked_s: float, devices: bool, page: LivePage | None, loop: Loop
) -> Iterator[None]:
    """A context in which signals end the run cleanly, and a node that blocks a tick is reported.

    Beside `devices` the run has its real-time priority. A `page` shows and steers it.
    """
    if page is not None:
        page.attend(loop)
    from cobodeck.loop import ending_on_signals, naming_what_blocks
    from hw.ipc import ENGINE, hurrying

    first = hurrying(ENGINE) if devices else nullcontext()
    with ending_on_signals(loop), naming_what_blocks(loop, blocked_s, complain), first:
        yield


def _error_once() -> Callable[[Raised], None]:
    """What tells errors while they occur; the same error in the same node is not told again."""
    told = set()

    def tell(error: Raised) -> None:
        if error._replace(time=0) not in told:
            told.add(error._replace(time=0))
            complain(f"at {error.time / 1e9:.2f} s, {error.path or 'a part'}: {error}")

    return tell
