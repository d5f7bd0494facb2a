"""Check charts, scenes, users, robots, props and profiles; nothing is run.

Without a path: the charts of the project around the present folder, or all shipped files.
Exit code 0: no errors; 1: errors, with --strict also warnings.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

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
from engine.files.finding import FileError, Finding, Place, in_order
from engine.files.item import gather
from engine.files.source import Source
from engine.load import Library, load_files
from engine.machine import Machine
from engine.report import FORMATS, report

if TYPE_CHECKING:
    from behaviors.profile import Profile
    from hw.robot import RobotModel

WALKED = 2_000
"""Configurations that are walked at most; more are said to be cut."""


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
    checker = _Checker([file for file, kind in files if kind == "robot"])
    for file, kind in files:
        if kind != "chart":
            sources[str(file)] = read_source(str(file))
            findings += checker.findings(file, kind)
    findings = _once(findings)
    for name in {place.file for finding in findings for place in _places(finding)}:
        sources.setdefault(name, read_source(name))
    findings = in_order(strictly(findings) if args.strict else findings)
    show(report(findings, sources, args.format).rstrip("\n"))
    if any(finding.severity == "error" for finding in findings):
        return FAILED
    if args.format == "text":
        for name in _not_used(library, {str(file) for file in charts}):
            show(f"{name}: {_walked(library[name], library, known)}")
    return OK


def _once(findings: Iterable[Finding]) -> list[Finding]:
    """Without those that another file that names theirs has brought up again."""
    found: dict[tuple[Place, str], Finding] = {}
    for finding in findings:
        key = (finding.place, finding.message)
        if key not in found or not finding.related:
            found[key] = finding
    return list(found.values())


def _places(finding: Finding) -> list[Place]:
    return [finding.place, *(place for place, _ in finding.related)]


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
    import hw
    import states.arm

    shipped = [CHARTS, *(Path(package.__path__[0]) for package in (hw, states.arm))]
    here = Path.cwd()
    return [path.relative_to(here) if path.is_relative_to(here) else path for path in shipped]


class _Checker:
    """Loads files of every kind but charts, and says what is wrong with them.

    Args:
        robots: the robot files that are checked too; profiles must go with one of them, or with a
            shipped one if there are none.
    """

    def __init__(self, robots: Sequence[Path]) -> None:
        self._robots = robots
        self._loaders: Mapping[str, Callable[[Path], object]] = {
            "scene": self._scene,
            "robot": self._robot,
            "profile": self._profile,
            "user": self._user,
            "prop": self._prop,
            "calibration": self._calibration,
            "arm": self._arm,
        }

    def findings(self, file: Path, kind: str) -> tuple[Finding, ...]:
        """All mistakes in a file and in those that it names."""
        try:
            self._loaders[kind](file)
        except FileError as error:
            return error.findings
        return ()

    def _scene(self, file: Path) -> None:
        from hw.staging import check_scene

        check_scene(file)

    def _robot(self, file: Path) -> None:
        from hw.robot import load_robot

        robot = load_robot(file)
        if robot.arm.urdf is not None:
            from states.arm.model import manipulator_of

            manipulator_of(robot)

    def _profile(self, file: Path) -> None:
        from behaviors.profile import load_profile

        profile = load_profile(file)
        gather((lambda: profile.require(self._charts), lambda: self._fits(profile)))

    def _fits(self, profile: Profile) -> None:
        """Whether a profile goes with a robot at all; else why it does not with the first."""
        errors = []
        for robot in self._known_robots:
            try:
                profile.require_robot(robot)
            except FileError as error:
                errors.append(error)
        if errors and len(errors) == len(self._known_robots):
            raise errors[0]

    @cached_property
    def _charts(self) -> Library:
        return load_files(chart_names(catalogue()).values())

    @cached_property
    def _known_robots(self) -> list[RobotModel]:
        from hw.robot import load_robot, robot_names

        found = []
        for robot in self._robots or robot_names():
            with suppress(FileError):  # told where the robot is checked
                found.append(load_robot(robot))
        return found

    def _user(self, file: Path) -> None:
        from hw.script import load_script

        load_script(file)

    def _prop(self, file: Path) -> None:
        from hw.prop import load_prop

        load_prop(file)

    def _calibration(self, file: Path) -> None:
        from hw.calibration import load_calibration

        load_calibration(file)

    def _arm(self, file: Path) -> None:
        from states.arm.model import load_manipulator

        load_manipulator(file)
