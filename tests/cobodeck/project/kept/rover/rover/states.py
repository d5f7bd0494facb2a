"""States that charts can name."""

import math

from engine.files.units import Length, Speed
from engine.state import Action, Context, Monitor, On, Run
from hw.geometry import Twist2


class BatteryLow(Monitor):
    """`low` once the battery is emptier than `level`."""

    outcomes = ("low",)
    reads = {"battery.level": 1.0}  # the signal, and its largest age, s

    def __init__(self, level: float = 0.3) -> None:
        self.level = level

    def run(self, ctx: Context) -> Run:
        while (level := ctx.value("battery.level")) is None or level > self.level:
            yield On("battery.level")  # step me again when there is a new sample
        return "low"


class GoTo(Action):
    """Drive straight to a place, slower and slower, without turning.

    `lost`: nobody knows where the robot is.
    """

    outcomes = ("there", "lost")
    reads = {"base.pose": 0.2}
    commands = ("base",)

    def __init__(self, x: Length, y: Length, speed: Speed = 0.5) -> None:
        self.x, self.y, self.speed = x, y, speed

    def run(self, ctx: Context) -> Run:
        base = ctx.part("base")
        try:
            while ctx.value("base.pose") is None:  # before the first sample
                if ctx.age("base.pose") < math.inf:
                    return "lost"
                yield On("base.pose")
            while (pose := ctx.value("base.pose")) is not None:
                ahead, left = pose.inverse().transform(self.x, self.y)
                distance = math.hypot(ahead, left)
                if distance < 0.05:
                    return "there"
                speed = min(self.speed, distance)
                base.drive(Twist2(speed * ahead / distance, speed * left / distance, 0.0))
                yield None
            return "lost"
        finally:
            base.release()


class Light(Action):
    """Switch the lamp on or off."""

    outcomes = ("done",)
    commands = ("lamp",)

    def __init__(self, on: bool = True) -> None:
        self.on = on

    def run(self, ctx: Context) -> str:
        ctx.part("lamp").light(self.on)
        return "done"
