"""Watch charts while you edit them, a recorded run, or one that goes on.

CHART or FOLDER: a page in the browser that checks and draws the charts at each save; a run can be
started there. RECORD: a page that plays a recorded run; two of them side by side. URL: of a page
that `simulate --live` or `run --live` has printed, here in the terminal (--tty).

The page is served to this machine alone; the first line tells its URL. Ctrl-C ends it.
"""

from __future__ import annotations

import argparse
import signal
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from cobodeck.setup import PROFILE
from cobodeck.terminal import OK, Problem, is_record, port, show, word

if TYPE_CHECKING:
    from cobodeck.live import Source

SCHEMES = ("http://", "https://", "ws://", "wss://")


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument(
        "things",
        nargs="*",
        type=word,
        metavar="CHART|FOLDER|RECORD|URL",
        help="default: the charts in this folder",
    )
    about = f"by which charts are drawn first, name or file; default {PROFILE}"
    parser.add_argument("--profile", type=word, default=PROFILE, help=about)
    parser.add_argument(
        "--tty", action="store_true", help="in this terminal instead, as over SSH; q ends it"
    )
    parser.add_argument(
        "--port", type=port, default=0, metavar="PORT", help="of the page; default: a free one"
    )
    parser.add_argument(
        "--host",
        type=word,
        default="127.0.0.1",
        help="address on which the page is served; default 127.0.0.1, this machine alone. With any "
        "other, all who reach it see what you see, and nothing is encrypted: `ssh -L` is safer",
    )


def run(args: argparse.Namespace) -> int:
    """Serve a page, or show it here."""
    with _ended_in_order():
        return _watch(args)


@contextmanager
def _ended_in_order() -> Iterator[None]:
    """TERM and HUP are as Ctrl-C: a terminal is as before, and runs that were started end."""
    before = {number: signal.getsignal(number) for number in (signal.SIGTERM, signal.SIGHUP)}
    for number, handler in before.items():
        if handler != signal.SIG_IGN:  # as `nohup` has it
            signal.signal(number, signal.default_int_handler)
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _watch(args: argparse.Namespace) -> int:
    things = args.things or ["."]
    if any(thing.startswith(SCHEMES) for thing in things):
        return _watch_url(things, args)
    if any(map(is_record, things)):
        return _watch_records(things, args)
    if things[1:]:
        raise Problem("one chart or folder at a time; a second chart is chosen on the page")
    from cobodeck.live.charts import EditedCharts
    from cobodeck.project import catalogue, chart_file, chart_names

    known = catalogue(own=args.own)
    target = Path(things[0])
    if things[0] in chart_names(known) or not target.is_dir():  # ./NAME is a folder
        target = chart_file(things[0], known)
    return _show(EditedCharts(target, known, args.profile, args.host), args)


def _watch_url(things: Sequence[str], args: argparse.Namespace) -> int:
    if things[1:]:
        raise Problem("one URL at a time, and nothing else beside it")
    if not args.tty:
        raise Problem(f"open {things[0]} in a browser, or add --tty to see it in this terminal")
    from cobodeck.live import FarLink, watch_in_terminal

    return watch_in_terminal(FarLink(things[0]))


def _watch_records(things: Sequence[str], args: argparse.Namespace) -> int:
    if len(things) > 2 or not all(map(is_record, things)):
        raise Problem("one record, or two: X.mcap Y.mcap")
    from cobodeck.live.sources import RecordSource

    return _show(RecordSource([Path(thing) for thing in things]), args)


def _show(source: Source, args: argparse.Namespace) -> int:
    if args.tty:
        from cobodeck.live import NearLink, watch_in_terminal

        return watch_in_terminal(NearLink(source))
    from cobodeck.live import PageAddress, show_source

    show_source(source, PageAddress(args.host, args.port), _say)
    return OK


def _say(line: str) -> None:
    show(line)
    sys.stdout.flush()
