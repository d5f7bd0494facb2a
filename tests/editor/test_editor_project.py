"""What somebody sees in the editor who has a project of `cobodeck new`, with its own states."""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from cobodeck.__main__ import main
from tests.editor.language_server import LanguageServer
from tests.editor.seen import Seen, running_server

pytestmark = pytest.mark.slow

NAMES = {"cafe": [], "wagon": ["--robot"]}
"""The projects, and how they are made."""
STATE = "states:\n  a:\n    {}\n"


@pytest.fixture(scope="module", params=NAMES)
def project(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[Path]:
    """The package of a project, with its schema."""
    root = tmp_path_factory.mktemp("editor") / str(request.param)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "path", sys.path.copy())
        assert main(["new", str(root), *NAMES[str(request.param)]]) == 0
        yield root / root.name
    for name in [name for name in sys.modules if name.partition(".")[0] == root.name]:
        del sys.modules[name]


@pytest.fixture(scope="module")
def server(project: Path) -> Iterator[LanguageServer]:
    schema = (project / "chart.schema.json").read_text(encoding="utf-8")
    yield from running_server(project, schema)


@pytest.fixture
def own(project: Path) -> dict[str, Any]:
    """What is of the project's own, by its name."""
    return {
        "cafe": {
            "monitor": "PersonNear", "parameter": "distance", "value": "2 m", "wrong": "2 s",
            "default": "1 m",
            "outcome": "near", "about": "`near` once the user is within `distance` of the robot.",
            "chart": "greet", "chart_about": "Wait with the arm parked until somebody comes near.",
        },
        "wagon": {
            "monitor": "BatteryLow", "parameter": "level", "value": "0.2", "wrong": "half",
            "default": "0.3",
            "outcome": "low", "about": "`low` once the battery is emptier than `level`.",
            "chart": "patrol", "chart_about": "To and fro until the battery is low",
        },
    }[project.name]  # fmt: skip


def test_the_charts_of_the_project_have_no_mistake_for_the_server(
    server: LanguageServer, project: Path
) -> None:
    charts = [file for file in project.glob("*.yaml") if "chart:" in file.read_text("utf-8")]
    assert charts
    for file in charts:
        assert server.open(file.name, file.read_text(encoding="utf-8")) == []


def test_own_states_are_offered_beside_ours(server: LanguageServer, own: dict[str, Any]) -> None:
    offered = Seen(server, "watch.yaml", STATE.format("watch: ‸")).offered
    assert own["monitor"] in offered
    assert "WaitFor" in offered
    assert own["about"].split("`")[1] in str(offered[own["monitor"]]["documentation"])


def test_own_parameters_and_outcomes_are_offered(
    server: LanguageServer, own: dict[str, Any]
) -> None:
    watch = f"watch: {own['monitor']}"
    given = Seen(server, "with.yaml", STATE.format(f"{watch}\n    with:\n      ‸")).offered
    assert given.keys() == {own["parameter"]}
    led = Seen(server, "next.yaml", STATE.format(f"{watch}\n    next:\n      ‸")).offered
    assert led.keys() == {own["outcome"], "error"}


def test_hovers_tell_meaning_units_and_default(server: LanguageServer, own: dict[str, Any]) -> None:
    name, parameter = own["monitor"], own["parameter"]
    line = f"watch: {name}\n    with: {{{parameter}: {own['value']}}}\n    next: {{}}"
    body = STATE.format(line.replace(name, f"{name[:2]}‸{name[2:]}"))
    assert own["about"] in Seen(server, "state.yaml", body).hover
    over = f"{parameter[:2]}‸{parameter[2:]}"
    hover = Seen(server, "parameter.yaml", STATE.format(line.replace(parameter, over))).hover
    assert f"Default: {own['default']}." in hover
    if own["value"].endswith(" m"):
        assert "A length, in mm, cm, m, km" in hover


def test_an_input_that_is_missing_is_underlined(server: LanguageServer) -> None:
    led = "next: {arrived: .done, no_path: .done, stuck: .done, lost: .done, error: .done}"
    seen = Seen(server, "input.yaml", STATE.format(f"do: DriveTo\n    {led}"))
    assert [(word, said) for word, said in seen.underlined if '"in"' in said or '"goal"' in said]


def test_the_outline_has_the_nodes(server: LanguageServer, project: Path) -> None:
    (chart,) = [f for f in project.glob("*.yaml") if "\nchart:" in f.read_text("utf-8")]
    server.open(chart.name, chart.read_text(encoding="utf-8"))
    asked = {"textDocument": {"uri": server.uri(chart.name)}}
    names = {symbol["name"] for symbol in server.ask("textDocument/documentSymbol", asked)}
    assert {"chart", "outcomes"} <= names
    assert names & {"person", "patrol"}


def test_a_used_chart_is_offered_and_explained(server: LanguageServer, own: dict[str, Any]) -> None:
    chart = own["chart"]
    assert chart in Seen(server, "use.yaml", STATE.format("use: ‸")).offered
    hover = Seen(server, "used.yaml", STATE.format(f"use: {chart[:2]}‸{chart[2:]}")).hover
    assert own["chart_about"] in hover


def test_mistakes_are_underlined(server: LanguageServer, own: dict[str, Any]) -> None:
    name = own["monitor"]
    body = STATE.format(f"watch: {name}s\n    next: {{}}")
    assert [f"{name}s"] == [word for word, _ in Seen(server, "state_wrong.yaml", body).underlined]
    wrong = f"with: {{{own['parameter']}: {own['wrong']}}}"
    body = STATE.format(f"watch: {name}\n    {wrong}\n    next: {{{own['outcome']}: .done}}")
    (found,) = Seen(server, "unit_wrong.yaml", body).underlined
    assert found[0] == own["wrong"]
    body = STATE.format(f"watch: {name}\n    next: {{}}")
    (missing,) = Seen(server, "next_wrong.yaml", body).underlined
    assert missing == ("next", f'Missing property "{own["outcome"]}".')


def test_what_the_page_says_the_server_cannot_do_it_cannot(
    server: LanguageServer, own: dict[str, Any]
) -> None:
    """Whoever finds that it can now changes `edit-charts.md`."""
    led = f"next: {{{own['outcome']}: b}}"
    body = f"states:\n  a: {{watch: {own['monitor']}, {led}}}\n  b: {{use: {own['chart']}}}\n"
    seen = Seen(server, "cannot.yaml", body)
    for word in (own["monitor"], own["chart"]):
        (line,) = [n for n, text in enumerate(seen.lines) if re.search(rf": {word}\b", text)]
        place = {"line": line, "character": seen.lines[line].index(f": {word}") + 3}
        asked = {"textDocument": {"uri": server.uri(seen.name)}, "position": place}
        assert not server.ask("textDocument/definition", asked)
    assert not server.ask("textDocument/documentLink", {"textDocument": asked["textDocument"]})
    assert not server.ask("textDocument/rename", {**asked, "newName": "other"})
    with pytest.raises(AssertionError, match="Unhandled method"):
        server.ask("textDocument/references", {**asked, "context": {"includeDeclaration": True}})


def test_what_does_it_instead_names_module_and_file(
    project: Path, own: dict[str, Any], monkeypatch: pytest.MonkeyPatch, capsys: Any
) -> None:
    monkeypatch.chdir(project.parent)
    assert main(["list", "states", own["monitor"]]) == 0
    assert f"{project.name}.states" in capsys.readouterr().out
    assert main(["list", "charts", own["chart"]]) == 0
    assert f"{own['chart']}.yaml" in capsys.readouterr().out.replace("\n", "").replace(" ", "")
