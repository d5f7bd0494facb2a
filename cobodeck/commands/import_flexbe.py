"""Make a project of behaviours of FlexBE: charts, stubs of their states, tests, a list of work.

Reads generated Python (*_sm.py of FlexBE 1 to 4), behaviours as JSON, or all in a folder; none of
it is run. With --neutral it prints the behaviour as JSON and writes nothing. With --states, the
state modules in the folder that stand alone are loaded, and the project has those that work in it.
"""

from __future__ import annotations

import argparse
import re
import subprocess
import sys
from collections.abc import Iterable, Mapping
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from cobodeck.commands.new import all_or_nothing, go_on_with, package_name
from cobodeck.flexbe import Behaviour, Conversion, convert, files_of_project, found_in, summary
from cobodeck.project import catalogue
from cobodeck.terminal import FAILED, OK, Problem, complain, json_options, show, show_json


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument("path", type=Path, metavar="PATH", help="X_sm.py, X.json, or a folder")
    parser.add_argument("-o", "--output", type=Path, metavar="DIR", help="the project to make")
    parser.add_argument("--neutral", action="store_true", help="print the behaviour as JSON")
    what = "load the state modules in the folder, and keep those that run as they are"
    parser.add_argument("--states", action="store_true", help=what)
    json_options(parser)


def run(args: argparse.Namespace) -> int:
    """Read, convert, write, and say what is left.

    Raises:
        Problem: there is nowhere to write, or something is there already.
    """
    found = found_in(args.path)
    if args.neutral:
        read = {behaviour.name: behaviour.json for behaviour in found.behaviours}
        show_json(read if args.path.is_dir() else next(iter(read.values())))
        return _told(found.wrong)
    folder: Path | None = args.output
    if folder is None:
        raise Problem("name the folder of the new project with -o DIR")
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise Problem(f"{folder} is there already; choose an empty or new folder", FAILED)
    name = package_name(folder)
    conversion = convert(found.behaviours, found.classes, catalogue(own=False).interfaces)
    if args.states:
        _keep_what_works(name, found.behaviours, conversion)
    files = files_of_project(name, found.behaviours, conversion)
    with all_or_nothing(folder):
        _write(folder, files)
    figures = summary(found.behaviours, conversion)
    if args.json:
        left = [
            {"chart": left.chart, "path": left.path, "what": left.what, "code": left.code}
            for left in conversion.left
        ]
        report: dict[str, Any] = {"project": str(folder), "files": list(files), **figures}
        show_json(report | {"work": left, "different": conversion.notes, "wrong": found.wrong})
    else:
        _show(folder, figures)
    return _told(found.wrong)


def _write(folder: Path, files: Mapping[str, str]) -> None:
    for path, text in files.items():
        (folder / path).parent.mkdir(parents=True, exist_ok=True)
        (folder / path).write_text(text, encoding="utf-8")


def _keep_what_works(name: str, behaviours: Iterable[Behaviour], conversion: Conversion) -> None:
    """Have the project run the state classes with which it validates, in a process of its own."""
    classes = conversion.classes.values()
    for cls in classes:
        cls.adapted = cls.may_be_adapted
    while wanted := [cls for cls in classes if cls.adapted]:
        with TemporaryDirectory() as made:
            folder = Path(made) / name
            _write(folder, files_of_project(name, behaviours, conversion))
            validate = [sys.executable, "-m", "cobodeck", "validate"]
            done = subprocess.run(validate, cwd=folder, capture_output=True, text=True, check=False)
        if done.returncode == OK:
            return
        said = done.stdout + done.stderr
        wrong = [cls for cls in wanted if re.search(rf"\b{cls.name}\b", said)]
        for cls in wrong or wanted:
            cls.adapted = False


def _show(folder: Path, figures: Any) -> None:
    show(
        f"{folder}: {_count(figures, 'chart')} of {_count(figures, 'behaviour')} with "
        f"{_count(figures, 'state')} of {_count(figures, 'class', 'classes')}: "
        f"{figures['translated']} translated, {figures['adapted']} as they are, "
        f"{_count(figures, 'stub')}."
    )
    left = "1 thing is" if figures["left"] == 1 else f"{figures['left']} things are"
    show(f"{left} left to do in charts; WORK.md has them. {go_on_with(folder)}")


def _count(figures: Any, one: str, many: str = "") -> str:
    many = many or f"{one}s"
    return f"{figures[many]} {one if figures[many] == 1 else many}"


def _told(wrong: list[str]) -> int:
    for what in wrong:
        complain(what)
    return FAILED if wrong else OK
