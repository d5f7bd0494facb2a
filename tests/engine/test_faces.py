"""A folder offers what its stub names, loads it when asked for, and nothing before."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

import engine
from engine import faces
from tests.program import ROOT, python

PRODUCT = ("engine", "hw", "states", "behaviors", "cobodeck")
FOLDERS = sorted(
    ".".join(stub.parent.relative_to(ROOT).parts)
    for top in PRODUCT
    for stub in (ROOT / top).rglob("__init__.pyi")
)
ALLOWED = {"cobodeck.commands": "a file there is a command"}
MOST = 12


def defined(file: Path) -> set[str]:
    """The names that a module assigns, defines or imports at its top."""
    found: set[str] = set()
    for node in ast.parse(file.read_text(encoding="utf-8")).body:
        match node:
            case ast.ClassDef() | ast.FunctionDef():
                found.add(node.name)
            case ast.Assign():
                found |= {
                    n.id for t in node.targets for n in ast.walk(t) if isinstance(n, ast.Name)
                }
            case ast.AnnAssign(target=ast.Name(name)):
                found.add(name)
            case ast.ImportFrom():
                found |= {alias.asname or alias.name for alias in node.names}
    return found


@pytest.mark.parametrize("folder", FOLDERS)
def test_what_a_folder_offers_is_there(folder: str) -> None:
    homes = faces.homes(folder)

    assert homes
    for name, module in homes.items():
        file = ROOT / f"{module.replace('.', '/')}.py"
        if module == folder:  # a module that is offered as a whole
            assert (ROOT / folder.replace(".", "/") / f"{name}.py").exists(), name
        else:
            assert name in defined(file), f"{module}.{name}"


def test_no_folder_offers_a_name_that_one_of_its_modules_has() -> None:
    """Whichever was imported first would hide the other."""
    for folder in FOLDERS:
        here = ROOT / folder.replace(".", "/")
        modules = {file.stem for file in here.glob("*.py")} | {d.name for d in here.iterdir()}
        taken = {n for n, home in faces.homes(folder).items() if home != folder} & modules

        assert not taken, folder


def test_importing_folders_loads_no_module_of_them(tmp_path: Path) -> None:
    imports = "; ".join(f"import {folder}" for folder in FOLDERS)
    show = "print(*sorted(m for m in sys.modules if m.split('.')[0] in {tops}))"
    done = python(tmp_path, "-c", f"import sys; {imports}; {show.format(tops=PRODUCT)}")

    above = {folder.rpartition(".")[0] for folder in FOLDERS} - {""}
    own = {*FOLDERS, *PRODUCT, *above, "engine.faces", "cobodeck.shadowed"}
    assert done.returncode == 0, done.stderr
    assert set(done.stdout.split()) == own


def test_a_name_that_is_not_offered_is_an_attribute_error_and_the_others_are_listed() -> None:
    with pytest.raises(AttributeError, match="module 'engine' has no attribute 'Nothing'"):
        _ = engine.Nothing  # type: ignore[attr-defined]
    assert {"Action", "Monitor", "Context", "On", "Until", "Measured", "Length"} <= {*dir(engine)}
    assert engine.Action is engine.Action


def folders() -> Iterator[Path]:
    for top in PRODUCT:
        for file in sorted((ROOT / top).rglob("__init__.py")):
            if "template" not in file.parts:
                yield file.parent


def test_a_folder_has_at_most_twelve_modules_and_a_line_that_says_what_belongs_there() -> None:
    for folder in folders():
        name = ".".join(folder.relative_to(ROOT).parts)
        modules = [f for f in folder.glob("*.py") if f.name != "__init__.py"]
        line = ast.get_docstring(ast.parse((folder / "__init__.py").read_text())) or ""

        assert len(modules) <= MOST or name in ALLOWED, name
        assert re.match(r"[A-Z].+[.:]", line.partition("\n")[0]), name
