"""Begin a project of your own: one package with a chart, a state, a schema, and a test.

With --robot a robot of your own: a body, a base behind UDP with its fake, parts, a chart, a test.
Either passes `cobodeck validate` and `pytest` at once.
"""

from __future__ import annotations

import argparse
import keyword
import shlex
import shutil
import sys
from importlib.util import find_spec
from pathlib import Path

from cobodeck.console import FAILED, OK, Problem, show

TEMPLATES = Path(__file__).parent.parent / "template"
PLACEHOLDER = "PROJECT"


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
    for source in sorted(template.rglob("*")):
        if source.is_file() and "__pycache__" not in source.parts:
            inside = str(source.relative_to(template)).replace(PLACEHOLDER, name)
            target = folder / inside
            target.parent.mkdir(parents=True, exist_ok=True)
            text = source.read_text(encoding="utf-8")
            target.write_text(text.replace(PLACEHOLDER, name), encoding="utf-8")
    from cobodeck.commands.schema import schema_of

    (folder / name / "chart.schema.json").write_text(
        schema_of(folder, own=args.own), encoding="utf-8"
    )
    what = "a robot, its fake, a chart and its test"
    if not args.robot:
        what = "a chart, a state and its test"
    show(f"{folder}: {what}. Go on with")
    activate = activation()
    if activate is not None:
        show(f"  . {shlex.quote(str(activate))}")
    show(f"  cd {shlex.quote(str(folder))} && cobodeck validate && pytest")
    return OK


def activation() -> Path | None:
    """The script with which a shell finds `cobodeck`; `None` where it finds this one, or none is.

    The programs of a virtual environment stand beside its Python, and so does its script.
    """
    programs = Path(sys.executable).parent
    found = shutil.which("cobodeck")
    script = programs / "activate"
    if not script.is_file() or (found is not None and Path(found).parent == programs):
        return None
    return script


def package_name(folder: Path) -> str:
    """The package's name.

    Raises:
        Problem: the folder's name is none, or stands for another module already.
    """
    name = folder.resolve().name.replace("-", "_").replace(" ", "_").lower()
    if not name.isidentifier() or keyword.iskeyword(name):
        raise Problem(f"{folder.name!r} cannot name a package; use letters, digits and _")
    if find_spec(name) is not None and not (folder / name).exists():
        raise Problem(f"a module {name!r} is there already; choose another name")
    return name
