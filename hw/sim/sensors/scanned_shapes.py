"""The shapes that sensors see: the walls of the room, and standing or walking bodies."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from hw.scene import Body, Room

_GRID_NS = 20_000_000


class Shapes:
    """Walls and bodies as arrays for the kernels."""

    def __init__(self, room: Room | None, bodies: Sequence[Body] = ()) -> None:
        walls = () if room is None else room.segments
        self.segments = np.array(walls, dtype=float).reshape(-1, 4)
        self._bodies = tuple(bodies)
        self._looked, self._cylinders = -1, np.empty((0, 4))

    def discs(self, start_ns: int, end_ns: int) -> NDArray[np.float64]:
        """(n, 5): x, y at the start, x, y at the end, radius, of all bodies in between.

        They are assumed to move straight: at an acceleration a of 3 m/s2 they are off by at most
        a t^2 / 8 = 1.4 mm in t = 60 ms.
        """
        found = []
        for body in self._bodies:
            start, end = body.at(start_ns), body.at(end_ns)
            if start is not None or end is not None:
                found.append((*(start or end or ()), *(end or start or ()), body.radius))
        return np.array(found, dtype=float).reshape(-1, 5)

    def cylinders(self, time_ns: int) -> NDArray[np.float64]:
        """(n, 4): x, y, radius, height of all bodies, on a time grid of 20 ms."""
        time_ns -= time_ns % _GRID_NS
        if time_ns != self._looked:
            there = ((body, body.at(time_ns)) for body in self._bodies)
            found = [(*at, body.radius, body.height) for body, at in there if at is not None]
            self._looked = time_ns
            self._cylinders = np.array(found, dtype=float).reshape(-1, 4)
        return self._cylinders
