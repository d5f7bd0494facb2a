"""The pages for authors: every chart is right, every test passes, every command works as typed."""

from __future__ import annotations

import re
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from cobodeck.project import Catalogue, findings_of, own_files_around, strictly
from cobodeck.terminal import OK
from cobodeck.testing import ChartTester, RecordedCase
from engine import text as report_text
from engine.chart import Library
from engine.files.declared import with_own_files
from tests.cobodeck.docs.author_pages import (
    AUTHOR_PAGES,
    PageTest,
    blocks,
    new_project,
    page_tests,
    shown_charts,
    write_blocks,
)
from tests.cobodeck.docs.test_first_hour import shell  # noqa: F401  a fixture

EXIT = re.compile(r"# exit code (\d)")
"""At the end of a command that is not to end with 0."""
COMMANDS = [page for page in AUTHOR_PAGES if any(b.language == "sh" for b in blocks(page))]
LANGUAGES = {"yaml", "python", "sh", "text", "lua", "json", "lisp", "xml"}


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
        assert block.language in LANGUAGES, block
        if block.language == "yaml":
            assert block.file is not None, f"{block.page}:{block.line} has no name"


def test_a_name_is_used_once_by_all_pages() -> None:
    files = [block.file for block in blocks() if block.file is not None and not block.at_the_end]

    assert sorted(files) == sorted(set(files))


def _marked(shown: PageTest) -> Any:
    marks = [pytest.mark.slow] if shown.slow else []
    return pytest.param(shown, id=f"{shown.block.page}-{shown.name}", marks=marks)


@pytest.mark.parametrize("shown", [_marked(shown) for shown in page_tests()])
def test_a_test_that_a_page_shows_passes(
    shown: PageTest, page_sim: ChartTester, author_project: Path, golden: Any
) -> None:
    name = f"{shown.block.page}:{shown.block.line}"
    namespace: dict[str, Any] = {"__name__": shown.name}
    exec(compile(shown.block.text, name, "exec", dont_inherit=True), namespace)

    def recorded_case(file: str, lines: list[str]) -> None:
        RecordedCase(author_project / "tests" / file, author_project).assert_followed(lines)

    fixtures: dict[str, Any] = {"sim": page_sim, "golden": golden, "recorded_case": recorded_case}
    function: Callable[..., None] = namespace[shown.name]
    wanted = function.__code__.co_varnames[: function.__code__.co_argcount]
    function(**{name: fixtures[name] for name in wanted})


@pytest.mark.slow
@pytest.mark.parametrize("page", COMMANDS)
def test_every_command_of_a_page_works_as_it_is_typed(
    page: str,
    tmp_path: Path,
    shell: dict[str, str],  # noqa: F811
) -> None:
    root = new_project(tmp_path)
    write_blocks(root)
    folder = root
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
