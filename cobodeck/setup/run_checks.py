"""What a run requires of robot, room and profile, checked before it starts."""

from __future__ import annotations

from cobodeck.setup.setup import Setup
from cobodeck.terminal import FAILED, Problem
from engine import TickGrid
from states import QUARTER


def refuse_blind_robot(setup: Setup) -> None:
    """Check that the robot can localize itself.

    Raises:
        Problem: it has no wheel odometry, or there is no room to localize in.
    """
    if setup.scene is None:
        raise Problem("tier 2 needs a room to localize in; give one with --scene")
    if setup.robot.sensing.odometry is None:
        raise Problem(
            f"robot {setup.robot.name}: tier 2 needs wheels that measure; "
            "its file has no sensing.odometry"
        )


def refuse_small_floor(setup: Setup) -> None:
    """Check that all behaviours have room (R124), or as much as the profile is content with.

    Raises:
        Problem: the floor is too small.
    """
    quarter = setup.profile.navigation.quarter
    found = _shortcoming(setup, quarter)
    if found is not None and setup.scene is not None:
        hint = "to run all the same, set the radius that has to do, --set 'navigation.quarter=2 m'"
        raise Problem(f"scene {setup.scene.name}: {found}\n{hint}", FAILED)


def small_floor(setup: Setup) -> str | None:
    """Why the floor is too small for all behaviours where the profile is content with less."""
    if setup.profile.navigation.quarter >= QUARTER:
        return None
    return _shortcoming(setup, QUARTER)


def _shortcoming(setup: Setup, quarter: float) -> str | None:
    from states.floors import Floor, shortcoming

    if setup.place is None or setup.scene is None:
        return None
    floor: Floor
    if setup.place.map is None:
        from states.floors import RoomFloor

        floor = RoomFloor(setup.scene.room)
    else:
        from states.floors import MapFloor

        floor = MapFloor(setup.place.map)
    return shortcoming(floor, setup.profile.navigation.haptic.inflation, quarter)


def latency_ns(setup: Setup) -> int:
    """The profile's latency from the samples of a tick to its commands, ns.

    Raises:
        Problem: it is not shorter than a tick.
    """
    latency = round(setup.profile.plant.latency * 1e9)
    if latency >= TickGrid(setup.tick_hz).period_ns:
        shown = f"{latency / 1e6:g} ms is not less than a tick at {setup.tick_hz} Hz"
        raise Problem(f"profile {setup.profile.name}: plant.latency of {shown}")
    return latency
