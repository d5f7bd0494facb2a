"""Begin a project of your own: a package with a chart, a state, a room, a profile, and tests.

With --robot a robot of your own: a body, a base behind UDP with its fake, parts, a chart, tests.
Either passes `cobodeck validate` and `pytest` at once.
"""

from __future__ import annotations

import argparse
import keyword
import re
import shlex
import shutil
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path

from cobodeck.project import kind_of, own_files_around
from cobodeck.terminal import FAILED, OK, Problem, show

TEMPLATES = Path(__file__).parent.parent / "template"
PLACEHOLDER = "PROJECT"
_NAME = re.compile("[a-z][a-z0-9_]*")


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument("--robot", action="store_true", help="a robot of your own")
    parser.add_argument("folder", type=Path, metavar="DIR", help="its last part names the package")


def run(args: argparse.Namespace) -> int:
    """Write the files."""
    folder: Path = args.folder
    name = package_name(folder)
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise Problem(f"{folder} is there already; choose an empty or new folder", FAILED)
    template = TEMPLATES / ("robot" if args.robot else "project")
    with all_or_nothing(folder):
        _copy(template, folder, name)
        _write_schemas(folder, name, own=args.own)
    what = "a robot, its fake, a chart and their tests"
    if not args.robot:
        what = "a chart, a state, a room, a profile and tests"
    show(f"{folder}: {what}. {go_on_with(folder)}")
    return OK


def _write_schemas(folder: Path, name: str, *, own: bool) -> None:
    """One of each kind of file that is there, with the project's names, not those around here."""
    from cobodeck.commands.schema import schema_of
    from engine.files.declared import no_files, with_own_files

    with with_own_files(own_files_around(folder) if own else no_files):
        for kind in {kind_of(file) for file in (folder / name).glob("*.yaml")}:
            schema = schema_of(str(kind), folder, own=own)
            (folder / name / f"{kind}.schema.json").write_text(schema, encoding="utf-8")


def _copy(template: Path, folder: Path, name: str) -> None:
    """Write the template's files with the package's name in place of the placeholder."""
    for source in sorted(template.rglob("*")):
        if source.is_file() and "__pycache__" not in source.parts:
            target = folder / str(source.relative_to(template)).replace(PLACEHOLDER, name)
            target.parent.mkdir(parents=True, exist_ok=True)
            text = source.read_text(encoding="utf-8")
            target.write_text(text.replace(PLACEHOLDER, name), encoding="utf-8")


@contextmanager
def all_or_nothing(folder: Path) -> Iterator[None]:
    """On any exception inside, restore the folder: absent or empty, as before."""
    was_there = folder.exists()
    try:
        yield
    except BaseException:
        shutil.rmtree(folder, ignore_errors=True)
        if was_there:
            folder.mkdir()
        raise


def go_on_with(folder: Path) -> str:
    """What to type next in a new project, a line each."""
    activate = _activation()
    lines = [] if activate is None else [f"  . {shlex.quote(str(activate))}"]
    next_step = f"  cd {shlex.quote(str(folder))} && cobodeck validate && pytest"
    return "\n".join(["Go on with", *lines, next_step])


def package_name(folder: Path) -> str:
    """The name of the package, from that of the folder.

    Raises:
        Problem: the folder's name is no valid one, or that of another module.
    """
    name = folder.resolve().name.replace("-", "_").replace(" ", "_").lower()
    if not _NAME.fullmatch(name) or keyword.iskeyword(name):
        raise Problem(
            f"{folder.name!r} cannot name a package; use the letters a to z, digits and _, "
            "beginning with a letter"
        )
    if find_spec(name) is not None and not (folder / name).exists():
        raise Problem(f"a module {name!r} is there already; choose another name")
    return name


def _activation() -> Path | None:
    """The script that lets a shell find `cobodeck`; None if not needed, or there is none.

    In a virtual environment the script is in the same folder as Python and all programs.
    """
    programs = Path(sys.executable).parent
    found = shutil.which("cobodeck")
    script = programs / "activate"
    if not script.is_file() or (found is not None and Path(found).parent == programs):
        return None
    return script
