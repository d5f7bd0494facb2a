"""Records of runs for tests of what is told about them."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from cobodeck.record.write.start import recorder
from cobodeck.run.simulation import RunResult, simulate
from cobodeck.setup.options import Options
from cobodeck.setup.setup import open_setup
from engine.files.text import noting

AT = datetime(2026, 1, 2, 3, 4, 5, tzinfo=UTC)


def recorded(path: Path, options: Options, **given: Any) -> RunResult:
    """A run with its record."""
    problems: list[str] = []
    with noting():
        setup = open_setup(**given)
        result = simulate(
            setup, options, recorder=recorder(setup, options, path, AT, problems.append)
        )
    assert problems == []
    return result
