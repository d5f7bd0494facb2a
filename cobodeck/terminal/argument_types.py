"""Parsers of arguments that several commands take, with error messages in the field's terms."""

from __future__ import annotations

import argparse
import math
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

from cobodeck.terminal.record_names import ENDING, PART

if TYPE_CHECKING:
    from hw import Pose2

LONGEST_S = 1e7
"""Longest accepted duration, s: about four months."""
FARTHEST_M = 1000.0


def count(text: str) -> int:
    """A whole number, 0 or more."""
    value = _whole(text)
    if value < 0:
        raise argparse.ArgumentTypeError(f"{text} is below 0")
    return value


def positive(text: str) -> int:
    """A whole number above 0."""
    value = _whole(text)
    if value < 1:
        raise argparse.ArgumentTypeError(f"{text} is not above 0")
    return value


def _whole(text: str) -> int:
    try:
        return int(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is no whole number") from None


def seconds(text: str) -> float:
    """A duration above 0 s."""
    return _number(text, LONGEST_S, "s")


def instant(text: str) -> float:
    """A time since the start, s."""
    with suppress(ValueError):
        if 0.0 <= float(text) < math.inf:
            return float(text)
    raise argparse.ArgumentTypeError(f"{text} is no time, s")


def length(text: str) -> float:
    """A length above 0 m."""
    return _number(text, FARTHEST_M, "m")


def address(text: str) -> tuple[str, int]:
    """`PORT`, or `HOST:PORT`; port 0: a free one. Without a host: this machine alone."""
    host, _, number = text.rpartition(":")
    return host.strip("[]") or "127.0.0.1", port(number)


def port(text: str) -> int:
    """A port; 0: a free one."""
    if not text.isdecimal() or not int(text) < 1 << 16:
        raise argparse.ArgumentTypeError(f"{text!r} is no port, 0 to 65535")
    return int(text)


def pose(text: str) -> Pose2:
    """A pose in the map, `x,y,yaw`; m, m, rad."""
    from hw import Pose2

    try:
        x, y, yaw = (float(part) for part in text.split(","))
        return Pose2.checked(x, y, yaw)
    except ValueError:
        hint = "x,y in m and yaw in rad, as 1.5,-2,0.3"
        raise argparse.ArgumentTypeError(f"{text!r} is no pose: {hint}") from None


def scan_mounts(parser: argparse.ArgumentParser) -> None:
    """Declare `--scan-mount`: the mounts of scanners, by name."""
    parser.add_argument(
        "--scan-mount", dest="scan_mounts", action="append", default=[], type=_mount,
        metavar="[NAME=]X,Y,YAW",
        help="a scanner's pose on the base, m and rad; of several scanners, that of NAME; may be "
        "given several times; default: that in the log",
    )  # fmt: skip


def _mount(text: str) -> tuple[str, Pose2]:
    name, equals, at = text.rpartition("=")
    if equals and not name:
        raise argparse.ArgumentTypeError(f"{text!r} names no scanner, as in front=0.2,0,0")
    return name, pose(at)


def word(text: str) -> str:
    """A name or file; an empty text, as from an unset shell variable, is refused."""
    if not text.strip():
        raise argparse.ArgumentTypeError("is empty; give a name or a file")
    return text


def live(parser: argparse.ArgumentParser) -> None:
    """Declare `--live`: a page of the run, on a port of this machine or another address."""
    parser.add_argument(
        "--live",
        nargs="?",
        type=address,
        const=("127.0.0.1", 0),
        metavar="PORT|HOST:PORT",
        help="a page in the browser that shows the run and can steer it; without PORT a free one, "
        "without HOST for this machine alone",
    )


def shadow(parser: argparse.ArgumentParser) -> None:
    """Declare `--shadow`."""
    parser.add_argument(
        "--shadow",
        type=word,
        metavar="CHART",
        help="a second chart that sees the same signals and decides beside, commanding nothing",
    )


def profile(parser: argparse.ArgumentParser, default: str) -> None:
    """Declare `--profile` and `--set`."""
    parser.add_argument(
        "--profile", type=word, default=default, help=f"name or file; default {default}"
    )
    parser.add_argument(
        "--set",
        dest="sets",
        action="append",
        default=[],
        metavar="KEY=VALUE",
        help="one value of the profile, as in chase.inner='2.6 m'; may be given several times",
    )


def inputs(parser: argparse.ArgumentParser) -> None:
    """Declare `--in`."""
    parser.add_argument(
        "--in",
        dest="inputs",
        action="append",
        default=[],
        metavar="KEY=VALUE",
        help="one input of the chart, as in goal='{x: 2 m, y: 1 m}'; may be given several times",
    )


def kept_file(text: str) -> Path:
    """A path for a record or a trace; the suffix of unfinished files is refused."""
    if text.endswith(PART):
        raise argparse.ArgumentTypeError(
            f"{text}: names that end in {PART} are of unfinished files"
        )
    return Path(text)


def new_record(text: str) -> Path:
    """A path for a new record."""
    if not text.endswith(ENDING):
        raise argparse.ArgumentTypeError(f"{text!r} does not end in {ENDING}, as records do")
    return Path(text)


def _number(text: str, most: float, unit: str) -> float:
    try:
        value = float(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is no number of {unit}") from None
    if not 0.0 < value <= most or not math.isfinite(value):
        raise argparse.ArgumentTypeError(f"{text} is not above 0 {unit}, up to {most:g} {unit}")
    return value
