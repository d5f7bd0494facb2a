"""The benchmark's charts in py_trees."""

from __future__ import annotations

from typing import Any

from cobodeck.bench.harness import Work
from cobodeck.bench.peers.calls import LEAVES, Calls, work


class PyTrees:
    """py_trees: behaviours under a Parallel, ticked by `tick_once`."""

    MODULES = "py_trees"

    @staticmethod
    def _behaviour(calls: Calls, name: str, busy: int | None) -> Any:
        import py_trees

        class Behaviour(py_trees.behaviour.Behaviour):
            left: int | None = None

            def initialise(self) -> None:
                self.left = busy

            def update(self) -> Any:
                calls.count += 1
                if self.left is None:
                    return py_trees.common.Status.RUNNING
                self.left -= 1
                done = self.left < 0
                return py_trees.common.Status.SUCCESS if done else py_trees.common.Status.RUNNING

        return Behaviour(name)

    @classmethod
    def _parallel(cls, calls: Calls, busy: list[int | None]) -> Any:
        import py_trees

        policy = py_trees.common.ParallelPolicy.SuccessOnOne()
        children = [cls._behaviour(calls, f"b{n}", ticks) for n, ticks in enumerate(busy)]
        return py_trees.composites.Parallel("parallel", policy=policy, children=children)

    @classmethod
    def _repeated(cls, children: list[Any]) -> Any:
        import py_trees

        sequence = py_trees.composites.Sequence("steps", memory=True, children=children)
        return py_trees.decorators.Repeat("again", child=sequence, num_success=-1)

    @classmethod
    def pair(cls) -> Work:
        """One monitor, one action."""
        calls = Calls()
        return work(cls._parallel(calls, [None, None]).tick_once, calls)

    @classmethod
    def parallel(cls, count: int = 100) -> Work:
        """So many at once."""
        calls = Calls()
        return work(cls._parallel(calls, [None] * count).tick_once, calls)

    @classmethod
    def steps(cls) -> Work:
        """One after the other, beside a monitor."""
        calls = Calls()
        children = [cls._behaviour(calls, f"s{n}", 1) for n in range(50)]
        root = cls._parallel(calls, [None])
        root.add_child(cls._repeated(children))
        return work(root.tick_once, calls)

    @classmethod
    def guarded(cls) -> Work:
        """A guard ends a Parallel, the next one begins."""
        calls = Calls()
        root = cls._repeated([cls._parallel(calls, [1, None]) for _ in range(50)])
        return work(root.tick_once, calls)

    @classmethod
    def load(cls, leaves: int = LEAVES) -> Any:
        """A tree of so many leaves, made by Python code; its own XML reader is experimental."""
        import py_trees

        calls = Calls()
        root = py_trees.composites.Sequence("large", memory=True)
        for box in range(10):
            inner = py_trees.composites.Sequence(f"box_{box}", memory=True)
            for step in range(leaves // 10):
                inner.add_child(cls._behaviour(calls, f"step_{box}_{step}", 1))
            root.add_child(inner)
        root.setup_with_descendants()
        return root

    @classmethod
    def loading(cls, leaves: int = LEAVES) -> Work:
        """Making it anew each time."""
        return work(lambda: cls.load(leaves), Calls())
