"""Pairs tracker readings with the base's track in time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from hw import Pose2, Pose3

Array = NDArray[np.float64]

LONGEST_GAP_S = 0.25
"""Largest gap between base readings that is interpolated, s."""


class OfTracker(Protocol):
    """vive_from_tracker at a stamp."""

    @property
    def stamp_ns(self) -> int: ...
    @property
    def tracker(self) -> str: ...
    @property
    def vive_from_tracker(self) -> Pose3: ...


class OfBase(Protocol):
    """map_from_base at a stamp, by a scanner."""

    @property
    def stamp_ns(self) -> int: ...
    @property
    def map_from_base(self) -> Pose2: ...
    @property
    def scanner(self) -> str: ...


@dataclass(frozen=True, slots=True)
class Pairs:
    """n tracker readings, each with the track of a scanner, ordered by window.

    `tracks`: per scanner time (s), x, y, unwrapped yaw, (m, 4). `starts`: first row of each window.
    """

    trackers: list[str]
    scanners: list[str]
    tracks: list[Array]
    tracker: NDArray[np.int64]
    scanner: NDArray[np.int64]
    times: Array
    places: Array
    turns: Rotation
    starts: NDArray[np.int64]

    @property
    def windows(self) -> int:
        """Number of windows, over all trackers and scanners."""
        return len(self.starts)

    def base_at(self, offset: float) -> tuple[Array, Array]:
        """Position (n, 3) and yaw (n,) of the base at the trackers' times plus an offset, s."""
        base = np.zeros((len(self.times), 4))
        for at, track in enumerate(self.tracks):
            here = self.scanner == at
            for axis in (1, 2, 3):
                column = np.interp(self.times[here] + offset, track[:, 0], track[:, axis])
                base[here, axis] = column
        return np.column_stack((base[:, 1], base[:, 2], np.zeros(len(base)))), base[:, 3]

    def mean(self, rows: Array) -> Array:
        """Means over windows (w, 3) of rows (n, 3)."""
        counts = np.diff(np.append(self.starts, len(rows)))
        return np.asarray(np.add.reduceat(rows, self.starts) / counts[:, None])


def pairs_of(trackers: Sequence[OfTracker], bases: Sequence[OfBase], window: float) -> Pairs:
    """Each tracker reading with every scanner's track that covers its time."""
    names = sorted({reading.tracker for reading in trackers})
    scanners = sorted({reading.scanner for reading in bases})
    origin = min((reading.stamp_ns for reading in bases), default=0)
    tracks = [_track(bases, scanner, origin) for scanner in scanners]
    rows = []
    for reading in trackers:
        time, pose = (reading.stamp_ns - origin) * 1e-9, reading.vive_from_tracker
        place, turn = (pose.x, pose.y, pose.z), (pose.qx, pose.qy, pose.qz, pose.qw)
        for at, track in enumerate(tracks):
            if _covers(track, time):
                slot = int(time // window)
                rows.append((names.index(reading.tracker), at, slot, time, *place, *turn))
    rows.sort()
    table = np.array(rows, np.float64).reshape(-1, 11)
    keys = table[:, :3].astype(np.int64)
    starts = np.flatnonzero(np.any(np.diff(keys, axis=0, prepend=-1) != 0, axis=1))
    return Pairs(
        names,
        scanners,
        tracks,
        keys[:, 0],
        keys[:, 1],
        table[:, 3],
        table[:, 4:7],
        Rotation.from_quat(table[:, 7:]) if rows else Rotation.identity(),
        starts,
    )


def _track(bases: Sequence[OfBase], scanner: str, origin: int) -> Array:
    rows = sorted(
        ((reading.stamp_ns - origin) * 1e-9, pose.x, pose.y, pose.yaw)
        for reading in bases
        if reading.scanner == scanner
        for pose in (reading.map_from_base,)
    )
    track = np.array(rows, np.float64)
    track[:, 3] = np.unwrap(track[:, 3])
    return track


def _covers(track: Array, time: float) -> bool:
    after = int(np.searchsorted(track[:, 0], time))
    if after == 0 or after == len(track):
        return False
    return bool(track[after, 0] - track[after - 1, 0] <= LONGEST_GAP_S)
