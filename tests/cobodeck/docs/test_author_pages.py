"""The pages for authors: every chart is right, every test passes, every command works as typed."""

from __future__ import annotations

import re
import runpy
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from cobodeck.project import Catalogue, findings_of, own_files_around, strictly
from cobodeck.terminal import OK
from cobodeck.testing import ChartTester
from engine import text as report_text
from engine.chart import Library
from engine.files.declared import with_own_files
from tests.cobodeck.docs.author_pages import (
    AUTHOR_PAGES,
    DOCS,
    PACKAGE,
    PageTest,
    blocks,
    page_tests,
    shown_charts,
    write_blocks,
)
from tests.cobodeck.docs.test_first_hour import shell  # noqa: F401  a fixture

EXIT = re.compile(r"# exit code (\d)")
"""At the end of a command that is not to end with 0."""
COMMANDS = [page for page in AUTHOR_PAGES if any(b.language == "sh" for b in blocks(page))]
LANGUAGES = {"yaml", "python", "sh", "text"}
FOREIGN = {"py", "xml"}
"""Languages of what others' programs read."""


@pytest.mark.slow
def test_every_chart_of_the_pages_passes_the_strict_checks(
    author_project: Path, author_catalogue: Catalogue, author_library: Library
) -> None:
    files = shown_charts(author_project)
    with with_own_files(own_files_around(author_project)):
        found = strictly(findings_of(author_library, author_catalogue, files))

    assert len(files) >= 14
    assert not found, report_text(found, author_library.sources)


def test_no_block_of_a_page_is_left_out() -> None:
    for block in blocks():
        assert block.language in LANGUAGES | FOREIGN, block
        if block.language in {"yaml", "python"}:
            assert block.file is not None, f"{block.page}:{block.line} has no name"


LONGEST = {"chart-language.md": 190}
"""Lines beside the examples, where more than 90: it has every form of the language on one page."""


@pytest.mark.parametrize("page", AUTHOR_PAGES)
def test_a_page_is_short_beside_its_examples(page: str) -> None:
    text = (DOCS / page).read_text(encoding="utf-8")
    said = re.sub(r"^```.*?^```$", "", text, flags=re.MULTILINE | re.DOTALL)

    assert len(said.splitlines()) <= LONGEST.get(page, 90)


def test_the_index_has_every_page() -> None:
    linked = {
        match
        for page in ("README.md", "cookbook.md")
        for match in re.findall(r"\]\(([\w/-]+\.md)\)", (DOCS / page).read_text("utf-8"))
    }

    assert {*AUTHOR_PAGES, "first-hour.md", "ten-minutes.md"} <= linked
    assert {p.relative_to(DOCS).as_posix() for p in DOCS.glob("*.md")} - {"README.md"} <= linked


def test_a_name_is_used_once_by_all_pages() -> None:
    files = [block.file for block in blocks() if block.file is not None and not block.at_the_end]

    assert sorted(files) == sorted(set(files))


def _marked(shown: PageTest) -> Any:
    marks = [pytest.mark.slow] if shown.slow else []
    return pytest.param(shown, id=f"{shown.block.page}-{shown.name}", marks=marks)


@pytest.mark.parametrize("shown", [_marked(shown) for shown in page_tests()])
def test_a_test_that_a_page_shows_passes(shown: PageTest, page_sim: ChartTester) -> None:
    kept: dict[str, str] = {}

    def golden(name: str, text: str) -> None:
        assert kept.setdefault(name, text) == text

    function = _function(shown)
    wanted = function.__code__.co_varnames[: function.__code__.co_argcount]
    given: dict[str, Any] = {"sim": page_sim, "golden": golden}
    for _ in range(2 if "golden" in wanted else 1):  # the second time it is compared
        function(**{name: given[name] for name in wanted})


def _function(shown: PageTest) -> Callable[..., None]:
    name = f"{shown.block.page}:{shown.block.line}"
    namespace: dict[str, Any] = {"__name__": shown.name}
    exec(compile(shown.block.text, name, "exec", dont_inherit=True), namespace)
    function: Callable[..., None] = namespace[shown.name]
    return function


PROGRAMS = [str(b.file) for b in blocks() if re.fullmatch(r"\w+\.py", b.file or "")]


@pytest.mark.parametrize("program", PROGRAMS)
def test_a_program_that_a_page_shows_runs(program: str, author_project: Path) -> None:
    try:
        runpy.run_path(str(author_project / program))
    finally:
        for other in PROGRAMS:
            sys.modules.pop(Path(other).stem, None)


def test_a_failure_reads_as_the_page_shows(page_sim: ChartTester) -> None:
    (shown,) = (b.text for b in blocks("testing.md") if b.language == "text")
    page_sim.start("bring_it", script={"drive": "arrived"}, real=["Below"])
    with pytest.raises(AssertionError) as failed:
        page_sim.until("taken", timeout=2)

    assert str(failed.value) == shown.rstrip()


@pytest.mark.slow
@pytest.mark.parametrize("page", COMMANDS)
def test_every_command_of_a_page_works_as_it_is_typed(
    page: str,
    tmp_path: Path,
    shell: dict[str, str],  # noqa: F811
) -> None:
    subprocess.run(["cobodeck", "new", PACKAGE], cwd=tmp_path, env=shell, check=True)
    folder = tmp_path / PACKAGE
    write_blocks(folder)
    for block in blocks(page):
        if block.language != "sh":
            continue
        for line in block.text.splitlines():
            if line.startswith("cd "):
                folder = (folder / line[3:].partition("#")[0].strip()).resolve()
                continue
            done = subprocess.run(
                line, shell=True, cwd=folder, env=shell, capture_output=True, text=True
            )
            told = EXIT.search(line)
            wanted = int(told[1]) if told else OK
            assert done.returncode == wanted, f"{page}: {line}\n{done.stdout}{done.stderr}"
