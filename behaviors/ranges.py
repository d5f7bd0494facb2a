"""Which values of a profile make sense, so that a wrong sign or unit never moves the robot.

The limits are wide: they keep out what cannot be meant (36 rad for 36 deg, a negative inflation),
not what is unwise.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from behaviors.settings import (
    ChaseSettings,
    EscapeSettings,
    HapticSettings,
    PlantSettings,
    RobotSettings,
    SafetySettings,
    UserSettings,
)
from engine.files.finding import did_you_mean
from states.signals.prediction import PREDICTORS
from states.site import CostmapValues, Subsystem

JOINTS = 6
_QUARTER = 0.5 * math.pi + 1e-9


@dataclass(frozen=True, slots=True)
class Range:
    """From `low` to `high`, SI units; `above`: `low` itself is not allowed."""

    low: float
    high: float
    above: bool = False

    def admits(self, value: float) -> bool:
        """Is the value in it?"""
        return (self.low < value if self.above else self.low <= value) and value <= self.high

    def __str__(self) -> str:
        begin = f"above {self.low:g}, up" if self.above else f"{self.low:.4g}"
        return f"{begin} to {self.high:.4g}"


def _above_0(high: float) -> Range:
    return Range(0.0, high, above=True)


RANGES: Mapping[type, Mapping[str, Range]] = {
    RobotSettings: {
        "base_acceleration": _above_0(10.0),
        "base_yaw_acceleration": _above_0(20.0),
        "base_speed": _above_0(5.0),
        "base_yaw_rate": _above_0(10.0),
        "arm_acceleration": _above_0(50.0),
        "arm_jerk": _above_0(10_000.0),
        "tool_speed": _above_0(10.0),
        "arm_parked": Range(-2.0 * math.pi, 2.0 * math.pi),
    },
    SafetySettings: {"overlap": Range(0.0, 0.5)},
    PlantSettings: {
        "latency": Range(0.0, 1.0),
        "tracking_delay": Range(0.0, 1.0),
        "tracking_noise": Range(0.0, 0.2),
        "pose_noise": Range(0.0, 0.2),
    },
    Subsystem: {
        "max_speed": _above_0(5.0),
        "inflation": _above_0(5.0),
        "user_radius": _above_0(5.0),
        "tolerance": _above_0(1.0),
        "yaw_tolerance": _above_0(math.pi),
    },
    CostmapValues: {
        "resolution": Range(0.01, 0.25),
        "inflation_radius": Range(0.0, 5.0),
        "cost_scaling_factor": Range(0.0, 100.0),
        "width": Range(1.0, 100.0),
        "height": Range(1.0, 100.0),
    },
    UserSettings: {
        "window": _above_0(5.0),
        "still_speed": _above_0(2.0),
        "still_turn": _above_0(10.0),
    },
    EscapeSettings: {
        "ahead": _above_0(10.0),
        "half_view": Range(0.0, math.pi),
        "around": _above_0(10.0),
        "moving": Range(0.0, 5.0),
        "hysteresis": Range(0.0, 5.0),
        "contact": _above_0(5.0),
        "reaction": Range(0.0, 10.0),
        "warning": Range(0.0, 10.0),
        "distances": _above_0(10.0),
        "angles": Range(-_QUARTER, _QUARTER),  # a pose behind the robot is nearer to the user
    },
    ChaseSettings: {
        "inner": _above_0(10.0),
        "outer": _above_0(10.0),
        "cell": Range(0.01, 1.0),
        "front": Range(0.0, 2.0 * math.pi),
        "rear": Range(0.0, 2.0 * math.pi),
        "margin": Range(0.0, 5.0),
        "margin_angle": Range(0.0, math.pi),
        "best_angle": Range(0.0, math.pi),
        "best_radius": _above_0(10.0),
        "tie": Range(0.0, 1.0),
        "seed": Range(0, 2**63),
    },
    HapticSettings: {
        "radius": _above_0(3.0),
        "angles": Range(-math.pi, math.pi),
        "deep_ahead": Range(0.0, 3.0),
        "deep_height": _above_0(3.0),
    },
}
"""The admitted values by the class of a section and the name; those of a list are each one's."""


def fault_of(kind: type, name: str, value: Any) -> str | None:
    """Why a value that has the right type cannot be meant; None if it can."""
    if name in ("likely", "possible"):
        return _unknown_predictor(name, value)
    if name == "arm_parked" and value is not None and len(value) != JOINTS:
        return f"needs {JOINTS} angles, has {len(value)}"
    if value == () and name in RANGES.get(kind, {}):
        return "is an empty list; at least one value is needed"
    allowed = RANGES.get(kind, {}).get(name)
    if allowed is None:
        return None
    for number in _numbers(value):
        if not allowed.admits(number):
            return f"{number:g} is out of range, {allowed} is allowed (SI units, rad)"
    return None


def _numbers(value: Any) -> Iterator[float]:
    if value is not None:
        yield from value if isinstance(value, tuple) else (value,)


def _unknown_predictor(name: str, value: tuple[str, ...]) -> str | None:
    if not value and name == "likely":
        return "is an empty list; Escape counts on at least one predictor"
    wrong = next((entry for entry in value if entry not in PREDICTORS), None)
    return None if wrong is None else f"no predictor {wrong!r}; {did_you_mean(wrong, PREDICTORS)}"


def contradiction(section: Any) -> tuple[str, str] | None:
    """The name of a value that does not go with another of its section, and why; None if all do."""
    if not isinstance(section, ChaseSettings):
        return None
    if section.inner >= section.outer:
        return "inner", f"{section.inner:g} is not below outer, {section.outer:g}"
    if section.front + section.rear >= 2.0 * math.pi:
        return "rear", "front and rear cut out the whole turn; nothing is left of the space"
    if (section.margin is None) != (section.margin_angle is None):
        return "margin", "margin and margin_angle go together; give both, or null for both"
    return None
