"""All reference pages, of what is shipped and, in a project, of its own."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

from cobodeck.manual.chart_entries import chart_page
from cobodeck.manual.file_entries import file_page
from cobodeck.manual.page import ManualPage
from cobodeck.manual.signal_entries import signal_page
from cobodeck.manual.state_entries import state_page
from cobodeck.project import Catalogue, chart_names
from engine.chart import load_files
from hw.model import load_robot

REFERENCE = Path(__file__).parent.parent / "docs" / "reference"
"""The pages of what is shipped."""
_ROBOT = "rbkairos_ur10"
"""The robot whose rates are told."""


def _charts(known: Catalogue) -> ManualPage:
    library = load_files(chart_names(known).values())
    return chart_page(known, known.tuned.apply(library, ()))


def _signals(known: Catalogue) -> ManualPage:
    return signal_page(known, known.signals, load_robot(_ROBOT))


_PAGES: Mapping[str, Callable[[Catalogue], ManualPage]] = {
    "states": state_page,
    "signals": _signals,
    "charts": _charts,
    "files": lambda _: file_page(),
}
NAMES = {
    "states": "what charts can do and watch for",
    "signals": "what states read",
    "charts": "what charts can use",
    "files": "the keys of every kind of file",
}
"""The pages by name, each with what is in it."""


def manual_pages(known: Catalogue) -> Iterator[ManualPage]:
    """The pages, each made when it is asked for.

    Raises:
        FileError: a chart of the project has mistakes.
    """
    for make in _PAGES.values():
        yield make(known)


def manual_page(name: str, known: Catalogue) -> ManualPage:
    """The page of this name."""
    return _PAGES[name](known)
