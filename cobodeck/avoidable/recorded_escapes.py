"""What a record tells about robot and person: true paths, walls, limits, Escapes, contacts.

It is read from the record alone, without the profile's or the scene's own readers.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from numpy.typing import NDArray

from cobodeck.avoidable.motion_search import RobotLimits, RobotState, Walk
from cobodeck.avoidable.shapes import Array
from cobodeck.project import nodes_of
from cobodeck.record.read import Group, Record
from engine.chart import Library, Node, load_text
from engine.files import mistake, quantity
from engine.files.declared import YAML

BEHAVIOUR = "escape"
STALE_S = 0.25
"""With an older pose of the person the robot has to brake, s: it must be stopped once the pose is
150 ms old (R149), by a command that takes at most 100 ms (R5)."""
PERSON = "user"
"""The person with the headset, as contacts name them."""
Ring = tuple[tuple[float, float], ...]


@dataclass(frozen=True, slots=True)
class EscapeVisit:
    """One Escape: entry and end, s, and its outcome; None while it runs, or if it was left."""

    start_s: float
    end_s: float | None = None
    outcome: str | None = None


@dataclass(frozen=True, slots=True)
class EscapeProfile:
    """What a profile says about Escape; m, s, m/s2.

    Attributes:
        name: of the profile.
        acceleration: of the base.
        ahead: reach of the zone in the person's view; `around`: elsewhere.
        reaction_s: what it reckons with until the robot moves; `latency_s`: of a simulated robot.
    """

    name: str
    acceleration: float
    ahead: float
    around: float
    reaction_s: float
    latency_s: float = 0.0

    @classmethod
    def of(cls, name: str, values: Mapping[str, Any]) -> EscapeProfile:
        """From the values of a profile by their dotted keys, as a record's header has them."""
        keys = ("robot.base_acceleration", "escape.ahead", "escape.around", "escape.reaction")
        acceleration, ahead, around, reaction_s = (_si(values[key]) for key in keys)
        latency_s = _si(values.get("plant.latency", 0.0))
        return cls(name, acceleration, ahead, around, reaction_s, latency_s)


@dataclass(frozen=True)
class RecordedRun:
    """A run as its record tells it; map frame, m, s, rad.

    Attributes:
        name: what was run, in words; `profile`: with which values of Escape.
        limits: those of an Escape, and the outline.
        rings: outlines of the floor, first the outer one; `walls` are their edges (n, 4).
        times: (n,); `robot` x, y, yaw and `person` x, y, direction of view at these, (n, 3).
        shown: (n,) whether the stop sign was shown.
        seen: (n,) time of the newest pose of the person that was known, s.
        escapes: in order; `contacts` likewise: time, s, and who closed in, of base and person.
    """

    name: str
    profile: EscapeProfile
    limits: RobotLimits
    rings: tuple[Ring, ...]
    walls: Array
    times: Array
    robot: Array
    person: Array
    shown: NDArray[np.bool_]
    seen: Array
    escapes: tuple[EscapeVisit, ...]
    contacts: tuple[tuple[float, str], ...]

    def robot_at(self, at_s: float) -> RobotState:
        """Pose and velocity of the robot, by differences over the ticks before and after."""
        n = int(np.clip(np.searchsorted(self.times, at_s - 1e-6), 1, len(self.times) - 2))
        span = self.times[n + 1] - self.times[n - 1]
        vx, vy, wz = ((self.robot[n + 1] - self.robot[n - 1]) / span).tolist()
        x, y, yaw = (float(np.interp(at_s, self.times, row)) for row in self.robot.T)
        return RobotState(x, y, yaw, vx, vy, wz)

    def blind_between(self, start_s: float, end_s: float) -> tuple[tuple[float, float], ...]:
        """Spans, s, in which the newest pose of the person was older than STALE_S."""
        stale = (self.times - self.seen > STALE_S) & (self.times >= start_s) & (self.times < end_s)
        edge = np.flatnonzero(np.diff(np.concatenate(([False], stale, [False])).astype(np.int8)))
        ends = np.append(self.times, math.inf)
        return tuple((float(ends[a]), float(ends[b])) for a, b in edge.reshape(-1, 2).tolist())

    @property
    def way(self) -> Walk:
        """Where the person was."""
        return Walk(self.times, self.person)


@dataclass(slots=True)
class _Reading:
    """Collects what the messages tell, tick by tick."""

    escape_paths: frozenset[str]
    scene: Mapping[str, Any] | None = None
    rows: list[tuple[float, ...]] = field(default_factory=list)
    escapes: list[EscapeVisit] = field(default_factory=list)
    contacts: list[tuple[float, str]] = field(default_factory=list)
    truth: Mapping[str, Any] | None = None
    open: dict[str, int] = field(default_factory=dict)

    def add_tick(self, group: Group) -> None:
        """Take one tick."""
        for found in group.messages("scene"):
            self.scene = found
        for found in group.messages("truth"):
            self.truth = found
        for found in group.messages("trace"):
            self._traced(*found["line"])
        if self.truth is None or group.ticked.kind not in ("grid", "left_out"):
            return
        base, body = self.truth["base"], self.truth["body"]
        if base is not None and body is not None:
            x, y, yaw = _values(body)
            place = *_values(base), x, y, yaw + self.truth["head_turn"]
            now_s, seen_ns = group.ticked.at_ns / 1e9, self.truth["seen_ns"]
            seen_s = now_s if seen_ns is None else seen_ns / 1e9
            self.rows.append((now_s, *place, float(bool(self.truth["informed"])), seen_s))
        self._touched(self.truth["contacts"] or ())

    def _traced(self, at_ns: int, kind: str, path: str, *detail: Any) -> None:
        if path not in self.escape_paths:
            return
        if kind == "enter":
            self.open[path] = len(self.escapes)
            self.escapes.append(EscapeVisit(at_ns / 1e9))
        elif kind == "outcome" and path in self.open:
            number = self.open.pop(path)
            start = self.escapes[number].start_s
            self.escapes[number] = EscapeVisit(start, at_ns / 1e9, detail[0])

    def _touched(self, contacts: Any) -> None:
        """Those of base and person that are new; the truth lists all so far."""
        told = [_values(contact) for contact in contacts]
        ours = [c for c in told if c[_PART] == "base" and c[_WHO] == PERSON]
        for at_ns, _, _, _, closing, *_ in ours[len(self.contacts) :]:
            self.contacts.append((at_ns / 1e9, "robot" if closing > _CLOSING else "person"))


_PART, _WHO = 3, 7
_CLOSING = 0.05
"""Closing speed of the robot above which it is said to have caused a contact, m/s."""


def _values(found: Mapping[str, Any]) -> list[Any]:
    """The values of an instance of a class, which is written `{class: values}`."""
    (values,) = found.values()
    return list(values.values()) if isinstance(values, Mapping) else list(values)


def read_run(record: Record) -> RecordedRun:
    """What a record tells.

    Raises:
        FileError: the record cannot be read, is damaged, or has no true poses of robot and person,
            no room, or no limits of an Escape.
    """
    record.require_intact()
    record.require_ticks()
    with record.usable("the text of a chart"):
        reading = _Reading(escape_paths(record))
    for group in record.groups():
        with record.understood(group):
            reading.add_tick(group)
    if len(reading.rows) < 3 or reading.scene is None:
        told = "does not tell where robot, person and walls truly were"
        raise mistake(record.path, told, hint="take the record of a simulation beside a person")
    rows = np.array(reading.rows)
    with record.usable("its room"):
        rings, outline = _rings(reading.scene), _outline(reading.scene)
    with record.usable("what limits an Escape"):
        limits = _limits(record, *outline)
        told = record.header["profile"]
        profile = EscapeProfile.of(told["name"], told["values"])
    robot, person = rows[:, 1:4], rows[:, 4:7]
    robot[:, 2], person[:, 2] = np.unwrap(robot[:, 2]), np.unwrap(person[:, 2])
    return RecordedRun(
        _name(record.header),
        profile,
        limits,
        rings,
        edges(rings),
        rows[:, 0],
        robot,
        person,
        rows[:, 7] > 0.0,
        rows[:, 8],
        tuple(reading.escapes),
        tuple(reading.contacts),
    )


def _name(header: Mapping[str, Any]) -> str:
    scene = header["scene"]
    where = "" if scene is None else f" in {scene['name']}"
    profile, seed = header["profile"]["name"], header["options"]["seed"]
    return f"{header['chart']}{where} with {header['user']}, {profile}, seed {seed}"


def _rings(scene: Mapping[str, Any]) -> tuple[Ring, ...]:
    """The outlines of floor, walls and columns in the picture of the scene."""
    lines = [e["lines"] for e in scene["entities"] if e["id"] == "room"]
    return tuple(tuple((p["x"], p["y"]) for p in line["points"]) for line in lines[0])


def _outline(scene: Mapping[str, Any]) -> tuple[float, float]:
    """Half length and half width of the robot, m."""
    size = next(e["cubes"][0]["size"] for e in scene["entities"] if e["id"] == "rover")
    return 0.5 * size["x"], 0.5 * size["y"]


def edges(rings: tuple[Ring, ...]) -> Array:
    """The edges of closed rings: x0, y0, x1, y1, (n, 4)."""
    found = [(*a, *b) for ring in rings for a, b in pairwise((*ring, ring[0]))]
    return np.array(found, dtype=np.float64).reshape(-1, 4)


def _limits(record: Record, half_length: float, half_width: float) -> RobotLimits:
    """The limits of an Escape: the least of those of profile, robot and connection."""
    values, narrowed = record.header["profile"]["values"], record.header["limits"]
    body = _body(record)
    least = partial(_least, record.path)
    acceleration = least(values.get("robot.base_acceleration"), narrowed["acceleration"])
    brakes = (body.get("brake_deceleration"), narrowed["brakes"])
    return RobotLimits(
        acceleration,
        least(*brakes) if any(brakes) else acceleration,
        least(
            values.get("navigation.escape.max_speed"),
            values.get("robot.base_speed"),
            body.get("max_speed"),
            narrowed["speed"],
        ),
        half_length,
        half_width,
        least(values.get("robot.base_yaw_acceleration"), narrowed["yaw_acceleration"]),
    )


def _least(path: Path, *given: object) -> float:
    """The least of these quantities in SI units; those that are None do not limit."""
    known = [_si(value) for value in given if value is not None]
    if not known:
        raise mistake(path, "does not tell the limits of an Escape")
    return min(known)


def _si(value: object) -> float:
    found = quantity(value) if isinstance(value, str) else None
    return float(value) if found is None else found[0]  # type: ignore[arg-type]


def _body(record: Record) -> Mapping[str, Any]:
    """The entry `base` of the robot's own file; empty if the record does not have it."""
    for name, text in record.attachments.items():
        if name.endswith(YAML):
            found = yaml.safe_load(text)
            if isinstance(found, dict) and found.get("robot") == record.header["robot"]:
                body = found.get("base")
                return body if isinstance(body, dict) else {}
    return {}


def escape_paths(record: Record) -> frozenset[str]:
    """Paths of the nodes that use a chart of Escape, from the charts in the record."""
    library = Library()
    for name, file in record.header["charts"].items():
        found = load_text(record.attachments[file].decode(), file)
        library[name] = found[name]
    main = library[record.header["chart"]]
    return nodes_of(BEHAVIOUR, dict(_uses(main.root, "", library)))


def _uses(node: Node, path: str, library: Library) -> Iterator[tuple[str, str]]:
    for child in node.children:
        below = f"{path}/{child.name}" if path else child.name
        if child.form == "use":
            yield below, child.target
            yield from _uses(library[child.target].root, below, library)
        else:
            yield from _uses(child, below, library)
