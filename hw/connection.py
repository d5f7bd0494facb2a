"""Connections: which driver serves which part of a robot, and where; one file each.

connection: rover_udp
about: what it is
model: ./rover.yaml         # the body: a robot by name or by file
parts:
  base: {driver: "rover.udp_base:UdpBase", address: 127.0.0.1, port: 47101}

A driver is a class, named as `module:Class`. It is called with the other values of its entry and
with `now`, a function that gives the time of the run in ns, for the stamps of its samples.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Annotated, Any

from engine.files.item import Item, gather, load_yaml
from engine.files.record import Name, record
from engine.files.values import shown

_DRIVER = re.compile(r"[A-Za-z_][\w.]*:[A-Za-z_]\w*\Z")


@dataclass(frozen=True, slots=True)
class Served:
    """One part: the module and class of its driver, and what that is called with."""

    module: str
    driver: str
    arguments: Mapping[str, Any]
    place: str


@dataclass(frozen=True, slots=True)
class Connection:
    """The body of a robot, and what serves its parts, by name."""

    name: str
    about: str
    model: str
    parts: Mapping[str, Served]


@dataclass(frozen=True, slots=True)
class _File:
    connection: Name
    model: Annotated[str, Item.target]
    parts: Mapping[str, Item]
    about: str = ""


def load_connection(path: str | Path) -> Connection:
    """A connection from its file.

    Raises:
        FileError: every mistake in it, with file, line, column and what would be right.
    """
    return load_yaml(Path(path), connection_from)


def connection_from(item: Item) -> Connection:
    """A connection from a mapping as in its file.

    Raises:
        FileError: every mistake in it.
    """
    found = record(item, _File)
    served = gather(partial(_served, part) for part in found.parts.values())
    parts = dict(zip(found.parts, served, strict=True))
    return Connection(found.connection, found.about, found.model, parts)


def _served(item: Item) -> Served:
    content = item.mapping()
    if "driver" not in content:
        raise item.error("the key 'driver' is missing", 'write driver: "module:Class"')
    named = content.pop("driver")
    if not isinstance(named.value, str) or not _DRIVER.match(named.value):
        raise named.error(f"{shown(named.value)} names no driver", "write module:Class")
    module, _, driver = named.value.partition(":")
    arguments = {key: inner.value for key, inner in content.items()}
    return Served(module, driver, arguments, str(named.place))
