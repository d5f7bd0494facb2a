"""The signals that states read, each with the type of its values; see `engine.state.Key`.

A state names them in `reads` and asks for them by `ctx.value`; CoboDeck's own stand in
`behaviors/situation/keys.py`.
"""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Protocol, TypeVar

from engine import Key
from hw import (
    ArmState,
    DriveMode,
    GripperState,
    Pose2,
    Pose3,
    PoseSigma,
    Twist2,
    UserPose,
    WrenchReading,
)

if TYPE_CHECKING:
    from states.environment.environment import Environment
    from states.navigation import GlobalPlanner
    from states.subsystems import SubsystemName

V = TypeVar("V")

ENVIRONMENT: Key[Environment] = Key("environment")
BASE_POSE: Key[Pose2] = Key("base.pose")
BASE_POSE_SIGMA: Key[PoseSigma] = Key("base.pose_sigma")
BASE_TWIST: Key[Twist2] = Key("base.twist")
BASE_MODE: Key[DriveMode] = Key("base.mode")
BASE_REFUSAL: Key[str] = Key("base.refusal")
BASE_ADMITTED: Key[Twist2] = Key("base.admitted")
ARM_JOINTS: Key[ArmState] = Key("arm.joints")
GRIPPER_STATE: Key[GripperState] = Key("gripper.state")
WRENCH_READING: Key[WrenchReading] = Key("wrench.reading")
USER_POSE: Key[UserPose] = Key("user.pose")
USER_VELOCITY: Key[Twist2] = Key("user.velocity")
USER_STILL_SINCE: Key[int] = Key("user.still_since")
USER_STANDS_SINCE: Key[int] = Key("user.stands_since")
HAPTIC_REQUEST: Key[Pose3] = Key("vr.haptic_request")
RELEASE: Key[bool] = Key("vr.release")
RESTART: Key[bool] = Key("vr.restart")
STOP_ENGAGED: Key[str] = Key("stop.engaged")
ACKNOWLEDGE: Key[bool] = Key("operator.acknowledge")


class SignalReader(Protocol):
    """The part of a state's context that reads levels."""

    def value(self, signal: Key[V], /) -> V | None:
        """The newest value; None if there is none or it is older than the state accepts."""
        ...

    def age(self, signal: str, /) -> float:
        """Age of the newest value, s; infinite if there is none."""
        ...


@cache
def planner_key(subsystem: SubsystemName) -> Key[GlobalPlanner]:
    """The global planner of a subsystem, with the obstacles that scans have shown."""
    return Key(f"{subsystem}.planner")


def environment_of(ctx: SignalReader) -> Environment:
    """The environment of the run, a constant that is there before the first tick."""
    found = ctx.value(ENVIRONMENT)
    assert found is not None
    return found
