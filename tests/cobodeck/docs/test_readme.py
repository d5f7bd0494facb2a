"""What the pages say is so: the table, the commands, the links."""

from __future__ import annotations

import re
from importlib.util import find_spec
from pathlib import Path

import pytest

from cobodeck.__main__ import COMMANDS, main
from cobodeck.bench.result import read_result
from cobodeck.bench.table import CURVES, RESULTS
from cobodeck.commands.bench import BENCHES
from cobodeck.pictures.benched import draw_bench
from cobodeck.terminal.console import OK
from hw.connection.driver_names import our_drivers

ROOT = Path(__file__).resolve().parents[3]
README = (ROOT / "README.md").read_text()


def test_every_bench_has_a_committed_result():
    assert {file.stem for file in RESULTS.glob("*.json")} >= set(BENCHES)
    (renewed,) = re.findall(r"^BENCHES := (.*)", (ROOT / "Makefile").read_text(), flags=re.M)
    assert set(renewed.split()) == set(BENCHES)


@pytest.mark.slow
def test_the_page_of_curves_is_that_of_the_committed_results(tmp_path):
    rows = [row for file in sorted(RESULTS.glob("*.json")) for row in read_result(file)["rows"]]
    draw_bench(rows, tmp_path / "curves.svg")
    texts = [re.findall(r"<text.*?>(.*?)</text>", file.read_text(), flags=re.S)
             for file in (tmp_path / "curves.svg", CURVES)]  # fmt: skip
    assert texts[0] == texts[1], "make bench draws it"
    assert len(texts[0]) > 100


@pytest.mark.parametrize("page", ["README.md", "charts/README.md"])
def test_the_chart_has_no_mistake(page, tmp_path, capsys):
    text = re.findall(r"```yaml\n(chart: .*?)```", (ROOT / page).read_text(), flags=re.S)[0]
    file = tmp_path / "chase.yaml"
    file.write_text(text)

    assert main(["validate", "--strict", str(file)]) == OK, capsys.readouterr().out


def test_every_command_of_the_readme_exists():
    named = set(re.findall(r"`cobodeck (\w+)", README))
    assert named
    assert named <= set(COMMANDS)


@pytest.mark.slow
def test_the_run_shown_in_the_readme_is_that_of_make_demo(tmp_path, monkeypatch, capsys):
    (command,) = re.findall(r"cobodeck (simulate .*) --record", (ROOT / "Makefile").read_text())
    (shown,) = re.findall(r"^```\n(cobodeck in .*?)^```", README, flags=re.M | re.S)
    monkeypatch.chdir(tmp_path)

    assert main(command.split()) == OK
    printed = capsys.readouterr().out.splitlines()
    assert len(shown.splitlines()) >= 6
    assert [line for line in printed if line in shown.splitlines()] == shown.splitlines()


def test_every_make_target_of_the_readme_exists():
    targets = re.findall(r"^(\w+):", (ROOT / "Makefile").read_text(), flags=re.M)
    assert set(re.findall(r"^ {4}make (\w+)", README, flags=re.M)) <= set(targets)


TOPS = ("engine", "states", "behaviors", "hw", "cobodeck", "charts", ".github")
MARKDOWN = [
    ROOT / "README.md",
    *(page for top in TOPS for page in sorted((ROOT / top).rglob("*.md"))),
]
PAGES = [page for page in MARKDOWN[1:] if page.name == "README.md" and "template" not in page.parts]


@pytest.mark.parametrize("page", MARKDOWN, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_links_lead_somewhere(page):
    for target in re.findall(r"\]\((?!http)([^)#\s]+)\)", page.read_text()):
        assert (page.parent / target).exists(), target


TESTS = sorted(ROOT.glob("tests/**/*.py"))
NAMED = {file.name for file in TESTS}
WRITTEN = "\n".join(file.read_text(encoding="utf-8") for file in TESTS)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_a_page_is_one_page_and_names_tests_and_modules_that_exist(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    about, _, _rules = text.partition("\n## The rules")  # the engine's have a length of their own
    beside = {file.name for file in page.parent.rglob("*") if file.is_file()}

    assert len(about.splitlines()) <= 90
    assert "\n## Decisions" not in text
    for name in re.findall(r"\btest_\w+\.py\b", text):
        assert name in NAMED, name
    for name in re.findall(r"\btest_\w+\b(?!\.py|…)", text):
        assert name.endswith("_") or f"def {name}" in WRITTEN or f"{name}.py" in NAMED, name
    for name in re.findall(r"^\| ((?:`[\w/]+\.\w+`,? ?)+)", text, flags=re.M):
        for file in re.findall(r"`([\w/]+\.\w+)`", name):
            assert Path(file).name in beside, file


OURS = [page for page in MARKDOWN if not {"template", "docs"} & {*page.parts}]
"""The others have paths of a user's own project."""


@pytest.mark.parametrize("page", OURS, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_paths_and_drivers_of_a_page_are_those_of_today(page: Path) -> None:
    text = page.read_text(encoding="utf-8")

    for path in re.findall(r"`((?:\.\./)*\w+/[\w/.]*(?:/|\.(?:py|md|yaml|json)))`", text):
        assert any((near / path).exists() for near in (page.parent, ROOT)), path
    for driver in re.findall(r"driver: (\w+)", text):
        assert driver in our_drivers(), driver
    for module in re.findall(r"^from ((?:engine|hw|states)[\w.]*)", text, flags=re.M):
        assert find_spec(module) is not None, module
