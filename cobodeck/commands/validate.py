"""Check charts, scenes, robots and profiles; nothing is run.

Without a path: the charts of the project around the present folder, or all shipped files.
Exit code 0: no errors; 1: errors, with --strict also warnings.
"""

from __future__ import annotations

import argparse
import re
from collections.abc import Callable
from pathlib import Path

from cobodeck.catalogue import CHARTS, Catalogue, catalogue
from cobodeck.console import FAILED, OK, show
from cobodeck.library import (
    chart_names,
    errors_in_used,
    files_in,
    findings_of,
    load_beside,
    read_source,
    strictly,
)
from engine.chart import Chart
from engine.explore import explore
from engine.files.finding import Finding, Place, in_order
from engine.files.source import Source
from engine.load import Library, load_files
from engine.machine import Machine
from engine.report import FORMATS, report

WALKED = 2_000
"""Configurations that are walked at most; more are said to be cut."""

_PLACE = re.compile(r"(?P<file>.*?):(?P<line>\d+)(?::(?P<column>\d+))?: (?P<message>.*)", re.DOTALL)


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument("paths", nargs="*", metavar="PATH", help="files or folders", type=Path)
    parser.add_argument("--strict", action="store_true", help="warnings are errors")
    parser.add_argument("--format", choices=FORMATS, default="text", help="default: text")
    parser.add_argument("--json", dest="format", action="store_const", const="json")


def run(args: argparse.Namespace) -> int:
    """Check and report."""
    known = catalogue()
    files = files_in(args.paths or _default_paths(known))
    charts = [file for file, kind in files if kind == "chart"]
    library = load_beside(charts, known)
    findings = findings_of(library, known, charts)
    sources: dict[str, Source] = {str(file): library.sources[str(file)] for file in charts}
    for finding in errors_in_used(library, known, charts):
        findings.append(finding)
        sources[finding.place.file] = library.sources[finding.place.file]
    for file, kind in files:
        if kind != "chart":
            sources[str(file)] = read_source(file)
            findings += check_file(file, kind)
    findings = in_order(strictly(findings) if args.strict else findings)
    show(report(findings, sources, args.format).rstrip("\n"))
    if any(finding.severity == "error" for finding in findings):
        return FAILED
    if args.format == "text":
        for name in _not_used(library, {str(file) for file in charts}):
            show(f"{name}: {_walked(library[name], library, known)}")
    return OK


def _not_used(library: Library, files: set[str]) -> list[str]:
    """The charts of these files that no other chart uses and that need no parameters."""
    nodes = (node for chart in library.values() for node in chart.root.walk())
    used = {node.target for node in nodes if node.form == "use"}
    return [
        name
        for name, chart in library.items()
        if chart.file in files
        and name not in used
        and not any(parameter.required for parameter in chart.parameters.values())
    ]


def _walked(chart: Chart, library: Library, known: Catalogue) -> str:
    """All that the chart can do, counted."""
    machine = Machine(chart, library, known.interfaces, types=known.types)
    return explore(machine, WALKED).summary()


def _default_paths(known: Catalogue) -> list[Path]:
    own = [file for project in known.projects if project.folder for file in project.chart_files()]
    if own:
        return own
    import hw.robot
    import hw.scene
    import hw.script

    shipped = [CHARTS, hw.scene.FOLDER, hw.robot.FOLDER, hw.script.FOLDER]
    here = Path.cwd()
    return [path.relative_to(here) if path.is_relative_to(here) else path for path in shipped]


def check_file(file: Path, kind: str) -> list[Finding]:
    """The first mistake in a scene, robot, profile or user file."""
    load = _LOADERS[kind]()
    try:
        load(file)
    except ValueError as error:  # what these readers raise says where and what
        return [_finding(file, str(error))]
    return []


def _finding(file: Path, message: str) -> Finding:
    match = _PLACE.match(message)
    if match is None:
        return Finding("D01", message, Place(str(file), 1, 1, 2))
    line, column = int(match["line"]), int(match["column"] or 1)
    return Finding("D01", match["message"], Place(str(file), line, column, column + 1))


def _scene() -> Callable[[Path], object]:
    from hw.robot import load_robot
    from hw.scene import SceneError, load_scene
    from hw.sim.contact import rectangle_segment_distance
    from hw.user import open_user

    def load(file: Path) -> None:
        scene = load_scene(file)
        outline, start = load_robot(scene.robot).footprint, scene.robot_start
        inside = start.inverse().transform
        for x1, y1, x2, y2 in scene.room.segments:
            wall = inside(x1, y1), inside(x2, y2)
            if rectangle_segment_distance(outline.half_length, outline.half_width, *wall) <= 0.0:
                place = f"({start.x:g}, {start.y:g}, {start.yaw:g})"
                raise SceneError(file, 0, f"robot.start {place}: the robot would touch a wall")
        if scene.user is not None:
            open_user(scene.user, scene)

    return load


def _robot() -> Callable[[Path], object]:
    from hw.robot import load_robot

    return load_robot


def _profile() -> Callable[[Path], object]:
    from behaviors.profile import load_profile

    charts = load_files(chart_names(catalogue()).values())
    return lambda file: load_profile(file).require(charts)


def _user() -> Callable[[Path], object]:
    from hw.script import load_script

    return load_script


def _anything() -> Callable[[Path], object]:
    from hw.document import read_document

    return read_document


_LOADERS: dict[str, Callable[[], Callable[[Path], object]]] = {
    "scene": _scene,
    "robot": _robot,
    "profile": _profile,
    "user": _user,
    "prop": _anything,
}
