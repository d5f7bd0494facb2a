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

from cobodeck.console import Problem

GROUP = "cobodeck.states"
FILE = "pyproject.toml"


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
        Problem: the project's file cannot be read.
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
            text = file.read_text(encoding="utf-8", errors="replace")
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
        content = tomllib.loads(file.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise Problem(f"{file}: cannot be read: {error}") from None
    declared = content.get("project", {}).get("entry-points", {}).get(GROUP, {})
    modules = tuple(str(value) for value in declared.values())
    return Project(next(iter(declared)), modules, file.parent) if modules else None
