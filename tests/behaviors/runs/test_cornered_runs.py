"""A robot in a corner with a person close before it, in the closed loop."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from cobodeck.loop.loop import Loop
from cobodeck.run.build_run import stage
from cobodeck.setup.options import Options
from cobodeck.setup.setup import open_setup
from engine.run.trace import TraceRecord
from hw.geometry import Pose2

ROBOT = Pose2(1.05, 1.05, 0.785)
SCENE = (
    "scene: corner\nroom: {outer: [[0, 0], [7, 0], [7, 7], [0, 7]]}\n"
    f"robot: {{start: {{x: {ROBOT.x}, y: {ROBOT.y}, yaw: {ROBOT.yaw}}}}}\n"
)
BEHAVIOURS = ("chase", "haptic", "escape", "inform", "ask")


class Cornered:
    """A run beside somebody who stands `away` metres before the robot, or walks up to there."""

    def __init__(self, folder: Path, away: float, manner: str, walks_up: bool, seed: int) -> None:
        side = math.sqrt(0.5) * away
        x, y = ROBOT.x + side, ROBOT.y + side
        before = f"{{x: {x:.3f}, y: {y:.3f}, yaw: -2.356}}"
        begin = "{x: 5.5, y: 5.5, yaw: -2.356}" if walks_up else before
        walk = f"  - walk: {before[:-1]}, speed: 0.8}}\n" if walks_up else ""
        user, scene = folder / "user.yaml", folder / "scene.yaml"
        steps = f"steps:\n  - stand: 1\n{walk}  - stand: 600\n"
        user.write_text(f"user: u\nrepeat: false\nstart: {begin}\n{steps}")
        scene.write_text(SCENE)
        setup = open_setup("cobodeck", str(scene), "tuned")
        self.loop: Loop = stage(setup, Options(f"{user}:{manner}", seed=seed))
        self.world: Any = self.loop.plant
        self.signs: list[float] = []
        self.moved: list[str] = []
        self._informed = False

    @property
    def trace(self) -> list[TraceRecord]:
        return list(self.loop.wired.run.trace)

    @property
    def seconds(self) -> float:
        return self.loop.now_ns / 1e9

    @property
    def is_in_zone(self) -> bool:
        """Nearer than 1.5 m, or 2.5 m where they look."""
        body, base = self.world.person.body, self.world.base.pose
        bearing = math.remainder(math.atan2(base.y - body.y, base.x - body.x) - body.yaw, math.tau)
        return body.distance_to(base) < (2.5 if abs(bearing) <= math.radians(36.0) else 1.5)

    def go(self, seconds: float) -> None:
        while self.seconds < seconds:
            self.loop.tick()
            if self.world.informed and not self._informed:
                self.signs.append(self.seconds)
            self._informed = self.world.informed
            active = self.loop.wired.run.active
            if "inform/warn" in active or "ask/warn" in active:
                self.moved += [*self._drives()]

    def _drives(self) -> list[str]:
        selected = self.loop.wired.base.selected.source
        moving = self.world.arm.state.moving
        return ([selected] if selected is not None else []) + (["arm"] if moving else [])

    def entered(self) -> list[tuple[float, str]]:
        return [
            (r.time / 1e9, r.subject)
            for r in self.trace
            if r.kind == "enter" and r.subject in BEHAVIOURS
        ]


@pytest.fixture
def cornered(tmp_path: Path) -> Callable[..., Cornered]:
    def make(manner: str, away: float = 1.6, *, walks_up: bool = False, seed: int = 0) -> Cornered:
        return Cornered(tmp_path, away, manner, walks_up, seed)

    return make


@pytest.mark.requirement(72, 101, 114, 116, 117)
@pytest.mark.parametrize("manner", ["attentive", "instant"])
@pytest.mark.parametrize("seed", [0, pytest.param(1, marks=pytest.mark.slow)])
def test_beside_somebody_who_stands_before_a_corner_the_robot_gets_out_or_asks_once(
    cornered: Callable[..., Cornered], manner: str, seed: int
) -> None:
    """`instant` people never leave."""
    run = cornered(manner, seed=seed)
    run.go(45.0)

    asked = [time for time, name in run.entered() if name == "ask"]
    assert not run.is_in_zone or len(asked) == 1
    assert all(later - sooner >= 10.0 for sooner, later in itertools.pairwise(run.signs))
    assert len(run.signs) <= 1
    assert run.moved == []
    assert run.world.collisions.contacts == ()
    assert run.world.collisions.wall_hits == 0
    entered = [time for time, _ in run.entered()]
    short = [after - before < 0.5 for before, after in itertools.pairwise(entered)]
    assert not any(all(three) for three in zip(short, short[1:], short[2:], strict=False))


@pytest.mark.requirement(101, 116)
@pytest.mark.parametrize("away", [1.6, 2.0])
def test_somebody_who_walks_up_to_a_robot_in_a_corner_is_not_touched_nor_shown_it_again_and_again(
    cornered: Callable[..., Cornered], away: float
) -> None:
    run = cornered("attentive", away, walks_up=True)
    run.go(40.0)

    assert run.world.collisions.contacts == ()
    assert run.world.collisions.wall_hits == 0
    assert len(run.signs) <= 2
    assert run.moved == []
    last_time, last = run.entered()[-1]
    assert last == "chase"
    assert run.seconds - last_time > 5.0


@pytest.mark.requirement(101)
def test_with_room_beside_somebody_who_stands_too_near_the_robot_goes_out_by_itself(
    cornered: Callable[..., Cornered],
) -> None:
    """2.2 m before the corner they leave a way along the wall; nobody has to be shown anything."""
    run = cornered("instant", 2.2)
    assert run.is_in_zone
    run.go(20.0)

    assert not run.is_in_zone
    assert run.signs == []
    assert run.world.collisions.contacts == ()
