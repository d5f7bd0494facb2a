"""YAML files by the kind and name in their first line, including those of projects.

`scene: office` makes a file the scene `office`. Every YAML file in a project's package can be named
this way, and takes precedence over a shipped one of the same kind and name.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from functools import cache
from pathlib import Path

from cobodeck.project.project import Project, projects
from cobodeck.terminal import complain
from engine.files.declared import OwnFiles

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
    "campaign",
    "topics",
)
MAP, MAP_KEY = "map", "image:"
"""The kind that has no name, and the key that such a file begins a line with."""
ROOT = Path(__file__).parent.parent.parent
SHIPPED = ("charts", "hw", "cobodeck/campaign")
"""The folders that contain shipped files."""
EXAMPLES = ROOT / "charts" / "examples"
"""A project of its own among them."""
_HEAD_BYTES = 4096


def head_of(file: Path) -> tuple[str, str] | None:
    """Kind and name of a YAML file, from the first line that begins with one of the `KINDS`."""
    for line in _first_lines(file):
        key, colon, name = line.partition(":")
        if colon and key.rstrip() in KINDS:
            return key.rstrip(), name.partition("#")[0].strip().strip("'\"")
    return None


def _first_lines(file: Path) -> list[str]:
    try:
        if not file.is_file():  # reading a pipe would block
            return []
        with file.open("rb") as stream:
            head = stream.read(_HEAD_BYTES)
    except OSError:
        return []
    return head.decode("utf-8", "replace").lstrip("\ufeff").splitlines()


def kind_of(file: Path) -> str | None:
    """The kind of a YAML file; None if it is of no known kind.

    A map of map_server, `map`, gives no name: it is told by the picture that it names.
    """
    head = head_of(file)
    if head is not None:
        return head[0]
    return MAP if any(line.startswith(MAP_KEY) for line in _first_lines(file)) else None


def name_in(file: Path) -> str:
    """The name that a YAML file gives, or that of the file itself."""
    head = head_of(file)
    return head[1] if head is not None and head[1] else file.stem


def own_files_around(start: Path | None = None) -> OwnFiles:
    """The files of the project around a folder, by default the current one, and of installed ones.

    They are searched when the first name is looked up; clashing names are reported then.
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
    """The files of projects by kind and name, and a message for each clash of names."""
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
    for folder in SHIPPED:
        for file in (ROOT / folder).rglob("*.yaml"):
            head = head_of(file)
            if head is not None and EXAMPLES not in file.parents:
                yield head


def _nobody(_message: str) -> None:
    """Report nothing: `catalogue` reports it where the project's code is imported."""
