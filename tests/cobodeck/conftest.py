"""What tests of the program share."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from cobodeck.testing.testing import ChartTester
from hw.safety.guarded import GuardedBase


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The current folder, of this test alone."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def own_path(monkeypatch: pytest.MonkeyPatch) -> None:
    """What a project puts on the path is taken off it again."""
    monkeypatch.setattr(sys, "path", sys.path.copy())


def base_of(sim: ChartTester) -> GuardedBase:
    base = sim.run.parts["base"]
    assert isinstance(base, GuardedBase)
    return base
