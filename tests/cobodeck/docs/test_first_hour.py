"""The first hour: every command is typed, every file is written, in their order."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[3]
HOUR = (ROOT / "cobodeck/docs/first-hour.md").read_text(encoding="utf-8")
DIFFER = 1


def steps() -> list[tuple[str, str]]:
    """Language and text of each block."""
    return re.findall(r"^```(\w+)\n(.*?)^```", HOUR, flags=re.M | re.S)


@pytest.fixture
def shell(tmp_path: Path) -> dict[str, str]:
    """An environment in which `cobodeck` and `pytest` are those that run this test."""
    programs = tmp_path / "programs"
    programs.mkdir()
    for name in ("cobodeck", "pytest"):
        file = programs / name
        file.write_text(f'#!/bin/sh\nexec {sys.executable} -m {name} "$@"\n')
        file.chmod(0o755)
    return {
        **os.environ,
        "PATH": f"{programs}:{os.environ['PATH']}",
        "PYTHONPATH": str(ROOT),
        "PYTHONDONTWRITEBYTECODE": "1",
        "PYTEST_PLUGINS": "cobodeck.pytest_plugin",
    }


def write(folder: Path, text: str) -> None:
    """A file whose first line is its name, or what stands at the end of one."""
    first = re.match(r"# (\S+?)(, at its end)?\n", text)
    assert first is not None, text
    file = folder / first[1]
    assert file.exists() is bool(first[2]), file
    with file.open("a", encoding="utf-8") as stream:
        stream.write(text)


@pytest.mark.slow
def test_every_command_of_the_first_hour_works_as_it_is_typed(
    tmp_path: Path, shell: dict[str, str]
) -> None:
    folder, typed = tmp_path / "work", 0
    folder.mkdir()
    for language, text in steps():
        if language != "sh":
            write(folder, text)
            continue
        for line in text.splitlines():
            typed += 1
            if line.startswith("cd "):
                folder = (folder / line[3:]).resolve()
                continue
            done = subprocess.run(
                line, shell=True, cwd=folder, env=shell, capture_output=True, text=True
            )
            expected = DIFFER if line.startswith("cobodeck compare") else 0
            assert done.returncode == expected, f"{line}\n{done.stdout}{done.stderr}"
    assert typed >= 19
    assert (folder.parent / "my_project" / "after.png").stat().st_size > 10_000


def test_the_first_hour_has_the_steps_in_the_order_in_which_one_does_them() -> None:
    titles = re.findall(r"^## (.*)$", HOUR, flags=re.M)

    assert titles == [
        "A project, a chart, a state",
        "A test of your own",
        "A room of your own",
        "Other values",
        "A robot of your own",
        "What next",
        "The words",
    ]
