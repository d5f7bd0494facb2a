"""The slip of a body against its wheels, which turn exactly as commanded (R29, R146)."""

from __future__ import annotations

import math

from hw.geometry import Pose2
from hw.jit import Struct, Structs, compiled, record_type, wrapped
from hw.model import Slip
from hw.safety import PlanarState, Velocity
from hw.sim.sensors import Normals

_LEVER = 0.5
"""Distance that one rad of rotation counts as, m, for the length of floor covered."""
_AHEAD = 64
"""Patches whose spreads are drawn at once; as many again are known ahead of them."""

FLOOR = record_type(
    ("along", "f8"), ("across", "f8"), ("turning", "f8"), ("patchy", "f8"), ("patch", "f8"),
    ("pulling", "f8"), ("braking", "f8"), ("place", "f8", (3,)), ("way", "f8"),
    ("first", "i8"), ("spreads", "f8", (2 * _AHEAD, 3)),
)  # fmt: skip
"""A floor (`hw.model.Slip`), and on it the `place` of the body, map_from_base, and the `way` gone,
m. Patches from `first` on have these `spreads` of the shares lost."""


class SlipperyFloor:
    """Lays a floor under a body, and draws its patches as they are needed."""

    def __init__(self, slip: Slip, seed: int) -> None:
        self._slip, self._normals = slip, Normals(seed, "floor", 3)

    def lay(self, floors: Structs, start: Pose2) -> None:
        """Begin with the body at this pose; `floors` is (1,) of `FLOOR`."""
        for name in ("along", "across", "turning", "patchy", "patch", "pulling", "braking"):
            floors[name] = getattr(self._slip, name)
        floors["place"], floors["first"] = (start.x, start.y, start.yaw), -_AHEAD
        self.draw(floors)

    def draw(self, floors: Structs) -> None:
        """Draw the patches from here on, if there are not enough ahead."""
        if is_drawn(floors):
            return
        first = int(floors["way"][0] / self._slip.patch)
        floors["first"] = first
        floors["spreads"] = [self._normals.row(first + k) for k in range(2 * _AHEAD)]


@compiled
def is_drawn(floors: Structs) -> bool:
    """Whether the patches of a short motion from here are drawn."""
    return suffices(floors[0])


@compiled
def suffices(floor: Struct) -> bool:
    """The same of one floor."""
    found: bool = int(floor.way / floor.patch) - floor.first < _AHEAD
    return found


@compiled
def slide(floor: Struct, yaw: float, before: Velocity, motion: PlanarState) -> float:
    """Move the body by a short motion of the wheels.

    A share of each component is lost (`Slip`); a change of velocity dv adds -lag dv, so that the
    body trails while speeding up and overshoots while braking.

    Args:
        floor: of type `FLOOR`.
        yaw: of the wheels, rad.
        before: their velocity at the start, along the axes of the map.
        motion: of the wheels.

    Returns:
        The path length of the body, m.
    """
    x, y, turn, after = motion
    middle = yaw + 0.5 * turn
    c, s = math.cos(middle), math.sin(middle)
    dx, dy = c * x + s * y, c * y - s * x
    floor.way += math.hypot(dx, dy) + _LEVER * abs(turn)
    patch = floor.spreads[min(int(floor.way / floor.patch) - floor.first, 2 * _AHEAD - 1)]
    u, v = c * before[0] + s * before[1], c * before[1] - s * before[0]
    u2, v2 = c * after[0] + s * after[1], c * after[1] - s * after[0]
    lag = _lag(floor, math.hypot(u, v), math.hypot(u2, v2))
    ahead = dx * (1.0 - floor.along - floor.patchy * patch[0]) - lag * (u2 - u)
    aside = dy * (1.0 - floor.across - floor.patchy * patch[1]) - lag * (v2 - v)
    turned = turn * (1.0 - floor.turning - floor.patchy * patch[2])
    turned -= _lag(floor, abs(before[2]), abs(after[2])) * (after[2] - before[2])
    heading = floor.place[2] + 0.5 * turned
    c, s = math.cos(heading), math.sin(heading)
    floor.place[0] = floor.place[0] + c * ahead - s * aside
    floor.place[1] = floor.place[1] + s * ahead + c * aside
    floor.place[2] = wrapped(floor.place[2] + turned)
    return math.hypot(ahead, aside)


@compiled
def _lag(floor: Struct, before: float, after: float) -> float:
    lag: float = floor.braking if after < before else floor.pulling
    return lag
