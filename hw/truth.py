"""Ground truth at one instant, for evaluators, pictures and records.

Plain values only: written as JSON and read back they are equal.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, NamedTuple

from hw.geometry import Pose2, Pose3
from hw.samples import Joints

BASE = "base"
"""The part of a contact that is the rover's footprint; all others are parts of the arm."""
USER = "user"
"""The person with the headset; the others are objects of the scene."""
BASE_CLOSING, ARM_CLOSING = 0.05, 0.25
"""A contact counts as caused by base or arm above this closing speed, m/s."""

By = Literal["robot", "slow_arm", "person"]


@dataclass(frozen=True, slots=True)
class Contact:
    """A touch of robot and a person; one touch is one contact, however long it lasts.

    Attributes:
        at_ns: when it began, ns since the start of the run.
        x: place of the touch in the map, m; y likewise.
        part: `base`, or the link of the arm (the first is `arm_base`), or the prop.
        robot_closing: speed of the touching point towards the person, along the contact normal,
            m/s; negative: moving away. `person_closing` is that of the person towards the robot.
        granted: True if the person had requested a touch.
        who: `user`, or `person_N`: number N among the objects of the scene.
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
        """Who caused it: the robot if it closed in, else the person; slow arms count separately."""
        closing = self.robot_closing
        if self.part == BASE:
            return "robot" if closing > BASE_CLOSING else "person"
        if closing > ARM_CLOSING:
            return "robot"
        return "slow_arm" if closing > BASE_CLOSING else "person"


@dataclass(frozen=True, slots=True)
class Hit:
    """A wall or thing that held the robot: one hit, however often it tries again from there.

    Attributes:
        at_ns: first touch, ns since the start of the run; `until_ns`: the last one.
        what: `wall`, or the name of an object, such as `chair_1`.
        x: place of what was hit in the map, m; y likewise: the middle of a thing, the nearest
            point of a wall.
        count: touches so far.
    """

    at_ns: int
    until_ns: int
    what: str
    x: float
    y: float
    count: int = 1


class Truth(NamedTuple):
    """A snapshot; None for what does not exist or is not known.

    Attributes:
        base: map_from_base.
        joints: of the arm, rad.
        arm_moving: True while the arm moves.
        body: pose of the person's body in the map.
        speed: of the person over the floor, m/s.
        request: the DEEP in the map while the person requests a touch.
        seen_ns: stamp of the newest measured `user.pose`.
        head_turn: from the body to the direction of view, as last measured, rad.
        informed: True while the robot is shown to the person.
        distance_m: path length of the base so far; `energy_j` the energy spent on it.
        wall_hits: touches of robot and room so far; `object_hits` those of chairs and the like.
        min_gap: least gap between footprint and person so far, m; 0 or less if they touched.
        contacts: of the rover's footprint and people so far, in order.
        others: poses of people besides the user, in the map, by name.
        hits: walls and things that have held the robot, in order.
        tracked_since_ns: stamp from which on `user.pose` has come in every step up to `seen_ns`;
            None where that is not known.
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
    hits: tuple[Hit, ...] | None = None
    tracked_since_ns: int | None = None
