"""The picture of a run: the room from above with all events, and below it all lanes over time."""

from __future__ import annotations

from cobodeck.pictures.drawing import Sheet, draw, sheet
from cobodeck.pictures.run.lanes import draw_lanes, height_in
from cobodeck.pictures.run.marks import draw_marks
from cobodeck.pictures.run.run_course import Course
from cobodeck.pictures.run.tracks import bounds_of, draw_tracks
from cobodeck.shapes import object_shapes, tracked_shapes, wall_shapes
from engine.draw import GREY

NOWHERE = "no poses are known"
_NO_PLACE, _MIDDLE = (0.0, 0.0, 8.0, 2.0), (4.0, 1.0)


def run_picture(course: Course) -> Sheet:
    """A run, or a part of one, on one sheet."""
    bounds = bounds_of(course) if course.instants else _NO_PLACE
    on = sheet(bounds, course.title, course.lines, below_in=height_in(course))
    if course.instants:
        draw_tracks(on, course)
        draw_marks(on, course)
        if course.room is not None:
            draw(on, [*wall_shapes(course.room), *tracked_shapes(course.room)])
        draw(on, object_shapes(course.objects, course.end_s))
    else:
        on.axes.set_axis_off()
        on.axes.text(*_MIDDLE, NOWHERE, color=GREY, fontsize=9, ha="center", va="center")
    draw_lanes(on, course)
    return on
