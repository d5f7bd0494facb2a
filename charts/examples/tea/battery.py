"""The battery: a signal of one's own, and the part that gives it in simulation."""

from engine import Measured
from hw.samples import Sample

USED_S, CHARGED_S, LEAST = 100.0, 50.0, 0.2


class Battery:
    """Falls from 1 to `LEAST` in `USED_S`, and is charged again in `CHARGED_S`, over and over.

    It does not know where the robot is: one that minds its battery is at the dock by then.
    """

    signals = ("battery.level",)

    def samples(self, now_ns: int) -> list[Sample]:
        """The present level."""
        time = now_ns * 1e-9 % (USED_S + CHARGED_S)
        used = time / USED_S if time < USED_S else 1.0 - (time - USED_S) / CHARGED_S
        return [Sample("battery.level", now_ns, 1.0 - used * (1.0 - LEAST))]


PARTS = {"battery": Battery}
SIGNALS = (Measured("battery.level", float, about="0 is empty, 1 is full"),)
