"""Run a chart on a robot, in real time.

There are no drivers for real robots yet; `mock` does exactly as told, at the next tick.
"""

from __future__ import annotations

import argparse

from cobodeck.arguments import positive, seconds, word
from cobodeck.commands import simulate
from cobodeck.console import REFUSED, Problem
from cobodeck.wiring import PROFILE, SCENE, TICK_HZ

BLOCKED_S = 0.1
"""A tick that takes longer, s, is told with what blocks it: three periods at 30 Hz."""


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument("chart", type=word, metavar="CHART", help="name or file")
    parser.add_argument("--robot", required=True, help="mock")
    parser.add_argument("--scene", type=word, default=SCENE, help=f"name or file; default {SCENE}")
    parser.add_argument(
        "--user", type=word, metavar="NAME|FILE", help="default: the one of the scene"
    )
    parser.add_argument("--requests", type=positive, metavar="N", help="end after so many")
    parser.add_argument(
        "--profile", type=word, default=PROFILE, help=f"name or file; default {PROFILE}"
    )
    parser.add_argument("--seed", type=int, default=0, help="of everything random; default 0")
    parser.add_argument("--duration", type=seconds, default=3600.0, metavar="S", help="end by then")
    parser.add_argument(
        "--tick-hz", type=positive, default=TICK_HZ, metavar="HZ", help=f"default {TICK_HZ}"
    )
    parser.add_argument("--fast", action="store_true", help="as fast as it goes")
    parser.add_argument("--json", action="store_true", help="for programs")


def run(args: argparse.Namespace) -> int:
    """Run on the mock."""
    if args.robot != "mock":
        raise Problem(
            f"--robot {args.robot}: nothing drives a real robot yet, and a chart has to have "
            "passed a simulation before; use --robot mock, or cobodeck simulate",
            REFUSED,
        )
    from cobodeck.clocks import RealTime, Virtual
    from cobodeck.stage import Options

    options = Options(
        user=args.user,
        requests=args.requests,
        seed=args.seed,
        duration_s=args.duration,
        mock=True,
    )
    if args.fast:
        return simulate.report_on(args, options, Virtual())
    return simulate.report_on(args, options, RealTime(), blocked_s=BLOCKED_S)
