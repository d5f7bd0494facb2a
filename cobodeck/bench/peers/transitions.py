"""The benchmark's charts in transitions."""

from __future__ import annotations

import json
import logging
from typing import Any

from cobodeck.bench.harness import Work
from cobodeck.bench.peers.calls import LEAVES, Calls, work


class Transitions:
    """transitions: a HierarchicalMachine, one event per tick, steps as conditions."""

    MODULES = "transitions.extensions"

    @staticmethod
    def _machine(calls: Calls, states: list[Any], initial: str, moves: list[Any]) -> Any:
        from transitions.extensions import HierarchicalMachine

        logging.getLogger("transitions").setLevel(logging.ERROR)

        class Model:
            """Holds the step functions."""

            busy = staticmethod(calls.busy)
            ends = staticmethod(calls.ends)

        model = Model()
        machine = HierarchicalMachine(
            model, states=states, initial=initial, transitions=moves, auto_transitions=False
        )
        model.machine = machine  # type: ignore[attr-defined]
        return model

    @staticmethod
    def _move(source: str, target: str | None, step: str) -> dict[str, Any]:
        return {"trigger": "tick", "source": source, "dest": target, "conditions": step}

    @classmethod
    def pair(cls) -> Work:
        """One monitor, one action."""
        calls = Calls()
        states = [{"name": "p", "parallel": ["w", "a"]}]
        moves = [cls._move("p_w", None, "busy"), cls._move("p_a", None, "busy")]
        return work(cls._machine(calls, states, "p", moves).tick, calls)

    @classmethod
    def parallel(cls, count: int = 100) -> Work:
        """So many at once."""
        calls = Calls()
        names = [f"a{n}" for n in range(count)]
        moves = [cls._move(f"p_{name}", None, "busy") for name in names]
        return work(cls._machine(calls, [{"name": "p", "parallel": names}], "p", moves).tick, calls)

    @classmethod
    def steps(cls) -> Work:
        """One after the other, beside a monitor."""
        calls = Calls()
        inner = {"name": "s", "children": ["a", "b"], "initial": "a"}
        states = [{"name": "p", "parallel": ["w", inner]}]
        moves = [
            cls._move("p_w", None, "busy"),
            cls._move("p_s_a", "p_s_b", "ends"),
            cls._move("p_s_b", "p_s_a", "ends"),
        ]
        return work(cls._machine(calls, states, "p", moves).tick, calls)

    @classmethod
    def guarded(cls) -> Work:
        """A guard ends a parallel state, the next one begins."""
        calls = Calls()
        states = [{"name": name, "parallel": ["g", "w"]} for name in ("one", "two")]
        moves = [cls._move("one_g", "two", "ends"), cls._move("two_g", "one", "ends")]
        return work(cls._machine(calls, states, "one", moves).tick, calls)

    @classmethod
    def load(cls, leaves: int = LEAVES) -> Any:
        """So many states and their transitions from JSON."""
        return cls._read(_text(leaves))

    @classmethod
    def _read(cls, text: str) -> Any:
        definition = json.loads(text)
        return cls._machine(Calls(), definition["states"], "s0", definition["moves"])

    @classmethod
    def loading(cls, leaves: int = LEAVES) -> Work:
        """Reading it anew each time."""
        text = _text(leaves)
        return work(lambda: cls._read(text), Calls())


def _text(leaves: int) -> str:
    moves = [
        {"trigger": trigger, "source": f"s{n}", "dest": target}
        for n in range(leaves)
        for trigger, target in (
            ("arrived", f"s{(n + 1) % leaves}"),
            ("blocked", "failed"),
            ("timeout", "failed"),
        )
    ]
    return json.dumps({"states": [*(f"s{n}" for n in range(leaves)), "failed"], "moves": moves})
