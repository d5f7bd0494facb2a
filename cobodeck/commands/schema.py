"""Write the JSON Schema with which editors complete and check charts."""

from __future__ import annotations

import argparse
from pathlib import Path

from cobodeck.project import catalogue, schema_for
from cobodeck.terminal import OK, show


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument("-o", "--output", type=Path, metavar="FILE", help="default: print it")


def run(args: argparse.Namespace) -> int:
    """Print or write the schema."""
    text = schema_of(None, own=args.own)
    if args.output is None:
        show(text.rstrip("\n"))
        return OK
    args.output.parent.mkdir(parents=True, exist_ok=True)
    args.output.write_text(text, encoding="utf-8")
    show(str(args.output))
    return OK


def schema_of(start: Path | None, *, own: bool) -> str:
    """The schema for charts of the project around `start`, if `own`, and of the shipped ones."""
    return schema_for(catalogue(start, own=own))
