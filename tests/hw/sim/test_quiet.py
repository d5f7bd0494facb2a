"""Until when the world says that nothing changes; leaping there is the same as stepping."""

from __future__ import annotations

import random
from collections.abc import Iterator
from typing import Any

import pytest
from hypothesis import given, settings, strategies as st

from engine import NEVER_NS
from hw.geometry import Twist2
from hw.model.robot import load_robot
from hw.model.sensor_model import SensorModel
from hw.people.user import open_user
from hw.samples import Sample
from hw.scene.scene import load_scene
from hw.sim.world import World
from hw.truth import Truth

ROBOT = load_robot("rbkairos_ur10")
assert ROBOT.parked is not None
PARKED = ROBOT.parked
MOVED = (PARKED[0] + 0.1, *PARKED[1:])
SCENES = {name: load_scene(name) for name in ("study", "lab_a")}
HZ, SECOND = 30, 10**9
ORDERS = ("drive", "stop", "show", "hide", "reach", "stay", "zero", "open", "pull", "report")


class Played:
    """A world that is stepped, with its guard, as a loop steps it; `held`: the newest samples."""

    def __init__(self, user: str | None, scene: str, seed: int, **given: Any) -> None:
        place = SCENES[scene]
        person = None if user is None else open_user(user, place, seed=seed)
        self.world = World(place, ROBOT, person, **given)
        self.n = -1
        self.held: dict[str, object] = {}
        self.came: list[Sample] = []

    def step(self) -> None:
        """One instant of the grid."""
        self.n += 1
        world, now = self.world, self.n * SECOND // HZ
        world.advance(now)
        self.came = [one for part in world.parts.values() for one in part.samples(now)]
        for sample in self.came:
            self.held[sample.name] = sample.value
            world.guard.hear(sample, now)
        world.guard.tick(now)

    def leap(self, seconds: int) -> None:
        """Pass over so many seconds."""
        self.n += seconds * HZ
        self.world.leap(seconds * SECOND)

    def order(self, what: str) -> None:
        """What a chart may do between two instants."""
        world = self.world
        parts: Any = world.parts
        if what == "drive":
            world.guard.drive(Twist2(0.2, 0.1, 0.3), "escape")
        elif what == "stop":
            world.guard.stop()
        elif what in ("show", "hide"):
            parts["vr"].inform(what == "show")
        elif what in ("reach", "stay"):
            joints = parts["arm"].state.joints
            to = MOVED if joints == PARKED else PARKED
            parts["arm"].follow([(0.0, joints)] if what == "stay" else [(0.0, joints), (1.0, to)])
        elif what == "zero" and "wrench" in parts:
            parts["wrench"].zero()
        elif what == "open" and "gripper" in parts:
            parts["gripper"].open_to(0.01)
        elif what == "pull":
            parts["stop_line"].pull("a test")
        elif what == "report":
            parts["operator"].report("a fault")


def timeless(truth: Truth) -> Truth:
    return truth._replace(seen_ns=None)


def alike(before: tuple[object, ...], after: tuple[object, ...]) -> bool:
    pairs = zip(before, after, strict=True)
    return all(a is b or (isinstance(a, float) and a == b) for a, b in pairs)


KINDS = ("", ":hasty", ":deaf", ":pursuer", ":curious")
people = st.sampled_from(
    [("demo", "lab_a"), ("cornering", "lab_a")]
    + [(f"random{kind}", scene) for kind in KINDS for scene in sorted(SCENES)]
)


def ordered(seed: int) -> Iterator[str | None]:
    """Now and then an order; none for some seconds at a time."""
    chance = random.Random(seed)
    while True:
        yield from [None] * chance.choice((1, 5, 60, 200))
        yield chance.choice(ORDERS)


@settings(max_examples=20, deadline=None)
@given(people, st.integers(0, 999))
def test_before_the_instant_that_is_told_nothing_changes(who: tuple[str, str], seed: int) -> None:
    played, until, orders = Played(*who, seed), 0, ordered(seed)
    before, held, last = Truth(), dict[str, object](), set[str]()
    for _ in range(40 * HZ):
        played.step()
        world, names = played.world, {sample.name for sample in played.came}
        if world.now_ns < until:
            assert alike(timeless(before), timeless(world.truth))
            assert all(played.held[name] is held[name] for name in names)
            assert {"user.pose", "base.pose", "arm.joints"} <= names <= last
            assert world.truth.seen_ns == world.now_ns
            assert world.truth.tracked_since_ns == before.tracked_since_ns
        held, last = dict(played.held), names
        order = next(orders)
        if order is not None:
            played.order(order)
        before, until = world.truth, world.quiet_until()  # commands may change them
        assert until >= world.now_ns


@settings(max_examples=15, deadline=None)
@given(people, st.integers(0, 999))
def test_after_a_leap_everything_is_as_if_stepped(who: tuple[str, str], seed: int) -> None:
    stepped, leaping, orders = Played(*who, seed), Played(*who, seed), ordered(seed)
    while stepped.n < 40 * HZ:
        stepped.step()
        leaping.step()
        assert leaping.n == stepped.n
        assert leaping.world.truth == stepped.world.truth
        assert leaping.came == stepped.came
        assert leaping.world.guard.selected == stepped.world.guard.selected
        assert leaping.world.guard.chain.latched == stepped.world.guard.chain.latched
        order = next(orders)
        if order is not None:
            for one in (stepped, leaping):
                one.order(order)
            continue
        first = -(
            -leaping.world.quiet_until() * HZ // SECOND
        )  # the first instant that is not quiet
        seconds = (first - leaping.n - 1) // HZ
        if seconds > 0 and leaping.n > HZ:
            leaping.leap(seconds)
            for _ in range(seconds * HZ):
                stepped.step()


def test_a_person_who_stands_and_a_robot_at_rest_are_quiet_for_as_long_as_they_stand() -> None:
    played, told = Played("demo", "lab_a", 0), []
    for _ in range(60 * HZ):
        played.step()
        told.append(played.world.quiet_until() - played.world.now_ns)
    assert max(told) > 5 * SECOND


@pytest.mark.parametrize(
    "given",
    [
        {"sensors": SensorModel(tracking_delay=0.1)},
        {"sensors": SensorModel(tracking_noise=0.01)},
        {"sensors": SensorModel(pose_noise=0.01)},
    ],
)
def test_with_delay_or_noise_it_is_never_quiet(given: dict[str, Any]) -> None:
    played = Played("demo", "lab_a", 0, **given)
    for _ in range(30 * HZ):
        played.step()
        assert played.world.quiet_until() == played.world.now_ns


def test_a_robot_alone_is_quiet_forever_once_it_has_been_stepped() -> None:
    played = Played(None, "study", 0)
    assert played.world.quiet_until() == 0
    played.step()
    assert played.world.quiet_until() == NEVER_NS
    played.world.add({"extra": Extra()})
    assert played.world.quiet_until() == 0


class Extra:
    """A part that the world knows nothing of."""

    signals = ()

    def samples(self, now_ns: int) -> tuple[Sample, ...]:
        return ()

    def advance(self, until_ns: int) -> None:
        pass
