"""The observer of a safety chain: what to type, and whether the key is there (R55)."""

from __future__ import annotations

from collections.abc import Container, Iterator
from typing import TYPE_CHECKING

from cobodeck.checks.connection_checks import class_of
from cobodeck.fitness import BAD, NOTE, CheckResult
from hw.connection import OWN_HOST

if TYPE_CHECKING:
    from hw.connection import Connection
    from hw.drivers import Observed

ANYWHERE = ("0.0.0.0", "::", "")
WHAT = "observer"


def watching(connection: Connection, packages: Container[str]) -> Iterator[CheckResult]:
    """The command of each observer."""
    for wanted in _observers(connection, packages):
        given = "" if wanted.key is None else " --key FILE"
        where, there = wanted.host, ""
        if where in ANYWHERE:
            where, there = "HOST", "; HOST is an address of this machine"
        if where == OWN_HOST:
            where, there = "HOST", "; HOST is another one in each run, which tells it"
        command = f"cobodeck observe {where}:{wanted.port}{given}{there}"
        yield CheckResult(WHAT, NOTE, f"somebody has to watch: {command}")


def key(connection: Connection, packages: Container[str]) -> Iterator[CheckResult]:
    """Each key that is needed and cannot be read, or is not named."""
    from hw.drivers import key_in
    from hw.drivers.chain import KEYLESS
    from hw.ipc import is_loopback

    for wanted in _observers(connection, packages):
        if wanted.key is None:
            if wanted.host != OWN_HOST and not is_loopback(wanted.host):
                yield CheckResult(WHAT, BAD, KEYLESS.format(host=wanted.host))
            continue
        try:
            key_in(wanted.key)
        except (OSError, ValueError) as error:
            yield CheckResult(WHAT, BAD, str(error))


def _observers(connection: Connection, packages: Container[str]) -> Iterator[Observed]:
    """Where links say that somebody has to watch."""
    for served in connection.links.values():
        driver = class_of(f"{served.module}:{served.driver}", packages)
        if not hasattr(driver, "observed"):
            continue
        found: Observed | None = driver.observed(**served.arguments)
        if found is not None:
            yield found
