"""Sets a run up: the plant that the chart needs, the evaluators that can judge it, the loop."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, TextIO

from behaviors.signals import ESTIMATE
from cobodeck.arm_contact import ArmOutline, ArmWatch
from cobodeck.clocks import Clock, RealTime, Virtual
from cobodeck.connected import Connected, connect
from cobodeck.console import FAILED, REFUSED, Problem, complain
from cobodeck.inlet import Inlet
from cobodeck.localization import LocalizationWatch
from cobodeck.logic import wander
from cobodeck.loop import Loop, Observer
from cobodeck.measured import Senses
from cobodeck.metrics import Evaluator
from cobodeck.opening import finds_itself, is_needed, refuse_strange_drivers
from cobodeck.operators import ConsoleOperator
from cobodeck.plants import Nothing, Plant
from cobodeck.record.sink import behind_record
from cobodeck.requests import RequestWatch
from cobodeck.separation import SeparationWatch
from cobodeck.wiring import Setup, Uses, ValueTap, Wired, refuse_slow_ticks, wire
from engine.clock import TickGrid
from hw.connection import Connection, HostedScene, RunInfo
from hw.geometry import Pose2, Pose3
from hw.mock import mock_world
from hw.people.person import Person
from hw.people.user import open_user
from hw.reckoner import Reckoner
from hw.robot import RobotModel
from hw.samples import Joints
from hw.sim.base import SimBase
from hw.sim.devices import ScriptedOperator
from hw.sim.world import World
from hw.truth import BASE

FULL = 2
"""The tier with all sensors: the base finds out where it is."""
LONGEST_S = 3600.0
"""A run whose user never comes to an end is over after this time, s."""


@dataclass(frozen=True, slots=True)
class Options:
    """How to run.

    `duration_s` ends a run early, `stretch_m` makes a recording longer, `eager` computes every
    signal in every tick and leaves no tick out, `mock` takes the robot that does exactly as told,
    `connection` the real parts that it names. `console` is where the operator types, if there is
    one; `unwatched` accepts that no part tracks people, because nobody is near.
    """

    user: str | None = None
    requests: int | None = None
    stretch_m: float | None = None
    tier: int = 1
    seed: int = 0
    duration_s: float = LONGEST_S
    eager: bool = False
    frozen_base: bool = False
    mock: bool = False
    connection: Connection | None = None
    console: TextIO | None = None
    unwatched: bool = False

    @property
    def plays_dummy(self) -> bool:
        """Is the person out of a record?"""
        return self.user is not None and behind_record(self.user) is not None


class FrozenBase(SimBase):
    """A base that does not move, whatever it is told: to see whether a test would notice."""

    def drive(self, command: object) -> None:
        """Ignored."""


def stage(
    setup: Setup,
    options: Options,
    parameters: Mapping[str, Any] | None = None,
    clock: Clock | None = None,
    tap: ValueTap | None = None,
) -> Loop:
    """Everything for a run, before its first tick; `tap` as of `wire`.

    Raises:
        Problem: the chart needs what is not there; FileError: the user's file is wrong, or the
            chart drives and profile and robot do not go together.
    """
    grid, timing = TickGrid(setup.tick_hz), clock or Virtual()
    if options.tier == 0:
        wired = wander(setup, options.seed)
        return Loop(Nothing(), wired, grid, clock=timing, leave_out=not options.eager)
    setup = localizing(setup, options)
    uses = setup.uses(parameters)
    if "base" in uses.commands:
        setup.profile.require_robot(setup.robot, beside_person=uses.person)
    real = options.mock or options.connection is not None
    refuse_slow_ticks(setup, uses, 0.0 if real else setup.profile.plant.latency)
    if options.connection is not None:
        assert isinstance(timing, RealTime), "real parts have a clock of their own"
        return _on_real_parts(setup, uses, options, options.connection, parameters, timing, tap)
    world = _world(setup, _person(setup, uses, options), options)
    world.add(_own_parts(setup, uses))
    if setup.localizing is not None:
        world.guard.locate_by(Reckoner(setup.environment.tracking))
    operator = None
    if options.console is not None:
        operator = ConsoleOperator(world.parts["stop_line"], complain)
        world.add({"operator": operator})
    reading = time.perf_counter_ns
    wired = wire(
        setup, world.parts, eager=options.eager, clock=reading, parameters=parameters, tap=tap
    )
    watching = watchers(world, wired, setup.robot)
    loop = Loop(world, wired, grid, watching, timing, leave_out=not options.eager)
    if operator is not None and options.console is not None:
        operator.attend(options.console, loop.stop)
    return loop


def localizing(setup: Setup, options: Options) -> Setup:
    """The setup, with localization where the base will not know where it is.

    Raises:
        Problem: it cannot find out, or a driver is of no known package.
    """
    connection = options.connection
    if connection is not None:
        refuse_strange_drivers(connection, setup.catalogue.packages)
    if options.tier == FULL:
        refuse_blind_robot(setup)
    elif connection is None or setup.scene is None or not finds_itself(connection):
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
        Problem: something is missing, or nobody watches where people are and it was not said so.
    """
    opening = opening_of(setup, uses, options, connection, clock.now)
    connection = _with_dummy(setup, uses, options, connection)
    plant = connect(connection, opening, uses)
    try:
        if "base" in uses.commands and not plant.person_watched and not options.unwatched:
            raise Problem(
                f"connection {connection.name}: no part tracks people, so that nothing keeps the "
                "base away from them; if nobody can be near it, say so with --person-unwatched",
                REFUSED,
            )
        if setup.localizing is not None and plant.guard is not None:
            plant.guard.locate_by(Reckoner(setup.environment.tracking))
        operator = _operator(plant, options)
        plant.parts.setdefault("operator", operator)
        wired = wire(setup, plant.parts, eager=options.eager, parameters=parameters, tap=tap)
        wired.inlet.begins = True
    except BaseException:
        plant.close()
        raise
    watching = watchers(plant, wired, setup.robot)
    loop = Loop(plant, wired, TickGrid(setup.tick_hz), watching, clock)
    if isinstance(operator, ConsoleOperator) and options.console is not None:
        operator.attend(options.console, loop.stop)
    return loop


def opening_of(
    setup: Setup, uses: Uses, options: Options, connection: Connection, now: Callable[[], int]
) -> RunInfo:
    """What the drivers of a connection are told of a run; `now` is its time, ns.

    Raises:
        Problem: a person is asked for, and nothing is there that could move one.
    """
    motion = setup.profile.robot.limits
    return RunInfo(
        now=now,
        body=setup.body,
        motion=motion,
        safety=setup.profile.safety.limits(setup.robot, motion),
        tracking=setup.tracking,
        play=_play(setup, uses, options, connection),
    )


def _with_dummy(setup: Setup, uses: Uses, options: Options, connection: Connection) -> Connection:
    """A connection with the person of a record in the place of a real one, if one is asked for."""
    person = _person(setup, uses, options) if options.plays_dummy else None
    if person is None:
        return connection
    from cobodeck.dummy import with_dummy

    return with_dummy(connection, person)


def _operator(plant: Connected, options: Options) -> ConsoleOperator | ScriptedOperator:
    """Who looks after faults: somebody at a terminal; beside fakes without one, a script."""
    if plant.world is None or options.console is not None:
        return ConsoleOperator(plant.parts["stop_line"], complain)
    plant.attendant = ScriptedOperator(plant.parts["stop_line"], by_hand=plant.world.push_off)
    return plant.attendant


def _play(setup: Setup, uses: Uses, options: Options, connection: Connection) -> HostedScene | None:
    """What goes on around the fakes of a connection, if it has some.

    Raises:
        Problem: a person is asked for, and nothing is there that could move one.
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


def watchers(plant: Plant, wired: Wired, robot: RobotModel) -> list[Observer]:
    """Who judges a run: by the truth that the plant knows, or else by the samples that flow."""
    truth, seen = plant.truth, "user.pose" in wired.inlet.flowing
    if truth is None or (truth.body is None and seen):  # a dummy is in no world
        found: list[Observer] = [_by_samples(wired.inlet, robot)]
    else:
        found = [_by_truth(plant, robot, truth.body is not None)]
    if truth is not None and ESTIMATE in wired.board.slots:
        found.append(LocalizationWatch(plant, wired.board))
    if plant.cycles is not None:
        found.append(SeparationWatch(plant.cycles))
    return found


def _by_truth(plant: Plant, robot: RobotModel, person: bool) -> Evaluator:
    if not person or robot.arm is None:
        return Evaluator(plant, person)
    return Evaluator(plant, person, RequestWatch(prop_of(robot)), ArmWatch(arm_outline(robot)))


def _by_samples(inlet: Inlet, robot: RobotModel) -> Evaluator:
    heard = "vr.haptic_request" in inlet.flowing
    person = heard or "user.pose" in inlet.flowing
    prop = prop_of(robot) if heard and robot.arm is not None else None
    senses = Senses(inlet, robot.footprint)
    return Evaluator(senses, person, RequestWatch(prop, heard), measured=True)


def _person(setup: Setup, uses: Uses, options: Options) -> Person | None:
    """Who walks about: whoever was asked for, or the scene's, if the chart has to do with people.

    Raises:
        Problem: the chart needs a person, and nothing names one.
    """
    scene = setup.scene
    source = options.user or (scene.user if scene is not None and uses.person else None)
    if scene is None:
        if source is not None:
            raise Problem(f"--user {source} needs a room; give one with --scene")
        return None
    if source is not None and behind_record(source) is not None:
        from cobodeck.record.person import recalled  # what reads records is not loaded otherwise

        return recalled(source, scene.room, options.requests, options.stretch_m)
    if source is not None:
        return open_user(source, scene, options.requests, options.stretch_m, options.seed)
    if uses.person:
        raise Problem(f"scene {scene.name} names no user; give one with --user")
    return None


def _own_parts(setup: Setup, uses: Uses) -> dict[str, Any]:
    """The simulated parts of projects that the chart commands or reads."""
    parts = setup.catalogue.own_parts
    return {name: part() for name, part in parts.items() if is_needed(name, part, uses)}


def refuse_blind_robot(setup: Setup) -> None:
    """Look whether the robot can find out where it is.

    Raises:
        Problem: it has no sensors for that, or no room to find itself in.
    """
    if setup.scene is None:
        raise Problem("tier 2 needs a room to find itself in; give one with --scene")
    if setup.robot.sensing.odometry is None:
        raise Problem(
            f"robot {setup.robot.name}: tier 2 needs wheels that measure; "
            "its file has no sensing.odometry"
        )


def refuse_small_floor(setup: Setup) -> None:
    """Look whether all behaviours have room (R124).

    Raises:
        Problem: the floor is too small.
    """
    from states.floors.floor_cells import MapFloor
    from states.floors.floor_plan import RoomFloor
    from states.floors.space import shortcoming

    if setup.place is None or setup.scene is None:
        return
    map_ = setup.place.map
    floor = RoomFloor(setup.scene.room) if map_ is None else MapFloor(map_)
    found = shortcoming(floor, setup.profile.navigation.haptic.inflation)
    if found is not None:
        raise Problem(f"scene {setup.scene.name}: {found}", FAILED)


def _latency(setup: Setup) -> int:
    latency = round(setup.profile.plant.latency * 1e9)
    if latency >= TickGrid(setup.tick_hz).period_ns:
        shown = f"{latency / 1e6:g} ms is not less than a tick at {setup.tick_hz} Hz"
        raise Problem(f"profile {setup.profile.name}: plant.latency of {shown}")
    return latency


def _world(setup: Setup, person: Person | None, options: Options) -> World:
    limits = setup.profile.robot.limits
    safety = setup.profile.safety.limits(setup.robot, limits)
    if options.mock:
        return mock_world(setup.scene, setup.body, person, safety, options.console is None)
    base = None
    if options.frozen_base:
        start = Pose2(0.0, 0.0) if setup.scene is None else setup.scene.robot_start
        base = FrozenBase(setup.robot, limits, start)
    return World(
        setup.scene,
        setup.body,
        person,
        limits,
        base,
        safety=safety,
        latency_ns=_latency(setup),
        sensors=setup.profile.plant.sensors(options.seed),
        sensing=None if setup.localizing is None else setup.profile.plant.sensing,
    )


def prop_of(robot: RobotModel) -> Callable[[Pose2, Joints], Pose3]:
    """Where the prop is in the map, from the pose of the base and the joints."""
    from states.arm.kinematics import KinematicChain, forward
    from states.arm.model import manipulator_of

    chain = KinematicChain.of(manipulator_of(robot))

    def prop(base: Pose2, joints: Joints) -> Pose3:
        matrix = forward(chain, joints)
        map_from_rover = Pose3.from_yaw(base.x, base.y, 0.0, base.yaw)
        return map_from_rover @ pose_of(matrix.tolist())

    return prop


def arm_outline(robot: RobotModel) -> ArmOutline:
    """The arm as capsules."""
    from states.arm.collision import CollisionModel, outline
    from states.arm.model import manipulator_of

    arm = manipulator_of(robot)
    model = CollisionModel.of(arm)
    parts = tuple("arm_base" if link == BASE else link for link in model.links)
    return ArmOutline(partial(outline, model), parts, arm.tool.name, robot.footprint)


def pose_of(m: list[list[float]]) -> Pose3:
    """A homogeneous 4 x 4 matrix as a pose."""
    trace = m[0][0] + m[1][1] + m[2][2]
    # the largest of the four squares is taken, so that nothing is divided by almost 0
    squares = [trace, m[0][0], m[1][1], m[2][2]]
    largest = squares.index(max(squares))
    if largest == 0:
        q = (m[2][1] - m[1][2], m[0][2] - m[2][0], m[1][0] - m[0][1], 1.0 + trace)
    else:
        i = largest - 1
        j, k = (i + 1) % 3, (i + 2) % 3
        axis = [0.0, 0.0, 0.0]
        axis[i] = 1.0 + m[i][i] - m[j][j] - m[k][k]
        axis[j] = m[j][i] + m[i][j]
        axis[k] = m[k][i] + m[i][k]
        q = (axis[0], axis[1], axis[2], m[k][j] - m[j][k])
    length = sum(part * part for part in q) ** 0.5
    x, y, z, w = (part / length for part in q)
    return Pose3(m[0][3], m[1][3], m[2][3], x, y, z, w)
