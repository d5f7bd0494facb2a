"""Triangles of mesh files: STL, as text or binary, and OBJ."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np

from engine.files import is_file, read_bytes
from hw.model.urdf.frames import Matrix

READ = (".stl", ".obj")
_RECORD = np.dtype([("normal", "<f4", 3), ("points", "<f4", (3, 3)), ("more", "<u2")])
_HEAD = 84
"""Bytes of a binary STL before its triangles: 80 of any text, and their number."""
_PACKAGE, _FILE = "package://", "file://"
LARGEST = 16_000_000
"""Most bytes of a file; records keep what is as large."""


def mesh_file(written: str, folder: Path) -> Path:
    """The file that a URDF in this folder means.

    Of `package://name/path` every folder above the URDF may hold the package or be it.

    Raises:
        ValueError: there is none.
    """
    package = written.startswith(_PACKAGE)
    name = written.removeprefix(_PACKAGE).removeprefix(_FILE)
    if not package:
        tried = [folder / name]
    else:
        within = name.partition("/")[2]
        above = [folder, *folder.parents]
        tried = [up / found for up in above for found in (name, within)]
    for path in tried:
        if is_file(path):
            return path
    raise ValueError(f"names the mesh '{written}', which is not there")


def triangles(path: Path) -> Matrix:
    """The corners of all triangles of a mesh, (n, 3, 3), in its own unit.

    Raises:
        ValueError: its format is not read, or its content is no mesh.
        FileError: it cannot be read, or exceeds `LARGEST`.
    """
    kind = path.suffix.lower()
    if kind not in READ:
        raise ValueError(
            f"has the mesh {path.name}; STL and OBJ are read: convert it, or give the link "
            "cylinders, boxes or spheres as <collision>"
        )
    data = read_bytes(path, LARGEST)
    try:
        found = _obj(data) if kind == ".obj" else _stl(data)
    except (ValueError, IndexError, OverflowError):  # also of no text
        found = np.zeros((0, 3, 3))
    if not len(found) or not np.isfinite(found).all():
        raise ValueError(f"has the mesh {path.name}, which holds no triangles")
    return found


def _stl(data: bytes) -> Matrix:
    count = int.from_bytes(data[_HEAD - 4 : _HEAD], "little")
    if len(data) == _HEAD + count * _RECORD.itemsize:  # files that begin with `solid` as well
        return np.frombuffer(data, _RECORD, count, _HEAD)["points"].astype(np.float64)
    words = (line.split() for line in data.decode().splitlines())
    points = [line[1:4] for line in words if line[:1] == ["vertex"]]
    return np.array(points, dtype=np.float64).reshape(-1, 3, 3)


def _obj(data: bytes) -> Matrix:
    lines = [line.split() for line in data.decode().splitlines()]
    points = np.array([line[1:4] for line in lines if line[:1] == ["v"]], dtype=np.float64)
    found = []
    for line in lines:
        if line[:1] == ["f"]:
            corners = [int(word.partition("/")[0]) for word in line[1:]]
            corners = [n - 1 if n > 0 else n + len(points) for n in corners]
            found += [(corners[0], a, b) for a, b in pairwise(corners[1:])]
    return points[np.array(found, dtype=np.int64).reshape(-1, 3)]
