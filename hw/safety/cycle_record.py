"""The record of one cycle of the safety chain: what was commanded, what was admitted, and why."""

from __future__ import annotations

from typing import NamedTuple

from hw.geometry import Twist2
from hw.interfaces import DriveMode

USER_LOST = "tracking of the user is lost"
TOO_FAST = "the base is faster than its limit"
RUNS_ON = "the base does not stop"
BACKWARDS = "time runs backwards"

LATCHES = (None, BACKWARDS, USER_LOST, TOO_FAST, RUNS_ON)
"""Why a stop may latch; its place is the code of a latched stop."""

STOP_LINE = "stop line"
LATCHED = "latched"
NOT_FINITE = "a value is not finite"
BASE_UNKNOWN = "pose or velocity of the base is not known"
COMMAND_OLD = "command is old"
COMMAND_AHEAD = "command is stamped ahead of the clock"
USER_UNKNOWN = "no pose of the user yet"
USER_OLD = "pose of the user is old"
USER_AHEAD = "pose of the user is stamped ahead of the clock"
GRANTED = "granted touch"
SPEED = "speed limit"
USER_LATE = "pose of the user is late"
COMMAND_LATE = "command is late"
SEPARATION = "separation"
REASONS = (
    STOP_LINE, LATCHED, NOT_FINITE, BASE_UNKNOWN, COMMAND_OLD, COMMAND_AHEAD, USER_UNKNOWN,
    USER_OLD, USER_AHEAD, GRANTED, SPEED, USER_LATE, COMMAND_LATE, SEPARATION,
)  # fmt: skip
"""Why less is admitted than commanded, in the order in which the rule finds it."""


class SafetyRecord(NamedTuple):
    """One cycle of the chain.

    `command` and `admitted` are in the base frame; `admitted is command` if nothing was cut.
    `separation` is the measured gap S, m, and `needed` the S_p of the measured motion: S < S_p
    without a granted touch means that the robot is too close for its speed. `allowed` is the
    closing speed up to which the governor does not act, `user_speed` the speed it assumed of the
    user (m/s), `user_age` the age of their pose (s). None: there is no pose yet.
    """

    stamp_ns: int
    command: Twist2
    admitted: Twist2
    separation: float | None = None
    needed: float = 0.0
    allowed: float = 0.0
    user_speed: float | None = None
    user_age: float | None = None
    reasons: tuple[str, ...] = ()


class ChainStatus(NamedTuple):
    """The status that a chain in a process of its own reports periodically.

    `latched`, `refused` and `admitted` are those of `hw.safety.chain`; `mode` is the drive mode.
    `cycles` counts cycles since the start, `missed` those more than one period late, `records` the
    records sent; `longest_ms` is the longest time between two cycles since the status before.
    """

    latched: str | None
    refused: tuple[str, ...]
    admitted: Twist2 | None
    mode: DriveMode
    cycles: int
    missed: int
    records: int
    longest_ms: float
