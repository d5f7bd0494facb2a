"""What the virtual world is shown of the robot: in each tick, after the states (R18, R114)."""

from __future__ import annotations

from collections import defaultdict, deque
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings, strategies as st

from cobodeck.loop.loop import Loop
from cobodeck.loop.wiring import wire
from cobodeck.run.build_run import stage
from cobodeck.setup.options import Options
from cobodeck.setup.setup import open_setup
from engine.clock import TickGrid
from hw.drivers.unity.unity_link import UnityVr
from hw.geometry import Pose2
from hw.people.live import LivePerson
from hw.samples import RobotView, Sample
from hw.sim.sensors.devices import SimVr
from tests.repeats import examples

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


def staged(profile: str | None = None, user: str = "cornering") -> tuple[Loop, Link]:
    """CoboDeck in the simulation, seen through the driver of the VR link."""
    setup = open_setup(None, "lab_a", profile)
    loop, link = stage(setup, Options(user, seed=1)), Link()
    parts = dict(loop.plant.parts)
    parts["vr"] = Vr(link, parts["vr"], lambda: loop.now_ns)
    loop.wired = wire(setup, parts)
    return loop, link


@pytest.mark.requirement(18, 114)
def test_the_sign_is_shown_in_the_tick_in_which_inform_begins_until_its_end_or_two_seconds(
    tmp_path: Path,
) -> None:
    """Of somebody whom tracking loses for a short and for a long while; in `paper`."""
    steps = "".join(f"  - stand: 6\n  - lose_tracking: {span}\n" for span in (0.3, 3.0, 0.3))
    begin = "user: u\nrepeat: false\nstart: {x: 4, y: 5}\nsteps:\n"
    user = tmp_path / "user.yaml"
    user.write_text(f"{begin}{steps}  - stand: 60\n")
    loop, link = staged("paper", str(user))
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
    assert max(shown) > 3.0


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


TICK = 33_333_333


@pytest.mark.requirement(18, 114)
@given(
    calls=st.lists(
        st.tuples(st.sampled_from(["sign", "robot", "hidden", "nothing"]), st.integers(1, 90)),
        min_size=1,
        max_size=6,
    )
)
@settings(deadline=None, max_examples=examples(60))
def test_the_simulated_and_the_real_virtual_world_show_the_same(
    calls: list[tuple[str, int]],
) -> None:
    """Model and sign, tick by tick; a robot that leaves is shown without the sign."""
    now = [0]
    link = Link()
    real = UnityVr(link, lambda: now[0])
    simulated = SimVr(LivePerson(Pose2(1.0, 1.0)))
    for what, ticks in calls:
        for part in (real, simulated):
            if what != "nothing":
                part.inform(what != "hidden", what == "sign")
        for _ in range(ticks):
            now[0] += TICK
            simulated.step(now[0])
            real.show(now[0])
            view = link.shown[-1]
            assert view.stop_sign is simulated.shown
            assert view.visible is (simulated.visible or simulated.shown)
    assert link.shown
