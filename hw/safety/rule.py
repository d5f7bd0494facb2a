"""The rule of the safety chain: how much of the next velocity may reach the wheels.

It can only slow the base down or stop it. It is a software stop of a research prototype, not a
safety device (R54): a hardware stop, with a person's hand on it, is needed as well. It knows
nothing of charts and plans, and has no queue, clock or lock; the chain (`hw.safety.chain`) collects
its inputs and applies it at 100 Hz or more:

    rule.track_user(now_ns, stamp_ns, x, y)        # each tracked pose of the user, in the map
    rule.stop_line = reason                        # why the stop line is pulled, or None
    rule.request(True); rule.grant(pose)           # a touch is requested, and served from `pose`
    admitted = rule.admit(now_ns, command, stamp_ns, pose, twist)

`command` is the velocity that the wheels would get in the next cycle, ramps included: nothing after
the rule may slow down more gently than the brakes. The checks (`hw.safety.checks`) are, in this
order: stop line and latches, age of the command, age of the user's pose, speed limit, separation
governor (R48-R52, R149). The speed limit falls as a command ages, so that a computer that cannot
keep up slows the robot down before it stops it. Time that runs backwards latches a stop. A stamp
ahead of the clock is refused: a negative age is never fresh.

The governor limits only what closes the gap between the robot's footprint, a rectangle at its
measured yaw, and the user's cylinder: the velocity component towards the user, and a rotation that
brings the nearest point of the footprint closer. Both are scaled by one share and neither offsets
the other, because they need not brake in step. Motion away from the user or along the footprint's
side is not limited.
"""

from __future__ import annotations

import numpy as np

from hw.finite import is_finite
from hw.geometry import Pose2, Twist2
from hw.jit import Structs, compiled, example
from hw.model import Footprint
from hw.motion import EVER_NS
from hw.safety.checks import BRAKING, FIGURES, OUTLINE, RULE, STANDING, cycle, release, rest
from hw.safety.cycle_log import CycleLog, reasons_of
from hw.safety.cycle_record import LATCHES
from hw.safety.limits import SafetyLimits, Stopping
from hw.safety.separation import PlanarPose, Velocity
from hw.safety.user_track import add_position, await_user

_NONE = (0.0, 0.0, 0.0)


class SafetyRule:
    """See the module. `cycles` holds the newest cycles, for any number of readers.

    `stop_line` is the reason why the stop line is pulled, or None. `latched` is the reason of a
    latched stop, or None; while latched, nothing moves until `reset`. `refused` says why the last
    cycle allowed no motion at all; it is empty if some was allowed.

    `state` is the record behind it, (1,) of `RULE`; who owns simulated wheels runs
    `hw.safety.checks.cycle` on it and on the rows of `cycles`.
    """

    def __init__(self, limits: SafetyLimits) -> None:
        self.limits = limits
        self.state = _state_of(limits)
        self.cycles = CycleLog(counter=self.state["written"])
        self._latched, self._refused = self.state["latched"], self.state["refused"]
        self._commanded, self._stamp = self.state["commanded"], self.state["stamp_ns"]
        self._slowed, self._admitted = self.state["slowed"], self.state["admitted"][0]
        self._stop_line: str | None = None

    @property
    def latched(self) -> str | None:
        """The reason of a latched stop."""
        return LATCHES[self._latched[0]]

    @property
    def refused(self) -> tuple[str, ...]:
        """Why the last cycle allowed no motion at all."""
        bits = self._refused[0]
        return reasons_of(int(bits)) if bits else ()

    @property
    def slowed_to(self) -> Twist2 | None:
        """What was last admitted, base frame; None if nothing was cut since then."""
        return Twist2(*self._admitted.tolist()) if self._slowed[0] else None

    def begin(self, stamp_ns: int | None) -> None:
        """Begin a tick: `slowed_to` is None until something is cut.

        The velocity of its cycles is commanded at this stamp; None: a commanded stop, which does
        not age.
        """
        self._slowed[0] = False
        self._commanded[0] = stamp_ns is not None
        self._stamp[0] = stamp_ns or 0

    @property
    def stop_line(self) -> str | None:
        """Why the stop line is pulled."""
        return self._stop_line

    @stop_line.setter
    def stop_line(self, reason: str | None) -> None:
        self._stop_line = reason
        self.state["stopped"] = reason is not None

    def track_user(self, now_ns: int, stamp_ns: int, x: float, y: float) -> bool:
        """Take a pose of the user (map) that arrived now; False if refused, see `add_position`."""
        if not -EVER_NS < stamp_ns < EVER_NS:
            return False
        found: bool = _track(self.state, now_ns, stamp_ns, float(x), float(y))
        return found

    def leap(self, span_ns: int) -> None:
        """Pass over so long, ns, in which the base stands and the user is seen where they stand."""
        user = self.state["user"]
        user["stamp_ns"] += span_ns
        user["trail"]["stamps"] += span_ns

    def request(self, level: bool) -> None:
        """Set whether the user requests a touch. The end of a request ends its grant.

        This is a level that is sent on change, so silence does not end it: the owner of the link to
        the user reports its loss (`Vr`). A touch still needs a fresh pose of a user who stands
        still.
        """
        self.state["requested"] = level
        if not level:
            self.state["granted"] = False

    def grant(self, pose: Pose2 | None) -> None:
        """Set the base pose (map_from_base) from which the request is served; None: none known.

        A pose that is not finite counts as None.
        """
        self.state["granted"] = known = pose is not None and is_finite(pose)
        if pose is not None and known:
            self.state["served_from"] = pose.x, pose.y, pose.yaw

    def reset(self, now_ns: int) -> bool:
        """Release the latch; False while its cause persists or the base moves.

        Called by an operator's command only (R49).
        """
        found: bool = _release(self.state, now_ns)
        return found

    def rest(self, now_ns: int) -> None:
        """Run a cycle of a base that stands without a command: checks time and the user's age only.

        It writes no record.
        """
        _rest(self.state, now_ns)

    def admit(
        self,
        now_ns: int,
        command: Twist2,
        stamp_ns: int,
        pose: Pose2 | None,
        twist: Twist2 | None,
        sigma: float = 0.0,
        holonomic: bool = True,
    ) -> Twist2:
        """The part of the next velocity of the wheels that is admitted; itself if all of it is.

        Args:
            now_ns: the instant of this cycle.
            command: the next velocity of the wheels, base frame.
            stamp_ns: the instant at which that velocity was last commanded.
            pose: measured map_from_base; None if unknown.
            twist: measured velocity, base frame; None if unknown.
            sigma: standard deviation of the pose's position, m.
            holonomic: False for a base that drives along its heading only.
        """
        place = _NONE if pose is None else (float(pose.x), float(pose.y), float(pose.yaw))
        cut, *admitted = _admit(
            self.state,
            self.cycles.rows,
            (now_ns, stamp_ns),
            _floats(command),
            (pose is not None, place, float(sigma)),
            (twist is not None, _NONE if twist is None else _floats(twist)),
            holonomic,
        )
        return Twist2(*admitted) if cut else command


def is_standing(twist: Twist2) -> bool:
    """True for the velocity of a base that counts as standing."""
    return max(twist.speed, abs(twist.wz)) <= STANDING


def _floats(twist: Twist2) -> tuple[float, float, float]:
    return float(twist.vx), float(twist.vy), float(twist.wz)


def _state_of(limits: SafetyLimits) -> Structs:
    """The state of a rule before the first cycle."""
    state: Structs = np.zeros(1, RULE)
    found = state["limits"]
    for name in (*FIGURES, "governor", "watched"):
        found[name] = getattr(limits, name)
    for name in BRAKING:
        found[name] = getattr(limits.stopping, name)
    for name in OUTLINE:
        found[name] = getattr(limits.footprint, name)
    await_user(state[0].user, limits.ahead)
    return state


@compiled
def _track(state: Structs, now_ns: int, stamp_ns: int, x: float, y: float) -> bool:
    return add_position(state[0].user, now_ns, stamp_ns, x, y)


@compiled
def _release(state: Structs, now_ns: int) -> bool:
    return release(state[0], now_ns)


@compiled
def _rest(state: Structs, now_ns: int) -> None:
    rest(state[0], now_ns)


@compiled
def _admit(
    state: Structs,
    rows: Structs,
    at: tuple[int, int],
    command: Velocity,
    base: tuple[bool, PlanarPose, float],
    moves: tuple[bool, Velocity],
    holonomic: bool,
) -> tuple[bool, float, float, float]:
    state[0].holonomic = holonomic
    row = cycle(state[0], rows, at[0], at[1], command, base, moves)
    return row.cut, row.admitted[0], row.admitted[1], row.admitted[2]


@example
def _example() -> None:
    limits = SafetyLimits(Footprint(1.0, 1.0, 0.0, 1.0), Stopping(1.0, 0.0, 0.0), 1.0, 1.0)
    rule, still = SafetyRule(limits), Twist2(0.0)
    rule.track_user(0, 0, 2.0, 0.0)
    rule.admit(0, still, 0, None, still)
    rule.rest(0)
    rule.reset(0)
