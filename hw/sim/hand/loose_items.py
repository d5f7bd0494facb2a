"""Items that the simulated fingers can pick up, and what they and surfaces press on the tool.

Fingers that close around an item within `TOLERANCE` of the tool hold it: it moves with the tool,
and its weight shows in the sensor. Let go it falls at once, upright, on the surface below. Items
are touched by nothing else. A tool, or a held item, that is pushed into a surface presses on the
sensor by `STIFFNESS`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from hw.geometry import Pose2, Pose3
from hw.model import ArmModel, FlangeChain, Prop
from hw.samples import GripperState, Joints, WrenchReading
from hw.scene import Graspable, surface_under
from hw.sim.hand.tool import NO_LOAD, Hand

TOLERANCE = 0.02
"""Largest distance of an item's centre from the tool at which fingers close around it, m."""
STIFFNESS = 5000.0
"""Of a surface and what is pushed into it, N/m."""
GRAVITY = 9.81
"""m/s2."""

Vector = tuple[float, float, float]


class LooseItems:
    """The items of a scene and the hand that may hold one of them; `places` are their centres."""

    def __init__(self, items: Sequence[Graspable], arm: ArmModel, prop: Prop, hand: Hand) -> None:
        self.places: dict[str, Vector] = {item.name: item.at for item in items}
        self.held: Graspable | None = None
        self._items, self._hand, self._flange = tuple(items), hand, FlangeChain(arm)
        self._tip = prop.tcp.pose()
        self._grip: Vector = (0.0, 0.0, 0.0)
        self._within: Graspable | None = None
        self._load = NO_LOAD
        self._seen: tuple[object, ...] = ()

    def step(self, base: Pose2, joints: Joints) -> None:
        """Take the motion of base (map_from_base), arm (rad) and fingers since the last step."""
        gripper = self._hand.gripper
        fingers = None if gripper is None else gripper.state
        seen = (base, joints, fingers)
        if len(self._seen) == 3 and all(a is b for a, b in zip(seen, self._seen, strict=True)):
            return
        self._seen = seen
        flange = base.upright() @ self._flange.on_rover(joints)
        tool = flange @ self._tip
        if fingers is not None:
            self._grasp(tool, fingers)
        self._press(flange, tool)

    def _grasp(self, tool: Pose3, fingers: GripperState) -> None:
        """Take hold of what the fingers have closed around, carry it, or let it go."""
        if self.held is not None and not fingers.holding:
            self._fall(self.held)
            self.held = None
        elif self.held is None and fingers.holding and self._within is not None:
            self.held = self._within
            self._grip = tool.inverse().transform(*self.places[self.held.name])
        if self.held is not None:
            self.places[self.held.name] = tool.transform(*self._grip)
        elif not fingers.holding:  # else it is the prop's own
            gripper = self._hand.gripper
            assert gripper is not None
            self._within = self._between(tool, fingers.opening)
            gripper.between = None if self._within is None else self._within.width

    def _between(self, tool: Pose3, opening: float) -> Graspable | None:
        """The item nearest to the tool that is between fingers so far apart, if there is one."""
        here = (tool.x, tool.y, tool.z)
        away = {item: math.dist(self.places[item.name], here) for item in self._items}
        near = [i for i in self._items if away[i] <= TOLERANCE and i.width <= opening]
        return min(near, key=away.__getitem__, default=None)

    def _fall(self, item: Graspable) -> None:
        x, y, z = self.places[item.name]
        under = surface_under(self._items, x, y, z - item.half_height)
        self.places[item.name] = (x, y, under + item.half_height)

    def _press(self, flange: Pose3, tool: Pose3) -> None:
        """Weight of the held item, and the surface under it or under the tool."""
        wrench, held, load = self._hand.wrench, self.held, NO_LOAD
        if wrench is None:
            return
        x, y, z = (tool.x, tool.y, tool.z) if held is None else self.places[held.name]
        low = z if held is None else z - held.half_height
        depth = max(0.0, surface_under(self._items, x, y, low) - low)
        upwards = STIFFNESS * depth - (0.0 if held is None else GRAVITY * held.mass)
        if upwards != 0.0:
            load = _on_flange(flange, upwards, (x, y, z))
        if load != self._load:
            self._load = load
            wrench.press(load)


def _on_flange(flange: Pose3, upwards: float, at: Vector) -> WrenchReading:
    """A vertical force, N, at a point of the map, as force and torque in the flange's frame."""
    seen = flange.inverse()
    x, y, z = seen.transform(*at)
    ahead = seen.transform(at[0], at[1], at[2] + 1.0)
    fx, fy, fz = (upwards * (b - a) for a, b in zip((x, y, z), ahead, strict=True))
    return WrenchReading((fx, fy, fz), (y * fz - z * fy, z * fx - x * fz, x * fy - y * fx))
