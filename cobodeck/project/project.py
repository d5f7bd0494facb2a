"""Projects: where a user's own states, charts and other files are.

A project is a folder with a `pyproject.toml` that declares modules of state classes:

    [project.entry-points."cobodeck.states"]
    mine = "mine.states"

It is found from its folder, or from below it in the same repository, if all its files belong to
the user or to root; once installed, it is found from everywhere by the same entry points. The
charts, scenes, users, robots, profiles and connections of a project are the YAML files in these
packages.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cobodeck.shadowed import PACKAGES
from cobodeck.terminal import Problem, complain
from engine.files import FileError, read_bytes, read_text
from engine.files.declared import YAML

GROUP = "cobodeck.states"
FILE = "pyproject.toml"
MAX_BYTES = 10_000_000


@dataclass(frozen=True, slots=True)
class Project:
    """Modules with state classes, and the folder they are imported from (`None`: installed)."""

    name: str
    modules: tuple[str, ...]
    folder: Path | None = None

    @property
    def packages(self) -> frozenset[str]:
        """The names by which its code is imported."""
        return frozenset(module.partition(".")[0] for module in self.modules)

    def make_importable(self) -> None:
        """Put the project's folder on Python's path."""
        if self.folder is not None and str(self.folder) not in sys.path:
            sys.path.insert(0, str(self.folder))

    def code(self) -> Iterator[Path]:
        """Paths of the folder, the project file, and all in its packages, links followed."""
        if self.folder is None:
            return
        yield from (self.folder, self.folder / FILE)
        for package in sorted(self.packages):
            yield from sorted(self.folder.glob(f"{package}.*"))
            seen = set()
            for place, folders, files in os.walk(self.folder / package, followlinks=True):
                here = Path(place)
                if here.resolve() in seen:
                    folders.clear()
                    continue
                seen.add(here.resolve())
                yield from (here, *(here / name for name in files))

    def yaml_files(self) -> list[Path]:
        """The YAML files beside the project file and in the project's packages."""
        found: dict[Path, None] = {}
        if self.folder is not None:
            beside = (file for ending in YAML for file in self.folder.glob(f"*{ending}"))
            found |= dict.fromkeys(sorted(beside))
        for module in self.modules:
            folder = self._package(module)
            if folder is not None:
                inside = (file for ending in YAML for file in folder.rglob(f"*{ending}"))
                found |= dict.fromkeys(sorted(inside))
        return list(found)

    def _package(self, module: str) -> Path | None:
        top = module.partition(".")[0]
        if self.folder is not None:
            return self.folder / top if (self.folder / top).is_dir() else None
        from importlib.util import find_spec

        spec = find_spec(top)
        places = list(spec.submodule_search_locations or ()) if spec else []
        return Path(places[0]) if places else None


def projects(start: Path | None = None, tell: Callable[[str], None] = complain) -> list[Project]:
    """The project around a folder, by default the current one, and all installed projects.

    A project around it whose code may not be imported is left out; `tell` receives the reason.

    Raises:
        Problem: the project's file cannot be read, or is malformed.
    """
    start = (start or Path.cwd()).resolve()
    installed = {module: name for name, module in _installed(start)}
    here = _around(start)
    found = []
    if here is not None:
        for name, module in _hiding(here):
            tell(
                f"{module}: cobodeck has a package {name!r} of its own, and Python may import one "
                "for the other; rename yours"
            )
        why_not = _outside(here, start) or _foreign(here)
        if not why_not:
            found.append(here)
        elif not installed.keys() >= set(here.modules):  # else they are imported from there
            tell(f"{here.folder}/{FILE}: its states are not imported: {why_not}")
    known = {module for project in found for module in project.modules}
    return found + [
        Project(name, (module,)) for module, name in installed.items() if module not in known
    ]


def is_project(folder: Path) -> bool:
    """Whether a folder has a project file that declares states."""
    file = folder / FILE
    try:
        return file.is_file() and GROUP in read_text(file, MAX_BYTES)
    except FileError:
        return False


def folder_of_project(file: Path) -> Path | None:
    """The folder of the project in which a file is; None if it is in none."""
    return next(filter(is_project, file.resolve().parents), None)


def is_there(module: str) -> bool:
    """Whether a module can be found; its parent packages are imported, the module is not."""
    from importlib.util import find_spec

    try:
        return find_spec(module) is not None
    except (ImportError, ValueError):
        return False


def _installed(start: Path) -> Iterator[tuple[str, str]]:
    """Names and modules of the installed entry points.

    Parsed here because importlib.metadata takes longer than checking all shipped charts. `start`
    is skipped, although `python -m` puts it on the path: only its project file counts.
    """
    for folder in dict.fromkeys(Path(place).resolve() for place in sys.path):
        if folder == start:
            continue
        for file in sorted(folder.glob("*-info/entry_points.txt")):
            text = read_bytes(file, MAX_BYTES).decode("utf-8", "replace")
            if f"[{GROUP}]" in text:
                _, _, section = text.partition(f"[{GROUP}]")
                for line in section.partition("\n[")[0].splitlines():
                    name, given, module = line.partition("=")
                    if given:
                        yield name.strip(), module.strip()


def _around(start: Path) -> Project | None:
    """The project of the nearest project file that declares states, in the folder or above."""
    top = _top(start)
    for folder in (start, *start.parents):
        try:
            project = _read(folder / FILE) if (folder / FILE).is_file() else None
        except Problem:
            if folder.is_relative_to(top):
                raise
            continue
        if project is not None:
            return project
    return None


def _top(start: Path) -> Path:
    """The root of the repository around a folder; the folder itself if there is none."""
    return next((place for place in (start, *start.parents) if (place / ".git").exists()), start)


def _outside(project: Project, start: Path) -> str:
    """Why a project does not count for a folder below it; empty if it does."""
    assert project.folder is not None
    if project.folder.is_relative_to(_top(start)):
        return ""
    return f"no repository holds both it and {start}; go to its folder"


def _foreign(project: Project) -> str:
    """Which file of a project belongs to neither the user nor root; empty if all of them do.

    Links count as their targets. On systems whose files have no owner id (Windows) nothing is
    foreign.
    """
    if not hasattr(os, "getuid"):
        return ""
    for path in project.code():
        try:
            owner = path.stat().st_uid
        except OSError:  # a broken link; what cannot be inspected cannot be imported
            continue
        if owner not in (0, os.getuid()):
            return f"{path} belongs to user {owner}; if you trust it, make it your own (chown)"
    return ""


def _hiding(project: Project) -> Iterator[tuple[str, Path]]:
    """Modules in a project's folder with the name of a cobodeck package, as (name, file)."""
    assert project.folder is not None
    for name in PACKAGES:
        for module in (project.folder / f"{name}.py", project.folder / name / "__init__.py"):
            if module.is_file():
                yield name, module


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
        if isinstance(module, str) and module.partition(".")[0] in PACKAGES:
            raise Problem(
                f"{file}: {GROUP}.{name} names {module!r}, which is in a package of cobodeck; "
                "give your own another name"
            )
        if not isinstance(module, str) or not all(map(str.isidentifier, module.split("."))):
            raise Problem(f"{file}: {GROUP}.{name} is not the name of a module")
    return Project(next(iter(found)), tuple(found.values()), file.parent) if found else None
