"""Check this machine: versions, libraries, packages that shadow ours, Graphviz.

With --scene: check that a room suits its robot, how far from a wall a user who faces it has to
stand, and where there is no Haptic pose. With --tracking: check a calibration. With --robot: check
everything that a connection needs; nothing of it is opened, and nothing moves. Exit code 1: some
check failed.
"""

from __future__ import annotations

import argparse
import importlib.util
import platform
import re
import shutil
import sys
from collections.abc import Iterator
from importlib.metadata import PackageNotFoundError, requires, version
from pathlib import Path

from cobodeck.fitness import BAD, FIT, MISSING, DoctorLine, room_checks, tracking_checks
from cobodeck.setup import PROFILE, described, open_place
from cobodeck.shadowed import explained, shadows
from cobodeck.terminal import FAILED, OK, profile, show, show_json, table, word
from hw.connection import Connection, load_connection


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument("--scene", type=word, metavar="S", help="name or file of a room")
    parser.add_argument(
        "--tracking", type=Path, metavar="FILE", help="a calibration that `calibrate` has written"
    )
    parser.add_argument("--robot", type=word, metavar="R", help="name or file of a connection")
    profile(parser, PROFILE)
    parser.add_argument("--json", action="store_true", help="for programs")


def run(args: argparse.Namespace) -> int:
    """Run all checks, with advice for those that fail."""
    found = list(checks())
    if args.scene is not None:
        found += room_checks(args.scene, args.profile, args.sets)
        found += _arm_checks(open_place(args.scene).scene.robot, args)
    if args.tracking is not None:
        found += tracking_checks(args.tracking)
    if args.robot is not None:
        connection = load_connection(args.robot)
        found += connection_checks(connection, own=args.own)
        if connection.model is not None:
            found += _arm_checks(connection.model, args)
    if args.json:
        keys = ("what", "state", "about")
        show_json([dict(zip(keys, check, strict=True)) for check in found])
    else:
        show(table([("what", "is", ""), *found]))
    return FAILED if any(state == BAD for _, state, _ in found) else OK


def connection_checks(connection: Connection, *, own: bool) -> list[DoctorLine]:
    """Check that everything a connection needs is present."""
    from cobodeck.project import catalogue
    from cobodeck.real import preflight

    return list(preflight(connection, catalogue(own=own).packages))


def _arm_checks(robot: str | Path, args: argparse.Namespace) -> list[DoctorLine]:
    """Check how the arm of a robot is folded, and what a reach asks of it."""
    from cobodeck.fitness import arm_checks
    from cobodeck.setup import profile_with
    from hw.model import load_robot

    return list(arm_checks(load_robot(robot), profile_with(args.profile, args.sets)))


def checks() -> Iterator[tuple[str, str, str]]:
    """One line per check: what was checked, its state, what to do."""
    fit = sys.version_info >= (3, 11)
    yield "python", FIT if fit else BAD, f"{platform.python_version()}, 3.11 or newer is needed"
    yield "system", FIT, f"{platform.system()} {platform.machine()}"
    yield from _shadowed()
    yield from _libraries()
    yield _graphviz()
    yield "compiled code", FIT, described()


def _shadowed() -> Iterator[tuple[str, str, str]]:
    for name, file in shadows().items():
        yield f"package {name}", BAD, explained({name: file})


def _libraries() -> Iterator[tuple[str, str, str]]:
    try:
        needed = requires("cobodeck") or []
    except PackageNotFoundError:
        yield "cobodeck", MISSING, "not installed; `make demo` does it, or `pip install -e .`"
        return
    yield "cobodeck", FIT, version("cobodeck")
    for line in needed:
        requirement, _, marker = line.partition(";")
        name = re.split(r"[\[<>=!~ ]", requirement, maxsplit=1)[0]
        try:
            yield name, FIT, version(name)
        except PackageNotFoundError:
            if "extra" not in marker:
                yield name, MISSING, _advice(requirement.strip(), marker.strip())


def _advice(requirement: str, marker: str) -> str:
    if marker:
        drives = "no UR arm can be driven from here; " * requirement.startswith("ur-rtde")
        return f"there may be none for this machine ({marker}); {drives}the rest works without it"
    return f"pip install {requirement!r}"


def _graphviz() -> tuple[str, str, str]:
    if importlib.util.find_spec("pygraphviz") is not None:
        return "graphviz", FIT, "comes with pygraphviz"
    if shutil.which("dot") is not None:
        return "graphviz", FIT, "the program dot"
    return "graphviz", MISSING, "render makes only .dot and .mmd; pip install pygraphviz"
