"""A command that serves a page, as users start it."""

from __future__ import annotations

import re
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from threading import Timer
from typing import NamedTuple

from tests.program import ROOT

PATIENCE_S, ENDING_S = 180.0, 20.0
FOUND = re.compile(r"page: (http://127\.0\.0\.1:\d+/)(?:  token: (\S+))?")


class Served(NamedTuple):
    running: subprocess.Popen[str]
    url: str
    token: str


@contextmanager
def serving(folder: Path, *words: str) -> Iterator[Served]:
    """A command that serves a page, until the end of the test."""
    pipe, env = subprocess.PIPE, {"PYTHONPATH": str(ROOT), "PATH": "/usr/bin:/bin"}
    command = [sys.executable, "-m", "cobodeck", *words]
    with subprocess.Popen(
        command, cwd=folder, env={**env, "HOME": str(folder)}, stdout=pipe, stderr=pipe, text=True
    ) as running:
        patience = Timer(PATIENCE_S, running.kill)
        patience.start()
        try:
            told = running.stderr if "--json" in words else running.stdout
            assert told is not None
            lines = iter(told.readline, "")
            found = next(filter(None, map(FOUND.search, lines)))  # libraries may warn before
            patience.cancel()
            yield Served(running, found[1], found[2])
        finally:
            patience.cancel()
            running.terminate()
            with suppress(subprocess.TimeoutExpired):
                running.wait(ENDING_S)
            running.kill()
