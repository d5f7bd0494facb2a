"""States that open and close the gripper, and wait for a force on the tool (R150)."""

from __future__ import annotations

import math
from collections.abc import Generator
from typing import Annotated, Literal

from engine import Action, Context, Key, Monitor, Run, Yielded
from engine.files import Duration, Force, Length
from engine.files.declared import ABOVE_0, FROM_0
from hw import Gripper, GripperState, WrenchReading
from states.environment import GRIPPER_STATE, STOP_ENGAGED, WRENCH_READING
from states.watching import sustained

AGE_S = 0.2
"""Greatest age of what gripper and sensor report, s."""
NEAR = 0.002
"""Fingers nearer to the opening they were sent to than this have got there, m."""
STILL_FELT = 0.9
"""Share of the limit from which on a force that was beyond it still counts: it is never quiet."""

Axis = Literal["any", "x", "y", "z"]
"""The whole force, or its component along an axis of the flange."""


class _MovesFingers(Action):
    """Moves the fingers of a gripper; `part` and `signal` name it where a robot has several.

    Args:
        patience: how long they may take to come to rest.
        part: the gripper that is commanded.
        signal: the signal that tells its state.
    """

    reads = {"$signal": AGE_S, STOP_ENGAGED: None}
    commands = ("$part",)
    part: str
    signal: Key[GripperState]

    def _moved(
        self, ctx: Context, opening: float | None, patience: float
    ) -> Generator[Yielded, None, GripperState | None]:
        """The fingers once they rest after being sent to this opening; None if they cannot."""
        gripper: Gripper = ctx.part(self.part)
        gripper.open_to(opening)
        sent, until = ctx.now, ctx.after(patience)
        try:
            while ctx.value(STOP_ENGAGED) is None:
                seen = ctx.sample(self.signal)
                if seen is not None and seen.stamp > sent and not seen.value.moving:
                    return seen.value
                if ctx.now >= until:
                    yield f"the fingers have not come to rest within {patience:g} s"
                    return None
                yield None  # a state that only repeats is no news, but tells that they rest
            return None
        finally:
            gripper.stop()


class OpenGripper(_MovesFingers):
    """Open the fingers and let go of what they hold: as wide as they go, or to `opening`.

    `{do: OpenGripper, with: {opening: 5 cm}, next: {opened: leave, failed: .failed}}`. Of several
    grippers, `part` and `signal` name one: `{part: left_gripper, signal: left_gripper.state}`.

    Args:
        opening: between the fingers; by default as wide as they go.

    Outcomes:
        opened: the fingers are there.
        failed: they stand elsewhere, still hold something, have not come to rest after `patience`,
            or the stop line is pulled.
    """

    outcomes = ("opened", "failed")

    def __init__(
        self,
        opening: Annotated[Length, FROM_0] | None = None,
        patience: Annotated[Duration, ABOVE_0] = 3.0,
        part: str = "gripper",
        signal: Key[GripperState] = GRIPPER_STATE,
    ) -> None:
        self.opening, self.patience = opening, patience
        self.part, self.signal = part, signal

    def run(self, ctx: Context) -> Run:
        fingers = yield from self._moved(ctx, self.opening, self.patience)
        if fingers is None:
            return "failed"
        if fingers.holding:
            yield "the fingers still hold something"
            return "failed"
        if self.opening is not None and abs(fingers.opening - self.opening) > NEAR:
            yield f"the fingers stand at {fingers.opening * 1e3:.0f} mm"
            return "failed"
        return "opened"


class CloseGripper(_MovesFingers):
    """Close the fingers on what is between them: fully, or until they are `opening` apart.

    `{do: CloseGripper, next: {holding: lift, empty: search, failed: .failed}}`. `part` and `signal`
    as for `OpenGripper`.

    Args:
        opening: how far apart the fingers end up where they have met nothing.

    Outcomes:
        holding: they have closed on something.
        empty: there was nothing between them.
        failed: they have not come to rest after `patience`, or the stop line is pulled.
    """

    outcomes = ("holding", "empty", "failed")

    def __init__(
        self,
        opening: Annotated[Length, FROM_0] = 0.0,
        patience: Annotated[Duration, ABOVE_0] = 3.0,
        part: str = "gripper",
        signal: Key[GripperState] = GRIPPER_STATE,
    ) -> None:
        self.opening, self.patience = opening, patience
        self.part, self.signal = part, signal

    def run(self, ctx: Context) -> Run:
        fingers = yield from self._moved(ctx, self.opening, self.patience)
        if fingers is None:
            return "failed"
        return "holding" if fingers.holding else "empty"


class WaitForForce(Monitor):
    """`felt` once the force on the tool has been beyond `limit`, N, for the time `for`.

    `{watch: WaitForForce, with: {limit: 8 N, along: z, for: 0.1 s}, next: {felt: let_go}}`.
    The force is the whole one, or its component `along` an axis of the flange (z points out of
    it), to either side; `relative`: the change since the state was entered, so that what the tool
    weighs does not count. A force that was beyond the limit counts until it falls below 90 % of
    it. While the sensor is silent, or its reading is older than `older`, nothing is felt, and the
    time begins anew. `signal` names one of several sensors.

    Args:
        limit: the force to exceed.
        along: the axis of the flange along which the force counts, to either side; `any`: the whole
            force.
        for: how long the force has to be beyond `limit`.
        relative: whether the force when this begins is subtracted, so that the weight of the tool
            does not count.
        signal: the force sensor.
        older: with readings older than this nothing is felt.

    Outcomes:
        felt: the force has been beyond `limit` for the time `for`.
    """

    outcomes = ("felt",)
    reads = {"$signal": "$older"}

    def __init__(
        self,
        limit: Annotated[Force, FROM_0],
        along: Axis = "any",
        for_: Annotated[Duration, FROM_0] = 0.0,
        relative: bool = True,
        signal: Key[WrenchReading] = WRENCH_READING,
        older: Annotated[Duration, FROM_0] = AGE_S,
    ) -> None:
        self.limit, self.along, self.for_, self.relative = limit, along, for_, relative
        self.signal, self.older = signal, older
        self._first: WrenchReading | None = None

    def run(self, ctx: Context) -> Run:
        yield from sustained(ctx, self.signal, self._is_felt, self.for_, self.older)
        return "felt"

    def _is_felt(self, reading: WrenchReading, before: bool) -> bool:
        self._first = self._first or reading
        return self._force(reading, self._first) > self.limit * (STILL_FELT if before else 1.0)

    def _force(self, reading: WrenchReading, first: WrenchReading) -> float:
        """What counts of a reading, N."""
        force = reading.force
        if self.relative:
            x, y, z = (a - b for a, b in zip(force, first.force, strict=True))
            force = (x, y, z)
        if self.along == "any":
            return math.hypot(*force)
        return abs(force["xyz".index(self.along)])
