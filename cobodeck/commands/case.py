"""Write a test that plays a moment of a recorded run: its samples, the chart, what followed.

The test is played before it is kept: it passes with the code that is there, and fails once the
chart decides otherwise at the same samples.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from cobodeck.terminal import OK, Problem, instant, json_options, show, show_json, table


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument("file", type=Path, metavar="RECORD", help="X.mcap or X.mcap.part")
    parser.add_argument(
        "--at", type=instant, required=True, metavar="S", help="the moment, s in the run"
    )
    parser.add_argument(
        "-o", "--output", type=Path, metavar="FILE.py", help="default test_RECORD_Ss.py"
    )
    json_options(parser)


def run(args: argparse.Namespace) -> int:
    """Write it."""
    from cobodeck.project import catalogue
    from cobodeck.record.read import Record
    from cobodeck.review import write_case

    if args.output is not None and args.output.suffix != ".py":
        raise Problem(f"{args.output}: a test is a file FILE.py")
    written = write_case(Record(args.file), args.at, args.output, catalogue(own=args.own))
    if args.json:
        files = {"test": str(written.test), "data": str(written.data)}
        show_json({**files, "start_s": written.start_s, "followed": written.followed})
    else:
        rows = [("test", str(written.test)), ("samples", str(written.data))]
        rows += [("plays", f"from {written.start_s:.3f} s on")]
        rows += [("asserts" if n == 0 else "", line) for n, line in enumerate(written.followed)]
        show(table(rows))
    return OK
