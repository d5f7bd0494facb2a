"""All signals that the charts of CoboDeck read, and the types that charts may name."""

from __future__ import annotations

from functools import cache, partial
from typing import TYPE_CHECKING

from behaviors import chase, escape, haptic
from behaviors.settings import Settings
from engine.signals import Derived, Estimated, Measured, Signal
from engine.types import Type
from hw.geometry import Pose2, Pose3, Twist2
from hw.samples import ArmState, BumperHit, UserPose
from states.signals.motion import StillnessEstimator, VelocityEstimator
from states.site import Site

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

TYPES = {kind.__name__: Type(kind.__name__, python=kind) for kind in (Pose2, Pose3, UserPose)}

MEASURED = (
    Measured("site", Site, constant=True, about="room, robot and limits"),
    Measured("settings", Settings, constant=True, about="values of the behaviours"),
    Measured("base.pose", Pose2, about="map_from_base"),
    Measured("base.twist", Twist2, about="velocity in the base frame"),
    Measured("base.mode", str, about="how the wheels are driven: omni or differential"),
    Measured("base.refusal", str, about="why a base that is to drive does not, none while it may"),
    Measured("arm.joints", ArmState),
    Measured("user.pose", UserPose, about="tracked pose of the user, none while it is lost"),
    Measured("vr.haptic_request", Pose3, about="where the user reaches, while they do"),
    Measured("vr.release", bool, event=True),
    Measured("vr.restart", bool, event=True),
    Measured("bumper.hit", BumperHit, event=True),
    Measured("stop.engaged", str, about="why the stop line is pulled, none while it is not"),
    Measured("operator.acknowledge", bool, event=True),
)


def signals(site: Site, settings: Settings) -> tuple[Signal, ...]:
    """Everything that can be asked for; what nobody asks for is never computed."""
    user = settings.user
    cells = cache(partial(_cells, site, settings))
    return (
        *MEASURED,
        Estimated(
            "user.velocity", ("user.pose",), partial(VelocityEstimator, user.window), Twist2,
            about="in the map, by least squares; turn of the body as wz",
        ),
        Estimated(
            "user.still", ("user.velocity",),
            partial(StillnessEstimator, user.still_speed, user.still_turn), float,
            about="for how long the user has stood still, s",
        ),
        Derived("user.distance", ("user.pose", "base.pose"), _distance, float,
                about="from the user's body to the robot's centre, m"),
        Derived(
            "escape.required", ("user.pose", "base.pose", "user.velocity"),
            partial(escape.is_required, site, settings), bool,
            about="the user is in an Escape zone and moves, or will be before the robot is away",
        ),
        Derived(
            "escape.safe", ("user.pose", "base.pose", "user.velocity"),
            partial(escape.is_safe, site, settings), bool,
            about="both zones are clear, with hysteresis",
        ),
        Derived(
            "escape.poses", ("user.pose", "base.pose"),
            partial(escape.poses, site, settings), tuple,
            about="the free Escape poses, in order",
        ),
        Derived(
            "chase.space", ("user.pose",),
            partial(chase.space, site, settings, cells), chase.ChaseSpace,
            about="the cells about the user, best first",
        ),
        Derived(
            "haptic.poses", ("vr.haptic_request",), partial(haptic.poses, site, settings), tuple,
            about="the free Haptic rover poses, in order",
        ),
    )  # fmt: skip


def _distance(user: UserPose, base: Pose2) -> float:
    return user.body.distance_to(base)


def _cells(site: Site, settings: Settings) -> NDArray[np.float64]:
    from behaviors.chase_space import grid

    return grid(site, settings)
