"""Names that are gone tell what there is in their place, wherever they are used."""

from __future__ import annotations

from pathlib import Path

import pytest

from cobodeck.__main__ import main
from cobodeck.project.old_names import OLD_CHARTS, OLD_STATES
from cobodeck.project.state_catalogue import catalogue, shipped_charts
from cobodeck.terminal.console import FAILED, USAGE

USES = "chart: mine\nstates: {{machine: {{{}: {}}}}}\n"


def test_a_name_that_is_gone_stands_for_nothing_else() -> None:
    known = catalogue(own=False)

    assert not OLD_STATES.keys() & known.classes.keys()
    assert not OLD_CHARTS.keys() & {file.stem for file in shipped_charts()}


@pytest.mark.parametrize("name", OLD_CHARTS)
def test_a_chart_that_is_gone_names_its_successor(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "mine.yaml").write_text(USES.format("use", name))

    assert main(["simulate", name]) == USAGE
    assert f"no chart '{name}'; {OLD_CHARTS[name]}" in capsys.readouterr().err
    assert main(["validate", str(tmp_path / "mine.yaml")]) == FAILED
    assert OLD_CHARTS[name] in capsys.readouterr().out


@pytest.mark.parametrize("name", OLD_STATES)
def test_a_state_that_is_gone_names_its_successor(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "mine.yaml").write_text(USES.format("do", name))

    assert main(["validate", str(tmp_path / "mine.yaml")]) == FAILED
    assert OLD_STATES[name] in capsys.readouterr().out
