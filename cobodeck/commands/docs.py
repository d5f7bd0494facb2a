"""Write reference pages: states, signals, charts and files, with those of your project.

Without -o the names of the pages are listed; `cobodeck list states DriveTo` shows a single entry.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from cobodeck.manual import manual_pages, markdown_text
from cobodeck.project import catalogue
from cobodeck.terminal import OK, Problem, show, table


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument("-o", "--output", type=Path, metavar="DIR", help="write the pages here")


def run(args: argparse.Namespace) -> int:
    """List the pages, or write them."""
    pages = list(manual_pages(catalogue(own=args.own)))
    if args.output is None:
        rows = [(page.name, f"{len(page.entries)} entries", page.title) for page in pages]
        show(f"{table(rows)}\n\n`cobodeck docs -o DIR` writes them as Markdown.")
        return OK
    folder: Path = args.output
    if folder.exists() and not folder.is_dir():
        raise Problem(f"{folder} is a file; -o names a folder")
    folder.mkdir(parents=True, exist_ok=True)
    for page in pages:
        file = folder / f"{page.name}.md"
        file.write_text(markdown_text(page), encoding="utf-8")
        show(str(file))
    return OK
