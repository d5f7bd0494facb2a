"""The one list of checks: what is asked of machine, robot, room, connection and run, and when."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from cobodeck.fitness.check import CheckResult, FitnessCheck, Occasion

CHECKS = (
    FitnessCheck("Is this Python new enough?", "machine_checks:python", ("machine",)),
    FitnessCheck("Which system is this?", "machine_checks:system", ("machine",)),
    FitnessCheck("Do other packages hide ours?", "machine_checks:shadowed", ("machine",)),
    FitnessCheck("Are all libraries installed?", "machine_checks:libraries", ("machine",)),
    FitnessCheck("Can charts be drawn?", "machine_checks:drawing", ("machine",)),
    FitnessCheck("Where is compiled code kept?", "machine_checks:compiled", ("machine",)),
    # robot, profile and room
    FitnessCheck("How large is the robot?", "robot_checks:outline", ("doctor",)),
    FitnessCheck("How does the base drive?", "drive_checks:modes", ("doctor",)),
    FitnessCheck(
        "Can the base drive the profile's chart?", "drive_checks:main_chart", ("validate",)
    ),
    FitnessCheck("Can the base drive as the chart asks?", "drive_checks:followed", ("wire",)),
    FitnessCheck("Is there all that the profile names?", "profile_checks:named", ("validate",)),
    FitnessCheck("Is there all that is set by name?", "profile_checks:set_by_name", ("setup",)),
    FitnessCheck(
        "Does the profile suit the robot?", "profile_checks:suited", ("doctor", "validate", "start")
    ),
    FitnessCheck(
        "How fast does the robot get out of the way?", "profile_checks:getting_away", ("doctor",)
    ),
    FitnessCheck(
        "Is the floor large enough for all behaviours?", "room_checks:large_enough", ("doctor",)
    ),
    FitnessCheck(
        "Is the floor large enough for this chart?", "room_checks:enough_for_chart", ("simulate",)
    ),
    FitnessCheck(
        "Is the room small enough for costmaps?", "room_checks:fits_on_cells", ("localize",)
    ),
    FitnessCheck("How much of the floor can be used?", "room_checks:usable", ("doctor",)),
    FitnessCheck(
        "How far from a wall does a user have to stand?", "room_checks:facing_a_wall", ("doctor",)
    ),
    FitnessCheck("Where is there no Haptic pose?", "room_checks:untouchable", ("doctor",)),
    FitnessCheck("What does waiting beside a user risk?", "room_checks:waiting", ("doctor",)),
    FitnessCheck("Do robot and user start on the floor?", "room_checks:staged", ("validate",)),
    FitnessCheck("Does the calibration fit its log?", "room_checks:tracked", ("doctor",)),
    # the arm
    FitnessCheck(
        "Is the arm, folded as the profile says, clear?", "robot_checks:folded", ("doctor",)
    ),
    FitnessCheck("Does the folded arm touch anything?", "robot_checks:free", ("fold",)),
    FitnessCheck("How is the arm's inverse found?", "robot_checks:numeric", ("doctor",)),
    FitnessCheck(
        "Is the arm's reach enough, within its limits?", "robot_checks:reach", ("doctor",)
    ),
    # the connection
    FitnessCheck("What is the connection?", "connection_checks:described", ("doctor",)),
    FitnessCheck(
        "Is the scene of the connection's robot?", "connection_checks:one_body", ("setup",)
    ),
    FitnessCheck(
        "Do all drivers belong to known packages?", "connection_checks:of_projects", ("import",)
    ),
    FitnessCheck("Is there such a driver?", "connection_checks:in_code", ("validate",)),
    FitnessCheck("Does the driver take these arguments?", "connection_checks:taken", ("validate",)),
    FitnessCheck(
        "Has the robot the arm of this driver?", "connection_checks:own_arm", ("doctor", "validate")
    ),
    FitnessCheck("Can drivers import what they need?", "connection_checks:drivers", ("doctor",)),
    FitnessCheck("Do the devices say who they are?", "device_checks:identities", ("doctor",)),
    FitnessCheck("Are the ports of the drivers free?", "device_checks:ports", ("doctor",)),
    FitnessCheck("Do the devices take connections?", "device_checks:addresses", ("doctor",)),
    FitnessCheck("Can the serial devices be opened?", "device_checks:serial", ("doctor",)),
    FitnessCheck("Can the CAN buses work?", "device_checks:buses", ("doctor",)),
    FitnessCheck(
        "What else has the operator to know?", "connection_checks:remarks", ("doctor", "run")
    ),
    FitnessCheck("Is the person a dummy?", "run_checks:played", ("devices",)),
    FitnessCheck(
        "May other programs delay cycles?", "machine_checks:realtime", ("machine", "devices")
    ),
    FitnessCheck("Is the clock synchronised?", "machine_checks:clock", ("machine",)),
    FitnessCheck("Who has to watch?", "observer_checks:watching", ("doctor", "devices")),
    FitnessCheck("Is the observer's key there?", "observer_checks:key", ("doctor",)),
    FitnessCheck("Was this tried before?", "run_checks:tried_before", ("real",)),
    FitnessCheck(
        "Was it ever run on the devices?", "connection_checks:proven", ("doctor", "moves")
    ),
    FitnessCheck("Does a part track people?", "connection_checks:watched", ("opened",)),
    # the run
    FitnessCheck(
        "Is there all that the chart commands and reads?", "run_checks:provided", ("wire",)
    ),
    FitnessCheck("Have the chart's inputs values?", "run_checks:given", ("begin",)),
    FitnessCheck("Can the robot localize itself?", "run_checks:localized", ("localize",)),
    FitnessCheck("Can physics move the robot?", "run_checks:embodied", ("localize",)),
    FitnessCheck("Do velocities come often enough?", "run_checks:tick_rate", ("start",)),
    FitnessCheck("Is the latency shorter than a tick?", "run_checks:latency", ("start",)),
)


def ask(occasion: Occasion, **case: Any) -> Iterator[CheckResult]:
    """The answers to all checks of an occasion about what is at hand, by the names of `Case`."""
    for check in CHECKS:
        yield from check.asked(occasion, case)


def require(occasion: Occasion, **case: Any) -> None:
    """Ask, and raise at the first answer that is bad.

    Raises:
        Problem, FileError: see `CheckResult.require`.
    """
    for answer in ask(occasion, **case):
        answer.require()
