"""Kinds of arguments that several commands take; what is wrong is said in the field's words."""

from __future__ import annotations

import argparse
import math
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

from cobodeck.record.sink import ENDING, PART

if TYPE_CHECKING:
    from hw.geometry import Pose2

LONGEST_S = 1e7
"""Four months: longer runs are a mistake."""
FARTHEST_M = 1000.0


def positive(text: str) -> int:
    """A whole number above 0."""
    try:
        value = int(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is no whole number") from None
    if value < 1:
        raise argparse.ArgumentTypeError(f"{text} is not above 0")
    return value


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


def pose(text: str) -> Pose2:
    """Where something stands: x, y, m, and yaw, rad."""
    from hw.geometry import Pose2

    try:
        x, y, yaw = (float(part) for part in text.split(","))
        return Pose2.checked(x, y, yaw)
    except ValueError:
        hint = "x,y in m and yaw in rad, as 1.5,-2,0.3"
        raise argparse.ArgumentTypeError(f"{text!r} is no pose: {hint}") from None


def word(text: str) -> str:
    """A name or file; an empty text, as of a variable that is not set, is none."""
    if not text.strip():
        raise argparse.ArgumentTypeError("is empty; give a name or a file")
    return text


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


def kept_file(text: str) -> Path:
    """A file for a record or a trace; not one that is only half written."""
    if text.endswith(PART):
        raise argparse.ArgumentTypeError(
            f"{text}: names that end in {PART} are of unfinished files"
        )
    return Path(text)


def new_record(text: str) -> Path:
    """Where a record is to be written."""
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
