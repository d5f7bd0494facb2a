"""Labels beside marks on a sheet, where there is room for them."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

from cobodeck.pictures.drawing.canvas import Sheet
from hw.scene import Point

_PT = 1.0 / 72.0
_WIDTH, _HEIGHT = 0.72, 1.2
"""Estimated width and height of a letter, in font sizes; measuring would need a drawing."""
_AROUND = tuple(math.radians(angle) for angle in (30, -30, 150, -150, 90, -90, 0, 180))
_AWAY = (1.0, 2.2)
_APART = 1.5

Area = tuple[float, float, float, float]


@dataclass(frozen=True, slots=True)
class Label:
    """Text beside a mark; `away`: distance from its centre, `size`: of the font, both in points."""

    place: Point
    text: str
    colour: str
    size: float
    away: float


@dataclass(frozen=True, slots=True)
class Labels:
    """Places labels where nothing else is.

    `taken` are areas in inches from the map's origin: least x and y, greatest x and y. A label
    without room is left out, or, with `always`, written at its best place anyway.
    """

    on: Sheet
    always: bool = False
    wanted: list[Label] = field(default_factory=list)
    taken: list[Area] = field(default_factory=list)

    def mark(self, place: Point, extent: float, text: str, colour: str, size: float) -> None:
        """Reserve the area of a mark of this extent, points, and request a label beside it."""
        x, y = (self.on.scale * value for value in place)
        half = 0.5 * extent * _PT
        self.taken.append((x - half, y - half, x + half, y + half))
        if text:
            self.wanted.append(Label(place, text, colour, size, 0.5 * extent + _APART))

    def keep_off(self, points: Sequence[Point]) -> None:
        """Reserve the rectangle around these points, m."""
        xs, ys = zip(*points, strict=True)
        s = self.on.scale
        self.taken.append((s * min(xs), s * min(ys), s * max(xs), s * max(ys)))

    def write(self) -> None:
        """Write the requested labels; earlier ones choose their place first."""
        for label in self.wanted:
            areas = list(self._areas(label))
            best = areas[0] if self.always else None
            area = next(filter(self._is_free, areas), best)
            if area is not None:
                self.taken.append(area)
                self._draw(label, area)

    def _areas(self, label: Label) -> Iterator[Area]:
        """Possible areas of a label, the best first."""
        width = _WIDTH * label.size * len(label.text) * _PT
        height = _HEIGHT * label.size * _PT
        for factor in _AWAY:
            for angle in _AROUND:
                x, y = self._middle(label.place, angle, factor * label.away * _PT, width, height)
                yield x - width / 2, y - height / 2, x + width / 2, y + height / 2

    def _middle(
        self, place: Point, angle: float, away: float, width: float, height: float
    ) -> Point:
        x, y = (self.on.scale * value for value in place)
        across, up = math.cos(angle), math.sin(angle)
        return x + across * (away + width / 2), y + up * (away + height / 2)

    def _is_free(self, area: Area) -> bool:
        (x_low, x_high), (y_low, y_high) = self.on.axes.get_xlim(), self.on.axes.get_ylim()
        s, (left, low, right, high) = self.on.scale, area
        if left < s * x_low or right > s * x_high or low < s * y_low or high > s * y_high:
            return False
        return all(right < a or left > c or high < b or low > d for a, b, c, d in self.taken)

    def _draw(self, label: Label, area: Area) -> None:
        x, y = (
            0.5 * (low + high) / self.on.scale for low, high in zip(area, area[2:], strict=False)
        )
        # a light background instead of an outline, which an SVG stores as curves, 6 kB a word
        ground = {"fc": "white", "alpha": 0.72, "lw": 0.0, "boxstyle": "square,pad=0.05"}
        self.on.axes.text(
            x, y, label.text, color=label.colour, fontsize=label.size, ha="center", va="center",
            zorder=9.5, fontweight="bold", clip_on=True, bbox=ground,
        )  # fmt: skip
