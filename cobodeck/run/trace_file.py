"""The trace file of a run: one line that says what was run, then one line per record.

The first line has the hashes of chart, profile and scene and the versions, which identify a run;
the records are the engine's own, in its canonical encoding.
"""

from __future__ import annotations

import json
import platform
from collections.abc import Mapping
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from cobodeck.record.format import Sink
from cobodeck.run.simulation import RunResult
from cobodeck.setup import Setup

FORMAT = "cobodeck trace 1"
ENDING = ".trace.jsonl"
_RUN = ("inputs", "user", "tier", "seed", "tick_hz", "sim_s", "outcome", "trace_sha256")


def header(setup: Setup, figures: Mapping[str, Any]) -> dict[str, Any]:
    """What was run, and with which versions."""
    return {
        "format": FORMAT,
        "cobodeck": own_version(),
        "python": platform.python_version(),
        "chart": {"name": setup.chart.name, "sha256": setup.chart_sha256},
        "profile": {"name": setup.profile.name, "sha256": setup.profile.sha256},
        "scene": None
        if setup.scene is None
        else {"name": setup.scene.name, "sha256": setup.scene.sha256},
        "robot": setup.robot.name,
    } | {name: figures.get(name) for name in _RUN}


def own_version() -> str:
    """The installed version; `0` if cobodeck is not installed but runs from its folder."""
    try:
        return version("cobodeck")
    except PackageNotFoundError:
        return "0"


def write(sink: Sink, setup: Setup, result: RunResult) -> Path | None:
    """Write the trace file; returns its path, None on failure (see `sink.error`; no file stays)."""
    first = json.dumps(header(setup, result.figures), ensure_ascii=False)
    lines = (first, *result.wired.run.trace.lines())
    sink.write("".join(f"{line}\n" for line in lines).encode())
    path = sink.finish()
    if path is None:
        sink.remove()
    return path
