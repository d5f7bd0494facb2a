"""Scripts for simulated people: a list of steps in YAML.

    user: demo
    about: what they do
    start: {x: 5.5, y: 5.0, yaw: 3.1}    # or the scene's start of the user
    speed: 1.5                           # m/s, walking, unless a step says otherwise
    turn_rate: 3.0                       # rad/s, turning on the spot
    repeat: true                         # start again after the last step; a number: so many rounds
    steps:
      - walk: {x: 2.0, y: 4.4, yaw: 1.6}   # turn, walk straight, turn to yaw (may be left out)
      - stand: 10                          # s
      - turn: 1.57                         # to this yaw in the map, rad
      - look: 0.5                          # head turned from the body by this angle, rad
      - request: {hold: 30, ahead: 0.85, height: 1.5}   # ask for a touch, let go after hold s
      - approach: {target: robot, stop_at: 1.0, for: 5}  # walk at the robot wherever it goes
      - lose_tracking: 2                   # s without user.pose, while the next steps go on

An `approach` ends at that distance (m, to the robot's centre), after that time, before a wall, or
when the robot is shown to the person.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from hw.document import FileError, Item, find_file, read_document, suggestion
from hw.geometry import Pose2, wrap

FOLDER = Path(__file__).parent / "users"
KINDS = ("walk", "stand", "turn", "look", "request", "approach", "lose_tracking")


class ScriptError(FileError):
    """A user script is wrong or missing."""


@dataclass(frozen=True, slots=True)
class Walk:
    """Straight to (x, y) in m, then to yaw if given; speed in m/s."""

    x: float
    y: float
    yaw: float | None
    speed: float


@dataclass(frozen=True, slots=True)
class Stand:
    """Do nothing for so many ns."""

    span_ns: int


@dataclass(frozen=True, slots=True)
class Turn:
    """Turn on the spot to this yaw, rad in the map."""

    yaw: float


@dataclass(frozen=True, slots=True)
class Look:
    """Turn the head by this angle from the body, rad."""

    turn: float


@dataclass(frozen=True, slots=True)
class Request:
    """Ask for a touch for hold_ns, with the DEEP so far ahead of the body and so high, m."""

    hold_ns: int
    ahead: float
    height: float


@dataclass(frozen=True, slots=True)
class Approach:
    """Walk at the robot until stop_at m from its centre, for so many ns at the longest."""

    speed: float
    stop_at: float
    span_ns: int


@dataclass(frozen=True, slots=True)
class LoseTracking:
    """From now on no user.pose for so many ns."""

    span_ns: int


Step = Walk | Stand | Turn | Look | Request | Approach | LoseTracking


@dataclass(frozen=True, slots=True)
class Script:
    """A checked script; rounds None: again and again. Lines name the steps' places in the file."""

    name: str
    about: str
    path: str
    start: Pose2 | None
    turn_rate: float
    rounds: int | None
    steps: tuple[Step, ...]
    lines: tuple[int, ...]


def script_names() -> tuple[str, ...]:
    """The scripts that come with the project."""
    return tuple(sorted(path.stem for path in FOLDER.glob("*.yaml")))


def load_script(name_or_path: str | Path) -> Script:
    """A script by name or by file.

    Raises:
        ScriptError: with file, line, key and what would be right.
    """
    path = find_file(str(name_or_path), FOLDER, "user", ScriptError)
    content = read_document(path, ScriptError).section(
        required=("user", "steps"), optional=("about", "start", "speed", "turn_rate", "repeat")
    )
    speed = _rate(content, "speed", 1.5)
    items = content["steps"].items()
    if not items:
        raise content["steps"].fail("needs at least one step")
    return Script(
        name=content["user"].text(),
        about=content["about"].text() if "about" in content else "",
        path=str(path),
        start=content["start"].pose() if "start" in content else None,
        turn_rate=_rate(content, "turn_rate", 3.0),
        rounds=_rounds(content.get("repeat")),
        steps=tuple(_step(item, speed) for item in items),
        lines=tuple(item.line for item in items),
    )


def _rate(content: dict[str, Item], key: str, default: float) -> float:
    if key not in content:
        return default
    return content[key].number(low=0.01, high=100.0)


def _rounds(item: Item | None) -> int | None:
    if item is None or item.value is False:
        return 1
    if item.value is True:
        return None
    if isinstance(item.value, int) and item.value >= 1:
        return item.value
    raise item.fail("needs true, false or a whole number of rounds")


def _step(item: Item, speed: float) -> Step:
    content = item.mapping()
    if len(content) != 1:
        raise item.fail(f"a step has one key, one of {', '.join(KINDS)}; has {len(content)}")
    kind, value = next(iter(content.items()))
    if kind == "walk":
        return _walk(value, speed)
    if kind == "stand":
        return Stand(_span(value))
    if kind == "turn":
        return Turn(wrap(value.number()))
    if kind == "look":
        return Look(value.number(-3.2, 3.2))
    if kind == "request":
        return _request(value)
    if kind == "approach":
        return _approach(value, speed)
    if kind == "lose_tracking":
        return LoseTracking(_span(value))
    raise value.fail(f"no such step{suggestion(kind, KINDS)}")


def _walk(item: Item, speed: float) -> Walk:
    part = item.section(required=("x", "y"), optional=("yaw", "speed"))
    yaw = wrap(part["yaw"].number()) if "yaw" in part else None
    return Walk(part["x"].number(), part["y"].number(), yaw, _rate(part, "speed", speed))


def _request(item: Item) -> Request:
    part = item.section(required=("hold",), optional=("ahead", "height"))
    return Request(
        hold_ns=_span(part["hold"], low=0.1),
        ahead=part["ahead"].number(low=0.0) if "ahead" in part else 0.85,
        height=part["height"].number(low=0.0) if "height" in part else 1.5,
    )


def _approach(item: Item, speed: float) -> Approach:
    part = item.section(required=("target", "for"), optional=("stop_at", "speed"))
    part["target"].text(("robot",))
    return Approach(
        speed=_rate(part, "speed", speed),
        stop_at=part["stop_at"].number(low=0.0) if "stop_at" in part else 0.0,
        span_ns=_span(part["for"]),
    )


def _span(item: Item, low: float = 0.0) -> int:
    return round(item.number(low=low, high=1e6) * 1e9)
