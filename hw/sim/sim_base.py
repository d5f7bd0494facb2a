"""The wheels of the reduced simulation: ideal pose, limited speed and acceleration.

The limits are those of `hw.safety.ramps`. With a safety chain the base runs its own loop at 100 Hz
or more and asks the chain in each cycle, after the ramps and last before the wheels; what the chain
cuts is braked away.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from hw.geometry import STILL, Pose2, Twist2
from hw.interfaces import DriveMode
from hw.jit import compile_examples
from hw.model import MotionLimits, RobotModel, WhiteNoise, added
from hw.motion import RECKONING
from hw.safety import CYCLE, RULE, LocalChain, Ramps, require_rolling
from hw.samples import Sample
from hw.sim import wheel_cycles
from hw.sim.wheel_cycles import BODY, Moved, move

if TYPE_CHECKING:
    from hw.sim.sensors import Track
    from hw.sim.slip import SlipperyFloor

_GRAVITY = 9.81
_EXACT = Pose2(0.0, 0.0)
_UNCHAINED = np.zeros(1, RULE), np.zeros(1, CYCLE), np.zeros(1, RECKONING)


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

    shaken = False
    """Whether an arm that moves shakes it while it stands."""

    def __init__(
        self,
        model: RobotModel,
        limits: MotionLimits,
        start: Pose2,
        noise: WhiteNoise | None = None,
    ) -> None:
        compile_examples((wheel_cycles,))
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
        self._model, self._sideways = base, base.sideways
        self._ramps = Ramps(base, limits)
        self._timeout_ns = round(base.command_timeout * 1e9)
        self._target = STILL
        self._wanted_mode = self.mode
        self._now = 0
        self._expires = 0
        self._stands = True
        self._reported = -1
        self._body = np.zeros(1, BODY)
        outline = model.footprint
        inertia = model.mass * (outline.length**2 + outline.width**2) / 12.0
        self._body["ramps"] = self._ramps.figures
        self._body["mass"], self._body["inertia"] = model.mass, inertia
        self._body["rolling"] = base.rolling_resistance * model.mass * _GRAVITY
        self._body["place"] = start.x, start.y, start.yaw

    def watch(self, body: Track, wheels: Track, floor: SlipperyFloor | None) -> None:
        """Record the poses of body and wheels from now on, and slip on this floor."""
        self.signals = ("base.twist",)
        self._tracks, self._floor = (body, wheels), floor
        if floor is not None:
            self._body["slips"] = True
            floor.lay(self._body["floor"], self.pose)

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
        if not self._sideways:
            require_rolling(command)
        if not math.isfinite(command.vx + command.vy + command.wz):
            Twist2.checked(command.vx, command.vy, command.wz)
        self._target = self._limited(command)
        self._expires = self._now + self._timeout_ns

    def stop(self) -> None:
        """Slow down to standstill; see `Base`."""
        self._target = STILL

    def samples(self, now_ns: int) -> list[Sample]:
        """Pose and twist at this instant; the error of the pose is held until the next one."""
        if self._reported == now_ns:
            return []
        self._reported = now_ns
        twist = Sample("base.twist", now_ns, self.twist)
        if self._tracks is not None:
            return [twist]
        pose = self.pose if self._noise is None else added(self.pose, self._error)
        return [Sample("base.pose", now_ns, pose), twist]

    @property
    def still(self) -> bool:
        """True while it stands, without a command, a change of mode or noise: it only repeats."""
        stands = self.twist is STILL and self._target is STILL and self._noise is None
        return stands and self.mode == self._wanted_mode

    def block(self, pose: Pose2) -> None:
        """A solid obstacle stops the base at once, at this pose."""
        self.pose, self.twist, self._target, self._stands = pose, STILL, STILL, True
        place = pose.x, pose.y, pose.yaw
        if self._floor is None:
            self._body["place"] = place
        else:
            self._body["floor"]["place"] = place  # the wheels stand; the body is pushed or held
        for name in ("velocity", "twist", "kinetic"):
            self._body[name] = 0.0

    def advance(self, until_ns: int) -> None:
        """Advance to until_ns."""
        if self.braked:
            self._target = STILL
        if self._expires < until_ns and self._target is not STILL:
            self._move(max(self._now, self._expires))
            self._target = STILL
        self._move(until_ns)
        if self._noise is not None:
            self._error = error = self._noise.error(until_ns)
            self._body["noisy"], self._body["error"] = True, (error.x, error.y, error.yaw)

    def _limited(self, command: Twist2) -> Twist2:
        return self._ramps.limited(command, self._wanted_mode)

    def _move(self, until_ns: int) -> None:
        since, self._now = self._now, until_ns
        target, chain = self._target, self.chain
        if self._stands:
            self.mode = self._wanted_mode
            if target.vx == 0.0 and target.vy == 0.0 and target.wz == 0.0:
                self.twist = STILL
                if chain is not None:
                    chain.rest(since)
                if self._tracks is not None:
                    self._note(until_ns, *self._tracks)
                return
        elif self.mode != self._wanted_mode:
            target = STILL
        if until_ns > since:
            self._run(target, since, until_ns)

    def _run(self, target: Twist2, since: int, until: int) -> None:
        """Run the cycles of a drive; see `hw.sim.wheel_cycles`."""
        body, chain, left = self._body, self.chain, True
        body["target"] = target.vx, target.vy, target.wz
        body["omni"], body["omni_wanted"] = self.mode == "omni", self._wanted_mode == "omni"
        body["braked"], body["chained"] = self.braked, chain is not None
        while left:
            if chain is None:
                left = self._take(move(body, since, until, *_UNCHAINED))
            else:
                left = self._take(chain.run(since, move, body, since, until))

    def _take(self, found: Moved) -> bool:
        """Take over where the body is; whether cycles are left."""
        left, self._stands, place, twist, self.distance_m, self.energy_j = found
        self.pose, self.twist = Pose2(*place), Twist2(*twist)
        if self._tracks is not None:
            body, wheels = self._tracks
            now, n = self._body[0], self._body["noted"][0]
            body.extend(now["stamps"][:n].tolist(), now["bodies"][:n].tolist())
            if self._floor is not None:
                wheels.extend(now["stamps"][:n].tolist(), now["wheels"][:n].tolist())
                self._floor.draw(self._body["floor"])
        return left

    def _note(self, now_ns: int, body: Track, wheels: Track) -> None:
        """Note that body and wheels stand."""
        pose = self.pose
        body.extend((now_ns,), ((pose.x, pose.y, pose.yaw),))
        if self._floor is not None:
            wheels.extend((now_ns,), self._body["place"].tolist())
