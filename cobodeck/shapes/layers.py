"""All shapes of a room and of a moment in it: of the layers asked for, and no others."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from behaviors.profile import Profile, Settings
from cobodeck.evaluate import ArmOutline, arm_outline
from cobodeck.shapes import actors, room_parts
from cobodeck.shapes.moment import Moment, next_deep, planner_at, situation_at
from cobodeck.shapes.sensed import costmap_shapes, scan_shapes
from cobodeck.shapes.shape import Layer, MapShape
from cobodeck.shapes.spaces import chase_shapes, escape_shapes, haptic_shapes
from hw.model import Footprint
from hw.scene import Scene
from states import SubsystemName
from states.environment import Environment


@dataclass(frozen=True, eq=False)
class Backdrop:
    """What stays the same in a run: scene, environment, and the values of the behaviours.

    `chase_cell` is the side of Chase cells that are shown, m; None: the profile's.
    """

    scene: Scene
    environment: Environment
    profile: Profile
    chase_cell: float | None = None

    @property
    def settings(self) -> Settings:
        """The values of the behaviours."""
        return self.profile.settings

    @property
    def footprint(self) -> Footprint:
        """The robot's outline."""
        return self.environment.robot.footprint

    @cached_property
    def arm(self) -> ArmOutline | None:
        """The arm; None: the robot has none."""
        robot = self.environment.robot
        return None if robot.arm is None else arm_outline(robot)


def room_shapes(around: Backdrop) -> list[MapShape]:
    """What does not move, the lowest first: inflations, walls, tracked area, places."""
    scene, room = around.scene, around.scene.room
    return [
        *room_parts.inflation_shapes(room, around.environment.navigation),
        *room_parts.wall_shapes(room),
        *room_parts.tracked_shapes(room),
        *room_parts.place_shapes(scene.places),
    ]


def shapes_of(moment: Moment, around: Backdrop, layers: Collection[str]) -> list[MapShape]:
    """What moves, of these layers, the lowest first; what is unknown at the moment has no shapes.

    Nothing is computed for other layers.
    """
    found: list[MapShape] = []
    for layer, (needs, make) in MOVING.items():
        if layer in layers and all(getattr(moment, name) is not None for name in needs):
            found += make(moment, around)
    return found


def _objects(moment: Moment, around: Backdrop) -> list[MapShape]:
    objects = room_parts.object_shapes(around.scene.objects, moment.at_s)
    return [*objects, *room_parts.item_shapes(around.scene.items)]


def _arm(moment: Any, around: Backdrop) -> list[MapShape]:
    return [] if around.arm is None else actors.arm_shapes(moment.robot, moment.joints, around.arm)


def _user(moment: Any, around: Backdrop) -> list[MapShape]:
    keeping = around.environment.navigation.named(_subsystem(moment))
    return actors.user_shapes(moment.user, keeping.user_radius)


def _subsystem(moment: Moment) -> SubsystemName:
    return "haptic" if moment.deep else "chase"


def _trails(moment: Moment, _: Backdrop) -> list[MapShape]:
    users = actors.trail_shapes(moment.user_trail, "trail-user")
    return [*users, *actors.trail_shapes(moment.robot_trail, "trail-robot")]


def _costmap(moment: Any, around: Backdrop) -> list[MapShape]:
    environment, name = around.environment, moment.subsystem or _subsystem(moment)
    values = environment.navigation.named(name).costmap
    planner = planner_at(environment, name, moment.obstacles)
    return costmap_shapes(planner, moment.robot, (values.width, values.height))


def _situation(moment: Moment, around: Backdrop, name: SubsystemName) -> Any:
    return situation_at(moment, around.environment, around.settings, name)


def _haptic(moment: Moment, around: Backdrop) -> list[MapShape]:
    """The poses for the touch that is requested, or for one that would be requested now."""
    settings, environment, deep = around.settings, around.environment, moment.deep
    if deep is None and moment.user is not None:
        deep = next_deep(settings, moment.user)
    if deep is None:
        return []
    planner = planner_at(environment, "haptic", moment.obstacles)
    return haptic_shapes(settings, planner, deep, moment.robot, around.footprint)


MOVING: Mapping[Layer, tuple[Sequence[str], Callable[[Any, Backdrop], list[MapShape]]]] = {
    "costmap": (["robot"], _costmap),
    "chase": (
        ["robot", "user"],
        lambda m, around: chase_shapes(_situation(m, around, "chase"), around.chase_cell),
    ),
    "objects": ([], _objects),
    "zones": (["user"], lambda m, around: actors.zone_shapes(m.user, around.settings.escape)),
    "user": (["user"], _user),
    "trails": ([], _trails),
    "path": ([], lambda m, _: actors.path_shapes(m.path)),
    "goal": (["goal"], lambda m, around: actors.goal_shapes(m.goal, around.footprint)),
    "scan": ([], lambda m, around: scan_shapes(m.scans, around.environment.robot.sensing)),
    "escape": (
        ["robot", "user"],
        lambda m, around: escape_shapes(_situation(m, around, "escape"), m.joints),
    ),
    "haptic": ([], _haptic),
    "robot": (["robot"], lambda m, around: actors.robot_shapes(m.robot, around.footprint)),
    "arm": (["robot", "joints"], _arm),
    "deep": (["deep"], lambda m, _: actors.deep_shapes(m.deep)),
}
"""The layers that move, in the order in which they are drawn: what of a moment each needs, and what
makes its shapes."""
