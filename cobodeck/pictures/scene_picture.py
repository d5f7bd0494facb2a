"""A scene with robot and user, and the spaces that the behaviours consider."""

from __future__ import annotations

from collections.abc import Collection

from cobodeck.pictures.drawing import Sheet, draw, sheet
from cobodeck.shapes import (
    Moment,
    Surroundings,
    box,
    deep_shapes,
    next_deep,
    place_shapes,
    room_shapes,
    shapes_of,
)
from hw import Pose2

ALWAYS = ("objects", "user", "trails", "path", "goal", "robot", "arm")
LAYERS_OF = {"chase": ("chase",), "escape": ("zones", "escape"), "haptic": ("haptic", "deep")}
"""The layers of each space."""


def scene_picture(
    around: Surroundings, moment: Moment, spaces: Collection[str] | None = None
) -> Sheet:
    """The room with everything in it at one moment.

    `spaces` are names from `command.SPACES`; by default Haptic's while the user requests a touch,
    otherwise all others. Haptic's poses are for the requested touch, or for a possible next one.
    """
    scene, robot = around.scene, moment.robot
    assert robot is not None
    shown = _present(moment) if spaces is None else spaces
    on = sheet(scene.room.bounds, scene.name, [x for x in (scene.about, moment.caption) if x])
    layers = [*ALWAYS, *(layer for space in shown for layer in LAYERS_OF[space])]
    room = [shape for shape in room_shapes(around) if shape.layer != "places"]
    moving = shapes_of(moment, around, layers)
    if "haptic" in shown and moment.deep is None and moment.user is not None:
        moving += deep_shapes(next_deep(around.settings, moment.user))
    outline = around.environment.robot.footprint
    radius = outline.enclosing_radius
    draw(on, [*room, *moving], [box(robot, outline.half_length, outline.half_width)])
    draw(on, place_shapes(scene.places), [box(Pose2(robot.x, robot.y), radius, radius)])
    return on


def _present(moment: Moment) -> tuple[str, ...]:
    return ("haptic",) if moment.deep is not None else ("chase", "escape")
