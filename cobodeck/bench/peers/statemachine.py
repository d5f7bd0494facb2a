"""The benchmark's charts in python-statemachine."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

from cobodeck.bench.harness import Work
from cobodeck.bench.peers.calls import LEAVES, Calls, work


class StateMachine:
    """python-statemachine: a StateChart, one event per tick, steps as conditions."""

    MODULES = "statemachine"

    @staticmethod
    def _class(states: dict[str, Any]) -> Any:
        from statemachine.io import create_machine_class_from_definition

        return create_machine_class_from_definition("Bench", states=states)

    @classmethod
    def _work(cls, calls: Calls, states: dict[str, Any]) -> Work:
        chart = cls._class(states)()
        return work(lambda: chart.send("tick"), calls)

    @staticmethod
    def _state(name: str, step: Callable[..., bool], target: str = "") -> dict[str, Any]:
        move: dict[str, Any] = {"target": target or name, "internal": not target}
        # explicit signatures, because the library inspects those of its callbacks
        return {"initial": True, "on": {"tick": [move | {"cond": lambda: step()}]}}

    @classmethod
    def _regions(cls, calls: Calls, count: int) -> Work:
        states = {f"a{n}": cls._state(f"a{n}", calls.busy) for n in range(count)}
        return cls._work(calls, {"p": {"initial": True, "parallel": True, "states": states}})

    @classmethod
    def pair(cls) -> Work:
        """One monitor, one action."""
        return cls._regions(Calls(), 2)

    @classmethod
    def parallel(cls, count: int = 100) -> Work:
        """So many at once."""
        return cls._regions(Calls(), count)

    @classmethod
    def steps(cls) -> Work:
        """One after the other, beside a monitor."""
        calls = Calls()
        inner = {"a": cls._state("a", calls.ends, "b"), "b": cls._state("b", calls.ends, "a")}
        inner["b"]["initial"] = False
        regions = {"w": cls._state("w", calls.busy), "s": {"initial": True, "states": inner}}
        return cls._work(calls, {"p": {"initial": True, "parallel": True, "states": regions}})

    @classmethod
    def guarded(cls) -> Work:
        """A guard ends a parallel state, the next one begins."""
        calls = Calls()
        states = {}
        for name, other in (("one", "two"), ("two", "one")):
            guard = cls._state(f"{name}_g", calls.ends, other)
            regions = {f"{name}_g": guard, f"{name}_w": {"initial": True}}
            states[name] = {"initial": name == "one", "parallel": True, "states": regions}
        return cls._work(calls, states)

    @classmethod
    def load(cls, leaves: int = LEAVES) -> Any:
        """So many states and their transitions from JSON."""
        return cls._read(_text(leaves))

    @classmethod
    def _read(cls, text: str) -> Any:
        return cls._class(json.loads(text))()

    @classmethod
    def loading(cls, leaves: int = LEAVES) -> Work:
        """Reading it anew each time."""
        text = _text(leaves)
        return work(lambda: cls._read(text), Calls())


def _text(leaves: int) -> str:
    states: dict[str, Any] = {
        f"s{n}": {
            "initial": n == 0,
            "on": {
                "arrived": [{"target": f"s{(n + 1) % leaves}"}],
                "blocked": [{"target": "failed"}],
                "timeout": [{"target": "failed"}],
            },
        }
        for n in range(leaves)
    }
    return json.dumps(states | {"failed": {"final": True}})
