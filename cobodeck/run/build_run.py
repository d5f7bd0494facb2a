"""Sets up a run: the plant that the chart needs, the evaluators that fit it, and the loop."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from typing import Any

from cobodeck.evaluate import watchers
from cobodeck.fitness import require
from cobodeck.loop import (
    Clock,
    ConsoleOperator,
    Loop,
    Nothing,
    RealTime,
    Stopwatch,
    ValueTap,
    Virtual,
    wander,
    wire,
)
from cobodeck.project import made
from cobodeck.real import Connected, connect, finds_itself, is_needed
from cobodeck.setup import FULL, REFERENCE, Options, Setup, Uses
from cobodeck.terminal import Problem, behind_record, complain
from engine import TickGrid
from engine.operator import Operator
from hw import Pose2
from hw.connection import Connection, HostedScene, RunInfo, WiredTopics
from hw.motion import Reckoner
from hw.people import open_user
from hw.people.walking import Person
from hw.sim import SimBase, World, mock_world
from hw.sim.sensors import ScriptedOperator


class FrozenBase(SimBase):
    """A base that ignores all commands, for checking that a test notices."""

    def drive(self, command: object) -> None:
        """Ignored."""


def stage(
    setup: Setup,
    options: Options,
    parameters: Mapping[str, Any] | None = None,
    clock: Clock | None = None,
    tap: ValueTap | None = None,
) -> Loop:
    """The loop of a run, ready for its first tick; `tap` as in `wire`.

    Raises:
        Problem: the chart needs something that is missing.
        FileError: the user's file is wrong, or the chart drives the base and profile and robot do
            not fit together.
    """
    require("begin", setup=setup)
    grid, timing = TickGrid(setup.tick_hz), clock or Virtual()
    if options.tier == 0:
        wired = wander(setup, options.seed)
        loop = Loop(Nothing(), wired, grid, clock=timing, leave_out=not options.eager)
        return _timed(loop, options)
    setup = localizing(setup, options)
    uses = setup.uses(parameters)
    require(
        "start",
        setup=setup,
        options=options,
        uses=uses,
        robot=setup.robot,
        profile=setup.profile,
    )
    if options.connection is not None:
        assert isinstance(timing, RealTime), "real parts have a clock of their own"
        return _on_real_parts(setup, uses, options, options.connection, parameters, timing, tap)
    world = _world(setup, _person(setup, uses, options), options)
    world.add(_own_parts(setup, uses))
    if setup.localizing is not None:
        world.guard.chain.locate_by(Reckoner(setup.environment.tracking))
    operator = None
    if options.console is not None:
        operator = ConsoleOperator(world.parts["stop_line"], complain)
        world.add({"operator": operator})
    elif options.mock and "operator" in world.parts:
        world.parts["operator"].show = complain
    reading = time.perf_counter_ns if options.timed else None
    wired = wire(
        setup, world.parts, eager=options.eager, clock=reading, parameters=parameters, tap=tap
    )
    watching = watchers(world, wired, setup.robot, setup.scene)
    loop = Loop(world, wired, grid, watching, timing, leave_out=not options.eager)
    _timed(loop, options)
    _at_console(operator, options, loop)
    return loop


def _at_console(
    operator: ConsoleOperator | ScriptedOperator | None, options: Options, loop: Loop
) -> None:
    """Take what is typed at the console, if that is where the operator is."""
    if isinstance(operator, ConsoleOperator) and options.console is not None:
        by = "console"
        operator.attend(
            options.console, partial(loop.stop, by), Operator(loop.wired.run, by).remark
        )


def _timed(loop: Loop, options: Options) -> Loop:
    if options.timed:
        loop.stopwatch = Stopwatch()
    return loop


def localizing(setup: Setup, options: Options) -> Setup:
    """The setup, with localization if the base does not measure its pose.

    Raises:
        Problem: it cannot be localized, or a driver is of no known package.
    """
    connection = options.connection
    if connection is not None:
        require("import", connection=connection, packages=setup.catalogue.packages)
    require("localize", setup=setup, options=options)
    if options.tier < FULL and (connection is None or setup.scene is None):
        return setup
    if options.tier < FULL and connection is not None and not finds_itself(connection):
        return setup
    return replace(setup, localizing=options.seed)


def _on_real_parts(
    setup: Setup,
    uses: Uses,
    options: Options,
    connection: Connection,
    parameters: Mapping[str, Any] | None,
    clock: RealTime,
    tap: ValueTap | None,
) -> Loop:
    """A loop on the parts of a connection; they are closed again if the chart cannot run on them.

    Raises:
        Problem: something is missing, or nothing tracks people and `unwatched` does not accept it.
    """
    opening = opening_of(setup, uses, options, connection, clock.now)
    connection = _with_dummy(setup, uses, options, connection)
    plant = connect(connection, opening, uses)
    try:
        require("opened", connection=connection, uses=uses, options=options, plant=plant)
        if setup.localizing is not None and plant.guard is not None:
            plant.guard.chain.locate_by(Reckoner(setup.environment.tracking))
        operator = _operator(plant, options)
        plant.parts.setdefault("operator", operator)
        wired = wire(setup, plant.parts, eager=options.eager, parameters=parameters, tap=tap)
        wired.inlet.begins = True
    except BaseException:
        plant.close()
        raise
    watching = watchers(plant, wired, setup.robot, setup.scene)
    loop = Loop(plant, wired, TickGrid(setup.tick_hz), watching, clock)
    _at_console(operator, options, loop)
    return loop


def opening_of(
    setup: Setup, uses: Uses, options: Options, connection: Connection, now: Callable[[], int]
) -> RunInfo:
    """What a connection's drivers are told about a run; `now` returns the run's time, ns.

    Raises:
        Problem: a person is requested, and the connection has neither fakes nor a dummy.
    """
    motion = setup.profile.robot.limits
    return RunInfo(
        now=now,
        body=setup.body,
        motion=motion,
        safety=setup.profile.safety.limits(setup.robot, motion),
        tracking=setup.tracking,
        play=_play(setup, uses, options, connection),
        tell=complain,
        topics=lambda: _topics(setup),
    )


def _topics(setup: Setup) -> WiredTopics:
    """What the project's table of topics wants carried."""
    from cobodeck.flexbe_states import wired_topics

    return wired_topics(setup.catalogue.topics)


def _with_dummy(setup: Setup, uses: Uses, options: Options, connection: Connection) -> Connection:
    """The connection, with a recorded person as the dummy if one is requested."""
    person = _person(setup, uses, options) if options.plays_dummy else None
    if person is None:
        return connection
    from cobodeck.real import with_dummy

    return with_dummy(connection, person)


def _operator(plant: Connected, options: Options) -> ConsoleOperator | ScriptedOperator:
    """The operator: a person at the terminal, or a script beside fakes without a terminal."""
    if plant.world is None or options.console is not None:
        return ConsoleOperator(plant.parts["stop_line"], complain)
    plant.attendant = ScriptedOperator(plant.parts["stop_line"], by_hand=plant.world.push_off)
    plant.attendant.show = complain
    return plant.attendant


def _play(setup: Setup, uses: Uses, options: Options, connection: Connection) -> HostedScene | None:
    """The scene around the fakes of a connection; None without a scene.

    Raises:
        Problem: a person is requested, and the connection has neither fakes nor a dummy.
    """
    if not connection.peers and not options.plays_dummy:
        asked = {"--user": options.user, "--requests": options.requests}
        for name, value in asked.items():
            if value is not None:
                raise Problem(
                    f"{name} {value}: connection {connection.name} has no fakes, so that nobody "
                    "but a real person is there, or a dummy: --user X.mcap, a record"
                )
    if setup.scene is None:
        return None
    person = (uses.person or options.user is not None) and not options.plays_dummy
    plant = setup.profile.plant
    return HostedScene(
        scene=setup.scene,
        user=(options.user or setup.scene.user) if person else None,
        sensing=plant.sensing,
        sensors=plant.sensors(options.seed),
        requests=options.requests,
        stretch_m=options.stretch_m,
        seed=options.seed,
    )


def _person(setup: Setup, uses: Uses, options: Options) -> Person | None:
    """The person: the one requested, else the scene's if the chart deals with people.

    Raises:
        Problem: the chart needs a person, and nothing names one.
    """
    scene = setup.scene
    source = options.user or (scene.user if scene is not None and uses.person else None)
    if scene is None:
        if source is not None:
            raise Problem(f"--user {source} needs a room; give one with --scene")
        return None
    given = options.requests, options.stretch_m, options.seed, options.heading, options.up
    if source is not None and behind_record(source) is not None:
        from cobodeck.record.read import recalled

        return recalled(source, scene.room, *given)
    if source is not None:
        return open_user(source, scene, *given)
    if uses.needs_person:
        raise Problem(f"scene {scene.name} names no user; give one with --user")
    return None


def _own_parts(setup: Setup, uses: Uses) -> dict[str, Any]:
    """A project's own simulated parts, as far as the chart commands or reads them."""
    parts, declared = setup.catalogue.own_parts, setup.signals
    return {
        name: made(name, make, declared)
        for name, make in parts.items()
        if is_needed(name, make, uses)
    }


def _world(setup: Setup, person: Person | None, options: Options) -> World:
    limits = setup.profile.robot.limits
    safety = setup.profile.safety.limits(setup.robot, limits)
    if options.mock:
        return mock_world(setup.scene, setup.body, person, safety, options.console is None)
    scene, arm = setup.scene, None
    base: SimBase | None = None
    start = Pose2(0.0, 0.0) if scene is None else scene.robot_start
    if options.frozen_base:
        base = FrozenBase(setup.robot, limits, start)
    elif options.tier == REFERENCE:
        from hw.sim.physics import physical_robot

        slip = setup.profile.plant.sensing.slip
        base, arm = physical_robot(setup.body, limits, start, slip)
    return World(
        setup.scene,
        setup.body,
        person,
        limits,
        base,
        arm,
        safety=safety,
        latency_ns=round(setup.profile.plant.latency * 1e9),
        sensors=setup.profile.plant.sensors(options.seed),
        sensing=None if setup.localizing is None else setup.profile.plant.sensing,
    )
