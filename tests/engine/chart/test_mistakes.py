"""Typical mistakes in files: all are found, nearly all at their exact place and with help.

The files go through the checks of `cobodeck validate`, with all shipped states, robots and scenes.
"""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import jsonschema
import pytest

from cobodeck.project.library import findings_of, load_beside
from cobodeck.project.state_catalogue import CHARTS, catalogue, shipped_charts
from cobodeck.validation.editor_schema import schema_for
from cobodeck.validation.file_checks import FileChecker
from engine.files.finding import Finding
from engine.files.source import read
from engine.interfaces import interface
from tests.engine.chart_mistakes import CHART, FORM, NAMES, VALUES
from tests.engine.file_mistakes import PROFILES, ROBOTS, SCENE, SCENES, USER, USERS
from tests.engine.value_mistakes import (
    BINDINGS,
    ENDINGS,
    FLOW,
    LITERALS,
    NAMED,
    RANGES,
    TOGETHER,
    TOUR,
    Brake,
)

SHIPPED = catalogue(own=False)
KNOWN = replace(SHIPPED, interfaces={**SHIPPED.interfaces, "Brake": interface(Brake)})
EDITORS = jsonschema.Draft7Validator(json.loads(schema_for("chart", KNOWN)))
ROBOT = (CHARTS.parent / "hw/robots/rbkairos_ur10.yaml").read_text(encoding="utf-8")
PROFILE = (CHARTS.parent / "tests/behaviors/profile/spelled_out.yaml").read_text(encoding="utf-8")
RIGHT = {
    "chart": CHART,
    "tour": TOUR,
    "scene": SCENE,
    "user": USER,
    "robot": ROBOT,
    "profile": PROFILE,
}
GROUPS = {
    "chart": [*FORM, *NAMES, *VALUES],
    "tour": [*LITERALS, *NAMED, *ENDINGS, *RANGES, *TOGETHER, *FLOW, *BINDINGS],
    "scene": SCENES,
    "user": USERS,
    "robot": ROBOTS,
    "profile": PROFILES,
}
MISTAKES = {
    f"{kind}: {name}": (kind, right, wrong, help)
    for kind, group in GROUPS.items()
    for name, right, wrong, help in group
}
WITHOUT_PLACE_OR_HELP = frozenset(("chart: outcome in capitals",))
"""Mistakes that are found, but not at their exact place or without help."""
AT_BOTH_ENDS = frozenset(("misspelt case in next", "misspelt outcome of a container"))
"""Mistakes told twice: where an outcome leads nowhere, and where the word for it stands."""


def found_in(tmp_path: Path, kind: str, text: str) -> list[Finding]:
    file = tmp_path / f"{kind}.yaml"
    file.write_text(text, encoding="utf-8")
    if kind in ("chart", "tour"):
        return findings_of(load_beside([file], KNOWN), KNOWN, [file])
    return list(FileChecker(KNOWN, []).findings(file, kind))


@pytest.mark.parametrize("kind", sorted(RIGHT))
def test_the_files_are_right_without_the_mistake(tmp_path: Path, kind: str) -> None:
    assert found_in(tmp_path, kind, RIGHT[kind]) == []


@pytest.mark.parametrize(
    "file", ["chart", "tour", *shipped_charts()], ids=lambda file: Path(file).stem
)
def test_editors_underline_nothing_in_right_charts(file: str | Path) -> None:
    text = file.read_text(encoding="utf-8") if isinstance(file, Path) else RIGHT[file]
    chart = json.loads(json.dumps(read(text.encode(), "chart.yaml").value))
    assert [f"{e.json_path}: {e.message}" for e in EDITORS.iter_errors(chart)] == []


@pytest.mark.parametrize("name", sorted(MISTAKES))
def test_a_mistake_is_found_where_it_is_and_the_mend_is_said(tmp_path: Path, name: str) -> None:
    kind, right, wrong, help = MISTAKES[name]
    assert RIGHT[kind].count(right) == 1
    assert wrong.count("¦") == 1
    marked = RIGHT[kind].replace(right, wrong)
    before, _, after = marked.partition("¦")
    place = (before.count("\n") + 1, len(before) - before.rfind("\n"))

    findings = found_in(tmp_path, kind, before + after)

    assert findings
    here = [f for f in findings if (f.place.line, f.place.column) == place]
    helps = any(help in f"{f.message}; {f.hint}" for f in here)
    shown = [f"{f.place}: [{f.code}] {f.message}; {f.hint}" for f in findings]
    assert helps != (name in WITHOUT_PLACE_OR_HELP), f"{help!r} at {place}, not {shown}"


@pytest.mark.parametrize("name", [name for name in sorted(MISTAKES) if name.startswith("tour: ")])
def test_a_mistake_is_told_once(tmp_path: Path, name: str) -> None:
    kind, right, wrong, _ = MISTAKES[name]
    told = found_in(tmp_path, kind, RIGHT[kind].replace(right, wrong.replace("¦", "")))
    assert len(told) == 1 + (name.removeprefix("tour: ") in AT_BOTH_ENDS), told


def test_nearly_all_have_place_and_help() -> None:
    assert len(MISTAKES) >= 93
    assert len(WITHOUT_PLACE_OR_HELP) <= 0.05 * len(MISTAKES)
