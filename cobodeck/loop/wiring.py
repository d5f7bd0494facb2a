"""Connects a setup's chart with the parts of a robot and with the signals that it needs.

Only signals that a reachable state or the recorder can ask for are built, and only their samples
are passed on to the run.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from behaviors import ESTIMATE
from cobodeck.loop.old_lines import OldLines
from cobodeck.loop.plant import Inert
from cobodeck.loop.sample_router import Inlet
from cobodeck.setup import Setup, Uses, reachable
from cobodeck.terminal import FAILED, Problem
from engine.machine import Leaf
from engine.run import ChartRun
from engine.signals import Board, Signal, compute, roots
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
            if self.base.reckons and ESTIMATE in self.board.slots:
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
            base.locate(0, None, None)
            return
        pose, sigma = found.value
        base.locate(found.stamp, pose, sigma)
        self.inlet.tell(Sample("base.pose", found.stamp, pose), now_ns)
        self.inlet.tell(Sample("base.pose_sigma", found.stamp, sigma), now_ns)

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
    hint = "; give a room with --scene" if setup.scene is None else ""
    scanning = any("base.scan" in part.signals for part in parts.values())
    declared = setup.signals if scanning else setup.signals_without_scans
    refuse_what_is_missing(leaves, declared, parts, constants, hint)
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


def refuse_what_is_missing(
    leaves: Iterable[Leaf],
    signals: Mapping[str, Signal],
    parts: Mapping[str, Any],
    constants: Iterable[str],
    hint: str = "",
) -> None:
    """Check that all parts and signals exist that the reachable states command and read.

    Raises:
        Problem: the text names every missing part and signal, and a state that needs it.
    """
    given = {name for part in parts.values() for name in part.signals} | set(constants)
    lacking: dict[str, None] = {}
    for leaf in leaves:
        who = leaf.interface.name
        for name in leaf.interface.commands:
            if name not in parts:
                lacking[f"this robot lacks part {name!r}, commanded by {who}"] = None
        for name in leaf.interface.reads:
            for root in sorted(roots(signals, (name,)) - given):
                through = "" if root == name else f" through {name!r}"
                lacking[f"nothing gives signal {root!r}, read by {who}{through}"] = None
    if lacking:
        told = "\n  ".join(lacking)
        raise Problem(f"this chart cannot run here{hint}:\n  {told}", FAILED)


def refuse_slow_ticks(setup: Setup, uses: Uses, latency: float = 0.0) -> None:
    """Check that velocity commands arrive more often than the safety chain's time-out.

    Args:
        setup: what is to be run.
        uses: of the chart; a chart that does not command the base may tick at any rate.
        latency: simulated delay from a tick to the robot, s.

    Raises:
        Problem: they do not; the base would stop and go.
    """
    oldest = 1.0 / setup.tick_hz + latency
    limits = setup.profile.safety.limits(setup.robot, setup.profile.robot.limits)
    if "base" in uses.commands and oldest >= limits.command_age:
        raise Problem(
            f"at {setup.tick_hz} Hz a velocity of the base is {oldest * 1e3:.1f} ms old before the "
            f"next one comes; the safety chain stops the base if that is not less than "
            f"{limits.command_age * 1e3:g} ms: raise --tick-hz"
        )


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
