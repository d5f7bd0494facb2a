"""Connections: which driver serves which part of a robot, and at which address; one file each.

connection: rover_udp
about: what it is
model: ./rover.yaml         # the body: a robot by name or by file
real: true                  # a robot that can hurt people: `run` checks what was tried before
proven: 2027-01-12, hall 3, A. Writer   # when it was first run on the devices, where, by whom
told: [its own time-out is 0.5 s]       # notes for the operator, printed at each run
scene: lab_a                # the default room; without it there is none
limits: {speed: 0.8 m/s}    # below the body's, never above
links:                      # shared by several parts: a bus, a server, a process
  bus: {driver: "rover.bus:Bus", channel: can0}
parts:
  base: {driver: "rover.can_base:CanBase", link: bus}
peers:                      # fakes that start and end with it
  drives: {driver: "rover.fake:FakeDrives", channel: can0}

A driver is a class: one of ours by its name, as `UrArm`, one of a project as `module:Class`. It is
called with the other values of its entry. If it has a parameter `now` it gets a function that
returns the time of the run, ns, for the stamps of its samples; if it has a parameter `opening`, a
`RunInfo`. `link: NAME` and `tells: NAME` are replaced by the link or peer of that name. Peers are
opened first, then links, both in file order, then parts; only what is needed is opened, and
everything is closed in reverse order. A driver with a method `wait` starts in the background; it is
waited for before the next group is opened. The text `loopback` is replaced by an address of this
machine that no other run uses.

What a driver needs it says beside its code (`hw/drivers/needs.py`), for `cobodeck doctor`.

`plant: mock` needs no parts: the whole robot of the scene is mocked, in the simulated world.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Any, Literal

from engine.files import Acceleration, AngularAcceleration, AngularSpeed, Speed, did_you_mean, plain
from engine.files.declared import (
    Fault,
    Item,
    Name,
    Range,
    Written,
    find_file,
    gather,
    known_files,
    load_yaml,
    record,
    shown,
)
from hw.connection.driver_names import PATTERN, located, our_drivers, with_located
from hw.connection.wired_topics import WiredTopics
from hw.model import (
    IDEAL,
    MotionLimits,
    RobotModel,
    SensorErrors,
    SensorModel,
    Tracking,
    load_robot,
)
from hw.safety import SafetyLimits
from hw.scene import Scene

FOLDER = Path(__file__).parent.parent / "connections"
REFERS = ("link", "tells")
"""The arguments that refer to a link or peer."""
OFFERED = ("now", "opening")
"""The arguments that a driver which has them is given by the run."""
OWN_HOST = "loopback"
"""Stands for a loopback address that no other run on this machine uses."""
PlantKind = Literal["parts", "mock"]


@dataclass(frozen=True, slots=True)
class EntryKeys:
    """What serves a part; all other keys are arguments of the driver."""

    driver: Annotated[str, Written({"type": "string", "pattern": PATTERN})]
    """Its class: the name of one of ours, or `module:Class`."""
    link: str = ""
    """The link that it uses, by name."""
    tells: str = ""
    """The link or peer that it tells, by name."""


Entry = Annotated[Item, Written(EntryKeys, keys="more")]


@dataclass(frozen=True, slots=True)
class ServedPart:
    """One part, link or peer: the module and class of its driver, and its arguments."""

    module: str
    driver: str
    arguments: Mapping[str, Any]
    place: str


@dataclass(frozen=True, slots=True)
class Narrowed:
    """Limits of this connection: m/s, m/s2, rad/s, rad/s2; None: the body's own limit."""

    speed: Annotated[Speed, Range(0.01, 10.0)] | None = None
    """Of the base, in any direction."""
    yaw_rate: Annotated[AngularSpeed, Range(0.01, 20.0)] | None = None
    """Of the base."""
    acceleration: Annotated[Acceleration, Range(0.01, 10.0)] | None = None
    """Of the base."""
    yaw_acceleration: Annotated[AngularAcceleration, Range(0.01, 20.0)] | None = None
    """Of the base."""
    brakes: Annotated[Acceleration, Range(0.05, 10.0)] | None = None
    """How hard the base brakes."""

    def faults_of(self, body: RobotModel) -> Iterator[Fault]:
        """Limits that exceed the body's, by key."""
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
        """The body with these limits on its speed and brakes."""
        base = body.base
        slower = replace(
            base,
            max_speed=_least(base.max_speed, self.speed),
            max_yaw_rate=_least(base.max_yaw_rate, self.yaw_rate),
            brake_deceleration=_least(base.brake_deceleration, self.brakes),
        )
        return replace(body, base=slower)

    def motion(self, motion: MotionLimits) -> MotionLimits:
        """A profile's limits within these; no acceleration exceeds the brakes."""
        return replace(
            motion,
            base_speed=_least(motion.base_speed, self.speed),
            base_yaw_rate=_least(motion.base_yaw_rate, self.yaw_rate),
            base_acceleration=_least(
                _least(motion.base_acceleration, self.acceleration), self.brakes
            ),
            base_yaw_acceleration=_least(motion.base_yaw_acceleration, self.yaw_acceleration),
        )


@dataclass(frozen=True, slots=True)
class Connection:
    """The body of a robot, and what serves its parts, by name.

    `model` is None if the body is that of the scene. `proven` says when and where it was first run
    on the devices; None: never yet. `sha256` is that of the text of its `file`.
    """

    name: str
    about: str
    model: str | None
    parts: Mapping[str, ServedPart]
    links: Mapping[str, ServedPart] = field(default_factory=lambda: MappingProxyType({}))
    peers: Mapping[str, ServedPart] = field(default_factory=lambda: MappingProxyType({}))
    limits: Narrowed = Narrowed()
    real: bool = False
    plant: PlantKind = "parts"
    scene: str | None = None
    proven: str | None = None
    told: tuple[str, ...] = ()
    file: str = ""
    sha256: str = ""

    @property
    def known_as(self) -> str:
        """The name or path by which `load_connection` finds it."""
        return self.name if Path(self.file).parent == FOLDER else self.file

    @property
    def entries(self) -> Iterator[tuple[str, ServedPart]]:
        """All entries, by kind and name (`links.bus`)."""
        groups = {"peers": self.peers, "links": self.links, "parts": self.parts}
        for group, served in groups.items():
            yield from ((f"{group}.{name}", one) for name, one in served.items())

    @property
    def drivers(self) -> Iterator[tuple[str, str, str]]:
        """All drivers it names: the entry, its place in the file, and `module:Class`."""
        for entry, served in self.entries:
            yield entry, served.place, f"{served.module}:{served.driver}"
            yield from ((entry, served.place, inner) for inner in _inner(served.arguments))


@dataclass(frozen=True, slots=True)
class HostedScene:
    """The scene around fakes: the room and its people, for the world that hosts them.

    `user`, `requests` and `stretch_m` are as in `hw.people.user.open_user`; `user` None: nobody.
    `seed` is that of all random numbers; `sensors` and `sensing` are the errors of measurements.
    """

    scene: Scene
    user: str | None
    sensing: SensorErrors
    sensors: SensorModel = IDEAL
    requests: int | None = None
    stretch_m: float | None = None
    seed: int = 0


def _nobody(_: str) -> None:
    """There is no operator."""


@dataclass(frozen=True, slots=True)
class RunInfo:
    """What a driver may need to know of the run that it is opened for.

    `safety.watched` says whether a part tracks people; `tracking` is the pose of the tracking
    system in the map, and the mounts of its trackers on the robot. `now`: the time of the run, ns.
    `play` is for fakes, None without a room. `tell` shows the operator a remark, from any thread.
    `topics` gives the ROS topics that the project wants carried.
    """

    now: Callable[[], int]
    body: RobotModel
    motion: MotionLimits
    safety: SafetyLimits
    tracking: Tracking
    play: HostedScene | None = None
    tell: Callable[[str], None] = _nobody
    topics: Callable[[], WiredTopics] = WiredTopics


@dataclass(frozen=True, slots=True)
class ConnectionFile:
    """Which driver serves which part of a robot, and where."""

    connection: Name
    """Its name."""
    model: Annotated[str, Item.target, Written(str)] | None = None
    """The body: a robot by name or by file; required unless `plant` is `mock`."""
    parts: Mapping[str, Entry] = field(default_factory=dict)
    """Which driver serves each part; required unless `plant` is `mock`."""
    about: str = ""
    """What it is."""
    real: bool = False
    """A robot that can hurt people: `run` checks what was tried before."""
    limits: Narrowed = Narrowed()
    """Below the body's, never above."""
    links: Mapping[str, Entry] = field(default_factory=dict)
    """Shared by several parts: a bus, a server, a process."""
    peers: Mapping[str, Entry] = field(default_factory=dict)
    """Fakes that start and end with it."""
    plant: PlantKind = "parts"
    """`mock`: the whole robot of the scene is mocked; no parts."""
    scene: Annotated[str, Item.target, Written(str)] | None = None
    """The default room; without it there is none."""
    proven: str | None = None
    """When it was first run on the devices, where, by whom."""
    told: tuple[str, ...] = ()
    """Notes for the operator, shown at each run."""

    def faults(self) -> Iterator[Fault]:
        """Contradictions and missing keys, by key."""
        if self.real and self.peers:
            yield "peers", "a real robot has no fakes beside it; leave out `peers` or `real`"
        if self.plant == "mock":
            for key in ("parts", "links", "peers", "real", "model"):
                if getattr(self, key):
                    yield key, "a mock has none; leave it out"
            return
        for key in ("model", "parts"):
            if not getattr(self, key):
                yield key, f"the key '{key}' is missing"


def connection_names() -> tuple[str, ...]:
    """Names of the shipped connections and of the project's own."""
    return tuple(known_files(FOLDER, "connection"))


def load_connection(name_or_path: str | Path) -> Connection:
    """A connection by name or by file.

    Raises:
        FileError: every mistake in it and in the robot's file, with file, line, column and a
            suggestion; also a limit beyond the body's.
    """
    return load_yaml(find_file(str(name_or_path), FOLDER, "connection"), connection_from)


def connection_from(item: Item) -> Connection:
    """A connection from a mapping as in its file.

    Raises:
        FileError: every mistake in it and in the robot's file.
    """
    found = record(item, ConnectionFile)
    if found.model is not None:
        _check_limits(item, found.model, found.limits)
    known = (*found.links, *found.peers)
    entries = [*found.parts.values(), *found.links.values(), *found.peers.values()]
    served = iter(gather(partial(_served, entry, known) for entry in entries))
    parts, links, peers = (
        {name: next(served) for name in group} for group in (found.parts, found.links, found.peers)
    )
    return Connection(
        name=found.connection,
        about=found.about,
        model=found.model,
        parts=parts,
        links=links,
        peers=peers,
        limits=found.limits,
        real=found.real,
        plant=found.plant,
        scene=found.scene,
        proven=found.proven,
        told=found.told,
        file=item.source.file,
        sha256=hashlib.sha256(item.source.text.encode()).hexdigest(),
    )


def _check_limits(item: Item, model: str, limits: Narrowed) -> None:
    """Check the body's file, and that no limit exceeds the body's."""
    body = item.inner("model").refer(lambda: load_robot(model))
    item.inner("limits").require(limits.faults_of(body))


def _served(item: Item, links: tuple[str, ...]) -> ServedPart:
    content = item.mapping()
    if "driver" not in content:
        raise item.error("the key 'driver' is missing", 'write driver: NAME, or "module:Class"')
    named = content.pop("driver")
    driver = located(named.value)
    if driver is None:
        hint = did_you_mean(str(named.value), our_drivers()) or "write module:Class"
        raise named.error(f"{shown(named.value)} names no driver", hint)
    for key in REFERS:
        if key in content and content[key].value not in links:
            there = ", ".join(links) or "there are none"
            raise content[key].error(f"{shown(content[key].value)} is no link", f"links: {there}")
    arguments = {key: with_located(plain(inner.value)) for key, inner in content.items()}
    module, _, name = driver.partition(":")
    return ServedPart(module, name, arguments, str(named.place))


def _inner(value: Any) -> Iterator[str]:
    """The drivers nested in the values of an entry."""
    if not isinstance(value, Mapping):
        return
    for key, inner in value.items():
        if key == "driver" and located(inner):
            yield inner
        yield from _inner(inner)


def _least(value: float, bound: float | None) -> float:
    return value if bound is None else min(value, bound)
