"""A command that serves a page, as users start it."""

from __future__ import annotations

import re
import signal
import subprocess
import sys
from pathlib import Path
from threading import Timer
from typing import Self

from tests.program import ROOT

PATIENCE_S = 60.0
FOUND = re.compile(r"page: (http://127\.0\.0\.1:\d+/)(?:  token: (\S+))?")


class Served:
    """A command that serves a page, until the end of the test."""

    def __init__(self, folder: Path, *words: str) -> None:
        self._command = [sys.executable, "-m", "cobodeck", *words]
        self._folder = folder

    def __enter__(self) -> Self:
        self._running = subprocess.Popen(
            self._command,
            cwd=self._folder,
            env={"PYTHONPATH": str(ROOT), "PATH": "/usr/bin:/bin", "HOME": str(self._folder)},
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        assert self._running.stdout
        patience = Timer(PATIENCE_S, self._running.kill)
        patience.start()
        lines, found = list[str](), None
        for line in self._running.stdout:  # libraries may warn before it says its first line
            lines.append(line)
            if found := FOUND.search(line):
                break
        patience.cancel()
        assert found, lines
        self.url, self.token = found[1], found[2]
        return self

    def __exit__(self, *_: object) -> None:
        self._running.send_signal(signal.SIGTERM)
        try:
            self._running.communicate(timeout=20)
        except subprocess.TimeoutExpired:
            self._running.kill()
            self._running.communicate()
