"""Checks YAML files of all kinds but charts: scenes, users, robots, profiles, connections etc."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from functools import cached_property, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cobodeck.project import Catalogue, chart_names
from engine.chart import Library, load_files
from engine.files import FileError, Finding, did_you_mean
from engine.files.declared import Item, gather, load_yaml, notes
from hw import PARTS

if TYPE_CHECKING:
    from behaviors.profile import Profile
    from cobodeck.campaign import CellRunner
    from cobodeck.fitness import CheckResult
    from hw.connection import ServedPart
    from hw.model import RobotModel


class FileChecker:
    """Loads files of every kind but charts, and returns their mistakes as findings.

    Args:
        known: gives the charts that profiles may name.
        robots: the robot files that are checked too; profiles must fit one of them, or a shipped
            robot if there are none.
    """

    def __init__(self, known: Catalogue, robots: Sequence[Path]) -> None:
        self._known, self._robots = known, robots
        self._loaders: Mapping[str, Callable[[Path], object]] = {
            "scene": self._scene,
            "robot": self._robot,
            "profile": self._profile,
            "user": self._user,
            "prop": self._prop,
            "calibration": self._calibration,
            "arm": self._arm,
            "connection": self._connection,
            "tracking": self._tracking,
            "campaign": self._campaign,
            "topics": self._topics,
            "map": self._map,
        }

    def findings(self, file: Path, kind: str) -> tuple[Finding, ...]:
        """All mistakes in a file and in the files that it names, and notes on old ways."""
        with notes() as found:
            try:
                self._loaders[kind](file)
            except FileError as error:
                found += error.findings
        return tuple(found)

    def _scene(self, file: Path) -> None:
        from cobodeck.fitness import require

        require("validate", scene_file=file)

    def _robot(self, file: Path) -> None:
        load_yaml(file, self._folded)

    def _folded(self, item: Item) -> None:
        """Check a robot, and that its folded arm touches nothing; shipped ones are tested."""
        from hw.model import FOLDER, robot_from

        robot = robot_from(item)
        if robot.arm is not None and item.folder.resolve() != FOLDER.resolve():
            from cobodeck.fitness import ask

            for answer in ask("fold", robot=robot):
                raise item.inner("arm.mount").error(answer.about)

    def _profile(self, file: Path) -> None:
        from behaviors.profile import is_base, load_profile, resting_on_base

        if is_base(file):
            gather(partial(load_profile, name) for name in resting_on_base())
            return
        profile = load_profile(file)
        gather((lambda: self._names_charts(profile), lambda: self._fits(profile)))

    def _names_charts(self, profile: Profile) -> None:
        """Check that the charts and parameters exist that a profile names."""
        from cobodeck.fitness import require

        if profile.chart not in self._charts:
            hint = did_you_mean(profile.chart, self._charts)
            raise FileError([profile.finding("chart", "no such chart", hint)])
        require("validate", profile=profile, library=self._charts)

    def _fits(self, profile: Profile) -> None:
        """Check that a profile fits any robot; otherwise raise why it does not fit the first."""
        from cobodeck.fitness import ask

        errors = [
            answer
            for robot in self._known_robots
            for answer in ask("validate", profile=profile, robot=robot, known=self._known)
        ]
        if errors and len(errors) == len(self._known_robots):
            errors[0].require()

    @cached_property
    def _charts(self) -> Library:
        return load_files(chart_names(self._known).values())

    @cached_property
    def _known_robots(self) -> list[RobotModel]:
        from hw.model import load_robot, robot_names

        found = []
        for robot in self._robots or robot_names():
            with suppress(FileError):  # reported where the robot itself is checked
                found.append(load_robot(robot))
        return found

    def _user(self, file: Path) -> None:
        from hw.people.walking import load_script

        load_script(file)

    def _prop(self, file: Path) -> None:
        from hw.model import load_prop

        load_prop(file)

    def _calibration(self, file: Path) -> None:
        from hw.model import load_calibration

        load_calibration(file)

    def _tracking(self, file: Path) -> None:
        from hw.model import load_tracking

        load_tracking(file)

    def _campaign(self, file: Path) -> None:
        from cobodeck.campaign import check_campaign

        load_yaml(file, lambda item: check_campaign(item, self._runner))

    @cached_property
    def _runner(self) -> CellRunner:
        """Keeps what several campaigns have in common."""
        from cobodeck.campaign import CellRunner

        return CellRunner(self._known)

    def _topics(self, file: Path) -> None:
        """Check that the signals, parts and commands of a table exist."""
        from cobodeck.flexbe_states import names_in_table

        known, parts = self._known, self._parts
        load_yaml(file, lambda item: names_in_table(item, known.signal_names, parts))

    @cached_property
    def _parts(self) -> Mapping[str, Any]:
        """All parts by name; a project's own as a simulation has them, None if it cannot be made.

        What is wrong with one is told of its code.
        """
        parts: dict[str, Any] = dict(PARTS)
        for name, make in self._known.own_parts.items():
            parts[name] = None
            with suppress(Exception):  # it may raise anything
                parts[name] = make()
        return parts

    def _map(self, file: Path) -> None:
        from states.maps import load_map

        load_map(file)

    def _arm(self, file: Path) -> None:
        from hw.model import load_arm

        load_arm(file)

    def _connection(self, file: Path) -> None:
        load_yaml(file, self._connected)

    def _connected(self, item: Item) -> None:
        from cobodeck.setup import open_place
        from hw.connection import connection_from

        found = connection_from(item)
        served = dict(found.entries)
        checks: list[Callable[[], Any]] = [
            partial(self._driver, item.inner(entry), served[entry], driver, found.model)
            for entry, _, driver in found.drivers
        ]
        scene = found.scene
        if scene is not None:
            checks.append(lambda: item.inner("scene").refer(lambda: open_place(scene)))
        gather(checks)

    def _driver(self, at: Item, served: ServedPart, driver: str, model: str | None) -> None:
        """Check a driver, its arguments and its robot's arm; nothing of it is imported.

        What a driver nested in another takes is known to that other one alone.
        """
        from cobodeck.fitness import ask

        case: dict[str, Any] = {"driver": driver, "model": model}
        if driver == f"{served.module}:{served.driver}":
            case["arguments"] = served.arguments
        answers = ask("validate", packages=self._known.packages, **case)
        gather(partial(_refuse, at, answer) for answer in answers)


def _refuse(entry: Item, answer: CheckResult) -> None:
    """Raise what is wrong with a driver, at the argument if it is one, else at its name."""
    at = entry.inner(answer.what if answer.what in entry.mapping() else "driver")
    raise at.error(answer.about, answer.remedy)
