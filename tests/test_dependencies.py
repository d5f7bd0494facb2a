"""Each default dependency is imported somewhere, or the issue that will is named beside it."""

from __future__ import annotations

import ast
import re
import tomllib
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PRODUCT = ("engine", "states", "behaviors", "hw", "cobodeck")
TEXT = (ROOT / "pyproject.toml").read_text()
MODULES = {
    "pyyaml": "yaml",
    "pillow": "PIL",
    "python-can": "can",
    "foxglove-sdk": "foxglove",
    "ur-rtde": "rtde_control",
}
"""What is imported under another name than it is installed by."""


def imported() -> Iterator[str]:
    """The modules that the product imports."""
    files = [file for top in PRODUCT for file in (ROOT / top).rglob("*.py")]
    for file in files:
        if "template" in file.relative_to(ROOT).parts:
            continue
        for node in ast.walk(ast.parse(file.read_text())):
            if isinstance(node, ast.Import):
                yield from (alias.name for alias in node.names)
            elif isinstance(node, ast.ImportFrom) and node.module:
                yield node.module


def dependencies() -> dict[str, str]:
    """The default dependencies, each with the comment beside it."""
    block = TEXT[TEXT.index("\ndependencies = [") :]
    lines = block[: block.index("\n]")].splitlines()[2:]
    found = [re.fullmatch(r'\s+"([\w-]+)[^"]*",\s*(?:# (.*))?', line) for line in lines]
    return {match[1]: match[2] or "" for match in found if match is not None}


def test_every_default_dependency_is_imported_or_the_issue_that_will_is_named() -> None:
    declared = tomllib.loads(TEXT)["project"]["dependencies"]
    modules = {name.partition(".")[0] for name in imported()}

    later = {
        name for name, comment in dependencies().items() if re.match(r"issue [A-Z]: ", comment)
    }
    used = {name for name in dependencies() if MODULES.get(name, name) in modules}

    assert len(dependencies()) == len(declared)
    assert dependencies().keys() - used == later
