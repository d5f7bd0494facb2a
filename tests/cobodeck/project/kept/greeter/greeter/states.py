"""States that charts can name."""

from engine.files.units import Length
from engine.state import Context, Monitor, On, Run


class PersonNear(Monitor):
    """`near` once the user is within `distance` of the robot."""

    outcomes = ("near",)
    reads = {"user.distance": 0.2}  # the signal, and its largest age, s

    def __init__(self, distance: Length = 1.0) -> None:
        self.distance = distance

    def run(self, ctx: Context) -> Run:
        while (found := ctx.value("user.distance")) is None or found > self.distance:
            yield On("user.distance")
        return "near"
