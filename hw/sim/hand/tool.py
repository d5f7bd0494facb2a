"""Simulated gripper and force-torque sensor at the flange (R150)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

from hw.interfaces import Gripper, Wrench
from hw.model import GripperModel, Prop, WrenchModel
from hw.samples import GripperState, Sample, WrenchReading

NO_LOAD = WrenchReading((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))


class MovingGripper(Gripper, Protocol):
    """Fingers whose motion the world computes; `between` is the width of the object held, m."""

    between: float | None
    braked: bool
    state: GripperState

    def advance(self, until_ns: int) -> None:
        """Move on to until_ns."""
        ...


class PressedWrench(Wrench, Protocol):
    """A force-torque sensor whose load is set from outside."""

    def press(self, load: WrenchReading) -> None:
        """Apply this force and torque to the flange, in its frame, from now on.

        Raises:
            ValueError: a value is NaN or infinite.
        """
        ...


@dataclass(frozen=True, slots=True)
class Hand:
    """Gripper and sensor between flange and prop; None where the prop has none."""

    gripper: MovingGripper | None = None
    wrench: PressedWrench | None = None

    @classmethod
    def of(cls, prop: Prop) -> Hand:
        """The simulated gripper and sensor of a prop."""
        fingers, sensor = prop.gripper, prop.wrench
        return cls(
            None if fingers is None else SimGripper(fingers),
            None if sensor is None else SimWrench(sensor),
        )

    @property
    def still(self) -> bool:
        """True while nothing of it moves or changes; a part that does not say so may do either."""
        return all(
            part is None or getattr(part, "still", False) for part in (self.gripper, self.wrench)
        )

    def advance(self, until_ns: int, *, braked: bool) -> None:
        """Move on to until_ns."""
        if self.gripper is not None:
            self.gripper.braked = braked
            self.gripper.advance(until_ns)


def check_load(load: WrenchReading) -> None:
    """Refuse an invalid load.

    Raises:
        ValueError: a value is NaN or infinite.
    """
    if not all(map(math.isfinite, (*load.force, *load.torque))):
        raise ValueError(f"wrench: a load of {load}; it must be finite")


def check_opening(model: GripperModel, opening: float) -> None:
    """Refuse an opening out of range.

    Raises:
        ValueError: naming the widest one.
    """
    if not 0.0 <= opening <= model.opening:  # NaN fails too
        raise ValueError(f"gripper: an opening of {opening} m; 0 to {model.opening:g} is free")


class SimGripper:
    """Fingers that move at constant speed, and stop at an object between them.

    They start holding what the file of the prop says, or wide open. `between` is the width of the
    object between the fingers, m, None for none; whoever removes or inserts one sets it.
    """

    signals: tuple[str, ...] = ("gripper.state",)

    def __init__(self, model: GripperModel) -> None:
        self.between: float | None = model.held
        self.braked = False
        opening = model.opening if model.held is None else model.held
        self.state = GripperState(opening, holding=model.held is not None)
        self._model = model
        self._goal: float | None = None
        self._now = 0
        self._reported = -1

    def open_to(self, opening: float | None) -> None:
        """Move the fingers; see `Gripper`."""
        wanted = self._model.opening if opening is None else opening
        check_opening(self._model, wanted)
        if not self.braked:
            self._goal = wanted

    def stop(self) -> None:
        """Keep the fingers where they are; see `Gripper`."""
        self._goal = None

    @property
    def still(self) -> bool:
        """True while the fingers stand, with an object between them or none."""
        return self._goal is None and self._state(self.state.opening) == self.state

    def samples(self, now_ns: int) -> list[Sample]:
        """The fingers at this instant."""
        if self._reported == now_ns:
            return []
        self._reported = now_ns
        return [Sample("gripper.state", now_ns, self.state)]

    def advance(self, until_ns: int) -> None:
        """Move on to until_ns."""
        span, self._now = (until_ns - self._now) * 1e-9, until_ns
        if self.braked:
            self._goal = None
        opening = self.state.opening
        if self._goal is not None:
            step = self._model.speed * span
            moved = opening + max(-step, min(step, self._goal - opening))
            opening = self._stopped(opening, moved)
            if opening == self._goal or opening != moved:
                self._goal = None
        self._tell(opening)

    def _tell(self, opening: float) -> None:
        """Note the state at this opening; the same object as long as nothing of it changes."""
        state = self._state(opening)
        if state != self.state:
            self.state = state

    def _state(self, opening: float) -> GripperState:
        holding = self.between is not None and opening <= self.between
        return GripperState(opening, holding, self._goal is not None)

    def _stopped(self, before: float, moved: float) -> float:
        """The opening at which closing fingers stop."""
        width = self.between
        return width if width is not None and moved < width <= before else moved


class SimWrench:
    """A sensor whose load is set from outside; readings are limited to its full scale."""

    signals: tuple[str, ...] = ("wrench.reading",)

    def __init__(self, model: WrenchModel) -> None:
        self._model = model
        self._load = self._zero = NO_LOAD
        self._reading = self._told = self._present()
        self._reported = -1

    def press(self, load: WrenchReading) -> None:
        """Apply this force and torque to the flange, in its frame."""
        check_load(load)
        self._load = load
        self._reading = self._present()

    @property
    def still(self) -> bool:
        """True while the reading is the one given last."""
        return self._reading is self._told

    def zero(self) -> None:
        """Take the present reading as no load; see `Wrench`."""
        self._zero = self._load
        self._reading = self._present()

    def samples(self, now_ns: int) -> list[Sample]:
        """The reading of this instant."""
        if self._reported == now_ns:
            return []
        self._reported, self._told = now_ns, self._reading
        return [Sample("wrench.reading", now_ns, self._reading)]

    def _present(self) -> WrenchReading:
        model = self._model
        return WrenchReading(
            _without(self._load.force, self._zero.force, model.force),
            _without(self._load.torque, self._zero.torque, model.torque),
        )


Three = tuple[float, float, float]


def _without(load: Three, zero: Three, scale: float) -> Three:
    x, y, z = (
        max(-scale, min(scale, a)) - max(-scale, min(scale, b))
        for a, b in zip(load, zero, strict=True)
    )
    return x, y, z
