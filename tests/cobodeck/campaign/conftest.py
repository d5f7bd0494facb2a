"""A project whose charts kill the process that runs them."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

STATES = '''import os
import signal
from pathlib import Path

from engine import Action, Context, Run


class Fatal(Action):
    """Kills its process, so many times."""

    outcomes = ("survived",)

    def __init__(self, times: int) -> None:
        self.times = times

    def run(self, ctx: Context) -> Run:
        deaths = Path(f"deaths of {self.times}")
        count = len(deaths.read_text()) if deaths.exists() else 0
        if count < self.times:
            deaths.write_text("x" * (count + 1))
            os.kill(os.getpid(), signal.SIGKILL)
        yield
        return "survived"
'''
CHART = """chart: {name}
about: Kills its process.
outcomes: [survived]
states:
  only: {{do: Fatal, with: {{times: {times}}}, next: {{survived: .survived}}}}
"""


@pytest.fixture
def fatal(folder: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A project whose charts `twice` and `always` kill the process that runs them."""
    monkeypatch.setattr(sys, "path", sys.path.copy())
    package = folder / "fatal"
    package.mkdir()
    (folder / "pyproject.toml").write_text(
        '[project]\nname = "fatal"\n[project.entry-points."cobodeck.states"]\nf = "fatal.states"\n'
    )
    (package / "__init__.py").write_text("")
    (package / "states.py").write_text(STATES)
    for name, times in {"twice": 2, "always": 99}.items():
        (package / f"{name}.yaml").write_text(CHART.format(name=name, times=times))
    return folder
