"""The arm as data: chain, limits, capsules, mount and tool.

Frames (metres, radians, right-handed):

* `rover`: `base_link` of the rover projected to the floor, x ahead, z up.
* `base`: the start of the arm's chain. It is the `base` of the UR controller, turned by pi about z
  from the ROS `base_link` of the arm; `mount` is rover_from_base.
* link 1 ... link 6: each turns with its joint about its own z; link 6 is ROS `tool0`.
* `tcp`: the prop's own frame, equal to the DEEP when the prop is presented: x points from the
  person into the touched surface (against the flange's z), z is up.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from hw.model import LINKS, ArmShape, Capsule, ChassisBox, Dh, LinkMass, Placement, Prop, Six, six

__all__ = ["LINKS", "Dh", "Manipulator", "six"]


@dataclass(frozen=True, slots=True)
class Manipulator:
    """A UR-like arm on its rover with its tool; speeds in rad/s, shoulder first.

    `placements` is the calibrated chain, None for the nominal one. `apart` names pairs of links or
    parts that cannot touch at any joint angles; neighbours are never checked. `masses` and
    `max_torque` (Nm) are for the dynamics.
    """

    name: str
    joints: tuple[str, ...]
    dh: Dh
    lower: Six
    upper: Six
    max_speed: Six
    max_torque: Six
    mount: Placement
    capsules: tuple[Capsule, ...]
    apart: tuple[tuple[str, str], ...]
    masses: tuple[LinkMass, ...]
    body: tuple[ChassisBox, ...]
    tool: Prop
    placements: tuple[Placement, ...] | None = None

    @classmethod
    def of(
        cls, shape: ArmShape, mount: Placement, body: tuple[ChassisBox, ...], tool: Prop
    ) -> Manipulator:
        """An arm at rover_from_base on a rover with this body."""
        return cls(
            name=shape.name,
            joints=shape.joints,
            dh=shape.dh,
            lower=shape.lower,
            upper=shape.upper,
            max_speed=shape.max_speed,
            max_torque=shape.max_torque,
            mount=mount,
            capsules=shape.capsules,
            apart=shape.apart,
            masses=shape.masses,
            body=body,
            tool=tool,
        )

    def with_tool(self, tool: Prop) -> Manipulator:
        """The same arm with another end effector."""
        return replace(self, tool=tool)

    def calibrated(self, placements: tuple[Placement, ...] | None) -> Manipulator:
        """The same arm with the calibrated chain of one robot, or with the nominal one (None)."""
        return replace(self, placements=placements)
