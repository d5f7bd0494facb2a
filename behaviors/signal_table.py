"""All signals that the charts of CoboDeck read, and the types that charts may name."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from functools import partial
from typing import TYPE_CHECKING, Any

from behaviors.escape import danger, escape_poses
from behaviors.profile import Settings
from engine import Angle, Length, Type
from engine.signals import Derived, Estimated, Measured, Signal
from hw import (
    ArmState,
    BumperHit,
    GripperState,
    ImuReading,
    Odometry,
    Pose2,
    Pose3,
    PoseSigma,
    Scan,
    TrackerPose,
    Twist2,
    UserPose,
    WrenchReading,
    wrap,
)
from states import SUBSYSTEMS, SubsystemName
from states.environment import Environment
from states.localization import (
    SENSED,
    LocalizationEstimator,
    Localizes,
    PoseEstimate,
    PoseOf,
    SigmaOf,
)
from states.localization.frames import FramesEstimator
from states.signals import StillnessEstimator, VelocityEstimator

if TYPE_CHECKING:
    from behaviors.escape import EscapeCandidates
    from states.navigation import GlobalPlanner
    from states.navigation.grid import Costmaps

OBSTACLES = "floor.obstacles"
TYPES = {
    kind.__name__: Type(kind.__name__, python=kind)
    for kind in (Pose2, Pose3, UserPose, Twist2, ArmState, GripperState, WrenchReading)
}

DANGER = ("escape.planner", "user.pose", "base.pose", "user.velocity", "base.twist")
"""Inputs that decide whether the user is about to walk into the robot."""

ESTIMATE = "base.localization"
"""Signal with the estimate that `base.pose` and `base.pose_sigma` come from if not measured."""

_STEP = "at each step of the simulation; of a robot, whenever its driver hears of it"
_ELSE = "where it does not measure it, it is estimated of all other sensors"
_CHANGE = "at the start, and on change"

MEASURED = (
    Measured("environment", Environment, constant=True, comes="once, at the start",
             about="room, robot and limits"),
    Measured("settings", Settings, constant=True, comes="once, at the start",
             about="values of the behaviours"),
    Measured("base.pose", Pose2, part="base", comes=f"{_STEP}; {_ELSE}",
             about="where the robot is: map_from_base"),
    Measured("base.twist", Twist2, part="base", comes=_STEP,
             about="velocity in the base frame"),
    Measured("base.mode", str, part="base", comes=_CHANGE,
             about="how the wheels are driven: omni or differential"),
    Measured("base.refusal", str, part="base", comes=_CHANGE,
             about="why a base that is to drive does not, none while it may"),
    Measured("base.admitted", Twist2, part="base", comes=_CHANGE,
             about="what the safety chain leaves of a velocity it cuts"),
    Measured("base.scan", Scan, part="lidar", comes="once per turn of each scanner",
             about="one turn of a scanner, in its own frame"),
    Measured("base.odometry", Odometry, part="odometry",
             comes="or by a base that counts itself, at the rate of the wheels",
             about="what the wheels say: odom_from_base"),
    Measured("base.imu", ImuReading, part="imu", comes="at the rate of the sensor",
             about="rates of turn and accelerations, in the base frame"),
    Measured("rover.tracker", TrackerPose, part="rover_trackers",
             comes="for each tracker, while it is tracked",
             about="a tracker on the rover: vive_from_tracker"),
    Measured("arm.joints", ArmState, part="arm", comes=_STEP,
             about="angles and velocities of the joints, and whether the arm moves"),
    Measured("gripper.state", GripperState, part="gripper", comes=_STEP,
             about="how far the fingers are open, what they do"),
    Measured("wrench.reading", WrenchReading, part="wrench", comes=_STEP,
             about="force and torque on the flange, in its frame"),
    Measured("user.pose", UserPose, part="trackers", comes="while the user is tracked",
             about="tracked pose of the user, none while it is lost"),
    Measured("vr.haptic_request", Pose3, part="vr", comes=_CHANGE,
             about="where the user reaches, while they do"),
    Measured("vr.release", bool, event=True, part="vr", comes="when it happens",
             about="the user lets go of a request"),
    Measured("vr.restart", bool, event=True, part="vr", comes="when it happens",
             about="the user, shown the robot, has stood still and is ready"),
    Measured("bumper.hit", BumperHit, event=True, part="bumper", comes="when it happens",
             about="the foam was touched"),
    Measured("stop.engaged", str, part="stop_line", comes=_CHANGE,
             about="why the stop line is pulled, none while it is not"),
    Measured("operator.acknowledge", bool, event=True, part="operator", comes="when it happens",
             about="the operator has acknowledged a fault"),
)  # fmt: skip


def signals(
    environment: Environment,
    settings: Settings,
    localizer: Callable[[], Localizes] | None = None,
    *,
    scanning: bool = True,
) -> tuple[Signal, ...]:
    """All signals; only those that are read are computed.

    `localizer` makes a new localizer; if given, `base.pose` is estimated from the base's sensors.
    `scanning`: whether there is a source of `base.scan`.
    """
    user = settings.user
    return (
        *(measured() if localizer is None else localized(localizer)),
        *planning(environment, scanning, "base.pose" if localizer is None else ESTIMATE),
        Estimated(
            "transforms", ("base.pose", "user.pose"),
            partial(FramesEstimator, environment.robot, environment.tracking), needs=(),
            about="all frames of robot, sensors, person and tracking, with ten seconds of history",
        ),
        Estimated(
            "user.velocity", ("user.pose",), partial(VelocityEstimator, user.window), Twist2,
            about="in the map, by least squares; turn of the body as wz",
        ),
        Estimated(
            "user.still_since", ("user.velocity",),
            partial(StillnessEstimator, user.still_speed, user.still_turn), int,
            about="since when the user has stood still, ns; none while they move",
        ),
        Estimated(
            "user.stands_since", ("user.velocity",),
            partial(StillnessEstimator, user.still_speed, math.inf), int,
            about="since when the user has stood, turning or not, ns; none while they walk",
        ),
        *_decisions(environment, settings),
    )  # fmt: skip


def _decisions(environment: Environment, settings: Settings) -> tuple[Signal, ...]:
    """The signals that CoboDeck's own decisions are based on: zones, poses and spaces."""
    return (
        Derived("user.distance", ("user.pose", "base.pose"), _distance, Length,
                about="from the user's body to the robot's centre"),
        Derived("user.gaze", ("user.pose", "base.pose"), _gaze, Angle,
                about="from where the user looks to the robot's centre; 0: they look at it"),
        Derived(
            "escape.required", DANGER,
            partial(danger.is_required, environment, settings), bool,
            about="the user is about to walk into the robot, or to catch it wherever it drives",
        ),
        Derived(
            "escape.safe", DANGER,
            partial(danger.is_safe, environment, settings), bool,
            about="the danger is over, with hysteresis",
        ),
        Derived(
            "escape.poses", ("escape.planner", "user.pose", "base.pose"),
            partial(escape_poses.poses, settings), tuple[Pose2, ...],
            about="the free Escape poses, in order",
        ),
        Derived(
            "escape.candidates", _candidates_of(environment),
            partial(_candidates, environment, settings), object,
            about="the free Escape poses, with what is predicted for the drive to each of them",
        ),
    )  # fmt: skip


def measured() -> tuple[Signal, ...]:
    """All signals that parts measure; the base measures its own pose."""
    about = "how sure base.pose is"
    return (*MEASURED, Derived("base.pose_sigma", ("environment",), _sigma, PoseSigma, about=about))


def localized(localizer: Callable[[], Localizes]) -> tuple[Signal, ...]:
    """All signals that parts measure, and the base's pose estimated from them."""
    others = (signal for signal in MEASURED if signal.name != "base.pose")
    return (
        *others,
        Estimated(
            ESTIMATE, SENSED, lambda: LocalizationEstimator(localizer()), PoseEstimate,
            needs=("base.odometry",), about="where the base is by all that it senses, how sure",
        ),
        Estimated("base.pose", (ESTIMATE,), PoseOf, Pose2, about="map_from_base, an estimate"),
        Estimated(
            "base.pose_sigma", (ESTIMATE,), SigmaOf, PoseSigma, about="how sure base.pose is"
        ),
    )  # fmt: skip


def planning(
    environment: Environment, scanning: bool = True, located: str = "base.pose"
) -> tuple[Signal, ...]:
    """Scanned obstacles, and each subsystem's costmaps and planner, which take them into account.

    Without `scanning`, planners use the map or room alone. `located` names the signal with the
    base's pose.
    """
    sensed = (located, "user.pose", "base.scan")
    obstacles = Estimated(
        OBSTACLES, sensed, environment.obstacle_estimator, needs=(),
        about="what scanners have shown about the robot and no map does",
    )  # fmt: skip
    planners = (signal for name in SUBSYSTEMS for signal in _planning(environment, name, scanning))
    return (obstacles, *planners) if scanning else tuple(planners)


def _planning(environment: Environment, name: SubsystemName, scanning: bool) -> Iterator[Signal]:
    kind, about = environment.navigation.named(name).planner, "finds paths for the robot's centre"
    if not scanning:
        yield Derived(f"{name}.planner", ("environment",), partial(_static, name), about=about)
    elif kind == "exact":
        among = partial(environment.planner_among, name)
        yield Derived(f"{name}.planner", (OBSTACLES,), among, about=about)
    else:
        yield Derived(
            f"{name}.costmap", (OBSTACLES,), partial(environment.costmaps_among, name),
            about="what it costs to be where, by the map and by what scanners have shown",
        )  # fmt: skip
        on_cells = partial(_on_cells, kind)
        yield Derived(f"{name}.planner", (f"{name}.costmap",), on_cells, about=about)


def _static(name: SubsystemName, environment: Environment) -> GlobalPlanner:
    return environment.static_planners[name]


def _on_cells(kind: str, costmaps: Costmaps) -> GlobalPlanner:
    return costmaps.planner(kind)


def _sigma(environment: Environment) -> PoseSigma:
    return environment.pose_sigma


def _distance(user: UserPose, base: Pose2) -> float:
    return user.body.distance_to(base)


def _candidates_of(environment: Environment) -> tuple[str, ...]:
    """The inputs of the candidates: the arm's joints, too, of a robot that has an arm."""
    arm = () if environment.robot.arm is None else ("arm.joints",)
    return ("escape.poses", *DANGER, *arm)


def _candidates(*seen: Any) -> EscapeCandidates:
    from behaviors.escape import seen_candidates

    return seen_candidates(*seen)


def _gaze(user: UserPose, base: Pose2) -> float:
    return abs(wrap(user.body.yaw + user.body.bearing_to(base) - user.head_yaw))
