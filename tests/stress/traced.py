"""Runs subjects without compiling: which modules that compute they run, and what they answer.

`python -m tests.stress.traced` writes what each subject covers into `covered.json`, beside this.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Iterable, Mapping
from pathlib import Path
from types import CodeType, FrameType
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
COVERED = Path(__file__).with_name("covered.json")


def covered() -> Mapping[str, list[str]]:
    """What the table says: by subject, the modules that compute."""
    found: Mapping[str, list[str]] = json.loads(COVERED.read_text())
    return found


def traced(names: Iterable[str]) -> Mapping[str, Any]:
    """By subject its `modules` and `answers`, found in another interpreter without a compiler."""
    environment = {**os.environ, "NUMBA_DISABLE_JIT": "1", "PYTHONPATH": str(ROOT)}
    done = subprocess.run(
        [sys.executable, "-m", "tests.stress.traced", *names],
        env=environment, cwd=ROOT, capture_output=True, text=True, check=True,
    )  # fmt: skip
    found: Mapping[str, Any] = json.loads(done.stdout)
    return found


def _trace(names: Iterable[str]) -> dict[str, Any]:
    from tests.stress.numerics import numeric_modules
    from tests.stress.subjects import HOME, SUBJECTS

    wanted, found = set(names) - {"all"}, {}
    for subject in SUBJECTS:
        if wanted and subject.name not in wanted:
            continue
        seen: set[CodeType] = set()

        def note(frame: FrameType, event: str, _: object, seen: set[CodeType] = seen) -> None:
            if event == "call" and frame.f_code.co_name != "<module>":
                seen.add(frame.f_code)

        sys.setprofile(note)
        try:
            answers = [float(value) for value in subject.run(HOME)]
        finally:
            sys.setprofile(None)
        files = {Path(code.co_filename) for code in seen}
        inside = {f.relative_to(ROOT).as_posix() for f in files if f.is_relative_to(ROOT)}
        found[subject.name] = {
            "modules": sorted(inside & numeric_modules()), "answers": answers,
        }  # fmt: skip
    return found


if __name__ == "__main__":
    if len(sys.argv) > 1:
        sys.stdout.write(json.dumps(_trace(sys.argv[1:])))
    else:
        table = {name: row["modules"] for name, row in traced(["all"]).items()}
        COVERED.write_text(json.dumps(table, indent=1) + "\n")
