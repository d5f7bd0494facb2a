"""The wheels of the reduced simulation: ideal pose, limited speed and acceleration.

The limits are those of `hw.safety.ramps`. With a safety chain the base runs its own loop at 100 Hz
or more and asks the chain in each cycle, after the ramps and last before the wheels; what the chain
cuts is braked away.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from hw.geometry import STILL, Pose2, Twist2, wrap
from hw.interfaces import DriveMode
from hw.model import MotionLimits, RobotModel, WhiteNoise, added
from hw.safety import CYCLE_NS, LocalChain, PlanarState, Ramps, twist_after
from hw.samples import Sample

if TYPE_CHECKING:
    from hw.sim.sensors import Track
    from hw.sim.slip import SlipperyFloor

_GRAVITY = 9.81
_EXACT = Pose2(0.0, 0.0)
_TURN_STEP = 0.01
"""Largest rotation, rad, within which the direction of the wanted velocity is held constant."""


class SimBase:
    """A base that reaches the commanded velocity as fast as its limits allow.

    The time step is exact for straight drives; turns are cut into pieces of 0.01 rad. In
    `differential` mode the base moves along its heading only, and the curve widens where speed
    times yaw rate would exceed the acceleration. A change of mode waits for standstill.

    `chain` limits what reaches the wheels; None: no limit. `noise` is that of the measured pose,
    which the chain uses too; `pose` is the true one.

    With a floor the wheels obey exactly and the body slips: `pose` is the body's. With sensors
    (`watch`) the base does not measure its pose and gives the velocity of its wheels only; a chain
    without a reckoner then uses the true pose.
    """

    def __init__(
        self,
        model: RobotModel,
        limits: MotionLimits,
        start: Pose2,
        noise: WhiteNoise | None = None,
    ) -> None:
        base = model.base
        self.pose = start
        self.mode: DriveMode = base.modes[0]
        self.twist = STILL
        self.distance_m = 0.0
        self.energy_j = 0.0
        self.braked = False
        self.chain: LocalChain | None = None
        self.signals: tuple[str, ...] = ("base.pose", "base.twist")
        self._floor: SlipperyFloor | None = None
        self._tracks: tuple[Track, Track] | None = None
        self._noise, self._error = noise, _EXACT
        self._model = base
        self._mass = model.mass
        self._rolling = base.rolling_resistance * model.mass * _GRAVITY
        outline = model.footprint
        self._inertia = model.mass * (outline.length**2 + outline.width**2) / 12.0
        self._ramps = Ramps(base, limits)
        self._timeout_ns = round(base.command_timeout * 1e9)
        self._target = STILL
        self._wanted_mode = self.mode
        self._now = 0
        self._expires = 0
        self._x, self._y, self._yaw = start.x, start.y, start.yaw
        self._vx = self._vy = self._wz = self._kinetic = 0.0
        self._reported = -1

    def watch(self, body: Track, wheels: Track, floor: SlipperyFloor | None) -> None:
        """Record the poses of body and wheels from now on, and slip on this floor."""
        self.signals = ("base.twist",)
        self._tracks, self._floor = (body, wheels), floor

    def use(self, mode: DriveMode) -> None:
        """Change the drive mode; see `Base`.

        Raises:
            ValueError: the robot has no such mode.
        """
        if mode not in self._model.modes:
            raise ValueError(f"base: mode '{mode}' is not one of {', '.join(self._model.modes)}")
        self._wanted_mode = mode

    def drive(self, command: Twist2) -> None:
        """Command a velocity; see `Base`."""
        Twist2.checked(command.vx, command.vy, command.wz)
        self._target = self._limited(command)
        self._expires = self._now + self._timeout_ns

    def stop(self) -> None:
        """Slow down to standstill; see `Base`."""
        self._target = STILL

    def samples(self, now_ns: int) -> list[Sample]:
        """Pose and twist at this instant."""
        if self._reported == now_ns:
            return []
        self._reported = now_ns
        twist = Sample("base.twist", now_ns, self.twist)
        if self._tracks is not None:
            return [twist]
        return [Sample("base.pose", now_ns, self._measured()), twist]

    @property
    def still(self) -> bool:
        """True while it stands, without a command, a change of mode or noise: it only repeats."""
        stands = self.twist is STILL and self._target is STILL and self._noise is None
        return stands and self.mode == self._wanted_mode

    def block(self, pose: Pose2) -> None:
        """A solid obstacle stops the base at once, at this pose."""
        self.pose, self.twist, self._target = pose, STILL, STILL
        if self._floor is None:
            self._x, self._y, self._yaw = pose.x, pose.y, pose.yaw
        else:
            self._floor.pose = pose  # the wheels stand; the body is pushed or held
        self._vx = self._vy = self._wz = self._kinetic = 0.0

    def advance(self, until_ns: int) -> None:
        """Advance to until_ns."""
        if self.braked:
            self._target = STILL
        if self._expires < until_ns and self._target is not STILL:
            self._move(max(self._now, self._expires))
            self._target = STILL
        self._move(until_ns)
        self._note(until_ns)
        if self._noise is not None:
            self._error = self._noise.error(until_ns)

    def _measured(self) -> Pose2:
        """The measured pose; its error is held until the next instant."""
        return self.pose if self._noise is None else added(self.pose, self._error)

    def _limited(self, command: Twist2) -> Twist2:
        return self._ramps.limited(command, self._wanted_mode)

    def _move(self, until_ns: int) -> None:
        since, self._now = self._now, until_ns
        span = (until_ns - since) * 1e-9
        target, moving = self._target, self._vx or self._vy or self._wz
        if not moving:
            self.mode = self._wanted_mode
            if target.vx == 0.0 and target.vy == 0.0 and target.wz == 0.0:
                self.twist = STILL
                if self.chain is not None:
                    self.chain.rest(since)
                return
        elif self.mode != self._wanted_mode:
            target = STILL
        turning = max(abs(self._wz), abs(target.wz)) * span
        pieces = max(1, math.ceil(turning / _TURN_STEP))
        if self.chain is not None and span > 0.0:
            cycles = -(-(until_ns - since) // CYCLE_NS)
            self._move_admitted(self.chain, target, since, max(pieces, cycles))
            return
        for _ in range(pieces):
            self._step(self._toward(target, span / pieces, self.braked))
        self.pose = self._place()
        self.twist = self._twist((0.0, 0.0, 0.0, (self._vx, self._vy, self._wz)))

    def _move_admitted(self, chain: LocalChain, target: Twist2, since: int, cycles: int) -> None:
        """Move from `since` until now, as far as the chain admits it, from cycle to cycle."""
        span = self._now - since
        h = span * 1e-9 / cycles
        braked, reckons = self.braked, chain.reckons
        for cycle in range(cycles):
            now = since + span * cycle // cycles
            motion = self._toward(target, h, braked)
            command = self._twist(motion)
            pose = None if reckons else self._measured()
            admitted = chain.admit(now, command, pose, self.twist, self.mode)
            if admitted is not command:
                motion = self._toward(self._limited(admitted), h, braked=True)
                command = self._twist(motion)
            self._step(motion)
            self.pose, self.twist = self._place(), command
            self._note(since + span * (cycle + 1) // cycles)

    def _place(self) -> Pose2:
        """The pose of the body."""
        return Pose2(self._x, self._y, self._yaw) if self._floor is None else self._floor.pose

    def _note(self, now_ns: int) -> None:
        if self._tracks is None:
            return
        body, wheels = self._tracks
        body.note(now_ns, self.pose)
        if self._floor is not None:
            wheels.note(now_ns, Pose2(self._x, self._y, self._yaw))

    def _twist(self, motion: PlanarState) -> Twist2:
        """The velocity at the end of a motion, base frame."""
        return twist_after(self._yaw, motion, self.mode)

    def _toward(self, target: Twist2, h: float, braked: bool) -> PlanarState:
        """The motion of h s towards a velocity, within ramps or brakes."""
        velocity = self._vx, self._vy, self._wz
        return self._ramps.toward(self._yaw, velocity, target, h, self.mode, braked)

    def _step(self, motion: PlanarState) -> None:
        dx, dy, turn, (vx, vy, wz) = motion
        way = math.hypot(dx, dy) if self._floor is None else self._slip(self._floor, motion)
        self._x += dx
        self._y += dy
        self._yaw = wrap(self._yaw + turn)
        self._vx, self._vy, self._wz = vx, vy, wz
        self.distance_m += way
        # braking costs as much as speeding up: no energy is recovered
        kinetic = 0.5 * (self._mass * (vx * vx + vy * vy) + self._inertia * wz * wz)
        self.energy_j += abs(kinetic - self._kinetic) + self._rolling * way
        self._kinetic = kinetic

    def _slip(self, floor: SlipperyFloor, motion: PlanarState) -> float:
        """Move the body by this motion of the wheels on this floor; its path length, m."""
        dx, dy, turn, (vx, vy, wz) = motion
        middle = self._yaw + 0.5 * turn
        c, s = math.cos(middle), math.sin(middle)
        before, after = (self._vx, self._vy, self._wz), (vx, vy, wz)
        along = [(c * x + s * y, c * y - s * x, z) for x, y, z in ((dx, dy, turn), before, after)]
        return floor.move(*along)
