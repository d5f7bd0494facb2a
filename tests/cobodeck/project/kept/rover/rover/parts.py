"""Your own parts, simulated: a lamp that charts command, and a battery that they read.

A part gives samples, and takes commands through its own methods. `PARTS` registers them.
"""

from collections.abc import Callable

from engine.signals import Measured
from hw.samples import Sample


class Lamp:
    """A lamp on the roof. Gives `lamp.lit` whenever it changes."""

    signals = ("lamp.lit",)

    def __init__(self, now: Callable[[], int] | None = None) -> None:  # drivers are given a clock
        self.lit = False
        self._told: bool | None = None

    def light(self, on: bool) -> None:
        """Switch it on or off."""
        self.lit = on

    def stop(self) -> None:
        """Nothing moves; the lamp stays as it is when another state takes over."""

    def samples(self, now_ns: int) -> list[Sample]:
        """A sample if the lamp was switched since the last call."""
        if self._told == self.lit:
            return []
        self._told = self.lit
        return [Sample("lamp.lit", now_ns, self.lit)]


class Battery:
    """A battery that lasts 20 s only, to keep tests short. Gives `battery.level`, 0 to 1."""

    signals = ("battery.level",)
    lasts_s = 20.0

    def __init__(self) -> None:
        self._now_ns = 0

    def advance(self, to_ns: int) -> None:
        """Advance to this simulated time, ns."""
        self._now_ns = to_ns

    def samples(self, now_ns: int) -> list[Sample]:
        """The current level."""
        return [Sample("battery.level", now_ns, max(0.0, 1.0 - self._now_ns * 1e-9 / self.lasts_s))]


PARTS = {"lamp": Lamp, "battery": Battery}
SIGNALS = (
    Measured("lamp.lit", bool, about="is the lamp on the roof on?"),
    Measured("battery.level", float, about="0 is empty, 1 is full"),
)
