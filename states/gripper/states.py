"""States that open and close the gripper, and wait for a force on the tool (R150)."""

from __future__ import annotations

import math
from collections.abc import Generator
from typing import Literal

from engine import NEVER_NS, Action, Context, Monitor, On, Run, Yielded
from engine.files import Duration, Force, Length
from hw import Gripper, GripperState, WrenchReading
from states.environment import GRIPPER_STATE, STOP_ENGAGED, WRENCH_READING

AGE_S = 0.2
"""Greatest age of what gripper and sensor report, s."""
NEAR = 0.002
"""Fingers nearer to the opening they were sent to than this have got there, m."""
STILL_FELT = 0.9
"""Share of the limit from which on a force that was beyond it still counts: it is never quiet."""

Axis = Literal["any", "x", "y", "z"]
"""The whole force, or its component along an axis of the flange."""


class OpenGripper(Action):
    """Open the fingers and let go of what they hold: as wide as they go, or to `opening`.

    `opened` once they are there. `failed`: they stand elsewhere, still hold something, have not
    come to rest after `patience`, or the stop line is pulled.
    """

    outcomes = ("opened", "failed")
    reads = {GRIPPER_STATE: AGE_S, STOP_ENGAGED: None}
    commands = ("gripper",)

    def __init__(self, opening: Length | None = None, patience: Duration = 3.0) -> None:
        self.opening, self.patience = opening, patience

    def run(self, ctx: Context) -> Run:
        fingers = yield from _moved(ctx, self.opening, self.patience)
        if fingers is None:
            return "failed"
        if fingers.holding:
            yield "the fingers still hold something"
            return "failed"
        if self.opening is not None and abs(fingers.opening - self.opening) > NEAR:
            yield f"the fingers stand at {fingers.opening * 1e3:.0f} mm"
            return "failed"
        return "opened"


class CloseGripper(Action):
    """Close the fingers on what is between them: fully, or until they are `opening` apart.

    `holding`: they have closed on something. `empty`: there was nothing between them. `failed`:
    they have not come to rest after `patience`, or the stop line is pulled.
    """

    outcomes = ("holding", "empty", "failed")
    reads = {GRIPPER_STATE: AGE_S, STOP_ENGAGED: None}
    commands = ("gripper",)

    def __init__(self, opening: Length = 0.0, patience: Duration = 3.0) -> None:
        self.opening, self.patience = opening, patience

    def run(self, ctx: Context) -> Run:
        fingers = yield from _moved(ctx, self.opening, self.patience)
        if fingers is None:
            return "failed"
        return "holding" if fingers.holding else "empty"


def _moved(
    ctx: Context, opening: float | None, patience: float
) -> Generator[Yielded, None, GripperState | None]:
    """The fingers once they rest after being sent to this opening; None if they cannot."""
    gripper: Gripper = ctx.part("gripper")
    gripper.open_to(opening)
    sent, until = ctx.now, ctx.after(patience)
    try:
        while ctx.value(STOP_ENGAGED) is None:
            seen = ctx.sample(GRIPPER_STATE)
            if seen is not None and seen.stamp > sent and not seen.value.moving:
                return seen.value
            if ctx.now >= until:
                yield f"the fingers have not come to rest within {patience:g} s"
                return None
            yield None  # a state that only repeats is no news, but tells that they rest
        return None
    finally:
        gripper.stop()


class WaitForForce(Monitor):
    """`felt` once the force on the tool has been beyond `limit`, N, for the time `for`.

    The force is the whole one, or its component `along` an axis of the flange (z points out of
    it), to either side; `relative`: the change since the state was entered, so that what the tool
    weighs does not count. A force that was beyond the limit counts until it falls below 90 % of
    it. While the sensor is silent nothing is felt, and the time begins anew.
    """

    outcomes = ("felt",)
    reads = {WRENCH_READING: AGE_S}

    def __init__(
        self, limit: Force, along: Axis = "any", for_: Duration = 0.0, relative: bool = True
    ) -> None:
        self.limit, self.along, self.for_, self.relative = limit, along, for_, relative

    def run(self, ctx: Context) -> Run:
        first: WrenchReading | None = None
        since: int | None = None
        while True:
            reading = ctx.value(WRENCH_READING)
            first = first or reading
            enough = self.limit if since is None else STILL_FELT * self.limit
            if reading is None or first is None or not self._force(reading, first) > enough:
                since = None
            elif since is None:
                since = ctx.now
            due = NEVER_NS if since is None else since + round(self.for_ * 1e9)
            if ctx.now >= due:
                return "felt"
            yield On(WRENCH_READING, until=due, older=AGE_S)

    def _force(self, reading: WrenchReading, first: WrenchReading) -> float:
        """What counts of a reading, N."""
        force = reading.force
        if self.relative:
            x, y, z = (a - b for a, b in zip(force, first.force, strict=True))
            force = (x, y, z)
        if self.along == "any":
            return math.hypot(*force)
        return abs(force["xyz".index(self.along)])
