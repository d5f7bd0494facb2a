"""Preparations before the first tick that would take too long in it: imports, compiling, planners.

Only what the chart can reach is prepared: a chart that never drives loads no planner.
"""

from __future__ import annotations

import gc
import importlib
import pkgutil

from cobodeck.fitness import require
from cobodeck.setup.compiling import compiling
from cobodeck.setup.setup import Setup, reachable
from engine.machine import Machine
from hw import ImuReading, Odometry, Pose2, Pose3, Scan, TrackerPose, Twist2

SCANS, SCAN_NS = 12, 80_000_000
"""Number of unmatched scans after which a localizer starts to search, and their interval, ns."""
OF_DRIVING, OF_REACHING = 235, 24
"""Approximate numbers of functions compiled for driving and for reaching, without a cache."""


def warm_up(setup: Setup, machine: Machine) -> None:
    """Load and compile everything that the reachable states may call."""
    leaves = reachable(machine)
    commanded = {part for leaf in leaves for part in leaf.interface.commands}
    in_a_room = any("environment" in leaf.interface.reads for leaf in leaves)
    drives = "base" in commanded and in_a_room
    reaches = "arm" in commanded and in_a_room and setup.robot.arm is not None  # else refused later
    if drives or reaches:
        with compiling(drives * OF_DRIVING + reaches * OF_REACHING):
            if drives:
                _driving(setup)
            if reaches:
                _reaching(setup)
    if setup.localizing is not None:
        _localizing(setup)
    # everything loaded by now stays alive: freeze it, so that a collection in a tick skips it
    if gc.get_freeze_count():  # for the first run of a process, nothing is worth the search
        gc.unfreeze()
        gc.collect()
    gc.freeze()


def _driving(setup: Setup) -> None:
    import behaviors
    from hw import compile_examples
    from states.navigation import driver_of

    for module in pkgutil.walk_packages(behaviors.__path__, "behaviors."):
        importlib.import_module(module.name)
    compile_examples((*setup.environment.compiled(setup.scans), behaviors))
    assert setup.scene is not None  # there is no environment without one
    planner = setup.environment.static_planners["chase"]
    start, driver = setup.scene.robot_start, driver_of(setup.environment, "chase", planner)
    driver.go_to(start @ Pose2(0.5, 0.0))  # straight ahead: the case of a path without bends
    driver.command(start, Twist2(0.1, 0.1), None, setup.environment.period)


def _localizing(setup: Setup) -> None:
    """Feed a separate localizer with a drive whose scans match nothing, until it searches."""
    localizer, sensing = setup.localizer(), setup.robot.sensing
    tracker = Pose3(0.0, 0.0, 0.0)
    for n in range(SCANS):
        stamp = n * SCAN_NS
        wheels = Odometry(Pose2(0.01 * n, 0.0, 0.001 * n), Twist2(0.1, 0.0, 0.01))
        localizer.take(stamp, wheels)
        localizer.take(stamp, ImuReading((0.0, 0.0, 0.01), (0.0, 0.0, 9.81)))
        for name in sensing.trackers:
            localizer.take(stamp, TrackerPose(name, tracker))
        for name, lidar in sensing.lidars.items():
            ranges = (0.5 * lidar.max_range,) * lidar.beams
            scan = Scan(name, lidar.start, lidar.step, ranges, lidar.beam_time)
            localizer.take(stamp, scan)


def _reaching(setup: Setup) -> None:
    from hw import compile_examples
    from states import arm

    require("fold", robot=setup.environment.robot)
    compile_examples((arm,), workspace=setup.environment.workspace)
