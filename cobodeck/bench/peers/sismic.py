"""The benchmark's charts in sismic."""

from __future__ import annotations

from typing import Any

from cobodeck.bench.harness import Work
from cobodeck.bench.peers.calls import LEAVES, Calls, work


class Sismic:
    """sismic: an Interpreter, one event per tick, steps as guards."""

    MODULES = "sismic.io, sismic.interpreter"

    @staticmethod
    def _interpreter(calls: Calls, root: str) -> Any:
        from sismic.interpreter import Interpreter
        from sismic.io import import_from_yaml

        text = "statechart:\n  name: bench\n  root state:\n    name: root\n" + root
        context = {"busy": calls.busy, "ends": calls.ends}
        interpreter = Interpreter(import_from_yaml(text), initial_context=context)
        interpreter.execute()
        return interpreter

    @classmethod
    def _work(cls, root: str) -> Work:
        calls = Calls()
        interpreter = cls._interpreter(calls, root)
        return work(lambda: interpreter.queue("tick").execute(), calls)

    @staticmethod
    def _state(name: str, guard: str, target: str = "", indent: int = 6) -> str:
        pad = " " * indent
        to = f"\n{pad}      target: {target}" if target else ""
        return (
            f"{pad}- name: {name}\n{pad}  transitions:\n"
            f"{pad}    - event: tick\n{pad}      guard: {guard}(){to}\n"
        )

    @classmethod
    def pair(cls) -> Work:
        """One monitor, one action."""
        leaves = cls._state("w", "busy") + cls._state("a", "busy")
        return cls._work("    parallel states:\n" + leaves)

    @classmethod
    def parallel(cls, count: int = 100) -> Work:
        """So many at once."""
        leaves = "".join(cls._state(f"a{n}", "busy") for n in range(count))
        return cls._work("    parallel states:\n" + leaves)

    @classmethod
    def steps(cls) -> Work:
        """One after the other, beside a monitor."""
        inner = cls._state("a", "ends", "b", 10) + cls._state("b", "ends", "a", 10)
        steps = "      - name: s\n        initial: a\n        states:\n" + inner
        return cls._work("    parallel states:\n" + cls._state("w", "busy") + steps)

    @classmethod
    def guarded(cls) -> Work:
        """A guard ends a parallel state, the next one begins."""
        root = "    initial: one\n    states:\n"
        for name, other in (("one", "two"), ("two", "one")):
            root += f"      - name: {name}\n        parallel states:\n"
            root += cls._state(f"{name}_g", "ends", other, 10) + f"          - name: {name}_w\n"
        return cls._work(root)

    @classmethod
    def load(cls, leaves: int = LEAVES) -> Any:
        """So many states and their transitions from YAML, checked as it does."""
        return cls._read(_text(leaves))

    @staticmethod
    def _read(text: str) -> Any:
        from sismic.io import import_from_yaml

        return import_from_yaml(text)

    @classmethod
    def loading(cls, leaves: int = LEAVES) -> Work:
        """Reading it anew each time."""
        text = _text(leaves)
        return work(lambda: cls._read(text), Calls())


def _text(leaves: int) -> str:
    states = "".join(
        f"      - name: s{n}\n        transitions:\n"
        f"          - {{event: arrived, target: s{(n + 1) % leaves}}}\n"
        "          - {event: blocked, target: failed}\n"
        "          - {event: timeout, target: failed}\n"
        for n in range(leaves)
    )
    root = "statechart:\n  name: large\n  root state:\n    name: root\n    initial: s0\n"
    return f"{root}    states:\n{states}      - name: failed\n"
