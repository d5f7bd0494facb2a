"""What the virtual world is shown of the robot: in each tick, after the states (R18, R114)."""

from __future__ import annotations

from collections import defaultdict, deque
from collections.abc import Callable
from typing import Any

import pytest

from cobodeck.loop import Loop
from cobodeck.options import Options
from cobodeck.setup import open_setup
from cobodeck.stage import stage
from cobodeck.wiring import wire
from engine.clock import TickGrid
from hw.drivers.unity.link import UnityVr
from hw.geometry import Pose2
from hw.samples import RobotView, Sample

LATER_NS = 100_000_000


class Link:
    """In place of the VR link: notes what is to be shown."""

    debug = False
    heard_ns = None

    def __init__(self) -> None:
        self.shown: list[RobotView] = []
        self.queues: dict[str, deque[Sample]] = defaultdict(deque)

    def queue(self, name: str) -> deque[Sample]:
        return self.queues[name]

    def wake_at(self, names: tuple[str, ...], wake: Callable[[], None]) -> None:
        """Nobody has to be woken in virtual time."""

    def show(self, stamp_ns: int, view: RobotView) -> None:
        self.shown.append(view)


class Vr(UnityVr):
    """The driver, with the simulated user in place of one behind a link."""

    def __init__(self, link: Link, simulated: Any, now: Callable[[], int]) -> None:
        super().__init__(link, now)
        self.simulated = simulated

    def samples(self, now_ns: int) -> list[Sample]:
        return self.simulated.samples(now_ns)

    def inform(self, show: bool, sign: bool = True) -> None:
        self.simulated.inform(show, sign)
        super().inform(show, sign)


def staged(profile: str | None = None) -> tuple[Loop, Link]:
    """CoboDeck in the simulation, seen through the driver of the VR link."""
    setup = open_setup("cobodeck", "lab_a", profile)
    loop, link = stage(setup, Options("cornering", seed=1)), Link()
    parts = dict(loop.plant.parts)
    parts["vr"] = Vr(link, parts["vr"], lambda: loop.now_ns)
    loop.wired = wire(setup, parts)
    return loop, link


@pytest.mark.requirement(18, 114)
def test_the_sign_is_shown_in_the_tick_in_which_inform_begins_until_its_end_or_two_seconds() -> (
    None
):
    loop, link = staged("paper")  # where only Inform shows it
    since: int | None = None
    shown: list[float] = []
    while len(shown) < 3:
        assert loop.now_ns < 90 * 10**9
        link.shown.clear()
        loop.tick()
        active, view = loop.wired.run.active, link.shown[-1]
        informed, leaving = "inform/warn" in active, "chase/follow/leave" in active
        if informed and since is None:
            since = loop.now_ns
        elif since is not None and not informed and loop.now_ns - since >= 2 * 10**9:
            shown.append((loop.now_ns - since) / 1e9)
            since = None
        assert view.stop_sign is (since is not None)
        assert view.visible is (since is not None or leaving)
    assert min(shown) == pytest.approx(2.0, abs=0.04)


@pytest.mark.requirement(114)
def test_the_robot_shown_is_where_it_truly_is_within_five_centimetres_100_ms_later() -> None:
    loop, link = staged()
    grid = TickGrid(30)
    shown: deque[tuple[int, RobotView]] = deque()
    worst, moving, looked = 0.0, 0.0, 0
    while loop.now_ns < 20 * 10**9:
        link.shown.clear()
        loop.tick()
        [view] = link.shown[-1:]
        shown.append((loop.now_ns, view))
        assert view.joints is not None
        while loop.now_ns - shown[0][0] >= LATER_NS:
            stamp, seen = shown.popleft()
            assert loop.now_ns - stamp < LATER_NS + 2 * grid.period_ns
            truth = loop.plant.truth.base
            worst = max(worst, moved_on(seen, loop.now_ns - stamp).distance_to(truth))
            moving = max(moving, seen.twist.speed)
            looked += 1
    assert looked > 500
    assert moving > 0.5
    assert worst <= 0.05


def moved_on(view: RobotView, after_ns: int) -> Pose2:
    """What an application makes of it: straight on with the velocity of the base."""
    assert view.pose is not None
    assert view.twist is not None
    after, twist = after_ns * 1e-9, view.twist
    half = Pose2(0.0, 0.0, 0.5 * twist.wz * after)
    return view.pose @ half @ Pose2(twist.vx * after, twist.vy * after) @ half
