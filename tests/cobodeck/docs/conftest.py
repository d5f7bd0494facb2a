"""A project with all files that the pages for authors show."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from cobodeck.project import Catalogue, catalogue, known_names, load_beside, own_files_around
from cobodeck.testing import ChartTester, Parts
from engine.chart import Chart, Library
from engine.files.declared import with_own_files
from engine.machine import NamedValues
from tests.cobodeck.docs.author_pages import forget_modules, new_project, shown_charts, write_blocks


@pytest.fixture(scope="package")
def author_project(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """The project of the pages, in its folder; its modules are forgotten at the end."""
    root = new_project(tmp_path_factory.mktemp("authors"))
    write_blocks(root)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "path", [str(root), *sys.path])
        patch.setattr(sys, "dont_write_bytecode", True)
        yield root
    forget_modules()


@pytest.fixture(scope="package")
def author_catalogue(author_project: Path) -> Catalogue:
    """What charts in that project can name."""
    return catalogue(author_project)


@pytest.fixture(scope="package")
def author_library(author_project: Path, author_catalogue: Catalogue) -> Library:
    """All charts of the pages, read once, and those that they use."""
    with with_own_files(own_files_around(author_project)):
        return load_beside(shown_charts(author_project), author_catalogue)


@pytest.fixture(scope="package")
def author_names(
    author_project: Path, author_catalogue: Catalogue, author_library: Library
) -> NamedValues:
    """What these charts can name in a run."""
    with with_own_files(own_files_around(author_project)):
        return known_names(author_library, author_catalogue, for_run=True)


@pytest.fixture
def page_sim(
    author_project: Path,
    author_library: Library,
    author_names: NamedValues,
    parts: Parts,
    monkeypatch: pytest.MonkeyPatch,
) -> Iterator[ChartTester]:
    """The `sim` of a test in that project; charts are not read and checked for each start."""

    def read_before(name: str, _known: Catalogue) -> tuple[Chart, Library]:
        return author_library[Path(name).stem], author_library

    monkeypatch.setattr("cobodeck.testing.testing.open_chart", read_before)
    monkeypatch.setattr("cobodeck.testing.chart_only.known_names", lambda *_, for_run: author_names)
    tester = ChartTester(author_project / "tests", author_project, parts)
    with with_own_files(own_files_around(author_project)):
        yield tester
    tester.finish()
