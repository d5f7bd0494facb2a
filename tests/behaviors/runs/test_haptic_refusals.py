"""No touch is refused that could have been served, by a judge that knows nothing of the chooser."""

from __future__ import annotations

import random
from collections import Counter
from collections.abc import Callable, Iterator
from typing import Any

import pytest

from behaviors import haptic
from behaviors.profile.profile import Profile
from cobodeck.run.build_run import stage
from cobodeck.setup.options import Options
from cobodeck.setup.setup import open_setup
from hw import samples
from hw.geometry import STILL, Pose2, Pose3
from hw.samples import UserPose
from hw.scene.room import Room
from hw.scene.scene import load_scene
from hw.sim.world import World
from states.environment.environment import Environment
from tests.behaviors.haptic_judge import USER_RADIUS, Judge
from tests.repeats import SHORT, THOROUGH, fewer

CHOOSE = "haptic/serve/choose"
REQUESTS = 15 if SHORT else 50
COUNT = 300 if THOROUGH else 60
"""Requests in each room."""
ARM_DEPTH = 0.6
"""Farther than this from all walls the arm has room behind the prop, m."""


def requests(room: Room, name: str) -> Iterator[tuple[Pose2, Pose2, Pose3]]:
    """COUNT times robot, user and DEEP, anywhere in a room that they may be."""
    rng, left = random.Random(f"{name} requests"), COUNT
    x_low, y_low, x_high, y_high = room.bounds
    while left:
        robot, user = (
            Pose2(rng.uniform(x_low, x_high), rng.uniform(y_low, y_high), rng.uniform(-3.1, 3.1))
            for _ in range(2)
        )
        clear = (
            room.clearance(user.x, user.y) >= samples.USER_RADIUS
            and room.clearance(robot.x, robot.y) > 0.78
        )
        if clear and robot.distance_to(user) >= USER_RADIUS:
            left -= 1
            ahead, height = rng.uniform(0.7, 0.95), rng.uniform(0.5, 1.6)
            x, y = user.transform(ahead, 0.0)
            yield robot, user, Pose3.from_yaw(x, y, height, user.yaw)


@pytest.mark.requirement(75, 77, 82, 126)
@pytest.mark.parametrize("name", ["lab_a", "lab_b", "hall"])
@pytest.mark.few(1)
def test_what_is_refused_could_not_be_served_and_what_is_chosen_can_be_driven_to(
    context: Any, tuned: Profile, environment_of: Callable[..., Environment], name: str
) -> None:
    room = load_scene(name).room
    environment, seen = environment_of(tuned, room), Counter[str]()
    judge = Judge(room, environment.workspace)
    for robot, user, deep in requests(room, name):
        ctx = context(
            {
                "environment": environment,
                "settings": tuned.settings,
                "base.pose": robot,
                "base.twist": STILL,
                "user.pose": UserPose(user, user.yaw),
                "user.velocity": STILL,
            }
        )
        found = ended(haptic.ChooseHapticPose().run(ctx, deep=deep))
        outcome, goal = (found, None) if isinstance(found, str) else (found[0], found[1]["pose"])
        seen[outcome] += 1
        if outcome != "deep_blocked":
            assert not judge.is_blocked(user, deep)
        if goal is not None:
            assert judge.is_reachable(goal, robot, user)
            assert goal.bearing_to(deep.flat()) == pytest.approx(0.0, abs=1e-9)
        elif not judge.is_blocked(user, deep):
            assert judge.servable(robot, user, deep) is None
            assert outcome != "deep_blocked" or room.clearance(deep.x, deep.y) < ARM_DEPTH
            assert outcome != "no_pose" or not any(judge.free_poses(user, deep))

    assert min(seen["chosen"], seen["close"], seen["deep_blocked"]) > 0


class Asked:
    """An observer of robot, user and DEEP while the user asks for a touch; by time, ns."""

    def __init__(self, world: World) -> None:
        self.world, self.moments = world, dict[int, tuple[Pose2, Pose2, Pose3]]()

    def watch(self, now_ns: int) -> None:
        person = self.world.person
        if person is not None and person.request is not None:
            self.moments[now_ns] = self.world.base.pose, person.body, person.request


@pytest.mark.slow
@pytest.mark.requirement(75, 77, 82, 126)
@pytest.mark.parametrize("seed", fewer(range(10), of=10))
@pytest.mark.parametrize("name", ["lab_a", "lab_b", "hall", "study"])
def test_no_request_of_a_random_user_is_refused_that_could_be_served(name: str, seed: int) -> None:
    setup = open_setup("cobodeck", name, "tuned")
    loop = stage(setup, Options("random", REQUESTS, seed=seed))
    world = loop.plant
    assert isinstance(world, World)
    asked = Asked(world)
    loop.observers = (*loop.observers, asked)
    loop.go(10**9 * 3600)
    judge, run = Judge(setup.environment.room, setup.environment.workspace), loop.wired.run
    ends = [
        (record.time, record.detail[0])
        for record in run.trace
        if record.kind == "outcome" and record.subject == CHOOSE
    ]
    assert len(ends) > 0.6 * REQUESTS
    assert world.collisions.wall_hits == 0
    for time, outcome in ends:
        robot, user, deep = asked.moments[time]
        if outcome == "deep_blocked" and judge.is_blocked(user, deep):
            continue
        if outcome not in ("chosen", "close"):
            assert judge.servable(robot, user, deep) is None


def ended(run: Any) -> Any:
    """The outcome of a state that is given a tick whenever it asks for one."""
    while True:
        try:
            next(run)
        except StopIteration as end:
            return end.value
