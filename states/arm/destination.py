"""Where the arm is to go."""

from __future__ import annotations

from dataclasses import dataclass

from hw import Joints, Pose2, Pose3


@dataclass(frozen=True, slots=True)
class Destination:
    """The tool to `pose`, or else the joints to `joints`, rad; without both the arm folds.

    The pose is in the map or, `on_rover`, in the frame of the rover. It is a DEEP if the tool
    `meets` a hand there: then the arm comes along its axis, and may come near the person.
    """

    pose: Pose3 | None = None
    joints: Joints | None = None
    on_rover: bool = False
    meets: bool = False

    @property
    def name(self) -> str:
        """What a person calls it."""
        return "the DEEP" if self.meets else "the goal"

    @property
    def deep(self) -> Pose3 | None:
        """map_from_deep, if it is a DEEP."""
        return self.pose if self.meets else None

    @property
    def folds(self) -> bool:
        """True if the arm folds, which it does out of a contact, too."""
        return self.pose is None and self.joints is None

    @property
    def stays(self) -> bool:
        """True for a pose that stays in the map if the base moves."""
        return self.pose is not None and not self.on_rover

    def tool(self, base: Pose2) -> Pose3:
        """map_from_tcp of a pose, seen from a base at map_from_rover."""
        assert self.pose is not None  # not for joints
        return base.upright() @ self.pose if self.on_rover else self.pose


FOLDED = Destination()
