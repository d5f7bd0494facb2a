"""The doctor tells what is missing, and which other packages hide ours."""

import json
from pathlib import Path

import pytest

from cobodeck.__main__ import main
from cobodeck.commands import doctor
from cobodeck.console import FAILED, OK


def test_here_everything_that_is_needed_is_found(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["doctor", "--json"]) == OK

    found = {check["what"]: check["state"] for check in json.loads(capsys.readouterr().out)}
    assert found["python"] == "ok"
    assert "bad" not in found.values()


def test_a_package_that_hides_ours_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(doctor, "ROOT", tmp_path)

    assert main(["doctor"]) == FAILED

    assert "package engine" in capsys.readouterr().out


def test_a_library_for_some_machines_only_is_no_failure() -> None:
    advice = doctor._advice("ur-rtde>=1.6.0", "platform_machine == 'x86_64'")

    assert "the rest works without it" in advice
    assert doctor._advice("numpy>=2.0", "") == "pip install 'numpy>=2.0'"
