"""Run a chart on the simulated robot, beside a scripted or recorded user."""

from __future__ import annotations

import argparse

from cobodeck.commands.run_and_report import report_on
from cobodeck.setup import PROFILE, SCENE, TICK_HZ
from cobodeck.terminal import (
    Problem,
    inputs,
    is_record,
    json_options,
    kept_file,
    length,
    live,
    positive,
    profile,
    seconds,
    shadow,
    word,
)


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument(
        "chart", nargs="?", type=word, help="name or file; default: the one that the profile names"
    )
    inputs(parser)
    about = f"name or file, or a map: FILE.yaml[@x,y,yaw]; default {SCENE}"
    parser.add_argument("--scene", type=word, help=about)
    parser.add_argument(
        "--robot",
        type=word,
        help="name or file of a robot, or of a connection, for its body and limits; default the "
        "scene's; without --scene: no room",
    )
    parser.add_argument(
        "--user",
        type=word,
        metavar="NAME|FILE",
        help="NAME, random, route or FILE[#id][@x,y,yaw][:KIND][ at SPEED]; X.mcap: the person of "
        "a record; :KIND: how they treat the robot, by default attentive (`list users`); "
        "at SPEED: of random people, 0.5 to 1.5 m/s else; default: the scene's",
    )
    parser.add_argument("--requests", type=positive, metavar="N", help="end after N requests")
    profile(parser, PROFILE)
    parser.add_argument(
        "--tier",
        type=int,
        default=1,
        choices=(0, 1, 2, 3),
        help="0: logic alone, leaves end by chance; 1: reduced; 2: with all sensors; 3: base and "
        "arm moved by physics, too (needs the extra `reference`); default 1",
    )
    parser.add_argument("--seed", type=int, default=0, help="of all random numbers; default 0")
    parser.add_argument(
        "--tick-hz", type=positive, default=TICK_HZ, metavar="HZ", help=f"default {TICK_HZ}"
    )
    about = "longest simulated time; default: an hour, or three minutes per request"
    parser.add_argument("--duration", type=seconds, metavar="S", help=about)
    parser.add_argument(
        "--stretch",
        type=length,
        metavar="M",
        help="scale a recorded walk so that its longer side has this length",
    )
    parser.add_argument(
        "--heading",
        choices=("centred", "causal"),
        default="centred",
        help="headings of a recorded walk: of the body, which turns before it walks, or of the way "
        "just walked; default centred",
    )
    parser.add_argument(
        "--up",
        choices=("z", "y", "y-right"),
        help="the axis of a recorded walk that is up: z, the floor is x, y; y of a left-handed "
        "frame (Unity), the floor is x, z; y of a right-handed one (OpenVR, OpenXR), x, -z; "
        "default z, unless y looks like a head's height",
    )
    parser.add_argument(
        "--record",
        type=kept_file,
        metavar="FILE",
        help="X.mcap: record all of the run; else its trace alone, by default in out/",
    )
    live(parser)
    parser.add_argument(
        "--judge",
        action="store_true",
        help="with --record X.mcap: count the contacts that could have been avoided",
    )
    parser.add_argument("--explain", action="store_true", help="report what was built and computed")
    parser.add_argument("--no-skip", action="store_true", help="compute every signal in every tick")
    parser.add_argument(
        "--frozen-base", action="store_true", help="the base does not move; for trying tests"
    )
    shadow(parser)
    json_options(parser)


def run(args: argparse.Namespace) -> int:
    """Simulate, record, report."""
    if args.judge and (args.record is None or not is_record(args.record)):
        raise Problem("--judge judges the record of the run: add --record X.mcap")
    from cobodeck.setup import Options, longest_s

    options = Options(
        user=args.user,
        requests=args.requests,
        stretch_m=args.stretch,
        heading=args.heading,
        up=args.up,
        tier=args.tier,
        seed=args.seed,
        duration_s=args.duration or longest_s(args.requests),
        eager=args.no_skip,
        frozen_base=args.frozen_base,
        timed=args.explain,
    )
    return report_on(args, options)
