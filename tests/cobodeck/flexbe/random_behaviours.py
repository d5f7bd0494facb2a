"""Behaviours by chance, whose names and values mean something to YAML, Python or the engine."""

from __future__ import annotations

from random import Random
from typing import Any

from tests.cobodeck.flexbe.generated import code
from tests.cobodeck.flexbe.test_convert import behaviour, concurrency, machine, state

STATES = ("true", "no", "class", "a b", "it's", "a?", "1st", "ä", "do", "$x", "a.b", "a/b", "next")
STATES += ("-", "states", "lambda", "None", "error", "A", "a_b", "Log", "#", "[x]", "self", "a_b_2")
ENDS = ("done", "failed", "true", "False", "timeout", "error", "preempted", "no", "a b", "2nd")
ENDS += ("it's", "stopped", "no_condition", "None", "$x", "done_", "error_", "next")
KEYS = ("goal", "in_", "out", "data", "class_", "self", "ctx", "true", "x", "x_", "none", "pose")
KEYS += ("data_", "input_value", "outcomes", "run", "default", "Goal", "ROOT", "a_x", "_")
CLASSES = ("Log", "pkg__Wait", "DriveTo", "Action", "Context", "wait", "Run", "a.b.C", "_State")
CLASSES += ("OperatorDecisionState", "SubscriberState", "LogState", "SetKey", "Any", "class_")
CLASSES += ("CalculationState", "FlexibleCalculationState", "CheckConditionState", "DecisionState")
VALUES: tuple[Any, ...] = (None, True, 0, -1.5, 1e300, 10**20, "", "5 s", "$y", "none", "a: b", "~")
VALUES += (
    [],
    [1, [None, "off"]],
    {"a": 1},
    {},
    "say \"\\'",
    "Ä\n\tb",
    "yes",
    "#",
    " x ",
    "{}",
    "\\N",
)
CODE = (
    "lambda x: x + 1",
    "lambda x, y: [x, self.speed]",
    "lambda *a: sum(a)",
    "self.near",
    "PI / 2",
)
CODE += (
    "self.speed",
    "self.speed * 2",
    "Pose(1)",
    "lambda x: x['a'] if x else None",
    "lambda: '$'",
)
CODE += ("[self.x, 1]", "lambda x: [y for y in x if y != self.x_]", "lambda x: {'a': x}")
LEVELS = ("Off", "Low", "High", "Full", "Inherit")


class RandomBehaviour:
    """One behaviour, of about ten states at the most."""

    def __init__(self, seed: int) -> None:
        self.random = Random(seed)
        self.containers: dict[str, Any] = {}
        self.embedded: dict[str, list[str]] = {}
        self.left = self.random.randint(0, 10)

    def json(self) -> dict[str, Any]:
        """The behaviour as neutral JSON."""
        names = self.some(("speed", "x", "x_", *KEYS), 4)
        parameters = {name: self.value() for name in names}
        root = self.container(0)
        found = behaviour(root, parameters, **self.containers)
        return found | {"behaviors": list(self.embedded.values()), "root": None}

    def container(self, depth: int) -> dict[str, Any]:
        pick = self.random
        outcomes = self.some(ENDS, 3) or ["done"]
        count = min(self.left, pick.choice((0, 1, 2, 2, 3, 4)))
        self.left -= count
        names = self.some(STATES, count, least=count)
        states = [self.state(name, [*names, *outcomes, "nowhere"], depth) for name in names]
        keys = {"input_keys": self.some(KEYS, 2), "output_keys": self.some(KEYS, 2)}
        more: dict[str, Any] = {key: value for key, value in keys.items() if value}
        kind = pick.choice(("statemachine", "statemachine", "concurrency", "priority"))
        if kind == "concurrency":
            rules = [[pick.choice(outcomes), self.condition(states)] for _ in range(4)]
            return concurrency(rules, *states, outcomes=outcomes, **more)
        return machine(*states, outcomes=outcomes, **more) | {"kind": kind}

    def condition(self, states: list[dict[str, Any]]) -> list[list[str]]:
        chosen = self.some(states, 2)
        pairs = [
            (one["name"], self.some([*one["transitions"], "x"], 1, least=1)[0]) for one in chosen
        ]
        return [list(pair) for pair in pairs]

    def state(self, name: str, targets: list[str], depth: int) -> dict[str, Any]:
        pick = self.random
        ends = self.some(ENDS, 3)
        more: dict[str, Any] = {}
        if depth < 3 and pick.random() < 0.3:
            inner = self.container(depth + 1)
            more["container"] = f"_sm_{len(self.containers)}"
            self.containers[more["container"]] = inner
            ends = pick.choice((ends, inner["outcomes"]))
        elif pick.random() < 0.15:
            cls = pick.choice(("OtherSM", "pkg__Other_SM", "MySelfSM", "classSM"))
            self.embedded[f"{cls}{name}"] = [cls, name]
            more |= {"behavior": cls, "args": self.embedding()}
        else:
            more |= {"class": pick.choice(CLASSES), "args": self.arguments(ends)}
            more["pos"] = [self.value() for _ in range(pick.choice((0, 0, 0, 1, 2)))]
        levels = {end: f"Autonomy.{pick.choice(LEVELS)}" for end in ends}
        if pick.random() < 0.5:
            more["remapping"] = {key: pick.choice(KEYS) for key in self.some(KEYS, 3)}
        transitions = {end: pick.choice(targets) for end in ends}
        return state(name, transitions, **more) | {"autonomy": levels}

    def arguments(self, ends: list[str]) -> dict[str, Any]:
        names = self.some(("calculation", "predicate", "conditions", "class_", "x", *KEYS), 3)
        found = {name: self.value() for name in names}
        if self.random.random() < 0.3:
            found |= {"outcomes": ends, "input_keys": self.some(KEYS, 2)}
        return found

    def embedding(self) -> dict[str, Any]:
        given = {key: self.value(code=False) for key in self.some(("x", "speed", *KEYS), 2)}
        ways = ({}, {"parameters": given}, {"parameters": {"expr": "{'x': self.speed}"}})
        return {**self.random.choice(ways), "default_keys": self.some(KEYS, 2)}

    def value(self, *, code: bool = True) -> Any:
        if code and self.random.random() < 0.4:
            return {"expr": self.random.choice(CODE)}
        return self.random.choice(VALUES)

    def some(self, of: Any, most: int, least: int = 0) -> list[Any]:
        return self.random.sample(list(of), min(len(of), self.random.randint(least, most)))

    def create(self) -> str:
        """Lines of `create`: private variables, and first values of userdata."""
        lines = ["PI = 3.14", "joints = ['j%d' % i for i in range(3)]"]
        made = (f"{key} = {code(self.value())}" for key in self.some(KEYS, 3))
        return "\n".join([*lines, *(f"_state_machine.userdata.{line}" for line in made)])
