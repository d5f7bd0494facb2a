"""Opens what a connection names: peers, links and parts, each by its driver."""

from __future__ import annotations

import importlib
import os
from collections.abc import Callable, Collection, Container, Mapping
from dataclasses import replace
from inspect import signature
from typing import Any, Literal

from cobodeck.project import error_text, is_there, why_no_part
from cobodeck.setup import Uses
from cobodeck.terminal import FAILED, Problem
from hw import needs
from hw.connection import OFFERED, OWN_HOST, REFERS, Connection, RunInfo, ServedPart
from hw.safety import HEARD

Kind = Literal["peer", "link", "part"]
ALWAYS = frozenset(("stop_line", "operator"))
"""Parts that are opened even if the chart does not use them."""


def open_all(
    kind: Kind,
    names: Collection[str],
    served: Mapping[str, ServedPart],
    opening: RunInfo,
    beside: Mapping[str, Any],
    opened: dict[str, Any],
) -> None:
    """Open the named entries of one kind, then wait for those that start in the background.

    Each is added to `opened` as soon as it is open; `beside` are the links and peers that entries
    may refer to.

    Raises:
        Problem: a driver cannot be found or opened.
    """
    for name in names:
        driver = _driver(kind, name, served[name])
        opened[name] = _opened(kind, name, served[name], driver, opening, beside)
    for name in names:
        error = try_to(getattr(opened[name], "wait", nothing))
        if error is not None:
            raise _problem(kind, name, served[name], error, type(opened[name]))


def drivers_of(connection: Connection) -> dict[str, Any]:
    """The drivers of all parts, imported and not opened.

    Raises:
        Problem: one cannot be found.
    """
    return {name: _driver("part", name, served) for name, served in connection.parts.items()}


def needed_links(connection: Connection, needed: Container[str]) -> list[str]:
    """The links that the needed parts refer to, directly or through other links, in file order."""
    wanted: set[str] = set()
    entries = [served for name, served in connection.parts.items() if name in needed]
    while entries:
        named = {str(entries[0].arguments.get(key)) for key in REFERS}
        named &= connection.links.keys() - wanted
        wanted |= named
        entries = [*entries[1:], *(connection.links[name] for name in named)]
    return [name for name in connection.links if name in wanted]


def is_needed(name: str, driver: Any, uses: Uses) -> bool:
    """True if the part is commanded or read, or if its signals are unknown until it is opened."""
    given = given_by(driver)
    if name in ALWAYS or name in uses.commands or given is None:
        return True
    heard = HEARD if "base" in uses.commands else frozenset[str]()
    return not (uses.signals | uses.welcome | heard).isdisjoint(given)


def finds_itself(connection: Connection) -> bool:
    """True if a connection's base gives odometry but no pose, so that it must be localized.

    Raises:
        Problem: its driver cannot be found.
    """
    served = connection.parts.get("base")
    given = None if served is None else signals_of("base", served)
    return given is not None and "base.odometry" in given and "base.pose" not in given


def signals_of(name: str, served: ServedPart) -> tuple[str, ...] | None:
    """The signals that a part's driver class declares; None: not known before it is opened.

    Raises:
        Problem: its driver cannot be found.
    """
    return given_by(_driver("part", name, served))


def given_by(driver: Any) -> tuple[str, ...] | None:
    """The signals that a part or its class declares; None: not known before it is opened."""
    given = getattr(driver, "signals", None)
    return given if isinstance(given, tuple) else None


def try_to(act: Callable[[], object]) -> Exception | None:
    """Call `act`; returns the exception it raised, or None."""
    try:
        act()
    except Exception as error:  # noqa: BLE001  a driver may raise anything
        return error
    return None


def _driver(kind: Kind, name: str, served: ServedPart) -> Any:
    try:
        return getattr(importlib.import_module(served.module), served.driver)
    except Exception as error:  # noqa: BLE001
        raise _problem(kind, name, served, error) from None


def _opened(
    kind: Kind,
    name: str,
    served: ServedPart,
    driver: Any,
    opening: RunInfo,
    beside: Mapping[str, Any],
) -> Any:
    given = placed(served.arguments)
    given |= {key: beside[given[key]] for key in REFERS if given.get(key) in beside}
    offered = dict(zip(OFFERED, (opening.now, opening), strict=True))
    lacking = [module for module in getattr(driver, "needs", ()) if not is_there(module)]
    if lacking:
        raise Problem(f"{_entry(kind, name, served)}: {needs(*lacking)}", FAILED)
    try:
        wanted = signature(driver).parameters
        given |= {key: value for key, value in offered.items() if key in wanted}
        opened = driver(**given)
    except Exception as error:  # noqa: BLE001
        raise _problem(kind, name, served, error, driver) from None
    wrong = why_no_part(name, opened) if kind == "part" else None
    if wrong is not None:
        try_to(getattr(opened, "close", nothing))
        raise Problem(f"{_entry(kind, name, served)}: {wrong}", FAILED)
    return opened


def placed(value: Any) -> Any:
    """A value of a connection file, with `loopback` replaced by this process's address."""
    if isinstance(value, Mapping):
        return {key: placed(inner) for key, inner in value.items()}
    if isinstance(value, list):
        return [placed(inner) for inner in value]
    return own_host() if value == OWN_HOST else value


def in_this_run(connection: Connection) -> Connection:
    """A connection whose links have this process's address in place of `loopback`."""
    links = {
        name: replace(link, arguments=placed(link.arguments))
        for name, link in connection.links.items()
    }
    return replace(connection, links=links)


def own_host() -> str:
    """A loopback address unique to this process.

    All of 127.0.0.0/8 is local; the process id, modulo 2^22 - 2, selects one of the addresses from
    127.64.0.1 to 127.127.255.254.
    """
    number = os.getpid() % 0x3F_FF_FE + 1
    return f"127.{64 + (number >> 16)}.{number >> 8 & 255}.{number & 255}"


def _problem(
    kind: Kind, name: str, served: ServedPart, error: Exception, driver: Any = None
) -> Problem:
    return Problem(f"{_entry(kind, name, served)}: {error_text(error, driver)}", FAILED)


def _entry(kind: Kind, name: str, served: ServedPart) -> str:
    return f"{served.place}: {kind} {name!r} by {served.module}:{served.driver}"


def nothing(*_: object) -> None:
    """Do nothing: there is nothing to close, to wait for or to tell."""
