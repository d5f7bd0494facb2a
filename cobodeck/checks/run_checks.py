"""A run: does the robot find itself, are ticks frequent enough, was it tried before."""

from __future__ import annotations

import shlex
from collections.abc import Collection, Iterator, Mapping, Sequence
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

from cobodeck.fitness import BAD, NOTE, CheckResult
from cobodeck.real import WORDS, PriorRuns
from cobodeck.terminal import FAILED, REFUSED
from engine import TickGrid
from engine.signals import roots
from hw import needs

if TYPE_CHECKING:
    from cobodeck.setup import Options, Setup, Uses
    from engine.machine import Leaf
    from engine.signals import Signal
    from hw.connection import Connection


def localized(setup: Setup, options: Options) -> Iterator[CheckResult]:
    """Whether a robot with all sensors has a room to localize in, and wheels that measure."""
    from cobodeck.setup import FULL

    if options.tier < FULL:
        return
    if setup.scene is None:
        about = f"tier {options.tier} needs a room to localize in"
        yield CheckResult("scene", BAD, about, "give one with --scene")
    elif setup.robot.sensing.odometry is None:
        about = f"robot {setup.robot.name}: tier {options.tier} needs wheels that measure"
        yield CheckResult("sensing", BAD, about, "its file has no sensing.odometry")


def embodied(setup: Setup, options: Options) -> Iterator[CheckResult]:
    """Whether physics can move the robot: Mecanum wheels, and an arm whose masses are known."""
    from cobodeck.setup import REFERENCE

    if options.tier != REFERENCE:
        return
    arm = setup.robot.arm
    if find_spec("mujoco") is None:
        yield CheckResult("tier 3", BAD, f"tier 3 {needs('mujoco')}")
    if "omni" not in setup.robot.base.modes:
        about = f"robot {setup.robot.name}: tier 3 needs Mecanum wheels"
        yield CheckResult("base", BAD, about, "its file has no mode omni in base.modes")
    if arm is not None and not arm.model.masses:
        about = f"arm {arm.model.name}: tier 3 needs the masses of its links"
        yield CheckResult("arm", BAD, about, "its file has no masses")


def provided(
    setup: Setup,
    leaves: Sequence[Leaf],
    declared: Mapping[str, Signal],
    parts: Mapping[str, Any],
) -> Iterator[CheckResult]:
    """Whether all parts and signals exist that the reachable states command and read."""
    given = {name for part in parts.values() for name in part.signals} | set(setup.constants)
    lacking: dict[str, None] = {}
    for leaf in leaves:
        who = leaf.interface.name
        for name in leaf.interface.commands:
            if name not in parts:
                lacking[f"this robot lacks part {name!r}, commanded by {who}"] = None
        for name in leaf.interface.needed:
            for root in sorted(roots(declared, (name,)) - given):
                through = "" if root == name else f" through {name!r}"
                lacking[f"nothing gives signal {root!r}, read by {who}{through}"] = None
    if lacking:
        hint = "; give a room with --scene" if setup.scene is None else ""
        about = "\n  ".join((f"this chart cannot run here{hint}:", *lacking))
        yield CheckResult(setup.chart.name, BAD, about, code=FAILED)


def given(setup: Setup) -> Iterator[CheckResult]:
    """Whether all inputs of the chart have a value."""
    from cobodeck.setup import wanted_inputs

    machine = setup.machine()
    if wanted := wanted_inputs(machine):
        hint = " ".join(f"--in '{name}=VALUE'" for name in machine.missing)
        yield CheckResult(f"chart {setup.chart.name}", BAD, wanted, f"write {hint}")


def tick_rate(setup: Setup, uses: Uses, options: Options) -> Iterator[CheckResult]:
    """Whether velocities come more often than the safety chain's time-out for them.

    A chart that does not command the base may tick at any rate. The latency from a tick to the
    robot counts where it is simulated.
    """
    if "base" not in uses.commands:
        return
    oldest = 1.0 / setup.tick_hz + _latency(setup, options)
    most = setup.profile.safety.limits(setup.robot, setup.profile.robot.limits).command_age
    if oldest >= most:
        about = (
            f"at {setup.tick_hz} Hz a velocity of the base is {oldest * 1e3:.1f} ms old before the "
            f"next one comes; the safety chain stops the base if that is not less than "
            f"{most * 1e3:g} ms: raise --tick-hz"
        )
        yield CheckResult("ticks", BAD, about)


def latency(setup: Setup, options: Options) -> Iterator[CheckResult]:
    """Whether the latency from the samples of a tick to its commands is shorter than a tick."""
    simulated_ns = round(_latency(setup, options) * 1e9)
    if simulated_ns >= TickGrid(setup.tick_hz).period_ns:
        shown = f"{simulated_ns / 1e6:g} ms is not less than a tick at {setup.tick_hz} Hz"
        about = f"profile {setup.profile.name}: plant.latency of {shown}"
        yield CheckResult("latency", BAD, about)


def _latency(setup: Setup, options: Options) -> float:
    """The latency that is simulated, s; the mock and real parts have none."""
    real = options.mock or options.connection is not None
    return 0.0 if real else setup.profile.plant.latency


def played(options: Options) -> Iterator[CheckResult]:
    """Whether the person is a recorded one, who is not in the room (R56)."""
    if options.plays_dummy:
        about = f"the person of {options.user} is played: nobody may be in the room"
        yield CheckResult("user", NOTE, about)


def tried_before(
    connection: Connection, prior: PriorRuns, although: Collection[str]
) -> Iterator[CheckResult]:
    """Whether the same was simulated, and then tried with a dummy (R53, R56)."""
    if prior.lacking:
        yield CheckResult("tried", BAD, _lacking(connection, prior), code=REFUSED)
        return
    for result in prior.results:
        yield CheckResult("tried", NOTE, f"{result.stage}: {result.file}")
    for words in WORDS.values():
        if words in although:
            yield CheckResult("tried", NOTE, f"although {words}")


def _lacking(connection: Connection, prior: PriorRuns) -> str:
    """The missing stages, with the command for each."""
    lines = [
        f"connection {connection.name} is of a real robot, and this was not tried before as it is "
        "now:"
    ]
    for result in prior.lacking:
        why = "there is no record of it"
        if result.file is not None:
            why = f"{result.file}: {'; '.join(result.why)}"
        lines += [f"  {WORDS[result.stage]}: {why}", f"    {prior.commands[result.stage]}"]
    words = " ".join(f"--although {shlex.quote(WORDS[one.stage])}" for one in prior.lacking)
    return "\n".join((*lines, f"or, with nobody near the robot: {words}"))
