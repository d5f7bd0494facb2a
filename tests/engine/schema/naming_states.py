"""States with the words that parameters name, and the types, signals and places around them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar, TypeVar

from engine.files.units import Angle, Duration, Length
from engine.interfaces import Interface, interface
from engine.signals.signal_kinds import Measured, Signal, declare
from engine.state import Action, Context, Monitor, Run
from engine.types import Key, Type

N = TypeVar("N", bound=float)
T = TypeVar("T")


@dataclass(frozen=True)
class Post:
    """A place to stand at, with a heading."""

    named_by: ClassVar[str] = "place"

    x: float
    y: float
    yaw: float

    @classmethod
    def written(cls, x: Length, y: Length, yaw: Angle = 0.0) -> Post:
        """As charts write it."""
        return cls(x, y, yaw)


class Exceeds(Monitor):
    """`exceeded` once a signal has been above `limit` for so long."""

    outcomes = ("exceeded",)
    reads: ClassVar = {"$signal": "$older"}
    outputs: ClassVar = {"exceeded": {"value": N}}

    def __init__(
        self, signal: Key[N], limit: N, for_: Duration = 0.0, older: Duration | None = None
    ) -> None:
        self.signal, self.limit, self.hold = signal, limit, for_

    def run(self, ctx: Context) -> Run:
        yield
        return "exceeded"


class Choose(Action):
    """Ends with the one of `cases` that `word` is."""

    outcomes = ("$cases", "other")
    outputs: ClassVar = {"$cases": {"rest": int}}

    def __init__(self, cases: tuple[str, ...]) -> None:
        self.cases = cases

    def run(self, ctx: Context, word: str | None) -> Run:
        return "other"


class Visit(Action):
    """Goes to all `posts` in turn, and to `home` at last."""

    outcomes = ("visited", "blocked")

    def __init__(self, pause: Duration, home: Post | None = None) -> None:
        self.pause, self.home = pause, home

    def run(self, ctx: Context, posts: tuple[Post, ...]) -> Run:
        yield
        return "visited"


class Pick(Action):
    """Takes the item of a list at an index."""

    outcomes = ("found", "end")
    outputs: ClassVar = {"found": {"item": T}}

    def run(self, ctx: Context, items: tuple[T, ...], index: int) -> Run:
        return "end"


INTERFACES: dict[str, Interface] = {
    cls.__name__: interface(cls) for cls in (Exceeds, Choose, Visit, Pick)
}
TYPES = {"Post": Type("Post", python=Post)}
SIGNALS: dict[str, Signal] = declare(
    [
        Measured("tank.level", Length, about="how full the tank is"),
        Measured("tank.share", float, about="the same, as a number"),
        Measured("door.state", str, about="open, closed or ajar"),
        Measured("robot.post", Post),
    ]
)
CONSTANTS: dict[str, Any] = {
    "profile.tank.full": "80 cm",
    "profile.tank.wait": "3 s",
    "profile.tank.name": "left",
}
NAMES = {"place": ["dock", "kitchen"]}
RIGHT = """\
chart: main
outcomes: [done]
parameters:
  n: {type: integer, default: 2}
  gauge: {type: signal of number, default: tank.level}
  full: {type: length, default: $profile.tank.full}
  rest: {type: duration | none, default: }
inputs:
  word: {type: text | none, default: none}
  home: {type: Post, default: {place: dock}}
data:
  pause: {type: duration, initial: 3 s}
  posts: {type: list of Post, initial: [{x: 1, y: 2, yaw: 90 deg}, {place: kitchen}]}
  post: {type: Post | none, initial: none}
any:
  full:
    watch: Exceeds
    with: {signal: tank.level, limit: $full, for: 3 s, older: $profile.tank.wait}
    next: {exceeded: .done}
  gauge: {watch: Exceeds, with: {signal: $gauge, limit: 2}, next: {exceeded: .done}}
  work:
    states:
      choose:
        do: Choose
        with: {cases: [tea, milk]}
        in: {word: word}
        retry: {times: $n, on: [tea, milk]}
        autonomy: {tea: low}
        next: {tea: visit, milk: near, other: visit}
      visit:
        do: Visit
        with: {home: {place: dock}}
        in: {posts: [{x: 1 m, y: 2}, {place: dock}], pause: pause}
        timeout: $profile.tank.wait
        next: {visited: pick, blocked: .done, timeout: .done}
      near:
        do: Visit
        with: {pause: 3 s, home: {x: 1 m, y: 50 cm, yaw: $turn}}
        in: {posts: posts}
        next: {visited: pick, blocked: .done}
      pick:
        do: Pick
        in: {items: posts, index: 3}
        out: {item: post}
        next: {found: .done, end: .done}
    in: {items: posts}
"""
