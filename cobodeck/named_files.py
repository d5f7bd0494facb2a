"""YAML files by kind and name, as their first line says, and those that a project brings.

`scene: office` makes a file the scene `office`. Every YAML file in a package of a project is known
so, and counts before a shipped one of the same kind and name.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from functools import cache
from pathlib import Path

from cobodeck.console import complain
from cobodeck.project import Project, projects
from engine.files.named import OwnFiles

KINDS = (
    "chart",
    "scene",
    "robot",
    "profile",
    "user",
    "prop",
    "calibration",
    "arm",
    "connection",
    "tracking",
)
ROOT = Path(__file__).parent.parent
SHIPPED = ("charts", "hw", "states")
"""The packages that shipped files are in."""
_HEAD_BYTES = 4096


def head_of(file: Path) -> tuple[str, str] | None:
    """What a YAML file is, and its name: the first line that begins with one of the `KINDS`."""
    try:
        if not file.is_file():  # a pipe would have to be waited for
            return None
        with file.open("rb") as stream:
            head = stream.read(_HEAD_BYTES)
    except OSError:
        return None
    for line in head.decode("utf-8", "replace").lstrip("\ufeff").splitlines():
        key, colon, name = line.partition(":")
        if colon and key.rstrip() in KINDS:
            return key.rstrip(), name.partition("#")[0].strip().strip("'\"")
    return None


def kind_of(file: Path) -> str | None:
    """What a YAML file is."""
    head = head_of(file)
    return None if head is None else head[0]


def own_files_around(start: Path | None = None) -> OwnFiles:
    """The files of the projects around a folder, by default the present one, and installed ones.

    They are looked for when the first name is asked for; names that clash are then reported.
    """

    @cache
    def files() -> Mapping[str, Mapping[str, Path]]:
        found, clashes = _by_name(projects(start, tell=_nobody))
        for clash in clashes:
            complain(clash)
        return found

    def own(kind: str) -> Mapping[str, Path]:
        return files().get(kind, {})

    return own


def _by_name(
    found: Iterable[Project],
) -> tuple[dict[str, dict[str, Path]], list[str]]:
    """The files of projects by kind and name, and what has to be said of names that clash."""
    files: dict[str, dict[str, Path]] = {}
    clashes = []
    for file in (file for project in found for file in project.yaml_files()):
        head = head_of(file)
        if head is None or head[0] == "chart":  # charts are found by `library.py`
            continue
        kind, name = head
        first = files.setdefault(kind, {}).setdefault(name, file)
        if first != file:
            clashes.append(f"{kind} {name!r} is {first}; rename the other one, {file}")
    shipped = set(_shipped_heads()) if files else set()
    for kind, own in files.items():
        clashes += [
            f"{kind} {name!r} is {file}; the shipped one of this name is hidden"
            for name, file in own.items()
            if (kind, name) in shipped
        ]
    return files, clashes


def _shipped_heads() -> Iterator[tuple[str, str]]:
    for package in SHIPPED:
        for file in (ROOT / package).rglob("*.yaml"):
            head = head_of(file)
            if head is not None:
                yield head


def _nobody(_message: str) -> None:
    """Reported where the project's code is imported."""
