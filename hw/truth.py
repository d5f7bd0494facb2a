"""Where everything truly is at one instant, as evaluators, pictures and records go by it.

Plain values only: written as JSON and read back they are the same.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, NamedTuple

from hw.geometry import Pose2, Pose3
from hw.samples import Joints

BASE = "base"
"""The part of a contact that is the outline of the rover; all others are parts of the arm."""
USER = "user"
"""Who wears the headset; the others are objects of the scene."""
BASE_CLOSING, ARM_CLOSING = 0.05, 0.25
"""What of a robot closes in faster than this has caused a contact, m/s: its base, its arm."""

By = Literal["robot", "slow_arm", "person"]


@dataclass(frozen=True, slots=True)
class Contact:
    """A touch of robot and anybody; one touch is one contact, for as long as it lasts.

    Attributes:
        at_ns: when it began, since the start of the run.
        x: where they touched, in the map, m; y likewise.
        part: `base`, or the link of the arm (the first is `arm_base`), or what the arm holds.
        robot_closing: speed of the touching point towards the person, along the normal of the
            contact, m/s; below 0 it went away. `person_closing` is that of the person to the robot.
        granted: had the person asked for a touch?
        who: the user, or `person_1`: by its number, the second object of the scene.
    """

    at_ns: int
    x: float
    y: float
    part: str
    robot_closing: float
    person_closing: float
    granted: bool
    who: str = USER

    @property
    def by(self) -> By:
        """Whose doing it was: a robot's that closed in, else the person's; slow arms apart."""
        closing = self.robot_closing
        if self.part == BASE:
            return "robot" if closing > BASE_CLOSING else "person"
        if closing > ARM_CLOSING:
            return "robot"
        return "slow_arm" if closing > BASE_CLOSING else "person"


class Truth(NamedTuple):
    """A snapshot; None is what is not there, or what nobody knows.

    Attributes:
        base: map_from_base.
        joints: of the arm, rad.
        arm_moving: is a move of the arm under way?
        body: the person's, in the map.
        speed: of the person over the floor, m/s.
        request: the DEEP in the map while the person asks for a touch.
        seen_ns: stamp of the newest `user.pose` that tracking had.
        head_turn: from the body to the direction of view, as tracking had it last, rad.
        informed: is the robot shown to the person?
        distance_m: the way of the base so far; `energy_j` what it has spent on it.
        wall_hits: touches of robot and room so far; `object_hits` those of chairs and the like.
        min_gap: least free space between outline and person so far, m; at most 0: they touched.
        contacts: of the rover's outline and anybody so far, in order.
        others: where people besides the user are, in the map, by their names.
    """

    base: Pose2 | None = None
    joints: Joints | None = None
    arm_moving: bool = False
    body: Pose2 | None = None
    speed: float = 0.0
    request: Pose3 | None = None
    seen_ns: int | None = None
    head_turn: float = 0.0
    informed: bool | None = None
    distance_m: float | None = None
    energy_j: float | None = None
    wall_hits: int | None = None
    min_gap: float | None = None
    contacts: tuple[Contact, ...] | None = None
    object_hits: int | None = None
    others: tuple[tuple[str, Pose2], ...] = ()
