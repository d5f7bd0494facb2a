"""What can happen to the charts of the examples, as scripts; together they take every edge."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

from cobodeck.testing import ChartTester

REAL = {
    "tea": ("Wait", "Below", "Above", "WaitFor", "Index", "Sum", "Log"),
    "patrol": ("Sum", "Compare", "Log"),
    "door_watch": ("Below", "Log"),
}
"""The states of each chart that are not scripted."""
LEVELS = {
    "tea": {"battery.level": 1.0, "user.distance": 9.0},
    "door_watch": {"user.distance": 9.0},
}
"""What their signals say where a story says nothing else: the battery is full, nobody is near."""
ARRIVED = ["arrived"] * 9
BROKEN = RuntimeError("a wheel is off")


class Story(NamedTuple):
    """A chart, its outcome, how its scripted states end, and what its signals say over time."""

    chart: str
    outcome: str
    script: Mapping[str, Any]
    series: Mapping[str, Mapping[float, Any]] = {}
    parameters: Mapping[str, Any] | None = None


def begin(sim: ChartTester, story: Story) -> None:
    """Start a story."""
    levels, real = LEVELS.get(story.chart, {}), REAL.get(story.chart, ())
    sim.start(story.chart, story.script, real=real, signals=levels, parameters=story.parameters)
    for name, value in levels.items():
        sim.signal(name, value, hold=True)
    for name, values in story.series.items():
        sim.series(name, values)


SERVING = {"fetch/drive": "arrived", "bring/drive": ARRIVED, "home/drive": "arrived"}
LOW = {"battery.level": {0: 1.0, 20: 0.2, 60: 0.95}}
TEA = {
    "nobody takes the tea": Story("tea", "served", SERVING),
    "everybody takes the tea": Story("tea", "served", SERVING, {"user.distance": {0: 1.0}}),
    "a table cannot be reached": Story(
        "tea", "served", {**SERVING, "bring/drive": ["lost", *ARRIVED]}
    ),
    "a chair is in the way for a while": Story(
        "tea", "served", {**SERVING, "bring/drive": ["no_path", "no_path", "stuck", *ARRIVED]}
    ),
    "the battery gets low": Story("tea", "served", {**SERVING, "charge/drive": "arrived"}, LOW),
    "the battery stays low": Story(
        "tea", "failed", {**SERVING, "charge/drive": "arrived"},
        {"battery.level": {0: 1.0, 20: 0.2}},
    ),
    "the dock cannot be reached": Story("tea", "failed", {**SERVING, "charge/drive": "lost"}, LOW),
    "the bumper is hit": Story("tea", "failed", SERVING, {"stop.engaged": {10: "bumper"}}),
    "the operator calls it back": Story(
        "tea", "served", SERVING, {"operator.acknowledge": {10: True}}
    ),
    "the kitchen cannot be reached": Story("tea", "failed", {"fetch/drive": ["no_path"] * 11}),
    "the last way is blocked": Story("tea", "failed", {**SERVING, "home/drive": ["stuck"] * 11}),
    "a drive never ends": Story("tea", "failed", {}),
    "a drive breaks down": Story("tea", "failed", {"fetch/drive": BROKEN}),
}  # fmt: skip

ROUNDS = {"DriveThrough": ARRIVED, "home/drive": "arrived"}
PATROL = {
    "a patrol goes its rounds": Story("patrol", "done", ROUNDS),
    "a patrol goes a round in any case": Story("patrol", "done", ROUNDS, {}, {"rounds": 0}),
    "a patrol is blocked, and goes on": Story(
        "patrol", "done", {**ROUNDS, "DriveThrough": ["no_path"] * 4 + ["stuck"] * 4}
    ),
    "a patrol is lost": Story("patrol", "failed", {"DriveThrough": "lost"}),
    "a patrol breaks down": Story("patrol", "failed", {"DriveThrough": BROKEN}),
    "a patrol does not get home": Story("patrol", "failed", {**ROUNDS, "home/drive": "lost"}),
}

COMES = {"user.distance": {0: 9.0, 30: 2.0}}
DOOR = {
    "somebody is at the door": Story("door_watch", "seen", {"DriveTo": "arrived"}, COMES),
    "nobody is at the door": Story("door_watch", "nobody", {"DriveTo": "arrived"}),
    "the door cannot be reached": Story("door_watch", "failed", {"DriveTo": "lost"}),
    "the way home is blocked after a visit": Story(
        "door_watch", "failed", {"go/drive": "arrived", "home/drive": "lost"}, COMES
    ),
    "the way home is blocked": Story(
        "door_watch", "failed", {"go/drive": "arrived", "back/drive": "lost"}
    ),
}

DOCK = {
    "a robot docks": Story("docking", "docked", {"DriveTo": "arrived"}),
    "a robot docks at last": Story(
        "docking", "docked",
        {"align/drive": ARRIVED, "enter": ["stuck", "no_path", "lost", "arrived"]},
    ),
    "a robot never docks": Story(
        "docking", "gave_up",
        {"align/drive": ["lost", *ARRIVED], "enter": BROKEN, "back/drive": "arrived"},
    ),
    "a robot never docks and cannot go back": Story(
        "docking", "gave_up", {"DriveTo": ["lost"] * 9}
    ),
}  # fmt: skip

FOLLOW = {
    "the person stays": Story("follow_me", "there", {"there": "settled"}),
    "the person is lost": Story("follow_me", "lost", {"lost": "lost"}),
    "the person cannot be reached": Story("follow_me", "lost", {"follow": ["no_path"] * 11}),
    "the robot does not know where it is": Story("follow_me", "lost", {"follow": "lost"}),
    "the robot breaks down": Story("follow_me", "failed", {"follow": BROKEN}),
    "the bumper is hit while following": Story(
        "follow_me", "failed", {"fault": ("there", {"value": "bumper"})}
    ),
}

MOVED = {
    "OpenGripper": "opened",
    "MoveArmTo": "arrived",
    "close": "holding",
    "lower/lower/move": [],
    "stands": "felt",
    "ParkArm": "parked",
}
FAILS = {
    "work/open": "failed",
    "above/move": "no_solution",
    "down/move": "blocked",
    "close": "failed",
    "lift/move": "failed",
    "across/move": BROKEN,
    "release": "failed",
    "up/move": "blocked",
    "park": "failed",
}
PICK = {
    "a cup is moved": Story("pick_and_place", "done", MOVED),
    "there is no cup": Story("pick_and_place", "empty", {**MOVED, "close": "empty"}),
    "there is no cup, and the arm jams": Story(
        "pick_and_place", "failed", {**MOVED, "close": "empty", "nothing": "failed"}
    ),
    "there is no table": Story(
        "pick_and_place", "failed", {**MOVED, "stands": [], "lower/lower/move": "arrived"}
    ),
    "the arm jams on its way down": Story(
        "pick_and_place", "failed", {**MOVED, "stands": [], "lower/lower/move": "failed"}
    ),
    "the arm never arrives": Story("pick_and_place", "failed", {**MOVED, "MoveArmTo": []}),
    "the gripper raises": Story("pick_and_place", "failed", {**MOVED, "work/open": BROKEN}),
    **{
        f"{node} fails": Story("pick_and_place", "failed", {**MOVED, node: outcome})
        for node, outcome in FAILS.items()
    },
}

STORIES = {**TEA, **PATROL, **DOOR, **DOCK, **FOLLOW, **PICK}
"""By what happens."""
