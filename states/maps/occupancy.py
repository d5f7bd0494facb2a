"""Occupancy maps, read and written as map_server does: a YAML file beside an image.

    image: lab.pgm                # relative to the YAML file, absolute, or below ~
    resolution: 0.05              # m per pixel
    origin: [-5.0, -5.0, 0.0]     # pose of the image's lower left corner in the map: x, y, yaw
    negate: 0                     # 1: dark is free
    occupied_thresh: 0.65
    free_thresh: 0.196
    mode: trinary                 # or scale, raw; may be left out

The top row of the image is the last row of the map. Two conventions decide what a pixel on a
threshold is: `ros1` compares with > and <, `nav2` with >= and <=; map_saver's grey for unknown,
205, is 0.19608, just above 0.196 and below a careless 0.25. `scale` spreads the greys between the
thresholds over 0 to 100, and `raw` takes greys as values: both read map_saver's 205 as something
else than unknown, which a remark tells. Pixels that are not opaque are unknown, as in Nav2,
except in `raw`.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import numpy as np
from numpy.typing import NDArray

from engine.files import Length
from engine.files.declared import Fault, Item, Range, Written, load_yaml, record
from hw import AnyAngle, Coordinate, Pose2
from hw.scene import Point

if TYPE_CHECKING:  # a drawn room has no image to be read by Pillow
    from states.maps.images import Pixels

Convention = Literal["ros1", "nav2"]
OccupancyMode = Literal["trinary", "scale", "raw"]

UNKNOWN = -1
FREE = 0
OCCUPIED = 100

Values = NDArray[np.int16]

FINEST, COARSEST = 0.001, 10.0
"""Range of the side of a cell, m."""
LARGEST = 1000.0
"""Longest side of a map, m."""

_GREYS = {"free": 254, "unknown": 205, "occupied": 0}


@dataclass(frozen=True, slots=True)
class OccupancyMap:
    """A map of cells.

    `values` is (rows, columns) int16, read-only, row 0 at the bottom: -1 unknown, 0 free to 100
    occupied (in `raw` maps up to 254). `map_from_corner` is the pose of the lower left corner,
    `resolution` the length of a cell's side, m. `remarks` are warnings for the reader.
    """

    values: Values
    resolution: float
    map_from_corner: Pose2
    remarks: tuple[str, ...] = ()

    def cell(self, x: float, y: float) -> tuple[int, int] | None:
        """Row and column of a place in the map, or None outside."""
        column_m, row_m = self.map_from_corner.inverse().transform(x, y)
        if not (math.isfinite(column_m) and math.isfinite(row_m)):
            return None
        row, column = math.floor(row_m / self.resolution), math.floor(column_m / self.resolution)
        rows, columns = self.values.shape
        return (row, column) if 0 <= row < rows and 0 <= column < columns else None

    def center(self, row: int, column: int) -> Point:
        """The centre of a cell in the map, m."""
        return self.map_from_corner.transform(
            (column + 0.5) * self.resolution, (row + 0.5) * self.resolution
        )

    def area(self, value: int = FREE) -> float:
        """Area of all cells of a value, m2."""
        return float(np.count_nonzero(self.values == value)) * self.resolution**2


def load_map(path: Path | str, convention: Convention = "ros1") -> OccupancyMap:
    """Read a map_server YAML file and its image.

    Raises:
        FileError: the YAML is wrong, with every mistake in it; the image is missing, cut off or no
            image.
    """
    return load_yaml(Path(path), lambda item: _map(item, convention))


def _flag(item: Item) -> bool:
    if item.value in (0, 1, True, False):
        return bool(item.value)
    raise item.error("needs 0 or 1")


_Share = Annotated[float, Range(0.0, 1.0)]


@dataclass(frozen=True, slots=True)
class MapFile:
    """A map of cells beside a picture, as map_server writes it; other keys are ignored."""

    image: str
    """The picture, PGM, PNG or BMP: a path from this file, absolute, or below ~."""
    resolution: Annotated[Length, Range(FINEST, COARSEST)]
    """The side of a pixel."""
    origin: tuple[Coordinate, Coordinate, AnyAngle]
    """Pose of the picture's lower left corner in the map: x, y and yaw, m and rad."""
    occupied_thresh: _Share
    """What is darker than this share is occupied."""
    free_thresh: _Share
    """What is lighter than this share of darkness is free; between the two it is unknown."""
    negate: Annotated[bool, _flag, Written({"type": ["integer", "boolean"]})]
    """0, or 1: dark is free."""
    mode: OccupancyMode = "trinary"
    """`scale` spreads the greys between the thresholds, `raw` takes greys as values."""

    def faults(self) -> Iterator[Fault]:
        """Contradictions, by key."""
        if self.free_thresh >= self.occupied_thresh:
            message = f"must be below occupied_thresh, {self.occupied_thresh:g}"
            yield "free_thresh", f"{self.free_thresh:g} {message}"


def _map(item: Item, convention: Convention) -> OccupancyMap:
    from states.maps.images import read_image

    read = record(item, MapFile, more=True)
    resolution = read.resolution
    image = item.inner("image")
    pixels = image.refer(lambda: read_image(image.path(read.image)))
    if (side := max(pixels.shape[:2]) * resolution) > LARGEST:
        message = f"makes the map {side:g} m long; at most {LARGEST:g} m are allowed"
        raise item.inner("resolution").error(message)
    thresholds = (read.occupied_thresh, read.free_thresh)
    values = pixel_values(pixels, read.mode, thresholds, read.negate, convention)
    remarks = _remarks(pixels, values, thresholds, read.mode, read.negate)
    return OccupancyMap(_frozen(values[::-1]), resolution, Pose2.checked(*read.origin), remarks)


def pixel_values(
    pixels: Pixels,
    mode: OccupancyMode,
    thresholds: tuple[float, float],
    negate: bool,
    convention: Convention,
) -> Values:
    """Map values of pixels, (rows, columns), top row first; thresholds are occupied, free."""
    grey, opaque = _grey_and_opaque(pixels)
    shade = 255.0 - grey if negate else grey
    if mode == "raw":
        whole = np.rint(shade).astype(np.int16)
        most = OCCUPIED if convention == "nav2" else 254
        return np.where(whole <= most, whole, UNKNOWN).astype(np.int16)
    occupied_from, free_to = thresholds
    share = (255.0 - shade) / 255.0
    if convention == "nav2":
        occupied, free = share >= occupied_from, share <= free_to
    else:
        occupied, free = share > occupied_from, share < free_to
    between = np.full(grey.shape, float(UNKNOWN))
    if mode == "scale":
        part = (share - free_to) / (occupied_from - free_to)
        between = np.rint(100.0 * part) if convention == "nav2" else np.trunc(99.0 * part)
    values = np.where(occupied, OCCUPIED, np.where(free, FREE, between))
    return np.where(opaque, values, UNKNOWN).astype(np.int16)


def save_map(map_: OccupancyMap, path: Path | str, mode: OccupancyMode = "trinary") -> None:
    """Write a YAML file and, beside it, an image of the same name.

    `trinary` and `raw` write PGM; trinary keeps free (up to 25), occupied (from 65) and unknown,
    as map_saver does. `scale` writes a PNG whose transparent pixels are unknown, to be read by the
    `nav2` convention.
    """
    from states.maps.images import write_image

    path = Path(path)
    values = map_.values[::-1]
    occupied_from, free_to, suffix = 0.65, 0.196, ".pgm"
    if mode == "raw":
        pixels = np.where(values == UNKNOWN, 255, values)[..., None]
    elif mode == "scale":
        occupied_from, free_to, suffix = 1.0, 0.0, ".png"
        known = values != UNKNOWN
        grey = np.rint(255.0 - 2.55 * np.clip(values, 0, 100))
        pixels = np.stack([grey, np.where(known, 255, 0)], axis=-1)
    else:
        free, occupied = (values >= 0) & (values <= 25), values >= 65
        pixels = np.where(occupied, _GREYS["occupied"], _GREYS["unknown"])
        pixels = np.where(free, _GREYS["free"], pixels)[..., None]
    image = path.with_suffix(suffix)
    write_image(image, np.ascontiguousarray(pixels, dtype=np.uint8))
    x, y, yaw = map_.map_from_corner.x, map_.map_from_corner.y, map_.map_from_corner.yaw
    path.write_text(
        f"image: {image.name}\nmode: {mode}\nresolution: {map_.resolution!r}\n"
        f"origin: [{x!r}, {y!r}, {yaw!r}]\nnegate: 0\n"
        f"occupied_thresh: {occupied_from}\nfree_thresh: {free_to}\n"
    )


def _grey_and_opaque(pixels: Pixels) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """The mean of the colours, and where it is not seen through (all of an image without alpha)."""
    if pixels.shape[2] in (2, 4):
        return pixels[..., :-1].mean(axis=2), pixels[..., -1] == 255
    return pixels.mean(axis=2), np.ones(pixels.shape[:2], np.bool_)


def _frozen(values: Values) -> Values:
    own = np.ascontiguousarray(values)
    own.setflags(write=False)
    return own


def _remarks(
    pixels: Pixels,
    values: Values,
    thresholds: tuple[float, float],
    mode: OccupancyMode,
    negate: bool,
) -> tuple[str, ...]:
    greys = np.array([*_GREYS.values(), 255])
    greys = 255 - greys if negate else greys
    grey, opaque = _grey_and_opaque(pixels)
    at_unknown = opaque & (grey == greys[1])
    count = np.count_nonzero(at_unknown)
    found = []
    if count and (values[at_unknown] == FREE).all():
        if mode == "trinary":
            cause, right = f"free_thresh {thresholds[1]:g}", "0.196"
        else:
            cause, right = f"mode {mode}", "mode trinary"
        found.append(
            f"{cause} reads map_saver's grey for unknown as free ({count} cells); "
            f"{right} keeps it unknown"
        )
    if not (values >= OCCUPIED).any():
        found.append("no cell is occupied: the walls may have been lost by scaling the image")
    between = np.count_nonzero((values == UNKNOWN) & opaque) - count
    if mode == "trinary" and between > 0.05 * values.size:
        found.append(f"{between} cells are neither free nor occupied nor map_saver's unknown")
    if mode == "raw" and np.isin(grey, greys).all():
        found.append(
            "mode raw takes greys as values, so that dark is free and bright is occupied: "
            "mode trinary reads an image of map_saver's greys"
        )
    return tuple(found)
