"""Connects a setup's chart with the parts of a robot and with the signals that it needs.

Only signals that a reachable state or the recorder can ask for are built, and only their samples
are passed on to the run.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from behaviors import ESTIMATE
from cobodeck.fitness import require
from cobodeck.loop.old_lines import OldLines
from cobodeck.loop.plant import Inert
from cobodeck.loop.sample_router import Inlet
from cobodeck.setup import Setup, reachable
from engine.run import ChartRun
from engine.signals import Board, compute
from hw import RobotPart, Sample
from hw.safety import GuardedBase

ValueTap = Callable[[str, Any], Any]
"""Wraps a part, given its name and the part."""


class WithoutMotion:
    """Adds the `stop` that the engine requires of every part to a part that cannot move."""

    def __init__(self, part: RobotPart) -> None:
        self._part = part

    def __getattr__(self, name: str) -> Any:
        return getattr(self._part, name)

    def stop(self) -> None:
        """Do nothing; nothing moves."""


@dataclass(frozen=True, slots=True)
class Wired:
    """A run with its board, its inlet, and the base that its states drive; its trace is kept whole.

    `show`, if any, updates the robot shown in VR; it is called in every tick (see `Vr`).
    """

    run: ChartRun
    board: Board
    inlet: Inlet
    base: GuardedBase | None = None
    show: Callable[[int], None] | None = None

    def __post_init__(self) -> None:
        self.run.trace.archive = OldLines()

    def pass_on(self, stamp_ns: int) -> None:
        """Pass the tick's results on: base command from `stamp_ns` on, and what the VR shows."""
        if self.base is not None:
            if self.base.chain.reckons and ESTIMATE in self.board.slots:
                self._locate(self.base, stamp_ns)
            self.base.tick(stamp_ns)
        if self.show is not None:
            self.show(stamp_ns)

    def _locate(self, base: GuardedBase, now_ns: int) -> None:
        """Pass the pose that localization estimates on to the safety chain."""
        slot = self.board.slots[ESTIMATE]
        compute(slot)  # what it raises is raised again in the states that read it
        found = slot.newest
        if found is None:
            base.chain.locate(0, None, None)
            return
        pose, sigma = found.value
        base.chain.locate(found.stamp, pose, sigma)
        self.inlet.notify(Sample("base.pose", found.stamp, pose), now_ns)
        self.inlet.notify(Sample("base.pose_sigma", found.stamp, sigma), now_ns)

    def tick(self, now_ns: int, stamp_ns: int, between: bool = False) -> str | None:
        """Tick the run, then the base; returns the chart's outcome, None while it runs.

        `stamp_ns` is the instant from which the base is commanded, which may lie between two ticks
        of the grid. `between`: this tick is off the grid (rule 13).
        """
        try:
            return self.run.tick(now_ns, between)
        except BaseException:
            self.run.hold()
            raise
        finally:
            self.pass_on(stamp_ns)


def wire(
    setup: Setup,
    parts: Mapping[str, Any],
    *,
    eager: bool = False,
    clock: Callable[[], int] | None = None,
    parameters: Mapping[str, Any] | None = None,
    tap: ValueTap | None = None,
) -> Wired:
    """A run of the setup's chart on these parts.

    Args:
        setup: what to run.
        parts: the robot and what is around it, by name.
        eager: build and compute every signal in every tick, whether it is read or not.
        clock: returns the time, ns; used only to report computing times.
        parameters: of the chart.
        tap: wraps the parts that states are given.

    Raises:
        Problem: the chart commands parts or reads signals that do not exist; it names them all.
    """
    machine = setup.machine(parameters)
    leaves = reachable(machine)
    constants = setup.constants
    scanning = any("base.scan" in part.signals for part in parts.values())
    declared = setup.signals if scanning else setup.signals_without_scans
    require("wire", setup=setup, leaves=leaves, declared=declared, parts=parts)
    wanted = {name for leaf in leaves for name in leaf.interface.reads}
    if setup.localizing is not None:
        wanted.add(ESTIMATE)  # the safety chain uses it
    board = Board(declared, wanted, eager)
    if clock is not None:
        board.clock = clock
    given = commanded(parts)
    if tap is not None:
        given = {name: tap(name, part) for name, part in given.items()}
    run = ChartRun(machine, board, given, freezers=freezers())
    hears = [(name, part.hear) for part in parts.values() for name in getattr(part, "hears", ())]
    heard = {name for name, _ in hears}
    needed = {
        key: part
        for key, part in parts.items()
        if any(board.needs(name) or name in heard for name in part.signals)
    }
    inlet = Inlet(board, needed, hears)
    for name, value in constants.items():
        if board.needs(name):
            inlet.put(name, value(), 0)
    show = getattr(parts.get("vr"), "show", None)
    return Wired(run, board, inlet, guarded(parts), show)


def guarded(parts: Mapping[str, Any]) -> GuardedBase | None:
    """The guarded base; None if there is no base, or only a recorded one.

    Raises:
        TypeError: the base has no safety chain in front of its wheels.
    """
    base = parts.get("base")
    if isinstance(base, Inert):
        return None
    if base is not None and not isinstance(base, GuardedBase):
        raise TypeError(
            f"part base is a {type(base).__name__}; wrap it in hw.safety.guarded.GuardedBase"
        )
    return base


def commanded(parts: Mapping[str, Any]) -> dict[str, Any]:
    """The parts by name, each with a `stop`, as states command them."""
    return {
        name: part if hasattr(part, "stop") else WithoutMotion(part) for name, part in parts.items()
    }


def freezers() -> dict[type, Callable[[Any], Any]]:
    """Functions by class that make values immutable when they enter a chart's data."""
    import sys

    if "numpy" not in sys.modules:
        return {}
    import numpy as np

    def freeze(array: Any) -> Any:
        if not array.flags.writeable and array.base is None:
            return array
        fixed = array.copy()
        fixed.setflags(write=False)
        return fixed

    return {np.ndarray: freeze}
