"""Save the intact beginning of a record that was cut off or damaged, in a new file.

A run that was killed leaves X.mcap.part with all but its last second. That file is not changed.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cobodeck.terminal import FAILED, OK, USAGE, Problem, json_options, new_record, show, show_json

if TYPE_CHECKING:
    from cobodeck.record.read import Record
    from cobodeck.record.write import Extent


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument("file", type=Path, metavar="FILE", help="X.mcap.part or X.mcap")
    parser.add_argument(
        "-o",
        dest="out",
        type=new_record,
        metavar="Y.mcap",
        help="default X.recovered.mcap, beside it",
    )
    json_options(parser)


def run(args: argparse.Namespace) -> int:
    """Recover."""
    from cobodeck.record.read import Record
    from cobodeck.record.write import extent

    record = Record(args.file)
    found = extent(record)
    if found.end_ns is None:
        told = found.broken or "it has none"
        raise Problem(f"{record.path}: no complete tick: {told}", FAILED)
    path = None if found.broken is None else _written(record, found, args.out)
    if args.json:
        show_json(_extent_values(record, found, path))
    else:
        show(_summary(record, found, path))
    return OK


def _written(record: Record, found: Extent, out: Path | None) -> Path:
    """Write the intact part to a new file.

    Raises:
        Problem: the requested file exists, or cannot be written.
    """
    from cobodeck.record.format import Sink, Taken, open_free
    from cobodeck.record.write import recover

    named = out or _beside(record.path)
    try:
        sink = open_free(named) if out is None else Sink(named)
    except Taken as taken:
        raise Problem(str(taken), USAGE) from None
    except OSError as error:
        raise Problem(f"{named}: {error.strerror}", FAILED) from None
    try:
        recover(record, found, sink)
    except BaseException:
        sink.remove()
        raise
    path = sink.finish()
    if path is None:
        sink.remove()
        raise Problem(f"{named}: {sink.error and sink.error.strerror}", FAILED)
    return path


def _beside(path: Path) -> Path:
    from cobodeck.terminal import ENDING, PART

    name = path.name.removesuffix(PART).removesuffix(ENDING)
    return path.with_name(f"{name}.recovered{ENDING}")


def _extent_values(record: Record, found: Extent, path: Path | None) -> dict[str, Any]:
    return {
        "file": str(record.path),
        "whole": found.broken is None,
        "broken": found.broken,
        "ticks": found.ticks,
        "end_s": None if found.end_ns is None else found.end_ns / 1e9,
        "damaged": list(found.damaged),
        "recovered_file": path and str(path),
    }


def _summary(record: Record, found: Extent, path: Path | None) -> str:
    from cobodeck.terminal import PART

    assert found.end_ns is not None, "there is no tick"
    length = f"{found.end_ns / 1e9:.1f} s, {found.ticks} ticks"
    lines = [f"{path}: {length}; of {record.path} the rest is lost: {found.broken}"]
    if path is None:
        name = f"; rename it to {record.path.with_suffix('')}"
        unnamed = name if record.path.suffix == PART else ""
        lines = [f"{record.path} is whole, nothing was written: {length}{unnamed}"]
    lines += [f"{name} in it is damaged" for name in found.damaged]
    return "\n".join(lines)
