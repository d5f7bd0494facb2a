"""What a base cannot drive: states that go sideways, on wheels that only drive ahead and turn.

A state that needs a base with the mode omni says so by its class attribute `sideways = True`; one
with a parameter `mode`, by its value.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from cobodeck.fitness import BAD, FIT, NOTE, CheckResult
from cobodeck.terminal import FAILED
from engine.files import FileError
from hw.model import RobotModel

if TYPE_CHECKING:
    from behaviors.profile import Profile
    from cobodeck.project import Catalogue
    from cobodeck.setup import Setup
    from engine import Interface
    from engine.chart import Chart
    from engine.machine import Leaf

ROLLS = "drives along its heading only: its base.modes has no omni"


def modes(robot: RobotModel, known: Catalogue) -> Iterator[CheckResult]:
    """How the base drives, and which charts it cannot run."""
    if robot.base.sideways:
        yield CheckResult("base", FIT, f"drives as {' or '.join(robot.base.modes)}")
        return
    from cobodeck.project import chart_names
    from engine.chart import load_files

    library = load_files(chart_names(known).values())
    found = [name for name in sorted(library) if sideways_in(name, library, known.interfaces)]
    cannot = f"; charts that need omni: {', '.join(found)}" if found else ""
    yield CheckResult("base", NOTE, f"{robot.name} {ROLLS}{cannot}")


def main_chart(profile: Profile, robot: RobotModel, known: Catalogue) -> Iterator[CheckResult]:
    """Whether the base can drive the chart that a profile names itself."""
    if robot.base.sideways or "chart" not in profile.places or profile.is_shipped("chart"):
        return
    from cobodeck.project import chart_names
    from engine.chart import load_files

    library = load_files(chart_names(known).values())
    if profile.chart in library:
        needing = sideways_in(profile.chart, library, known.interfaces)
        if needing:
            told = f"{profile.chart} needs omni ({', '.join(needing)}); {robot.name} {ROLLS}"
            finding = profile.finding("chart", told)
            yield CheckResult("profile", BAD, str(FileError([finding])), findings=(finding,))


def followed(setup: Setup, leaves: Sequence[Leaf]) -> Iterator[CheckResult]:
    """Whether the base can drive as the reachable states ask."""
    own = setup.robot.base.modes
    lacking: dict[str, None] = {}
    for leaf in leaves:
        mode = _mode_of(leaf.interface, leaf.parameters)
        if mode is not None and mode not in own:
            lacking[f"{leaf.path} ({leaf.interface.name}) needs the drive mode {mode}"] = None
    if lacking:
        about = f"{setup.robot.name} drives as {' or '.join(own)} only (base.modes):"
        told = "\n  ".join((f"this chart cannot run here; {about}", *lacking))
        yield CheckResult(setup.chart.name, BAD, told, code=FAILED)


def sideways_in(
    name: str, library: Mapping[str, Chart], interfaces: Mapping[str, Interface]
) -> tuple[str, ...]:
    """The states of a chart, and of those that it uses, that go sideways."""
    from cobodeck.project import reached

    return tuple(dict.fromkeys(_going_sideways(reached({name}, library), library, interfaces)))


def _going_sideways(
    names: Iterable[str], library: Mapping[str, Chart], interfaces: Mapping[str, Interface]
) -> Iterator[str]:
    for name in sorted(names):
        for node in library[name].root.walk():
            known = interfaces.get(node.target) if node.form == "do" else None
            if known is not None and _mode_of(known, node.parameters) == "omni":
                yield node.target


def _mode_of(interface: Interface, parameters: Mapping[str, Any]) -> str | None:
    """The drive mode without which a state cannot do what it is for; None if any will do."""
    if getattr(interface.make, "sideways", False):
        return "omni"
    mode = parameters.get("mode") if "base" in interface.commands else None
    return mode if mode in ("omni", "differential") else None
