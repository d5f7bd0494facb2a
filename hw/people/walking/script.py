"""Scripts for simulated people: a list of steps in YAML.

    user: demo
    about: what they do
    start: {x: 5.5, y: 5.0, yaw: 3.1}    # default: the scene's start of the user
    speed: 1.5                           # m/s, walking; a step may have its own
    turn_rate: 3.0                       # rad/s, turning on the spot
    repeat: true                         # start again after the last step, or a number of rounds
    steps:
      - walk: {x: 2.0, y: 4.4, yaw: 1.6}   # turn, walk straight, turn to yaw (optional)
      - stand: 10                          # s
      - turn: 1.57                         # to this yaw in the map, rad
      - look: 0.5                          # turn the head relative to the body, rad
      - request: {hold: 30, ahead: 0.85, height: 1.5}   # request a touch, let go after hold s
      - approach: {target: robot, stop_at: 1.0, for: 5}  # approach the robot wherever it goes
      - lose_tracking: 2                   # s without user.pose, while the next steps go on

Values may carry units (`stand: 2 min`, `turn: 90 deg`). An `approach` ends at that distance (m, to
the robot's centre), after that time, before a wall, or when the robot is shown to the person.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Annotated, Any, Literal

from engine.files import (
    Angle,
    AngularSpeed,
    Duration,
    Length,
    Place,
    Speed,
    did_you_mean,
    plain_word,
)
from engine.files.declared import (
    Count,
    Item,
    Name,
    Range,
    Written,
    fields_of,
    find_file,
    gather,
    known_files,
    load_yaml,
    record,
)
from hw.geometry import AnyAngle, Coordinate, Pose2, wrap
from hw.places import Pose

FOLDER = Path(__file__).parent.parent.parent / "users"

Pace = Annotated[Speed, Range(0.01, 10.0)]
Span = Annotated[Duration, Range(0.0, 1e6)]


@dataclass(frozen=True, slots=True)
class WalkStep:
    """Walk straight to (x, y) in m, then turn to yaw if given; speed in m/s."""

    x: float
    y: float
    yaw: float | None
    speed: float


@dataclass(frozen=True, slots=True)
class Stand:
    """Stand for span_ns."""

    span_ns: int


@dataclass(frozen=True, slots=True)
class Turn:
    """Turn on the spot to this yaw in the map, rad."""

    yaw: float


@dataclass(frozen=True, slots=True)
class LookStep:
    """Turn the head by this angle relative to the body, rad."""

    turn: float


@dataclass(frozen=True, slots=True)
class RequestStep:
    """Request a touch for hold_ns, with the DEEP `ahead` of the body and at `height`, m."""

    hold_ns: int
    ahead: float
    height: float


@dataclass(frozen=True, slots=True)
class ApproachStep:
    """Approach the robot until stop_at m from its centre, for span_ns at most."""

    speed: float
    stop_at: float
    span_ns: int


@dataclass(frozen=True, slots=True)
class LoseTracking:
    """No user.pose for span_ns from now on."""

    span_ns: int


ScriptStep = WalkStep | Stand | Turn | LookStep | RequestStep | ApproachStep | LoseTracking


@dataclass(frozen=True, slots=True)
class Script:
    """A checked script; `rounds` None: endless. `places` are the steps' places in the file."""

    name: str
    about: str
    path: str
    start: Pose2 | None
    turn_rate: float
    rounds: int | None
    steps: tuple[ScriptStep, ...]
    places: tuple[Place, ...]


def script_names() -> tuple[str, ...]:
    """Names of the shipped scripts and of the project's own."""
    return tuple(known_files(FOLDER, "user"))


def load_script(name_or_path: str | Path, also: Iterable[str] = ()) -> Script:
    """A script by name or by file; `also`: names of other kinds of users, to suggest.

    Raises:
        FileError: every mistake in it, with file, line, column and what would be right.
    """
    return load_yaml(find_file(str(name_or_path), FOLDER, "user", also), _script)


def _rounds(item: Item) -> int | None:
    if isinstance(item.value, bool):
        return None if item.value else 1
    if isinstance(item.value, int) and item.value >= 1:
        return item.value
    meant = plain_word(item.value)
    hint = f"write `{meant}`" if meant else ""
    raise item.error("needs true, false or a whole number of rounds", hint)


Rounds = Annotated[int | None, _rounds, Written({"type": ["boolean", "integer"], "minimum": 1})]


@dataclass(frozen=True, slots=True)
class _Walk:
    x: Coordinate
    """Where to, along x of the map."""
    y: Coordinate
    """Along y of the map."""
    yaw: AnyAngle | None = None
    """Turn to this yaw at the end."""
    speed: Pace | None = None
    """How fast; else as the script's `speed` says."""


@dataclass(frozen=True, slots=True)
class _Request:
    hold: Annotated[Duration, Range(0.1, 1e6)]
    """How long the touch lasts."""
    ahead: Annotated[Length, Range(0.0, 3.0)] = 0.85
    """How far ahead of the body the hand is."""
    height: Annotated[Length, Range(0.0, 3.0)] = 1.5
    """How high it is above the floor."""


@dataclass(frozen=True, slots=True)
class _Approach:
    target: Literal["robot"]
    """Whom to walk at."""
    for_: Span
    """For how long at most."""
    stop_at: Annotated[Length, Range(0.0, 100.0)] = 0.0
    """Distance to its centre at which to stop."""
    speed: Pace | None = None
    """How fast; else as the script's `speed` says."""


@dataclass(frozen=True, slots=True)
class StepKeys:
    """A step; it has exactly one of these keys."""

    walk: _Walk
    """Turn, walk straight to a place, turn to its yaw."""
    stand: Span
    """Stand for this long."""
    turn: AnyAngle
    """Turn on the spot to this yaw in the map."""
    look: Annotated[Angle, Range(-3.2, 3.2)]
    """Turn the head by this angle relative to the body."""
    request: _Request
    """Request a touch, and let go after a time."""
    approach: _Approach
    """Walk at the robot wherever it goes."""
    lose_tracking: Span
    """No `user.pose` for this long, while the next steps go on."""


Step = Annotated[Item, Written(StepKeys, keys="one")]


@dataclass(frozen=True, slots=True)
class UserFile:
    """A script for a simulated person."""

    user: Name
    """Its name."""
    steps: Annotated[tuple[Step, ...], Count(1)]
    """What they do, one after another."""
    about: str = ""
    """What it is good for."""
    start: Pose | None = None
    """Where they start; else where the scene says."""
    speed: Pace = 1.5
    """Walking; a step may have its own."""
    turn_rate: Annotated[AngularSpeed, Range(0.01, 100.0)] = 3.0
    """Turning on the spot."""
    repeat: Rounds = 1
    """`true`: again and again; `false`: once; or a number of rounds."""


def _script(item: Item) -> Script:
    read = record(item, UserFile)
    return Script(
        name=read.user,
        about=read.about,
        path=item.source.file,
        start=read.start,
        turn_rate=read.turn_rate,
        rounds=read.repeat,
        steps=tuple(gather(partial(_step, step, read.speed) for step in read.steps)),
        places=tuple(step.place for step in read.steps),
    )


def _step(item: Item, speed: float) -> ScriptStep:
    content, known = item.mapping(), fields_of(StepKeys)
    if len(content) != 1:
        raise item.error(f"a step has one key, one of {', '.join(known)}; it has {len(content)}")
    kind, value = next(iter(content.items()))
    if kind not in known:
        raise value.error("no such step", did_you_mean(kind, known))
    return _STEPS[kind](known[kind].read(value), speed)


def _walk(read: _Walk, speed: float) -> WalkStep:
    yaw = None if read.yaw is None else wrap(read.yaw)
    return WalkStep(read.x, read.y, yaw, read.speed or speed)


def _approach(read: _Approach, speed: float) -> ApproachStep:
    return ApproachStep(read.speed or speed, read.stop_at, _ns(read.for_))


def _ns(seconds: float) -> int:
    return round(seconds * 1e9)


_STEPS: Mapping[str, Callable[[Any, float], ScriptStep]] = {
    "walk": _walk,
    "stand": lambda span, _: Stand(_ns(span)),
    "turn": lambda yaw, _: Turn(wrap(yaw)),
    "look": lambda turn, _: LookStep(turn),
    "request": lambda read, _: RequestStep(_ns(read.hold), read.ahead, read.height),
    "approach": _approach,
    "lose_tracking": lambda span, _: LoseTracking(_ns(span)),
}
