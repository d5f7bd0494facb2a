"""Run a chart on a robot, in real time.

The robot is a connection, which says what serves each part; `cobodeck list connections` lists them.
`mock` does exactly as told, at the next tick. At a terminal the operator types: ack, stop, reset,
end.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Container, Iterable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from cobodeck.commands.run_and_report import report_on
from cobodeck.fitness import BAD, FIT, CheckResult, ask
from cobodeck.real import WORDS
from cobodeck.setup import PROFILE, TICK_HZ
from cobodeck.terminal import (
    REFUSED,
    Problem,
    complain,
    inputs,
    json_options,
    live,
    new_record,
    positive,
    profile,
    seconds,
    shadow,
    word,
)

if TYPE_CHECKING:
    from cobodeck.setup import Options, Setup
    from hw.connection import Connection

BLOCKED_S = 0.1
"""Ticks longer than this, s, are reported with the node that blocks them: 3 periods at 30 Hz."""


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument(
        "chart",
        nargs="?",
        type=word,
        metavar="CHART",
        help="name or file; default: the one that the profile names",
    )
    inputs(parser)
    parser.add_argument("--robot", required=True, type=word, help="name or file of a connection")
    about = "name or file; default: the one that the connection names, else no room"
    parser.add_argument("--scene", type=word, help=about)
    parser.add_argument(
        "--user",
        type=word,
        metavar="NAME|FILE",
        help="as in simulate; default: the scene's",
    )
    parser.add_argument("--requests", type=positive, metavar="N", help="end after N requests")
    profile(parser, PROFILE)
    parser.add_argument("--seed", type=int, default=0, help="of all random numbers; default 0")
    parser.add_argument(
        "--duration", type=seconds, default=3600.0, metavar="S", help="longest time"
    )
    parser.add_argument(
        "--tick-hz", type=positive, default=TICK_HZ, metavar="HZ", help=f"default {TICK_HZ}"
    )
    parser.add_argument(
        "--record", type=new_record, metavar="X.mcap", help="the record; default: a new one in out/"
    )
    live(parser)
    parser.add_argument(
        "--fast", action="store_true", help="without waiting for real time; the mock only"
    )
    parser.add_argument(
        "--person-unwatched",
        action="store_true",
        help="run although no part tracks people, because nobody can be near",
    )
    parser.add_argument(
        "--passed",
        type=Path,
        nargs="+",
        metavar="X.mcap",
        help="records of what was tried before; default: those in out/",
    )
    parser.add_argument(
        "--although",
        action="append",
        default=[],
        choices=tuple(WORDS.values()),
        metavar="WORDS",
        help="run a real robot although " + " or ".join(map(repr, WORDS.values())),
    )
    shadow(parser)
    json_options(parser)


def run(args: argparse.Namespace) -> int:
    """Run on the mock, or on real parts."""
    from cobodeck.loop import RealTime, Virtual
    from cobodeck.setup import Options
    from hw.connection import connection_names, load_connection
    from hw.model import robot_names

    if args.robot in robot_names():
        there = ", ".join(connection_names())
        raise Problem(f"--robot {args.robot}: is a body without drivers; connections: {there}")
    connection = load_connection(args.robot)
    mock = connection.plant == "mock"
    if not mock and args.fast:
        raise Problem(f"--fast is for the mock; {args.robot} runs in real time")
    options = Options(
        user=args.user,
        requests=args.requests,
        seed=args.seed,
        duration_s=args.duration,
        mock=mock,
        connection=None if mock else connection,
        console=None if args.fast or not sys.stdin.isatty() else sys.stdin,
        unwatched=args.person_unwatched,
    )
    before = partial(_look_first, args, options)
    if args.fast:
        return report_on(args, options, Virtual(), before=before)
    return report_on(args, options, RealTime(), BLOCKED_S, before)


def _look_first(args: argparse.Namespace, options: Options, setup: Setup) -> None:
    """Report what the operator must know of a connection; check that a real robot may move.

    Raises:
        Problem: the robot may not move.
    """
    from cobodeck.real import in_this_run

    connection = setup.connection
    assert connection is not None
    _say(ask("run", connection=connection))
    if options.mock:
        return
    packages, here = setup.catalogue.packages, in_this_run(connection)
    _say(ask("devices", connection=here, packages=packages, options=options))
    if connection.real:
        from cobodeck.real import prior_runs

        prior = prior_runs(setup, options.plays_dummy, args.passed, args.although)
        _say(ask("real", connection=connection, prior=prior, although=args.although))
        _require_ready(connection, packages)
        _say(ask("moves", connection=connection))


def _say(answers: Iterable[CheckResult]) -> None:
    """Say what is not simply well.

    Raises:
        Problem: an answer is bad.
    """
    for answer in answers:
        answer.require()
        if answer.state != FIT:
            complain(answer.message)


def _require_ready(connection: Connection, packages: Container[str]) -> None:
    """Check that everything is there that the connection needs.

    Raises:
        Problem: it names all that is not.
    """
    found = ask("doctor", connection=connection, packages=packages)
    bad = [f"  {answer.what}: {answer.explanation}" for answer in found if answer.state == BAD]
    if bad:
        listed = "\n".join(bad)
        raise Problem(f"{connection.name} is not ready (`cobodeck doctor`):\n{listed}", REFUSED)
