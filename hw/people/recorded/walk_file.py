"""Recorded walks: reading, checking, scaling and placing them.

`.txt` is the TUM format, one `stamp tx ty tz qx qy qz qw` per line in s and m. `.csv` has a header
with an optional person, a time and a position, such as `id,t,x,y`; a name may carry a unit (`t_ms`,
`x_cm`). The tag export `id;x;y;z;time` (mm, date and time of day) is read too.

The floor is x, y, with z up. Where y is up, x and z are on the floor, and seen from above z points
to the left of x in a left-handed frame (Unity), to the right in a right-handed one (OpenVR, OpenXR,
OpenGL): y of the floor is z or -z.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from datetime import datetime
from itertools import pairwise
from pathlib import Path
from typing import Literal

from engine.files import mistake, read_text
from hw.geometry import FAR
from hw.people.recorded.gaps import Gap, across_jumps, drop_out_ns

MAX_BYTES = 50_000_000
MAX_SPAN_S = 1e6
"""Longest recording, s."""
WINDOW_S = 0.5
"""Heading and speed are those of the chord over this time, s."""
WALKING = 0.2
"""Below this speed, m/s, a person counts as standing and keeps their heading."""

_UNITS = {"": 1.0, "s": 1.0, "ms": 1e-3, "m": 1.0, "cm": 1e-2, "mm": 1e-3}
_NAMES = {
    "id": ("id", "person", "ped", "pid"),
    "t": ("t", "time", "stamp", "timestamp"),
    "x": ("x",),
    "y": ("y",),
    "z": ("z",),
}
_TAG_EXPORT = "id;x;y;z;time"

Heading = Literal["centred", "causal"]
"""Whether a heading looks ahead, as of the true body, or is that of the way just walked."""
Up = Literal["z", "y", "y-right"]
"""The axis that is up: z, y of a left-handed frame, or y of a right-handed one."""
RecordingRow = tuple[float, float, float]
"""Time, s, and place on the floor, m."""
SpaceRow = tuple[float, float, float, float]
"""Time, s, and x, y, z as in the file, m; NaN where it has none."""
HEAD = (0.5, 2.3)
"""Heights of a person's head, sitting or standing, m."""
UP_SPAN = 1.0
"""A head's height changes by less than this, m, a walk's width by more."""


@dataclass(frozen=True, slots=True)
class Recording:
    """One person's walk: stamps in ns from its start, strictly rising, and positions in m.

    `jumps_ns` are stamps of rows after which the positions jumped; the rows of the jump are left
    out.
    """

    name: str
    stamps_ns: tuple[int, ...]
    xs: tuple[float, ...]
    ys: tuple[float, ...]
    jumps_ns: frozenset[int] = frozenset()

    @property
    def duration_ns(self) -> int:
        """Time from the first row to the last, ns."""
        return self.stamps_ns[-1]

    @property
    def size(self) -> tuple[float, float]:
        """Width and height of the bounding box, m."""
        return max(self.xs) - min(self.xs), max(self.ys) - min(self.ys)

    @property
    def middle(self) -> tuple[float, float]:
        """Centre of the bounding box, m."""
        return 0.5 * (max(self.xs) + min(self.xs)), 0.5 * (max(self.ys) + min(self.ys))

    def gaps(self) -> tuple[Gap, ...]:
        """Every drop-out and every jump, in the order of time."""
        longest = drop_out_ns(self.stamps_ns)
        found = []
        for sooner, later in pairwise(self.stamps_ns):
            if sooner in self.jumps_ns:
                found.append(Gap(sooner, later, "jump"))
            elif later - sooner > longest:
                found.append(Gap(sooner, later, "drop-out"))
        return tuple(found)

    def placed(self, x: float, y: float, yaw: float) -> Recording:
        """The walk rotated by yaw about its centre, and moved with its centre to (x, y)."""
        cx, cy = self.middle
        c, s = math.cos(yaw), math.sin(yaw)
        xs = tuple(x + c * (a - cx) - s * (b - cy) for a, b in zip(self.xs, self.ys, strict=True))
        ys = tuple(y + s * (a - cx) + c * (b - cy) for a, b in zip(self.xs, self.ys, strict=True))
        return replace(self, xs=xs, ys=ys)

    def stretched(self, size: float) -> Recording:
        """The walk scaled to `size` (longer side of the bounding box, m) at unchanged speeds."""
        longer = max(self.size)
        if longer == 0.0:
            raise mistake(self.name, "the person never moves; there is no walk to stretch")
        scale, (cx, cy) = size / longer, self.middle
        return Recording(
            self.name,
            tuple(round(stamp * scale) for stamp in self.stamps_ns),
            tuple(cx + scale * (x - cx) for x in self.xs),
            tuple(cy + scale * (y - cy) for y in self.ys),
            frozenset(round(stamp * scale) for stamp in self.jumps_ns),
        )

    def motion(self, *, causal: bool = False) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Heading (rad) and speed, m/s, at every row.

        Both are those of the chord from half a window before to half a window after, so they look
        ahead by 0.25 s: they stand for the true body, which turns before it walks. If `causal`, the
        headings are those of the chord over the window before, as tracking computes them. While the
        person stands the heading is held; before the first step it is that of the first step.
        """
        half = round(0.5e9 * WINDOW_S)
        centred = self._chords(half, half)
        headings: list[float | None] = []
        heading: float | None = None
        for dx, dy, span in self._chords(2 * half, 0) if causal else centred:
            walks = span > 0.0 and math.hypot(dx, dy) / span >= WALKING
            heading = math.atan2(dy, dx) if walks else heading
            headings.append(heading)
        initial = next((found for found in headings if found is not None), 0.0)
        speeds = tuple(math.hypot(dx, dy) / span for dx, dy, span in centred)
        return tuple(initial if h is None else h for h in headings), speeds

    def _chords(self, back_ns: int, ahead_ns: int) -> list[tuple[float, float, float]]:
        """At every row the chord from before to after: dx and dy in m, and its duration, s."""
        chords = []
        first, last, end = 0, 0, len(self.stamps_ns) - 1
        for stamp in self.stamps_ns:
            while first < end and self.stamps_ns[first + 1] <= stamp - back_ns:
                first += 1
            while last < end and self.stamps_ns[last] < stamp + ahead_ns:
                last += 1
            span = (self.stamps_ns[last] - self.stamps_ns[first]) * 1e-9
            chords.append((self.xs[last] - self.xs[first], self.ys[last] - self.ys[first], span))
        return chords


def read_recording(path: Path, person: str | None = None, up: Up | None = None) -> Recording:
    """The walk of one person in a file; `up` None: z, unless y looks like a head's height.

    Raises:
        FileError: with file and line: unknown format, bad numbers, stamps that do not rise,
            fewer than two rows, an unknown person, several without a choice, or y looks like a
            height and no `up` is given.
    """
    if path.suffix not in (".txt", ".csv"):
        raise mistake(path, f"'{path.suffix}' is not a known format; use .txt (TUM) or .csv")
    lines = read_text(path, MAX_BYTES).splitlines()
    if path.suffix == ".txt" and person is not None:
        raise mistake(path, f"a TUM file holds one person; leave out '#{person}'")
    needed = "txy" if up in (None, "z") else "txz"
    people = _tum(path, lines) if path.suffix == ".txt" else _csv(path, lines, needed)
    name = _choose(path, tuple(people), person)
    rows = people[name]
    if up is None:
        _refuse_heights(path, [row for _, row in rows])
    floor = [(line, _on_floor(row, up or "z")) for line, row in rows]
    return _checked(path, f"{path}#{name}" if name else str(path), floor)


People = dict[str, list[tuple[int, SpaceRow]]]


def _on_floor(row: SpaceRow, up: Up) -> RecordingRow:
    t, x, y, z = row
    return t, x, {"z": y, "y": z, "y-right": -z}[up]


def _refuse_heights(path: Path, rows: list[SpaceRow]) -> None:
    ys, zs = [row[2] for row in rows], [row[3] for row in rows]
    low, high = min(ys), max(ys)
    is_height = HEAD[0] <= low and high <= HEAD[1] and high - low < UP_SPAN
    if is_height and max(zs) - min(zs) > UP_SPAN:
        raise mistake(
            path,
            f"y stays within {low:.2f} and {high:.2f} m, like a head's height, and z does not: "
            "are x and z on the floor",
            hint="`--up y` reads x, z of a left-handed frame (Unity), `--up y-right` x, -z of a "
            "right-handed one (OpenVR, OpenXR), `--up z` x, y",
        )


def _tum(path: Path, lines: list[str]) -> People:
    rows = []
    for number, line in enumerate(lines, start=1):
        fields = line.split()
        if not fields or fields[0].startswith("#"):
            continue
        if len(fields) != 8:
            raise mistake(
                path, f"{len(fields)} values; needs 8: stamp tx ty tz qx qy qz qw", number
            )
        t, x, y, z, *_ = (_number(path, number, field) for field in fields)
        rows.append((number, (t, x, y, z)))
    return {"": rows} if rows else {}


def _csv(path: Path, lines: list[str], needed: str) -> People:
    header = lines[0].strip() if lines else ""
    if header == _TAG_EXPORT:
        separator = ";"
        columns = {"id": (0, 1.0), "t": (4, 1.0)} | {k: (i, 1e-3) for i, k in enumerate("xyz", 1)}
    else:
        separator = max(",;\t", key=header.count)
        columns = _columns(path, header.lower().split(separator), needed)
    people: People = {}
    for number, line in enumerate(lines[1:], start=2):
        if not line.strip():
            continue
        fields = line.split(separator)
        if len(fields) != header.count(separator) + 1:
            expected = header.count(separator) + 1
            raise mistake(path, f"{len(fields)} values; the header has {expected}", number)
        t, x, y, z = (_column(path, number, fields, columns, key, needed) for key in "txyz")
        name = fields[columns["id"][0]].strip() if "id" in columns else ""
        people.setdefault(name, []).append((number, (t, x, y, z)))
    return people


def _column(
    path: Path,
    line: int,
    fields: list[str],
    columns: dict[str, tuple[int, float]],
    key: str,
    needed: str,
) -> float:
    """A value in s or m; one that is not needed may be missing or no number, which is NaN."""
    index, unit = columns.get(key, (-1, 1.0))
    if key in needed:
        return unit * _number(path, line, fields[index])
    try:
        return unit * float(fields[index]) if key in columns else math.nan
    except ValueError:
        return math.nan


def _columns(path: Path, header: list[str], needed: str) -> dict[str, tuple[int, float]]:
    found: dict[str, tuple[int, float]] = {}
    for index, title in enumerate(header):
        name, _, unit = title.strip().partition("_")
        key = next((key for key, names in _NAMES.items() if name in names), None)
        if key is None or key in found:
            continue
        if key in "xyz" and key not in needed and unit not in _UNITS:
            continue
        if unit not in _UNITS or (key == "id" and unit):
            raise mistake(path, f"column '{title.strip()}': unknown unit '{unit}'", 1)
        found[key] = (index, _UNITS[unit])
    missing = [key for key in needed if key not in found]
    if missing:
        like = ",".join(needed)
        raise mistake(path, f"no column {', '.join(missing)}; the header must be like id,{like}", 1)
    return found


def _number(path: Path, line: int, text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = _time_of_day(path, line, text.strip())
    if not math.isfinite(value):
        raise mistake(path, f"'{text.strip()}' is not a finite number", line)
    return value


def _time_of_day(path: Path, line: int, text: str) -> float:
    try:
        moment = datetime.fromisoformat(text)
    except ValueError:
        raise mistake(path, f"'{text[:40]}' is not a number", line) from None
    return (moment.replace(tzinfo=None) - datetime(2000, 1, 1)).total_seconds()


def _choose(path: Path, people: tuple[str, ...], wanted: str | None) -> str:
    if not people:
        raise mistake(path, "holds no data")
    if wanted is not None and wanted in people:
        return wanted
    if wanted is None and len(people) == 1:
        return people[0]
    listed = ", ".join(people[:20]) + (", ..." if len(people) > 20 else "")
    if wanted is None:
        raise mistake(path, f"holds {len(people)} people; choose one by #id: {listed}")
    if people == ("",):
        raise mistake(path, f"has no column of persons; leave out '#{wanted}'")
    raise mistake(path, f"no person '{wanted}'; has {listed}")


def _checked(path: Path, name: str, rows: list[tuple[int, RecordingRow]]) -> Recording:
    if len(rows) < 2:
        raise mistake(path, "is the only row; a walk needs at least two", rows[0][0])
    start = rows[0][1][0]
    for line, (t, x, y) in rows:
        if max(abs(x), abs(y)) > FAR:
            raise mistake(path, f"({x:g}, {y:g}) m is too far away; wrong unit?", line)
        if abs(t - start) > MAX_SPAN_S:
            raise mistake(path, f"{t - start:g} s after the first row; wrong unit?", line)
    stamps = [round((row[0] - start) * 1e9) for _, row in rows]
    for i in range(1, len(stamps)):
        if stamps[i] <= stamps[i - 1]:
            line, row = rows[i]
            before = rows[i - 1][1][0]
            message = f"time {row[0]} is not after {before}; sort the rows by time"
            raise mistake(path, message, line)
    xs, ys = [row[1] for _, row in rows], [row[2] for _, row in rows]
    kept, jumps = across_jumps(stamps, xs, ys)
    if len(kept) < 2:
        raise mistake(path, "the person jumps from the first row on; wrong unit?", rows[1][0])
    return Recording(
        name,
        tuple(stamps[row] for row in kept),
        tuple(xs[row] for row in kept),
        tuple(ys[row] for row in kept),
        frozenset(stamps[row] for row in jumps),
    )
