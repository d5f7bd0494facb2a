"""Reference pages: current, complete, and their examples are what charts and files may say."""

from __future__ import annotations

import re
from collections.abc import Sequence
from functools import cache
from pathlib import Path

import pytest
import yaml

from cobodeck.__main__ import main
from cobodeck.manual.example_nodes import example_chart
from cobodeck.manual.file_entries import ABOUTS, EXAMPLES
from cobodeck.manual.file_keys import key_rows
from cobodeck.manual.in_markdown import markdown_text
from cobodeck.manual.on_terminal import terminal_text
from cobodeck.manual.page import ManualPage, PageEntry, PageTable, YamlCode
from cobodeck.manual.pages import NAMES, REFERENCE, manual_page
from cobodeck.project.named_files import KINDS
from cobodeck.project.state_catalogue import catalogue
from cobodeck.terminal.console import FAILED, OK, USAGE
from cobodeck.validation.editor_schema import declaration
from states.maps.occupancy import load_map

SHIPPED = catalogue(own=False)


@cache
def page_of(name: str) -> ManualPage:
    return manual_page(name, SHIPPED)


@pytest.mark.parametrize("name", NAMES)
def test_the_committed_pages_are_current(name: str) -> None:
    is_current = markdown_text(page_of(name)) == (REFERENCE / f"{name}.md").read_text(
        encoding="utf-8"
    )
    assert is_current, "`make docs` writes it"


def test_there_are_no_other_pages() -> None:
    assert sorted(page.stem for page in REFERENCE.glob("*.md")) == sorted(NAMES)


@pytest.mark.parametrize("name", sorted(SHIPPED.interfaces))
def test_a_shipped_state_says_what_all_its_words_mean(name: str) -> None:
    of = SHIPPED.interfaces[name]
    outputs = {output for named in of.outputs.values() for output in named}
    arguments = {**of.parameters, **of.inputs}

    assert [word for word, argument in arguments.items() if not argument.about] == []
    assert [word for word in of.outcomes if not of.meanings.get(word)] == []
    assert [word for word in outputs if not of.output_meanings.get(word)] == []
    assert set(of.meanings) <= set(of.outcomes), "an outcome that it does not have"


def test_every_shipped_signal_has_a_sentence_and_measured_ones_say_who_gives_them() -> None:
    for name, signal in SHIPPED.signals.items():
        assert signal.about, name
        if hasattr(signal, "comes"):
            assert signal.comes, name
            assert signal.constant or signal.part in SHIPPED.parts, name


@pytest.mark.parametrize("each", [4, pytest.param(1, marks=pytest.mark.slow)])
def test_the_example_of_every_state_validates(
    each: int, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for name, of in list(SHIPPED.interfaces.items())[::each]:
        chart = f"example_of_{name.lower()}"
        (tmp_path / f"{chart}.yaml").write_text(example_chart(of, chart), encoding="utf-8")

    assert main(["validate", str(tmp_path), "--no-project"]) == OK, capsys.readouterr().out


def test_there_is_an_example_of_every_kind_of_file() -> None:
    assert {file.stem for file in EXAMPLES.glob("*.yaml")} == ABOUTS.keys() - {"recording"}
    assert set(KINDS) < ABOUTS.keys()


@pytest.mark.parametrize(
    "kinds",
    [
        ["topics", "user", "prop"],
        pytest.param(KINDS, marks=pytest.mark.slow),  # each cell of the campaign is made
    ],
    ids=["few", "all"],
)
def test_the_examples_of_files_validate(
    kinds: Sequence[str], capsys: pytest.CaptureFixture[str]
) -> None:
    files = [str(EXAMPLES / f"{kind}.yaml") for kind in kinds]

    assert main(["validate", "--strict", *files, "--no-project"]) == OK, capsys.readouterr().out


def test_the_example_of_a_map_is_read_with_its_picture(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "lab.pgm").write_bytes(b"P5\n2 3\n255\n" + bytes([254, 254, 0, 0, 205, 254]))
    here = tmp_path / "map.yaml"
    here.write_text((EXAMPLES / "map.yaml").read_text(encoding="utf-8"), encoding="utf-8")

    assert load_map(here).values.shape == (3, 2)
    assert main(["validate", str(tmp_path), "--no-project"]) == OK, capsys.readouterr().out
    (tmp_path / "lab.pgm").unlink()
    assert main(["validate", str(here), "--no-project"]) == FAILED
    assert "map.yaml:1:8: error[Y01] image: " in capsys.readouterr().out


def test_the_keys_of_an_example_are_rows_of_its_page() -> None:
    for entry in page_of("files").entries:
        tables = (block for block in entry.blocks if isinstance(block, PageTable))
        rows = {row[0] for table in tables for row in table.rows}
        for code in (block for block in entry.blocks if isinstance(block, YamlCode)):
            assert set(yaml.safe_load(code.text)) <= rows, entry.name


def test_rows_of_keys_tell_type_range_default_and_meaning() -> None:
    scene = {row.key: row for row in key_rows(declaration("scene"))}

    assert scene["scene"] == ("scene", "name", "required", "Its name.")
    assert scene["robot.file"].default == "rbkairos_ur10"
    assert scene["touchable[].high"].type == "length, 0 to 100 m"
    assert scene["places.NAME.yaw"].type == "angle, rad, -720 to 720 deg"
    assert scene["places.NAME.yaw"].default == "0 rad"
    assert scene["tracking"].type == "one of everywhere, area"
    assert not [row.key for row in scene.values() if not row.meaning]


def test_what_a_profile_may_leave_out_has_the_value_of_tuned() -> None:
    rows = {row.key: row for row in key_rows(declaration("profile"), {"chase.inner": "1.5 m"})}

    assert rows["profile"].default == "required"
    assert rows["chase.inner"].default == "1.5 m"
    assert "required" not in {row.default for key, row in rows.items() if key.startswith("chase")}


PAGE = ManualPage(
    "words",
    "Words",
    ("About all.",),
    (
        PageEntry("a.b", ("One | two.", PageTable(("key", "meaning"), (("x | y", "p\nq | r"),)))),
        PageEntry("mine", ("Own.", YamlCode("do: It\n")), is_own=True),
    ),
)


def test_markdown_has_bars_of_cells_escaped_and_own_things_first() -> None:
    text = markdown_text(PAGE)

    assert "| `x \\| y` | p q \\| r |" in text
    assert "| [a.b](#ab) | One \\| two. |" in text
    headings = re.findall(r"^#+ .*", text, flags=re.M)
    assert headings == ["# Words", "## Of this project", "### mine", "## Shipped", "### a.b"]
    assert "```yaml\ndo: It\n```" in text


@pytest.mark.parametrize("width", [40, 80, 200])
def test_on_a_terminal_no_prose_is_wider_than_it(width: int) -> None:
    for entry in page_of("states").entries:
        told = terminal_text(entry, width)
        prose = [line for line in told.splitlines() if not line.strip().startswith(_CODE)]
        long = [line for line in prose if len(line) > width and " " in line.strip()]
        assert not long, entry.name


_CODE = ("do: ", "watch: ", "with: ", "in: ", "out: ", "next: ", "{do: ", "{watch: ")


def _list(capsys: pytest.CaptureFixture[str], *words: str) -> str:
    assert main(["list", *words, "--no-project"]) == OK
    return capsys.readouterr().out


def test_listing_a_state_prints_its_page(capsys: pytest.CaptureFixture[str]) -> None:
    told = _list(capsys, "states", "DriveTo")

    assert told.startswith("DriveTo\n    Drive to a goal")
    assert "    outcome\n      arrived  The robot stands at the goal" in told
    assert "duration, s; above 0 s; default 3 s: How long to go without progress" in told


def test_listing_signals_charts_and_kinds_of_files(capsys: pytest.CaptureFixture[str]) -> None:
    assert "12.5 Hz each with `rbkairos_ur10`" in _list(capsys, "signals", "base.scan")
    assert "default 4 m: Go after a user" in _list(capsys, "charts", "paper_chase")
    assert "touchable[].low" in _list(capsys, "files", "scene")
    assert re.search(r"^scene +The room", _list(capsys, "files"), flags=re.M)


def test_an_unknown_name_is_told_with_the_nearest(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["list", "states", "DriveTwo", "--no-project"]) == USAGE
    assert "did you mean 'DriveTo'?" in capsys.readouterr().err


STATES = '''
from engine import Action, Context, Run
from engine.signals import Measured

SIGNALS = (Measured("kettle.heat", float, about="of the water, in °C", part="kettle"),)


class Pour(Action):
    """Pour tea.

    Args:
        cups: how many.

    Outcomes:
        poured: the cups are full.
    """

    outcomes = ("poured",)

    def __init__(self, cups: int = 2) -> None:
        self.cups = cups

    def run(self, ctx: Context) -> Run:
        return "poured"
'''


def test_the_pages_of_a_project_have_its_own_things(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    package = tmp_path / "teahouse_pages"
    package.mkdir()
    (package / "__init__.py").touch()
    (package / "states.py").write_text(STATES, encoding="utf-8")
    (package / "serve.yaml").write_text(
        "chart: serve_tea\nabout: Serve.\noutcomes: [done]\n"
        "states: {pour: {do: Pour, next: {poured: .done}}}\n",
        encoding="utf-8",
    )
    (tmp_path / "pyproject.toml").write_text(
        '[project]\nname = "teahouse"\n'
        '[project.entry-points."cobodeck.states"]\nmine = "teahouse_pages.states"\n',
        encoding="utf-8",
    )
    monkeypatch.chdir(tmp_path)
    assert main(["docs", "-o", "out/docs"]) == OK, capsys.readouterr().err

    pages = {name: (tmp_path / f"out/docs/{name}.md").read_text("utf-8") for name in NAMES}
    assert "### Pour\n\nPour tea." in pages["states"]
    assert "| `cups` | integer | 2 | How many. |" in pages["states"]
    assert "| `poured` | The cups are full. |" in pages["states"]
    assert "### kettle.heat\n\nOf the water, in °C." in pages["signals"]
    assert "### serve_tea\n\nServe." in pages["charts"]
    assert "File: `teahouse_pages/serve.yaml`." in pages["charts"]


def test_the_folder_of_pages_cannot_be_a_file(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "docs").touch()

    assert main(["docs", "-o", str(tmp_path / "docs"), "--no-project"]) == USAGE
    assert "is a file" in capsys.readouterr().err


def test_without_a_folder_the_pages_are_named(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["docs", "--no-project"]) == OK
    told = capsys.readouterr().out
    named = [line.split(".md ")[0] for line in told.splitlines()[: len(NAMES)]]
    assert named == list(NAMES)
