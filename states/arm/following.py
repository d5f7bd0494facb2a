"""What the arm's states ask while a trajectory is followed, and the numbers they go by."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

from hw import ARM_MOVES, ArmState, Joints, Pose3

if TYPE_CHECKING:
    from states.arm.arm_situation import ArmSituation

SLICES = 4
"""Slices of planning per tick, some 2 ms each."""
MOVED, TURNED = 0.01, 0.01
"""Motion of base or user, m and rad, from which the running trajectory is checked again."""
CORRECTIONS = 3
"""Corrections at the DEEP at most."""
LATE_S = 0.5
"""Grace period after the planned end of a move before it counts as failed, s."""
SLOWEST = 0.05
"""Least share of its speed for which the end of a move is put off; a slower arm fails."""

Frame = Literal["map", "rover", "user"]
"""Frames in which a DEEP may be given."""


def stopped(state: ArmState) -> str | None:
    """Why the arm's own safety system forbids motion; None if it does not."""
    return None if state.mode in ARM_MOVES else f"the arm: {state.mode.replace('_', ' ')}"


def refusal_of(state: ArmState | None, number: int | None) -> str | None:
    """Why the arm does not follow the trajectory of this number; None if it does."""
    if state is None:
        return None
    if number is not None and state.course == number and state.refused is not None:
        return state.refused
    return stopped(state)


def is_at(state: ArmState | None, joints: Joints, tolerance: float) -> bool:
    """True if the arm stands still at these angles."""
    if state is None or state.moving:
        return False
    pairs = zip(state.joints, joints, strict=True)
    return all(abs(angle - wanted) <= tolerance for angle, wanted in pairs)


def in_map(situation: ArmSituation, deep: Pose3, frame: Frame) -> Pose3 | None:
    """map_from_deep of a DEEP in one of the frames; None if that frame is unknown (R84)."""
    if frame == "map":
        return deep
    here = situation.base if frame == "rover" else situation.user
    return None if here is None else here.upright() @ deep
