"""A connection: its drivers and what they import, what the operator has to know of it."""

from __future__ import annotations

import importlib
from collections.abc import Container, Iterator, Mapping
from contextlib import suppress
from typing import TYPE_CHECKING, Any

from cobodeck.fitness import BAD, FIT, MISSING, NOTE, CheckResult
from cobodeck.terminal import FAILED, REFUSED
from hw import missing, needs
from hw.connection import OFFERED
from hw.model import RobotModel, load_robot

if TYPE_CHECKING:
    from cobodeck.real import Connected
    from cobodeck.setup import Options, RunPlace, Uses
    from hw.connection import Connection

NEVER = (
    "never run on the real devices: its drivers were tried against stand-ins alone; the stop is a "
    "software stop, so keep a hand on the hardware's emergency stop"
)

UR_DRIVERS = "hw.drivers.ur."
"""The package of the drivers that speak to UR arms alone."""


def described(connection: Connection) -> Iterator[CheckResult]:
    """What its file says about it."""
    yield CheckResult(f"connection {connection.name}", FIT, connection.about)


def package_of(driver: str) -> str:
    """The package of `module:Class`."""
    return driver.partition(":")[0].partition(".")[0]


def class_of(driver: str, packages: Container[str]) -> Any:
    """A driver of a known package, imported; None if it is of another, or cannot be imported."""
    module, _, name = driver.partition(":")
    if package_of(driver) not in packages:
        return None
    try:
        return getattr(importlib.import_module(module), name)
    except Exception:  # noqa: BLE001  `drivers` says why
        return None


def of_projects(connection: Connection, packages: Container[str]) -> Iterator[CheckResult]:
    """Drivers of unknown packages, of which nothing is imported."""
    for entry, place, driver in connection.drivers:
        package = package_of(driver)
        if package not in packages:
            group, _, name = entry.partition(".")
            about = (
                f"{place}: {group.removesuffix('s')} {name!r} by {driver}: {package!r} is the "
                "package of no project, so nothing of it is imported"
            )
            remedy = "run this in the project's folder, without --no-project"
            yield CheckResult(entry, BAD, about, remedy, code=FAILED)


def in_code(driver: str, packages: Container[str]) -> Iterator[CheckResult]:
    """Whether a driver exists; it is not imported, as that might need the vendor's library."""
    from cobodeck.project import is_there, names_in
    from engine.files import did_you_mean

    module, _, name = driver.partition(":")
    package = package_of(driver)
    if package not in packages:
        about = f"{package!r} is the package of no project"
        yield CheckResult(driver, BAD, about, "check it in its project")
        return
    if not is_there(module):
        yield CheckResult(driver, BAD, f"there is no module {module!r}")
        return
    try:
        names = names_in(module)
    except SyntaxError as error:
        yield CheckResult(driver, BAD, f"{error.filename}:{error.lineno}: {error.msg}")
        return
    if names is not None and name not in names:
        yield CheckResult(driver, BAD, f"{module} has no {name!r}", did_you_mean(name, names))


def taken(
    driver: str, arguments: Mapping[str, Any], packages: Container[str]
) -> Iterator[CheckResult]:
    """Whether a driver's class takes these arguments, and has all that it needs; by its text."""
    from cobodeck.project import arguments_of, is_there
    from engine.files import did_you_mean

    module, _, name = driver.partition(":")
    if package_of(driver) not in packages or not is_there(module):
        return
    with suppress(SyntaxError):  # `in_code` tells it
        wanted = arguments_of(module, name)
        if wanted is None:
            return
        offered = [one for one in wanted.known if one not in OFFERED]
        for key in () if wanted.takes_others else arguments:
            if key not in wanted.known:
                yield CheckResult(key, BAD, f"{name} takes no {key!r}", did_you_mean(key, offered))
        for key in wanted.needed:
            if key not in arguments and key not in OFFERED:
                yield CheckResult(driver, BAD, f"{name} needs a {key!r}", f"write {key}: …")


def own_arm(driver: str, model: str | None, entry: str = "") -> Iterator[CheckResult]:
    """Whether the robot has a UR arm, if this driver speaks to one."""
    if model is None or not driver.startswith(UR_DRIVERS):
        return
    from hw.drivers import ur_arm_of

    body = load_robot(model)
    try:
        ur_arm_of(body)
    except ValueError as refused:
        yield CheckResult(entry or driver, BAD, str(refused))


def drivers(connection: Connection, packages: Container[str]) -> Iterator[CheckResult]:
    """Import the drivers of known packages, and look for the modules that they need when opened."""
    for entry, _, driver in connection.drivers:
        yield _driver(entry, driver, packages)


def _driver(entry: str, driver: str, packages: Container[str]) -> CheckResult:
    from cobodeck.project import is_there

    module, _, name = driver.partition(":")
    if package_of(driver) not in packages:
        return CheckResult(entry, BAD, f"{driver} is of no project", "go to its folder")
    try:
        found = getattr(importlib.import_module(module), name)
    except Exception as error:  # noqa: BLE001  a driver may raise anything
        why = missing(error) or f"{type(error).__name__}: {error}"
        return CheckResult(entry, BAD, f"{driver}: {why}")
    lacking = [module for module in getattr(found, "needs", ()) if not is_there(module)]
    if not lacking:
        return CheckResult(entry, FIT, driver)
    remedy = "a simulation works without it"
    return CheckResult(entry, BAD, f"{driver} {needs(*lacking)}", remedy)


def one_body(connection: Connection, robot: RobotModel, place: RunPlace) -> Iterator[CheckResult]:
    """Whether scene and connection have the same robot; a map has no robot to compare."""
    if connection.model is None or place.map is not None:
        return
    scenes = load_robot(place.scene.robot).name
    if scenes != robot.name:
        about = (
            f"scene {place.scene.name} is made for robot {scenes}, connection {connection.name} "
            f"is of {robot.name}"
        )
        yield CheckResult("robot", BAD, about, f"take a scene whose robot is {robot.name}")


def remarks(connection: Connection) -> Iterator[CheckResult]:
    """The notes of its file to the operator."""
    for remark in connection.told:
        yield CheckResult(connection.name, NOTE, remark, said=f"{connection.name}: {remark}")


def proven(connection: Connection) -> Iterator[CheckResult]:
    """When a real robot was first run on its devices."""
    if connection.proven is not None:
        yield CheckResult("proven", FIT, f"on {connection.proven}")
    elif connection.real:
        yield CheckResult("proven", MISSING, NEVER, said=f"{connection.name}: {NEVER}")


def watched(
    connection: Connection, uses: Uses, options: Options, plant: Connected
) -> Iterator[CheckResult]:
    """Whether a part tracks people, beside a base that drives."""
    if "base" not in uses.commands or plant.person_watched or options.unwatched:
        return
    about = (
        f"connection {connection.name}: no part tracks people, so that nothing keeps the "
        "base away from them"
    )
    remedy = "if nobody can be near it, say so with --person-unwatched"
    yield CheckResult("user.pose", BAD, about, remedy, code=REFUSED)
