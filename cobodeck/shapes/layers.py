"""All shapes of a room and of a moment in it: of the layers asked for, and no others."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from functools import cached_property

from behaviors.profile import Profile, Settings
from cobodeck.evaluate import ArmOutline, arm_outline
from cobodeck.shapes import actors, room_parts
from cobodeck.shapes.moment import Moment, next_deep, planner_at, situation_at
from cobodeck.shapes.sensed import costmap_shapes, scan_shapes
from cobodeck.shapes.shape import Layer, Shape
from cobodeck.shapes.spaces import chase_shapes, escape_shapes, haptic_shapes
from hw.scene import Scene
from states import SubsystemName
from states.environment import Environment


@dataclass(frozen=True, eq=False)
class Surroundings:
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

    @cached_property
    def arm(self) -> ArmOutline | None:
        """The arm; None: the robot has none."""
        robot = self.environment.robot
        return None if robot.arm is None else arm_outline(robot)


def room_shapes(around: Surroundings) -> list[Shape]:
    """What does not move, the lowest first: inflations, walls, tracked area, places."""
    scene, room = around.scene, around.scene.room
    return [
        *room_parts.inflation_shapes(room, around.environment.navigation),
        *room_parts.wall_shapes(room),
        *room_parts.tracked_shapes(room),
        *room_parts.place_shapes(scene.places),
    ]


def shapes_of(moment: Moment, around: Surroundings, layers: Collection[str]) -> list[Shape]:
    """What moves, of these layers, the lowest first; what is unknown at the moment has no shapes.

    Nothing is computed for other layers.
    """
    asked = (make for layer, make in MOVING.items() if layer in layers)
    return [shape for make in asked for shape in make(moment, around)]


def _objects(moment: Moment, around: Surroundings) -> list[Shape]:
    scene = around.scene
    return [
        *room_parts.object_shapes(scene.objects, moment.at_s),
        *room_parts.item_shapes(scene.items),
    ]


def _robot(moment: Moment, around: Surroundings) -> list[Shape]:
    footprint = around.environment.robot.footprint
    return [] if moment.robot is None else actors.robot_shapes(moment.robot, footprint)


def _arm(moment: Moment, around: Surroundings) -> list[Shape]:
    if moment.robot is None or moment.joints is None or around.arm is None:
        return []
    return actors.arm_shapes(moment.robot, moment.joints, around.arm)


def _user(moment: Moment, around: Surroundings) -> list[Shape]:
    if moment.user is None:
        return []
    keeping = around.environment.navigation.named("haptic" if moment.deep else "chase")
    return actors.user_shapes(moment.user, keeping.user_radius)


def _zones(moment: Moment, around: Surroundings) -> list[Shape]:
    user, escape = moment.user, around.settings.escape
    return [] if user is None else actors.zone_shapes(user, escape)


def _goal(moment: Moment, around: Surroundings) -> list[Shape]:
    footprint = around.environment.robot.footprint
    return [] if moment.goal is None else actors.goal_shapes(moment.goal, footprint)


def _trails(moment: Moment, around: Surroundings) -> list[Shape]:  # noqa: ARG001
    users = actors.trail_shapes(moment.user_trail, "trail-user")
    return [*users, *actors.trail_shapes(moment.robot_trail, "trail-robot")]


def _scan(moment: Moment, around: Surroundings) -> list[Shape]:
    return scan_shapes(moment.scans, around.environment.robot.sensing)


def _costmap(moment: Moment, around: Surroundings) -> list[Shape]:
    if moment.robot is None:
        return []
    environment = around.environment
    name: SubsystemName = moment.subsystem or ("haptic" if moment.deep else "chase")
    values = environment.navigation.named(name).costmap
    planner = planner_at(environment, name, moment.obstacles)
    return costmap_shapes(planner, moment.robot, (values.width, values.height))


def _chase(moment: Moment, around: Surroundings) -> list[Shape]:
    now = situation_at(moment, around.environment, around.settings, "chase")
    return [] if now is None else chase_shapes(now, around.chase_cell)


def _escape(moment: Moment, around: Surroundings) -> list[Shape]:
    now = situation_at(moment, around.environment, around.settings, "escape")
    return [] if now is None else escape_shapes(now, moment.joints)


def _haptic(moment: Moment, around: Surroundings) -> list[Shape]:
    """The poses for the touch that is requested, or for one that would be requested now."""
    settings, environment = around.settings, around.environment
    deep = moment.deep
    if deep is None:
        if moment.user is None:
            return []
        deep = next_deep(settings, moment.user)
    planner = planner_at(environment, "haptic", moment.obstacles)
    return haptic_shapes(settings, planner, deep, moment.robot, environment.robot.footprint)


def _deep(moment: Moment, around: Surroundings) -> list[Shape]:  # noqa: ARG001
    return [] if moment.deep is None else actors.deep_shapes(moment.deep)


MOVING: Mapping[Layer, Callable[[Moment, Surroundings], list[Shape]]] = {
    "costmap": _costmap,
    "chase": _chase,
    "objects": _objects,
    "zones": _zones,
    "user": _user,
    "trails": _trails,
    "path": lambda moment, around: actors.path_shapes(moment.path),  # noqa: ARG005
    "goal": _goal,
    "scan": _scan,
    "escape": _escape,
    "haptic": _haptic,
    "robot": _robot,
    "arm": _arm,
    "deep": _deep,
}
"""What makes the layers that move, in the order in which they are drawn."""
