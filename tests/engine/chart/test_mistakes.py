"""Typical mistakes in files: all are found, nearly all at their exact place and with help.

The files go through the checks of `cobodeck validate`, with all shipped states, robots and scenes.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from cobodeck.project.library import findings_of, load_beside
from cobodeck.project.state_catalogue import CHARTS, catalogue
from cobodeck.validation.file_checks import FileChecker
from engine.files.finding import Finding
from tests.engine.chart_mistakes import CHART, FORM, NAMES, VALUES
from tests.engine.file_mistakes import PROFILES, ROBOTS, SCENE, SCENES, USER, USERS

KNOWN = catalogue(own=False)
ROBOT = (CHARTS.parent / "hw/robots/rbkairos_ur10.yaml").read_text(encoding="utf-8")
PROFILE = (CHARTS / "profiles/tuned.yaml").read_text(encoding="utf-8")
RIGHT = {"chart": CHART, "scene": SCENE, "user": USER, "robot": ROBOT, "profile": PROFILE}
GROUPS = {
    "chart": [*FORM, *NAMES, *VALUES],
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


def found_in(tmp_path: Path, kind: str, text: str) -> list[Finding]:
    file = tmp_path / f"{kind}.yaml"
    file.write_text(text, encoding="utf-8")
    if kind == "chart":
        return findings_of(load_beside([file], KNOWN), KNOWN, [file])
    return list(FileChecker(KNOWN, []).findings(file, kind))


@pytest.mark.parametrize("kind", sorted(RIGHT))
def test_the_files_are_right_without_the_mistake(tmp_path: Path, kind: str) -> None:
    assert found_in(tmp_path, kind, RIGHT[kind]) == []


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


def test_nearly_all_have_place_and_help() -> None:
    assert len(MISTAKES) >= 93
    assert len(WITHOUT_PLACE_OR_HELP) <= 0.05 * len(MISTAKES)
