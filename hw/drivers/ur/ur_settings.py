"""Settings of a UR arm and of its worker process."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from hw.ipc import Door
from hw.model import ArmModel, RobotModel


def ur_arm_of(body: RobotModel) -> ArmModel:
    """The UR arm of a robot, which alone the drivers of this folder speak to.

    Raises:
        ValueError: it has no arm, or one of another maker; with what would be right.
    """
    own = "take the entry out of the connection, or give a driver of your own as module:Class"
    if body.arm is None:
        raise ValueError(f"{body.name} has no arm, and this is the driver of a UR arm: {own}")
    if body.arm.model.dh is None:
        arm = body.arm.model.name
        raise ValueError(f"{body.name} has the arm {arm}, and this driver speaks to UR arms: {own}")
    return body.arm


SERVO = {"lookahead": (0.03, 0.2), "gain": (100.0, 2000.0)}
"""What the controller takes: s, and a factor."""


@dataclass(frozen=True, slots=True)
class Servo:
    """How the controller follows set-points: `lookahead` s ahead, which smooths, with this `gain`.

    An arm that is jerky or hums wants a longer lookahead (0.1) and a smaller gain (300); one that
    lags behind, or overshoots slowly, the contrary.
    """

    lookahead: float = 0.03
    gain: float = 500.0

    @classmethod
    def of(cls, entry: Mapping[str, Any]) -> Servo:
        """From a connection file.

        Raises:
            ValueError: an invalid entry, with what would be right.
        """
        if strange := sorted(set(entry) - set(SERVO)):
            raise ValueError(f"servo: {strange[0]!r} is not known; there are {', '.join(SERVO)}")
        for name, value in entry.items():
            least, most = SERVO[name]
            if not isinstance(value, int | float) or not least <= value <= most:
                raise ValueError(f"servo: {name}: {value!r}: {least:g} to {most:g}")
        return cls(**entry)


@dataclass(frozen=True)
class WorkerSettings:
    """The worker's settings; `course` is the number of the newest trajectory before it.

    `tells` are the doors to engine and chain; `acknowledged`: the operator has allowed the arm
    to move again. `mass` (kg) and `center` (m, flange frame) are its payload.
    """

    host: str
    tells: tuple[Door, ...]
    model: ArmModel
    mass: float
    center: tuple[float, float, float]
    course: int = 0
    acknowledged: bool = False
    servo: Servo = Servo()
