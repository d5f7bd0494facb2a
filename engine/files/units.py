"""Units and their dimensions.

Numbers are SI and radians; text with a unit (`5 s`, `30 deg`, `20 cm`) is converted once, at load.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Annotated

# unit: (dimension, numerator, denominator); dividing rounds only once, so `20 cm` is exactly 0.2
UNITS: dict[str, tuple[str, float, float]] = {
    "ns": ("duration", 1, 1e9), "us": ("duration", 1, 1e6), "ms": ("duration", 1, 1e3),
    "s": ("duration", 1, 1), "min": ("duration", 60, 1), "h": ("duration", 3600, 1),
    "mm": ("length", 1, 1e3), "cm": ("length", 1, 1e2), "m": ("length", 1, 1),
    "km": ("length", 1e3, 1),
    "rad": ("angle", 1, 1), "deg": ("angle", 3.141592653589793, 180),
    "°": ("angle", 3.141592653589793, 180),
    "m/s": ("speed", 1, 1), "cm/s": ("speed", 1, 1e2), "mm/s": ("speed", 1, 1e3),
    "km/h": ("speed", 1, 3.6),
    "rad/s": ("angular_speed", 1, 1), "deg/s": ("angular_speed", 3.141592653589793, 180),
    "m/s2": ("acceleration", 1, 1), "m/s²": ("acceleration", 1, 1),
    "rad/s2": ("angular_acceleration", 1, 1), "rad/s²": ("angular_acceleration", 1, 1),
    "deg/s2": ("angular_acceleration", 3.141592653589793, 180),
    "rad/s3": ("angular_jerk", 1, 1), "rad/s³": ("angular_jerk", 1, 1),
    "deg/s3": ("angular_jerk", 3.141592653589793, 180),
    "kg": ("mass", 1, 1), "g": ("mass", 1, 1e3), "N": ("force", 1, 1), "Nm": ("torque", 1, 1),
    "W": ("power", 1, 1), "kg m/s": ("momentum", 1, 1), "kgm/s": ("momentum", 1, 1),
    "Hz": ("frequency", 1, 1), "%": ("ratio", 1, 100),
}  # fmt: skip
_SPELLINGS = {
    "sec": "s", "secs": "s", "second": "s", "seconds": "s", "msec": "ms", "millisecond": "ms",
    "milliseconds": "ms", "minute": "min", "minutes": "min", "mins": "min", "hour": "h",
    "hours": "h", "hr": "h", "hrs": "h", "µs": "us", "μs": "us",
    "meter": "m", "meters": "m", "metre": "m", "metres": "m", "centimeter": "cm",
    "centimeters": "cm", "centimetre": "cm", "centimetres": "cm", "millimeter": "mm",
    "millimeters": "mm", "millimetre": "mm", "millimetres": "mm",
    "degree": "deg", "degrees": "deg", "degs": "deg", "radian": "rad", "radians": "rad",
    "rads": "rad", "mps": "m/s", "m/sec": "m/s", "kph": "km/h", "kmh": "km/h", "dps": "deg/s",
    "°/s": "deg/s", "m/s^2": "m/s2", "m/s**2": "m/s2", "m/s/s": "m/s2", "rad/s^2": "rad/s2",
    "rad/s^3": "rad/s3", "deg/s^2": "deg/s2", "kilogram": "kg", "kilograms": "kg", "kgs": "kg",
    "gram": "g", "grams": "g", "newton": "N", "newtons": "N", "hertz": "Hz",
    "percent": "%", "pct": "%", "per cent": "%",
}  # fmt: skip
"""Other spellings of units, in lower case, with the accepted one."""
NUMBER = r"[-+]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][-+]?[0-9]+)?"
"""Pattern of numbers without a unit."""
_QUANTITY = re.compile(rf"({NUMBER})\s*([^\s\d].*)\Z")
_COMMA = re.compile(r"([0-9]),([0-9])")


@dataclass(frozen=True, slots=True)
class Dimension:
    """Marks a float as a physical quantity: `Annotated[float, Dimension("length")]`."""

    name: str


Duration = Annotated[float, Dimension("duration")]
Length = Annotated[float, Dimension("length")]
Angle = Annotated[float, Dimension("angle")]
Speed = Annotated[float, Dimension("speed")]
AngularSpeed = Annotated[float, Dimension("angular_speed")]
Acceleration = Annotated[float, Dimension("acceleration")]
AngularAcceleration = Annotated[float, Dimension("angular_acceleration")]
AngularJerk = Annotated[float, Dimension("angular_jerk")]
Mass = Annotated[float, Dimension("mass")]
Force = Annotated[float, Dimension("force")]
Torque = Annotated[float, Dimension("torque")]
Power = Annotated[float, Dimension("power")]
Momentum = Annotated[float, Dimension("momentum")]
Ratio = Annotated[float, Dimension("ratio")]

DIMENSIONS = tuple(dict.fromkeys(dimension for dimension, _, _ in UNITS.values()))


def si_unit(dimension: str) -> str:
    """The SI unit of a dimension; empty if it has none. SI units have the factor 1."""
    return next((u for u, (d, n, per) in UNITS.items() if d == dimension and n == per), "")


def quantity_text(value: float, dimension: str) -> str:
    """A value in SI units or rad as files would have it: `30 deg`, `0.002 rad`, `0.5 s`."""
    plain = f"{value:.12g} {si_unit(dimension)}".rstrip()
    for unit, (of, numerator, denominator) in UNITS.items():
        if of == dimension and unit.startswith("deg"):
            degrees = f"{value * denominator / numerator:.10g} {unit}"
            return degrees if len(degrees) < len(plain) else plain
    return plain


def quantity(text: str) -> tuple[float, str] | None:
    """`"20 cm"` as (0.2, "length"), in SI units and rad; `None` unless it has a known unit."""
    match = _QUANTITY.match(text.strip())
    if match is None or match[2].strip() not in UNITS:
        return None
    dimension, numerator, denominator = UNITS[match[2].strip()]
    value = float(match[1]) * numerator / denominator
    return (value, dimension) if abs(value) != float("inf") else None


def respelt(text: str) -> str:
    """`"15 sec"` as `"15 s"`, `"1,5 s"` as `"1.5 s"`; empty if unclear or spelt correctly."""
    plain = "".join(str(int(c)) if c.isdecimal() else c for c in text)  # digits of other scripts
    pointed = _COMMA.sub(r"\1.\2", plain.strip().rstrip(",;").replace("\u00a0", " "))
    match = _QUANTITY.match(pointed)
    if match is None:
        return ""
    written = match[2].strip()
    folded = {unit.lower(): unit for unit in UNITS}
    unit = written if written in UNITS else _SPELLINGS.get(written.lower())
    unit = unit or folded.get(written.lower())
    found = f"{match[1]} {unit}" if unit else ""
    return found if found != text else ""
