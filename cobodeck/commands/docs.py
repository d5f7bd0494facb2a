"""Write reference pages: states, signals, charts and files, with those of your project.

Without -o the names of the pages are listed; `cobodeck list states DriveTo` shows a single entry.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from cobodeck.manual import NAMES, manual_pages, markdown_text
from cobodeck.project import catalogue
from cobodeck.terminal import OK, Problem, show, table


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument("-o", "--output", type=Path, metavar="DIR", help="write the pages here")


def run(args: argparse.Namespace) -> int:
    """List the pages, or write them."""
    folder: Path | None = args.output
    if folder is None:
        rows = [(f"{name}.md", about) for name, about in NAMES.items()]
        show(f"{table(rows)}\n\n`cobodeck docs -o DIR` writes them as Markdown.")
        return OK
    if folder.exists() and not folder.is_dir():
        raise Problem(f"{folder} is a file; -o names a folder")
    pages = [(page.name, markdown_text(page)) for page in manual_pages(catalogue(own=args.own))]
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in pages:
        file = folder / f"{name}.md"
        file.write_text(text, encoding="utf-8")
        show(str(file))
    return OK
