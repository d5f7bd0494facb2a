"""A scene with robot and user, and the spaces that the behaviours consider."""

from __future__ import annotations

from collections.abc import Collection

from behaviors.profile import Profile, Settings
from cobodeck.evaluate import arm_outline
from cobodeck.pictures.drawing import (
    ROBOT_TRAIL,
    USER,
    Moment,
    Sheet,
    draw_arm,
    draw_inflations,
    draw_items,
    draw_objects,
    draw_places,
    draw_robot,
    draw_room,
    draw_tracked_area,
    draw_trail,
    draw_user,
    draw_zones,
    sheet,
    situation_at,
)
from cobodeck.pictures.spaces import draw_chase, draw_escape, draw_goal, draw_haptic, draw_path
from hw import Pose3
from hw.scene import Disc, Scene
from states import Navigation
from states.environment import Environment


def scene_picture(
    scene: Scene,
    environment: Environment,
    profile: Profile,
    moment: Moment,
    spaces: Collection[str] | None = None,
) -> Sheet:
    """The room with everything in it at one moment.

    `spaces` are names from `command.SPACES`; by default Haptic's while the user requests a touch,
    otherwise all others. Haptic's poses are for the requested touch, or for a possible next one.
    """
    settings = profile.settings
    shown = spaces if spaces is not None else _present(moment)
    lines = [line for line in (scene.about, moment.caption) if line]
    on = sheet(scene.room.bounds, scene.name, lines)
    draw_room(on, scene.room)
    draw_objects(on, scene.objects)
    draw_inflations(on, scene.room, levels(environment.navigation))
    draw_tracked_area(on, scene.room)
    user, robot = moment.user, moment.robot
    if user is not None:
        keep_off = environment.navigation.named("haptic" if moment.deep else "chase").user_radius
        draw_user(on, user, keep_off)
        draw_trail(on, moment.user_trail, USER)
        if "chase" in shown:
            draw_chase(on, environment, settings, user)
        if "escape" in shown:
            draw_zones(on, user, settings.escape)
            now = situation_at(moment, user, environment, settings)
            draw_escape(on, now, moment.joints, profile.policy)
        if "haptic" in shown:
            deep = moment.deep or next_deep(settings, moment)
            draw_haptic(on, environment, settings, deep, robot)
    draw_trail(on, moment.robot_trail, ROBOT_TRAIL)
    draw_path(on, moment.path)
    if moment.goal is not None:
        draw_goal(on, moment.goal, environment.robot.footprint)
    draw_robot(on, robot, environment.robot.footprint)
    if moment.joints is not None:
        draw_arm(on, robot, moment.joints, arm_outline(environment.robot))
    draw_items(on, scene.items)
    outline = environment.robot.footprint
    draw_places(on, scene.places, Disc(robot.x, robot.y, outline.enclosing_radius))
    return on


def levels(navigation: Navigation) -> list[tuple[float, str]]:
    """Inflations, m, with the subsystems that have them, the widest first."""
    found: dict[float, list[str]] = {}
    for name in ("haptic", "chase", "escape"):
        found.setdefault(navigation.named(name).inflation, []).append(name.capitalize())
    return [(inflation, ", ".join(found[inflation])) for inflation in sorted(found, reverse=True)]


def next_deep(settings: Settings, moment: Moment) -> Pose3:
    """Where the user would reach if they requested a touch now (R132)."""
    assert moment.user is not None, "nobody reaches"
    x, y = moment.user.body.transform(settings.haptic.deep_ahead, 0.0)
    return Pose3.from_yaw(x, y, settings.haptic.deep_height, moment.user.body.yaw)


def _present(moment: Moment) -> tuple[str, ...]:
    return ("haptic",) if moment.deep is not None else ("chase", "escape")
