"""Check this machine: versions, libraries, packages that shadow ours, Graphviz.

With --scene: check that a room suits its robot, how far from a wall a user who faces it has to
stand, and where there is no Haptic pose. With --tracking: check a calibration. With --robot: check
everything that a connection needs; nothing of it is opened, and nothing moves. Exit code 1: some
check failed.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from pathlib import Path

from cobodeck.fitness import BAD, CheckResult, ask
from cobodeck.setup import PROFILE
from cobodeck.terminal import FAILED, OK, json_options, profile, show, show_json, table, word


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument("--scene", type=word, metavar="S", help="name or file of a room")
    parser.add_argument(
        "--tracking", type=Path, metavar="FILE", help="a calibration that `calibrate` has written"
    )
    parser.add_argument("--robot", type=word, metavar="R", help="name or file of a connection")
    profile(parser, PROFILE)
    json_options(parser)


def run(args: argparse.Namespace) -> int:
    """Run all checks, with advice for those that fail."""
    found = list(ask("machine"))
    if args.scene is not None:
        found += _of_scene(args)
    if args.tracking is not None:
        from hw.model import load_tracking

        found += ask("doctor", tracking=load_tracking(args.tracking))
    if args.robot is not None:
        found += _of_connection(args)
    lines = [answer.line for answer in found]
    if args.json:
        keys = ("what", "state", "about")
        show_json({"checks": [dict(zip(keys, line, strict=True)) for line in lines]})
    else:
        show(table([("what", "is", ""), *lines]))
    return FAILED if any(answer.state == BAD for answer in found) else OK


def _of_scene(args: argparse.Namespace) -> Iterator[CheckResult]:
    """Whether a room suits its robot with the profile's values."""
    from cobodeck.checks import floor_report
    from cobodeck.project import catalogue
    from cobodeck.setup import open_place, profile_with
    from hw.model import load_robot

    place, values = open_place(args.scene), profile_with(args.profile, args.sets)
    yield from ask(
        "doctor",
        place=place,
        floor=floor_report(args.scene, values),
        robot=load_robot(place.scene.robot),
        profile=values,
        known=catalogue(own=args.own),
    )


def _of_connection(args: argparse.Namespace) -> Iterator[CheckResult]:
    """Whether everything is there that a connection needs, and what its robot can do."""
    from cobodeck.project import catalogue
    from cobodeck.setup import profile_with
    from hw.connection import load_connection
    from hw.model import load_robot

    connection = load_connection(args.robot)
    known = catalogue(own=args.own)
    yield from ask("doctor", connection=connection, packages=known.packages)
    for entry, _, driver in connection.drivers:
        yield from ask("doctor", driver=driver, model=connection.model, entry=entry)
    if connection.model is not None:
        body = connection.limits.body(load_robot(connection.model))
        values = profile_with(args.profile, args.sets).narrowed(connection.limits)
        yield from ask("doctor", robot=body, profile=values, known=known)
