"""Opens a person by its source: `NAME`, `FILE[#id][@x,y,yaw]`, `random`, `route` or `live`.

`NAME` is a script, `FILE` a recorded walk, `random` a seeded random walk, `route` the script
`study` at random poses. `:KIND` behind any of these four is the person's manner (`manner.py`), by
default attentive: `random:hasty`, `demo:deaf`. Random people walk at a chosen speed:
`random at 2 m/s`, `random:deaf at 1 m/s`.

`@x,y,yaw` moves the centre of the recording's bounding box to (x, y) and rotates the walk by yaw
about it; the walk itself must stay on the free floor. By default the box is centred on the largest
free disc, at the first yaw in steps of pi/8 that keeps the whole person, a disc of 0.5 m radius, on
the free floor, and their start off the robot; else at the first place around that does.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from engine.files import mistake, quantity
from hw.geometry import Pose2
from hw.people.live import LivePerson
from hw.people.recorded import Heading, Playback, Recording, Up, read_recording
from hw.people.walking import (
    ATTACKERS,
    ATTENTIVE,
    Attacker,
    Interaction,
    Manner,
    Person,
    Walker,
    at_speed,
    load_script,
    manner_named,
    route,
    wanderer,
)
from hw.samples import USER_RADIUS
from hw.scene import Disc, Point, Room, Scene

LIVE = "live"
OFF_ROBOT = 1.27
"""Least distance from the robot's start at which a recording begins by default, m; centres."""
_SOURCE = re.compile(r"(?P<file>.+?)(?:#(?P<person>[^#@]*))?(?:@(?P<place>[^@]*))?\Z")
_KIND = re.compile(r"(?P<source>.*[^:]):(?P<kind>[^:/\\.#@,]*)\Z")
_PACED = re.compile(r"(?P<source>.+?) at (?P<speed>[^ ]+ ?c?m/s)\Z")
_SPEEDS = (0.1, 5.0)
"""Range of speeds at which a random person can be told to walk, m/s."""
_STEPS, _RINGS = 16, (0.5, 1.0, 1.5, 2.0)


@dataclass(frozen=True, slots=True)
class PersonSource:
    """A recording as named on the command line; place is x, y in m and yaw in rad, or None."""

    path: Path
    person: str | None = None
    place: tuple[float, float, float] | None = None


def is_recording(source: str) -> bool:
    """True if this names a recorded walk rather than a script."""
    bare = source if (kind := _KIND.fullmatch(source)) is None else kind["source"]
    found = _SOURCE.match(bare)
    return found is not None and Path(found["file"]).suffix in (".txt", ".csv")


def parse_source(text: str) -> PersonSource:
    """`FILE[#id][@x,y,yaw]` split into its parts.

    Raises:
        FileError: the place is not three finite numbers, or the id is empty.
    """
    found = _SOURCE.match(text)
    if found is None:
        raise mistake(text, "needs FILE[#id][@x,y,yaw]")
    if found["person"] == "":
        raise mistake(text, "an id must follow '#'")
    if found["place"] is None:
        return PersonSource(Path(found["file"]), found["person"])
    try:
        numbers = [float(part) for part in found["place"].split(",")]
    except ValueError:
        numbers = []
    if len(numbers) != 3 or not all(map(math.isfinite, numbers)):
        raise mistake(text, f"'@{found['place']}' needs three numbers, @x,y,yaw (m, rad)")
    return PersonSource(Path(found["file"]), found["person"], (numbers[0], numbers[1], numbers[2]))


def open_user(
    source: str,
    scene: Scene,
    requests: int | None = None,
    size: float | None = None,
    seed: int = 0,
    heading: Heading = "centred",
    up: Up | None = None,
) -> Person:
    """The person that a source names, in a scene; in an `Interaction` if it has touchable surfaces.

    Args:
        source: a script's name or file, a recording, `random` or `route`, with `:KIND` or
            without; or `live`.
        scene: gives the room and the start.
        requests: number of touches to request; None: what the script says, none in a
            recording, endless for `random` and `route`. With touchable surfaces: end after this
            many that walking up to them has caused.
        size: scale a recording to this longer side of its bounding box, m.
        seed: of all that a person does by chance.
        heading: how the headings of a recording are computed.
        up: the axis of a recording that is up; None: z, unless y looks like a height.

    Raises:
        FileError: with file, line and what would be right.
    """
    if not scene.touchable:
        return _open(source, scene, requests, size, seed, heading, up)
    person = _open(source, scene, None, size, seed, heading, up)
    return Interaction(person, scene.touchable, requests)


def with_manner(source: str) -> tuple[str, Manner | None]:
    """A source without `:KIND` and speed, and the manner of both; None: of a live person.

    Raises:
        FileError: there is no such kind, or the person cannot walk at that speed.
    """
    paced = _PACED.fullmatch(source)
    if paced is not None:
        return _with_speed(source, paced["source"], paced["speed"])
    found = _KIND.fullmatch(source)
    bare = source if found is None else found["source"]
    if bare == LIVE:
        if found is not None:
            raise mistake(source, "a live person has their own manner; write live")
        return bare, None
    if found is None:
        return bare, ATTENTIVE
    return bare, manner_named(found["kind"], source, wanders=bare == wanderer.NAME)


def _with_speed(source: str, rest: str, written: str) -> tuple[str, Manner]:
    bare, manner = with_manner(rest)
    if manner is None or bare != wanderer.NAME:
        raise mistake(source, "only random people walk at a chosen speed")
    speed, (low, high) = quantity(written), _SPEEDS
    if speed is None or not low <= speed[0] <= high:
        raise mistake(source, f"'{written}' is no speed from {low:g} to {high:g} m/s")
    return bare, at_speed(manner, speed[0])


def _open(
    source: str,
    scene: Scene,
    requests: int | None,
    size: float | None,
    seed: int,
    heading: Heading,
    up: Up | None,
) -> Person:
    bare, manner = with_manner(source)
    if manner is None:
        return LivePerson(scene.user_start or _middle(scene.room))
    if is_recording(bare):
        recording = _placed(parse_source(bare), scene, size, up)
        return Playback(recording, scene.room, requests or 0, None, manner, seed, heading)
    if size is not None:
        raise mistake(source, "only a recording can be stretched")
    if heading != "centred":
        raise mistake(source, "only a recording has headings to compute")
    if up is not None:
        raise mistake(source, "only a recording has an axis that is up")
    if bare == wanderer.NAME:
        start = scene.user_start or _middle(scene.room)
        kind = Attacker if manner in ATTACKERS else wanderer.Wanderer
        return kind(scene.room, start, seed, requests, manner)
    if bare == route.NAME:
        script = route.route(scene.room, scene.robot_start, seed)
    else:
        script = load_script(bare, also=(wanderer.NAME, route.NAME, LIVE))
    return Walker(script, scene.room, scene.user_start, requests, manner, seed)


def _placed(source: PersonSource, scene: Scene, size: float | None, up: Up | None) -> Recording:
    recording = read_recording(source.path, source.person, up)
    if size is not None:
        recording = recording.stretched(size)
    if source.place is None:
        return place_in_largest_disc(recording, scene.room, scene.robot_start)
    return place_at(recording, scene.room, source.place)


def place_at(recording: Recording, room: Room, place: tuple[float, float, float]) -> Recording:
    """The recording with its centre at (x, y), rotated by yaw.

    Raises:
        FileError: the walk would leave the free floor.
    """
    placed = recording.placed(*place)
    for stamp, x, y in zip(placed.stamps_ns, placed.xs, placed.ys, strict=True):
        if not room.is_free(x, y):
            raise mistake(
                recording.name,
                f"at @{place[0]:g},{place[1]:g},{place[2]:g} the person would be at "
                f"({x:.2f}, {y:.2f}) after {stamp * 1e-9:.2f} s, which is not on the free floor",
            )
    return placed


def place_in_largest_disc(recording: Recording, room: Room, robot: Pose2) -> Recording:
    """The recording in the centre of the largest free disc, or near it, at the first yaw that fits.

    Raises:
        FileError: no yaw in steps of pi/8 keeps the 0.5 m disc on the free floor, or they would
            begin where the robot does, there and at all places around.
    """
    disc, fits = room.largest_free_disc, False
    for x, y in _places_about(disc):
        for step in range(_STEPS):
            placed = recording.placed(x, y, step * math.pi / 8.0)
            begins_off = math.dist((placed.xs[0], placed.ys[0]), (robot.x, robot.y)) >= OFF_ROBOT
            if (begins_off or not fits) and _keeps_clear(placed, room):
                fits = True
                if begins_off:
                    return placed
        if not fits:
            break
    width, height = recording.size
    off = " with its start off the robot" if fits else ""
    raise mistake(
        recording.name,
        f"a walk of {width:.2f} m x {height:.2f} m does not fit into the free floor about "
        f"({disc.x:.2f}, {disc.y:.2f}), the centre of the largest free disc (radius "
        f"{disc.radius:.2f} m), at any yaw in steps of pi/8{off}; give a place as @x,y,yaw",
    )


def _places_about(disc: Disc) -> Iterator[Point]:
    """The centre of a disc, then places on rings around it, m."""
    yield disc.x, disc.y
    for radius in _RINGS:
        for step in range(0, _STEPS, 2):
            angle = step * math.pi / 8.0
            if radius < disc.radius:
                yield disc.x + radius * math.cos(angle), disc.y + radius * math.sin(angle)


def _middle(room: Room) -> Pose2:
    disc = room.largest_free_disc
    return Pose2(disc.x, disc.y)


def _keeps_clear(recording: Recording, room: Room) -> bool:
    from shapely.geometry import LineString

    path = LineString(zip(recording.xs, recording.ys, strict=True))
    floor = room.free_space
    return bool(floor.contains(path) and path.distance(floor.boundary) >= USER_RADIUS)
