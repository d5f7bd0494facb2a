"""Plants faults, one at a time, into a copy of the tree, and runs the test that should notice.

Functions run as plain Python: numba keeps compiled code by the file of each function, so that a
caller would go on with what was compiled of a function in another file before the fault. Compiled
or not, they give the same bits.

The tests are run without a fault first. That leaves bytecode, which Python takes for that of a
source file of the same time and size; a planted file gets another time.
"""

from __future__ import annotations

import os
import re
import resource
import shutil
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from tests.planted.fault import Fault

ROOT = Path(__file__).resolve().parents[2]
PARTS = ("engine", "hw", "states", "behaviors", "cobodeck", "charts", "tests", "pyproject.toml")
LONGEST_S = 1800.0
"""A run that takes longer has no end, s."""
_FAILED = re.compile(r"^FAILED (\S+)", re.M)
_PASS, _FAIL = 0, 1


class Noticed(NamedTuple):
    """Whether a test failed with a fault planted, the first that did, and the CPU time, s."""

    fault: Fault
    noticed: bool
    by: str
    cpu_s: float


class Copy:
    """A copy of the tree in an empty folder, without faults but for the one being tried."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        for part in PARTS:
            source, ignored = ROOT / part, shutil.ignore_patterns("__pycache__", "*.egg-info")
            if source.is_dir():
                shutil.copytree(source, folder / part, ignore=ignored)
            else:
                shutil.copy2(source, folder / part)

    def check(self, faults: Sequence[Fault]) -> None:
        """Run the tests of these faults without any of them.

        Raises:
            ValueError: one fails all the same, or cannot be run.
        """
        tests = sorted({fault.test for fault in faults})
        code, said, _ = self._run(tests, writes=True)
        if code != _PASS:
            raise ValueError(f"without a fault these tests should pass:\n{said}")

    def tried(self, fault: Fault) -> Noticed:
        """Plant a fault and run its test; the fault is gone afterwards.

        Raises:
            ValueError: the fault does not fit its file, or pytest could not run the test.
        """
        file = self._folder / fault.file
        text, times = file.read_text(encoding="utf-8"), file.stat()
        file.write_text(fault.planted_in(text), encoding="utf-8")
        os.utime(file, (0, 0))
        try:
            code, said, cpu_s = self._run([fault.test], writes=False)
        finally:
            file.write_text(text, encoding="utf-8")
            os.utime(file, ns=(times.st_atime_ns, times.st_mtime_ns))
        if code not in (_PASS, _FAIL):
            raise ValueError(f"{fault.name}: {fault.test} could not be run:\n{said}")
        failed = _FAILED.search(said)
        return Noticed(fault, code == _FAIL, failed[1] if failed else "", cpu_s)

    def _run(self, tests: Sequence[str], *, writes: bool) -> tuple[int, str, float]:
        """Exit code of pytest, what it wrote, and its CPU time, s."""
        surroundings = {
            **os.environ,
            "NUMBA_DISABLE_JIT": "1",
            "PYTHONDONTWRITEBYTECODE": "" if writes else "1",
            "CI": "1",  # the same examples of each property every time
        }  # fmt: skip
        command = (sys.executable, "-m", "pytest", "-q", "-x", "--tb=line")
        before = _cpu_s()
        done = subprocess.run(
            (*command, *tests), cwd=self._folder, env=surroundings, capture_output=True, text=True,
            timeout=LONGEST_S, check=False,
        )  # fmt: skip
        return done.returncode, done.stdout + done.stderr, _cpu_s() - before


def _cpu_s() -> float:
    """CPU time of all processes that were started from here and have ended, s."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime
