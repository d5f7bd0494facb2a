"""The map in which a log is localized: a given one, or one made from part of the log's scans.

The first half of the scans makes the map, the second half is scored. If the second half leaves the
area seen by the first, every other scan makes the map instead.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Literal, NamedTuple

import numpy as np

from cobodeck.logs.formats import ODOMETRY, SCAN, SensorLog
from cobodeck.logs.mrpt import is_rawlog, read_rawlog
from cobodeck.logs.seen import SeenScan, scans_of
from engine.files import FileError, mistake, read_file
from hw import Pose2
from hw.motion import PoseHistory
from states.localization.slam import PlacedScan, Placing, Progress, place, points_in
from states.maps import (
    RESOLUTION,
    UNKNOWN,
    Field,
    Mapper,
    OccupancyMap,
    load_map,
    map_field,
    room_field,
)

if TYPE_CHECKING:
    from hw.scene import Room

Split = Literal["halves", "alternate"]
_HALVES: Split = "halves"
_ALTERNATE: Split = "alternate"
_SEEN = 0.6
"""A scan counts as seen if at least this share of its beams ends in known cells of the map."""
_OFTEN = 0.9
"""Least share of the second half's scans that must be seen."""


class Placed(NamedTuple):
    """A scan of a log, by its number, with the pose from which it was taken, map_from_base."""

    number: int
    seen: SeenScan
    pose: Pose2


@dataclass(frozen=True, slots=True, eq=False)
class Ground:
    """The map of a localization.

    `source`: origin of the map, in words; `map`: a map of cells, `room`: a drawn one. `scored`:
    numbers of the scans that the map was not made from; `placed`: poses of all scans, if the map
    was made from some. `own` is true if corrected poses of the log are poses in this map.
    `remarks`: what was odd in making it, in words.
    """

    source: str
    field: Field
    map: OccupancyMap | None
    room: Room | None
    scored: frozenset[int]
    split: Split | None = None
    placed: tuple[Placed, ...] = ()
    own: bool = True
    remarks: tuple[str, ...] = ()


def given_ground(place: str, log: SensorLog, resolution: float = RESOLUTION) -> Ground:
    """The ground of a given map: map_server YAML, a scene by name or file, or a log with poses.

    Raises:
        FileError: `place` is none of them, or malformed.
    """
    numbers = frozenset(range(log.count(SCAN)))
    path = Path(place)
    if path.is_file() and is_rawlog(path):
        seen = read_rawlog(path)
        map_ = _map_of(placed_by_reference(seen), seen, resolution)
        return Ground(f"{place}, {resolution:g} m", map_field(map_), map_, None, numbers, own=False)
    if path.is_file() and _is_map(path):
        map_ = load_map(path)
        return Ground(place, map_field(map_), map_, None, numbers, own=False)
    from hw.scene import load_scene

    room = load_scene(place).room
    own = log.form == "record"  # poses of a record are those of its scene
    return Ground(f"scene {place}", room_field(room), None, room, numbers, own=own)


def room_ground(log: SensorLog, room: Room) -> Ground:
    """The ground of the log's own room."""
    numbers = frozenset(range(log.count(SCAN)))
    return Ground("the room of the log", room_field(room), None, room, numbers)


def _silent(_text: str, _share: float) -> None:
    pass


def built_ground(
    log: SensorLog, resolution: float = RESOLUTION, progress: Progress = _silent
) -> Ground:
    """The ground made from part of the log's scans.

    Raises:
        FileError: there are too few scans, or no poses for them.
    """
    count = log.count(SCAN)
    if count < 4:
        hint = "--map MAP gives one"
        raise mistake(log.path, f"has {count} scans: too few for a map of its own", hint=hint)
    by = "its corrected poses" if log.reference else "matching scan to scan"
    remarks: tuple[str, ...] = ()
    if log.reference:
        placed = placed_by_reference(log)
    else:
        placed, remarks = placed_by_matching(log, resolution, progress)
    if len(placed) < 4:
        raise mistake(log.path, f"has poses for {len(placed)} scans only: too few for a map")
    half = len(placed) // 2
    map_, scored, split = _map_of(placed[:half], log, resolution), placed[half:], _HALVES
    if not _is_seen(map_, scored):
        map_, scored, split = _map_of(placed[::2], log, resolution), placed[1::2], _ALTERNATE
    part = "the first half of its scans" if split == _HALVES else "every other scan"
    source = f"{part}, by {by}, {resolution:g} m"
    numbers = frozenset(one.number for one in scored)
    field = map_field(map_)
    return Ground(source, field, map_, None, numbers, split, tuple(placed), remarks=remarks)


def placed_by_reference(log: SensorLog) -> list[Placed]:
    """The scans at whose stamps there are corrected poses.

    Raises:
        FileError: the log has no corrected poses.
    """
    if not log.reference:
        raise mistake(log.path, "has no poses to make a map by", hint="a simplemap has")
    reference = reference_of(log)
    found = ((n, seen, reference(seen.stamp_ns)) for n, seen in enumerate(scans_of(log)))
    return [Placed(number, seen, pose) for number, seen, pose in found if pose is not None]


def placed_by_matching(
    log: SensorLog, resolution: float, progress: Progress = _silent
) -> tuple[list[Placed], tuple[str, ...]]:
    """All scans, placed by wheels, matches and loops in one graph, and remarks.

    Raises:
        FileError: their poses are too far apart for a map.
    """
    scans = scans_of(log)
    taken = [PlacedScan(seen.sensor, seen.points, seen.odom_from_base) for seen in scans]

    def placed(poses: Sequence[Pose2]) -> list[Placed]:
        return [Placed(n, scans[n], pose) for n, pose in enumerate(poses)]

    def field_of(poses: Sequence[Pose2]) -> Field:
        return map_field(_map_of(placed(poses), log, resolution))

    try:
        found = place(taken, field_of, progress, resolution=resolution)
    except FileError:
        raise
    except ValueError as error:
        raise mistake(log.path, f"gives no map: {error}") from None
    alone = [] if log.count(ODOMETRY) else [ALONE]
    return placed(found.poses), (*alone, *_remarks(found))


ALONE = "there is no odometry: the map is by scans alone, and may tear where they show no way"


def _remarks(found: Placing) -> tuple[str, ...]:
    if not found.wrong:
        return ()
    which = "contradicts" if found.wrong == 1 else "contradict"
    return (
        f"{found.wrong} of {found.loops} places where the path seems to return {which} the rest "
        "and were left out of the map",
    )


def reference_of(log: SensorLog) -> Callable[[int], Pose2 | None]:
    """The corrected pose at a stamp, ns, interpolated; None in gaps longer than `_LONGEST_NS`."""
    return partial(PoseHistory(Pose2.between, poses=log.reference).at, longest_ns=_LONGEST_NS)


_LONGEST_NS = 500_000_000
"""Longest gap between corrected poses that is interpolated, ns."""


def _map_of(placed: Sequence[Placed], log: SensorLog, resolution: float) -> OccupancyMap:
    mapper = Mapper(resolution)
    try:
        for _, seen, pose in placed:
            start = pose @ log.sensing.mount(seen.sensor)
            mapper.add((start.x, start.y), points_in(pose, seen.points))
        return mapper.map()
    except ValueError as error:
        raise mistake(log.path, f"gives no map: {error}") from None


def _is_seen(map_: OccupancyMap, placed: Sequence[Placed]) -> bool:
    """True if most of the scans see known cells of the map."""
    return float(np.mean([share >= _SEEN for share in _shares(map_, placed)])) >= _OFTEN


def _shares(map_: OccupancyMap, placed: Sequence[Placed]) -> Iterator[float]:
    corner, cell = map_.map_from_corner, map_.resolution
    rows, columns = map_.values.shape
    for _, seen, pose in placed:
        points = points_in(pose, seen.points)
        places = np.floor((points - [corner.x, corner.y]) / cell).astype(np.int64)
        inside = ((places >= 0) & (places < [columns, rows])).all(axis=1)
        known = map_.values[places[inside, 1], places[inside, 0]] != UNKNOWN
        yield float(known.sum()) / max(1, len(points))


def _is_map(path: Path) -> bool:
    """True for map_server YAML: it has the key `image`."""
    source = read_file(path)
    return isinstance(source.value, dict) and "image" in source.value
