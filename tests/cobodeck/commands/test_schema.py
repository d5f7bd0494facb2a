"""Editors complete charts from a committed schema; it must be the one of the present classes."""

import json
from pathlib import Path

import pytest

from cobodeck.__main__ import main
from cobodeck.project.state_catalogue import catalogue
from cobodeck.terminal.console import OK

COMMITTED = Path(__file__).resolve().parents[3] / "charts" / "chart.schema.json"


def test_the_committed_schema_is_current(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)

    assert main(["schema"]) == OK

    is_current = capsys.readouterr().out == COMMITTED.read_text(encoding="utf-8")
    assert is_current, "`make schema` writes it"


def test_the_schema_knows_every_class_and_chart() -> None:
    text = COMMITTED.read_text(encoding="utf-8")

    json.loads(text)
    for name in (*catalogue().classes, "chase", "haptic", "escape", "inform"):
        assert f'"{name}"' in text


def test_the_schema_is_written_where_it_is_wanted(tmp_path: Path) -> None:
    assert main(["schema", "-o", str(tmp_path / "deep" / "s.json")]) == OK

    assert json.loads((tmp_path / "deep" / "s.json").read_text())["type"] == "object"
