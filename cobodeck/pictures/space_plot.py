"""What an inflation leaves of a room or map, what it closes, and where no touch is possible.

All areas are opaque, so that colours on the floor are the same as in the legend.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import shapely
from matplotlib.colors import to_rgba
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, Patch
from matplotlib.patheffects import withStroke
from matplotlib.transforms import Affine2D
from scipy import ndimage

from cobodeck.pictures.drawing import INFLATIONS, Sheet, draw, sheet
from cobodeck.shapes import areas, wall_shapes
from engine.draw import INK, RED
from hw.scene import Point
from states.floors import MapFloor, Passage, RoomFloor, Space, Untouchable
from states.navigation.exact import Array

LEFT = "#ffffff"
KEPT_OFF = INFLATIONS[1]
UNKNOWN = "#f3f0ea"
NO_TOUCH = "#e65100"
DARKEST = 0.75
"""Share of the colour `NO_TOUCH`, over white, at a place without any Haptic pose."""
EDGE: dict[str, Any] = {"ec": INK, "lw": 0.9, "ls": (0, (3, 2))}
"""Style of the border of the floor that is left; squares may cover the grey beyond it."""
LABELLED_IN2 = 0.4
"""Least size on paper, square inches, of pieces that are labelled with their area."""
SMALL_SCALE = 0.3


def space_picture(
    floor: RoomFloor | MapFloor, space: Space, untouchable: Untouchable, title: str, text: str
) -> Sheet:
    """The free floor: white where the robot's centre may be, shaded where users get no touch."""
    on = sheet(floor.bounds, title, text.splitlines())
    if isinstance(floor, RoomFloor):
        _draw_left_of_room(on, floor, space.inflation)
    else:
        _draw_left_of_map(on, floor, space.inflation)
    edge = EDGE if isinstance(floor, RoomFloor) else {"edgecolor": INK, "linewidth": 0.6}
    on.explain("left for the robot's centre", Patch(facecolor=LEFT, **edge))
    on.explain(f"{space.inflation:g} m from walls", Patch(facecolor=KEPT_OFF))
    _draw_untouchable(on, untouchable)
    for passage in space.closed:
        _draw_passage(on, passage)
    if space.closed:
        line: dict[str, Any] = {"color": RED, "lw": 2.4}
        ring: dict[str, Any] = {
            "lw": 0,
            "marker": "o",
            "mfc": "none",
            "mec": RED,
            "mew": 2,
            "ms": 9,
        }
        sign = Line2D([], [], **(line if isinstance(floor, RoomFloor) else ring))
        on.explain("closed passage, its width", sign)
    return on


def _draw_left_of_room(on: Sheet, floor: RoomFloor, inflation: float) -> None:
    draw(on, wall_shapes(floor.room))
    left = floor.usable(inflation)
    shut = floor.room.free_space.difference(left)
    draw(on, areas("inflations", "inflation-1", shut, fill=True))
    draw(on, areas("inflations", "left", left, fill=False), **EDGE)
    for piece in shapely.get_parts(left):
        if piece.area >= _least_labelled(on):
            _label(on, _middle(piece), piece.area)


def _middle(piece: Any) -> Point:
    disc = shapely.maximum_inscribed_circle(piece, tolerance=0.05)
    (x, y), _ = disc.coords
    return x, y


def _draw_left_of_map(on: Sheet, floor: MapFloor, inflation: float) -> None:
    size, values = floor.map.resolution, floor.map.values
    left = floor.usable(inflation)
    image = np.empty((*values.shape, 4))
    image[:] = to_rgba(UNKNOWN)
    image[values > 0] = to_rgba(INK)
    image[floor.free] = to_rgba(KEPT_OFF)
    image[left] = to_rgba(LEFT)
    rows, columns = values.shape
    corner = floor.map.map_from_corner
    placed = Affine2D().rotate(corner.yaw).translate(corner.x, corner.y) + on.axes.transData
    on.axes.imshow(
        image, extent=(0.0, columns * size, 0.0, rows * size), origin="lower",
        interpolation="none", transform=placed, zorder=1.0, aspect=on.axes.get_aspect(),
    )  # fmt: skip
    on.explain("occupied", Patch(facecolor=INK))
    on.explain("unknown", Patch(facecolor=UNKNOWN, edgecolor=INK, lw=0.6))
    pieces, count = ndimage.label(left, structure=np.ones((3, 3)))
    for number in range(1, count + 1):
        piece = pieces == number
        area = float(np.count_nonzero(piece)) * size**2
        if area >= _least_labelled(on):
            widest = np.where(piece, floor.distance, -1.0).argmax()
            _label(on, floor.map.center(*divmod(int(widest), columns)), area)


def _draw_untouchable(on: Sheet, found: Untouchable) -> None:
    """Places as opaque squares, darker the more headings have no Haptic pose."""
    some = found.share > 0.0
    if not some.any():
        return
    on.axes.imshow(
        _squares(found), extent=_extent(found), origin="lower", interpolation="none", zorder=2.0,
        aspect=on.axes.get_aspect(),
    )  # fmt: skip
    words = ("no Haptic pose in any direction", "… in half of the directions", "… in a quarter")
    for share, text in zip((1.0, 0.5, 0.25), words, strict=True):
        on.explain(text, Patch(facecolor=no_touch_colour(share)))


def no_touch_colour(share: float) -> tuple[float, float, float]:
    """The RGB colour of a place where this share of the user's headings has no Haptic pose."""
    full = to_rgba(NO_TOUCH)[:3]
    red, green, blue = (1.0 - DARKEST * share * (1.0 - value) for value in full)
    return red, green, blue


def _squares(found: Untouchable) -> Array:
    x_low, _, y_low, _ = _extent(found)
    column = np.rint((found.x - x_low) / found.step - 0.5).astype(int)
    row = np.rint((found.y - y_low) / found.step - 0.5).astype(int)
    image = np.zeros((row.max() + 1, column.max() + 1, 4))
    image[row, column, :3] = [no_touch_colour(share) for share in found.share.tolist()]
    image[row, column, 3] = found.share > 0.0
    return image


def _extent(found: Untouchable) -> tuple[float, float, float, float]:
    half = 0.5 * found.step
    return (
        float(found.x.min()) - half,
        float(found.x.max()) + half,
        float(found.y.min()) - half,
        float(found.y.max()) + half,
    )


def _draw_passage(on: Sheet, passage: Passage) -> None:
    """A line between the walls, or a ring if only the middle of the narrowest place is known."""
    x, y = passage.middle
    if passage.start == passage.end:
        ring = Circle((x, y), 0.5 * passage.width, fill=False, ec=RED, lw=2.0, zorder=6.0)
        on.axes.add_patch(ring)
    else:
        xs, ys = zip(passage.start, passage.end, strict=True)
        on.axes.plot(xs, ys, color=RED, lw=2.4, solid_capstyle="butt", zorder=6.0)
    _write(on, (x, y), f"{passage.width:.2f} m", RED, 7.5 if on.scale > SMALL_SCALE else 5.0)


def _least_labelled(on: Sheet) -> float:
    return LABELLED_IN2 / on.scale**2


def _label(on: Sheet, place: Point, area: float) -> None:
    _write(on, place, f"{area:.1f} m²", INK, 9.0)


def _write(on: Sheet, place: Point, text: str, colour: str, size: float) -> None:
    written = on.axes.text(
        *place, text, color=colour, fontsize=size, fontweight="bold", ha="center", va="center",
        zorder=9.0, clip_on=True,
    )  # fmt: skip
    written.set_path_effects([withStroke(linewidth=2.5, foreground="white")])
