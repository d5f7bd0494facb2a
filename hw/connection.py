"""Connections: which driver serves which part of a robot, and where; one file each.

connection: rover_udp
about: what it is
model: ./rover.yaml         # the body: a robot by name or by file
real: true                  # a robot that can hurt somebody: `run` asks for what was tried before
limits: {speed: 0.8 m/s}    # lower than the body's, never higher
links:                      # what several parts share: a bus, a server, a process
  bus: {driver: "rover.bus:Bus", channel: can0}
parts:
  base: {driver: "rover.can_base:CanBase", link: bus}
peers:                      # fakes that start with it, and end with it
  drives: {driver: "rover.fake:FakeDrives", channel: can0}

A driver is a class, named as `module:Class`. It is called with the other values of its entry and
with `now`, a function that gives the time of the run in ns, for the stamps of its samples; one that
has a parameter `opening` gets an `Opening`, too. `link: NAME` and `tells: NAME` become the link or
the peer of that name. Peers are opened first, then links, in the order of the file, then parts;
only what is needed is opened, and all is closed the other way round. What has a method `wait`
starts in the background; it is waited for before the next group is opened. The text `loopback`
becomes an address of this machine that no other run uses.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Any

from engine.files.item import Fault, Item, find_file, gather, load_yaml
from engine.files.record import Name, record
from engine.files.units import Acceleration, AngularAcceleration, AngularSpeed, Speed
from engine.files.values import Range, shown
from hw.robot import MotionLimits, RobotModel
from hw.safety_limits import SafetyLimits
from hw.scene import Scene
from hw.sim.errors import SensorErrors
from hw.sim.sensors import IDEAL, SensorModel
from hw.tracking import Tracking

FOLDER = Path(__file__).parent / "connections"
REFERS = ("link", "tells")
"""The arguments that name a link."""
_DRIVER = re.compile(r"[A-Za-z_][\w.]*:[A-Za-z_]\w*\Z")


@dataclass(frozen=True, slots=True)
class Served:
    """One part, link or peer: the module and class of its driver, and what that is called with."""

    module: str
    driver: str
    arguments: Mapping[str, Any]
    place: str


@dataclass(frozen=True, slots=True)
class Narrowed:
    """Limits of this connection: m/s, m/s2, rad/s, rad/s2; None: those of the body count."""

    speed: Annotated[Speed, Range(0.01, 10.0)] | None = None
    yaw_rate: Annotated[AngularSpeed, Range(0.01, 20.0)] | None = None
    acceleration: Annotated[Acceleration, Range(0.01, 10.0)] | None = None
    yaw_acceleration: Annotated[AngularAcceleration, Range(0.01, 20.0)] | None = None
    brakes: Annotated[Acceleration, Range(0.05, 10.0)] | None = None

    def faults_of(self, body: RobotModel) -> Iterator[Fault]:
        """What is wider than the body is, by key."""
        base = body.base
        own = {
            "speed": base.max_speed,
            "yaw_rate": base.max_yaw_rate,
            "brakes": base.brake_deceleration,
        }
        for key, most in own.items():
            value = getattr(self, key)
            if value is not None and value > most:
                yield key, f"{value:g} is more than the {most:g} of {body.name}; it may only narrow"

    def body(self, body: RobotModel) -> RobotModel:
        """The body, as slow and with brakes as weak as this says."""
        base = body.base
        slower = replace(
            base,
            max_speed=_least(base.max_speed, self.speed),
            max_yaw_rate=_least(base.max_yaw_rate, self.yaw_rate),
            brake_deceleration=_least(base.brake_deceleration, self.brakes),
        )
        return replace(body, base=slower)

    def motion(self, motion: MotionLimits) -> MotionLimits:
        """A profile's limits, no faster than this says."""
        return replace(
            motion,
            base_speed=_least(motion.base_speed, self.speed),
            base_yaw_rate=_least(motion.base_yaw_rate, self.yaw_rate),
            base_acceleration=_least(motion.base_acceleration, self.acceleration),
            base_yaw_acceleration=_least(motion.base_yaw_acceleration, self.yaw_acceleration),
        )


@dataclass(frozen=True, slots=True)
class Connection:
    """The body of a robot, and what serves its parts, by name."""

    name: str
    about: str
    model: str
    parts: Mapping[str, Served]
    links: Mapping[str, Served] = field(default_factory=lambda: MappingProxyType({}))
    peers: Mapping[str, Served] = field(default_factory=lambda: MappingProxyType({}))
    limits: Narrowed = Narrowed()
    real: bool = False


@dataclass(frozen=True, slots=True)
class Play:
    """What goes on around fakes: the room and who is in it, for the world that hosts them.

    `user` is as `hw.user.open_user` takes it, None: nobody; `requests` and `stretch_m` likewise.
    `seed` is that of all chance, `sensors` and `sensing` how far measurements are from the truth.
    """

    scene: Scene
    user: str | None
    sensing: SensorErrors
    sensors: SensorModel = IDEAL
    requests: int | None = None
    stretch_m: float | None = None
    seed: int = 0


@dataclass(frozen=True, slots=True)
class Opening:
    """What a driver may want to know of the run that it is opened for.

    `safety.watched` says whether a part tracks people; `tracking` is where the tracking system lies
    in the map, and where its trackers sit on the robot. `now`: the time of the run, ns. `play` is
    for fakes, where there is a room.
    """

    now: Callable[[], int]
    body: RobotModel
    motion: MotionLimits
    safety: SafetyLimits
    tracking: Tracking
    play: Play | None = None


@dataclass(frozen=True, slots=True)
class _File:
    connection: Name
    model: Annotated[str, Item.target]
    parts: Mapping[str, Item]
    about: str = ""
    real: bool = False
    limits: Narrowed = Narrowed()
    links: Mapping[str, Item] = field(default_factory=dict)
    peers: Mapping[str, Item] = field(default_factory=dict)


def connection_names() -> tuple[str, ...]:
    """The connections that come with the project."""
    return tuple(sorted(path.stem for path in FOLDER.glob("*.yaml")))


def load_connection(name_or_path: str | Path) -> Connection:
    """A connection by name or by file.

    Raises:
        FileError: every mistake in it, with file, line, column and what would be right.
    """
    return load_yaml(find_file(str(name_or_path), FOLDER, "connection"), connection_from)


def connection_from(item: Item) -> Connection:
    """A connection from a mapping as in its file.

    Raises:
        FileError: every mistake in it.
    """
    found = record(item, _File)
    known = (*found.links, *found.peers)
    entries = [*found.parts.values(), *found.links.values(), *found.peers.values()]
    served = iter(gather(partial(_served, entry, known) for entry in entries))
    parts, links, peers = (
        {name: next(served) for name in group} for group in (found.parts, found.links, found.peers)
    )
    if found.real and peers:
        raise item.inner("peers").error("a real robot has no fakes beside it", "real: false")
    return Connection(
        found.connection, found.about, found.model, parts, links, peers, found.limits, found.real
    )


def _served(item: Item, links: tuple[str, ...]) -> Served:
    content = item.mapping()
    if "driver" not in content:
        raise item.error("the key 'driver' is missing", 'write driver: "module:Class"')
    named = content.pop("driver")
    if not isinstance(named.value, str) or not _DRIVER.match(named.value):
        raise named.error(f"{shown(named.value)} names no driver", "write module:Class")
    for key in REFERS:
        if key in content and content[key].value not in links:
            there = ", ".join(links) or "there are none"
            raise content[key].error(f"{shown(content[key].value)} is no link", f"links: {there}")
    module, _, driver = named.value.partition(":")
    arguments = {key: inner.value for key, inner in content.items()}
    return Served(module, driver, arguments, str(named.place))


def _least(value: float, bound: float | None) -> float:
    return value if bound is None else min(value, bound)
