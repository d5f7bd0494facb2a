"""Parameters of the one model of the person: their lines of walk, margin, and room beside them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

from engine.files import Angle, AngularSpeed, Duration, Length, Speed
from engine.files.declared import Count, Range, above_0


@dataclass(frozen=True, slots=True)
class WalkSettings:
    """Where a person may walk who stands, turns or bends (`behaviors.person.lines`)."""

    pace: Annotated[Speed, above_0(5.0)]
    """Of somebody who sets off …"""
    turn_rate: Annotated[AngularSpeed, above_0(10.0)]
    """… after turning this fast to where they go."""
    stands: Annotated[Duration, above_0(3600.0)]
    """Mean time until somebody who stands sets off."""
    lookahead: Annotated[Duration, Range(1.0, 10.0)]
    """So far their lines are walked, and drives are simulated."""
    farthest: Annotated[Length, above_0(50.0)]
    """Nobody goes farther in one direction."""
    directions: Annotated[int, Range(4, 360)]
    """Number of directions in which somebody who stands may set off."""
    turning: Annotated[AngularSpeed, Range(0.0, 10.0)]
    """Somebody who stands and turns faster may set off …"""
    sets_off: Annotated[tuple[Annotated[Duration, Range(0.0, 3.0)], ...], Count(1)]
    """… after so much more of the turn; each time is one line."""
    heads_at: Annotated[Angle, Range(0.0, math.pi)]
    """Somebody heading within this of the robot walks at it …"""
    bend_for: Annotated[Duration, Range(0.0, 3.0)]
    """… or who will do so after so long of their bend …"""
    bend_most: Annotated[AngularSpeed, Range(0.0, 10.0)]
    """… which is no tighter than this; what is more is left of a turn on the spot."""
    bends: Annotated[AngularSpeed, Range(0.0, 10.0)]
    """A bend that is tighter than this is likely to become tighter yet."""
    noticed: Annotated[Duration, Range(0.0, 5.0)]
    """From the start of a walk until the robot moves, where it waits."""
    on_the_way: Annotated[tuple[Annotated[float, Range(0.0, 1.0)], ...], Count(1)]
    """Shares of a drive at which its risk is looked at."""
    stops: Annotated[Duration, Range(0.0, 10.0)]
    """From the stop sign until an attentive person stands."""


@dataclass(frozen=True, slots=True)
class MarginSettings:
    """What margin is enough (`behaviors.person.margin`), and what gap is a touch."""

    wanted: Annotated[Duration, Range(0.0, 5.0)]
    """With more nothing has to be done yet."""
    waiting: Annotated[Duration, Range(0.0, 5.0)]
    """Wanted at a place to wait, in each direction in which the user may set off."""
    escape: Annotated[Duration, Range(0.0, 60.0)]
    """What an Escape costs that such a place would lead to."""
    calm: Annotated[Duration, Range(0.0, 5.0)]
    """A danger is over with so much more."""
    touch: Annotated[Length, Range(0.0, 1.0)]
    """A predicted gap below this counts as a touch."""
    spare: Annotated[Length, Range(0.0, 0.5)]
    """A path is planned with so much more distance from the user than its drive has to keep."""
    at_hand: Annotated[Length, Range(0.0, 1.0)]
    """Of an arm with less between outline and user it is taken to be at their hand."""


@dataclass(frozen=True, slots=True)
class RoomSettings:
    """Choice of a place to drive to beside a user who walks or turns (`behaviors.chase.beside`)."""

    rings: Annotated[tuple[Annotated[Length, above_0(10.0)], ...], Count(1)]
    """Radii of the candidates around the robot."""
    directions: Annotated[int, Range(3, 360)]
    """Number of candidates on each."""
    lack: Annotated[float, Range(0.0, 1000.0)]
    """Weight of squared lacks of margin, 1/s2, against squared distances off the band, 1/m2."""
    beyond: Annotated[float, Range(0.0, 100.0)]
    """Weight of being too far away, against being too near."""
    close: Annotated[Length, Range(0.0, 5.0)]
    """What is missing to this distance is added …"""
    dread: Annotated[float, Range(0.0, 1000.0)]
    """… so many times, squared."""
    haste: Annotated[float, Range(0.0, 1000.0)]
    """Weight of closing in faster than the robot can stop at `turn`, squared, s2."""
    turn: Annotated[Length, above_0(10.0)]
    """Room to keep from somebody who may turn at any time."""
    settled: Annotated[Duration, Range(0.0, 60.0)]
    """A turn of somebody who has stood for so long begins a walk: then, more room than `turn`."""
    open: Annotated[Length, Range(0.0, 10.0)]
    """What is missing to this clearance from walls counts …"""
    walls: Annotated[float, Range(0.0, 1000.0)]
    """… so many times, squared, 1/m2."""
    effort: Annotated[float, Range(0.0, 100.0)]
    """Cost of driving, 1/m."""
    again: Annotated[Duration, above_0(5.0)]
    """Interval of choosing anew."""
    breaks_off: Annotated[tuple[Annotated[Duration, Range(0.0, 0.5)], ...], Count(3, 3)]
    """A drive may be aborted after so long; then braking must end clear of walls."""
    wall_slack: Annotated[Length, Range(0.0, 0.1)]
    """A robot that starts too near to a wall may come so much nearer on its way off."""
    slack: Annotated[Length, Range(0.0, 2.0)]
    """How much more room than asked for ends it."""
