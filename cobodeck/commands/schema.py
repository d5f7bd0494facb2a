"""Write the JSON Schema with which editors complete and check files of a kind."""

from __future__ import annotations

import argparse
from pathlib import Path

from cobodeck.project import KINDS, catalogue
from cobodeck.terminal import OK, show
from cobodeck.validation import schema_for


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    kinds = ", ".join(KINDS)
    parser.add_argument(
        "kind",
        nargs="?",
        choices=KINDS,
        default="chart",
        metavar="KIND",
        help=f"{kinds}; default: chart",
    )
    parser.add_argument("-o", "--output", type=Path, metavar="FILE", help="default: print it")


def run(args: argparse.Namespace) -> int:
    """Print or write the schema."""
    text = schema_of(args.kind, None, own=args.own)
    if args.output is None:
        show(text.rstrip("\n"))
        return OK
    args.output.parent.mkdir(parents=True, exist_ok=True)
    args.output.write_text(text, encoding="utf-8")
    show(str(args.output))
    return OK


def schema_of(kind: str, start: Path | None, *, own: bool) -> str:
    """The schema of a kind of file.

    That of charts has the states and charts of the project around `start`, if `own`, too.
    """
    return schema_for(kind, catalogue(start, own=own))
