"""A project of one's own: where its states and charts are.

A project is a folder with a `pyproject.toml` that declares modules of state classes:

    [project.entry-points."cobodeck.states"]
    mine = "mine.states"

Standing in the folder is enough; once the project is installed it is found from everywhere, by
the same lines. The charts of a project are the YAML files in the packages of these modules.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cobodeck.console import Problem
from engine.files.finding import FileError
from engine.files.text import read_bytes, read_text

GROUP = "cobodeck.states"
FILE = "pyproject.toml"
MAX_BYTES = 10_000_000


@dataclass(frozen=True, slots=True)
class Project:
    """Modules with state classes, and the folder they are imported from (`None`: installed)."""

    name: str
    modules: tuple[str, ...]
    folder: Path | None = None

    def make_importable(self) -> None:
        """Put the project's folder where Python looks for modules."""
        if self.folder is not None and str(self.folder) not in sys.path:
            sys.path.insert(0, str(self.folder))

    def chart_files(self) -> list[Path]:
        """The YAML files of the project's packages."""
        found: dict[Path, None] = {}
        for module in self.modules:
            folder = self._package(module)
            if folder is not None:
                found |= dict.fromkeys(sorted(folder.rglob("*.yaml")))
        return list(found)

    def _package(self, module: str) -> Path | None:
        top = module.partition(".")[0]
        if self.folder is not None:
            return self.folder / top if (self.folder / top).is_dir() else None
        from importlib.util import find_spec

        spec = find_spec(top)
        places = list(spec.submodule_search_locations or ()) if spec else []
        return Path(places[0]) if places else None


def projects(start: Path | None = None) -> list[Project]:
    """The project around a folder, by default the present one, and all that are installed.

    Raises:
        Problem: the project's file cannot be read, or is none.
    """
    here = _around((start or Path.cwd()).resolve())
    found = [] if here is None else [here]
    known = {module for project in found for module in project.modules}
    for name, module in _installed():
        if module not in known:
            found.append(Project(name, (module,)))
            known.add(module)
    return found


def _installed() -> Iterator[tuple[str, str]]:
    """Names and modules of the entry points that are installed.

    Read by hand: importlib.metadata takes longer than checking all shipped charts.
    """
    for folder in dict.fromkeys(sys.path):
        for file in sorted(Path(folder or ".").glob("*-info/entry_points.txt")):
            text = read_bytes(file, MAX_BYTES).decode("utf-8", "replace")
            if f"[{GROUP}]" in text:
                _, _, section = text.partition(f"[{GROUP}]")
                for line in section.partition("\n[")[0].splitlines():
                    name, given, module = line.partition("=")
                    if given:
                        yield name.strip(), module.strip()


def _around(start: Path) -> Project | None:
    for folder in (start, *start.parents):
        file = folder / FILE
        if file.is_file():
            project = _read(file)
            if project is not None:
                return project
    return None


def _read(file: Path) -> Project | None:
    import tomllib

    try:
        found: Any = tomllib.loads(read_text(file, MAX_BYTES))
    except FileError as error:
        raise Problem(str(error)) from None
    except tomllib.TOMLDecodeError as error:
        raise Problem(f"{file}: is not TOML: {error}") from None
    for key in ("project", "entry-points", GROUP):
        found = found.get(key, {})
        if not isinstance(found, dict):
            raise Problem(f"{file}: {key!r} is not a table")
    for name, module in found.items():
        if not isinstance(module, str):
            raise Problem(f"{file}: {GROUP}.{name} is not the name of a module")
    return Project(next(iter(found)), tuple(found.values()), file.parent) if found else None
