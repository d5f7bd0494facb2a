"""The state of a fake UR controller: registers, control script, safety system, joints.

The uploaded script is not interpreted: its effect on the registers is implemented here, command by
command, for those commands that move or stop joints. All others complete at once without effect.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

from hw.fakes.ur.cb3_arm import CYCLE_S, STOP, JointMotion, Joints, brake, move, servo, speed

REGISTERS = 48
STOPPED, PLAYING, PAUSED = 1, 2, 4
READY, DONE = 1, 2
"""Output register 0: the state of the script."""
REALTIME = frozenset((6, 9, 10, 11, 24, 25, 26, 27, 38, 58, *range(66, 72)))
"""Commands without a handshake: the script is ready again at once."""
NORMAL, PROTECTIVE = "NORMAL", "PROTECTIVE_STOP"
SAFEGUARD, EMERGENCY = "SAFEGUARD_STOP", "ROBOT_EMERGENCY_STOP"
BITS: Mapping[str, int] = {
    NORMAL: 1 << 0, PROTECTIVE: 1 << 2 | 1 << 10, SAFEGUARD: 1 << 4 | 1 << 10,
    EMERGENCY: 1 << 6 | 1 << 7 | 1 << 10,
}  # fmt: skip
MODES: Mapping[str, int] = {NORMAL: 1, PROTECTIVE: 3, SAFEGUARD: 5, EMERGENCY: 7}
NOTHING6 = (0.0,) * 6
VERSION = (3, 15, 8, 106339)
STARTING_CYCLES = 4
"""Cycles until an uploaded script runs."""


class FakeController:
    """Stepped every 8 ms; nothing in it waits."""

    def __init__(self, joints: Joints, unlock_s: float) -> None:
        self.version: tuple[int, ...] = VERSION
        self.program: str | None = None  # that of somebody else, which runs
        self.joints = self.target = joints
        self.velocities: Joints = (0.0,) * 6
        self.time_s = 0.0
        self.safety, self.scaling = NORMAL, 1.0
        self.runtime = STOPPED
        self.powered = True
        self.payload, self.center = 0.0, (0.0, 0.0, 0.0)
        self.tcp = self.force = NOTHING6
        self.ints_in, self.floats_in = [0] * REGISTERS, [0.0] * REGISTERS
        self.ints_out, self.floats_out = [0] * REGISTERS, [0.0] * REGISTERS
        self.scripts = 0
        self._unlock_s, self._stopped_at = unlock_s, 0.0
        self._starting = 0
        self._held = False  # a command runs once, until the client writes 0
        self._servo: tuple[Joints, float] | None = None
        self._speed: tuple[Joints, float] | None = None
        self._moving: JointMotion | None = None
        self._inline = False
        self._watchdog_s: float | None = None
        self._fed_at = 0.0

    # ---- clients

    def upload(self) -> None:
        """Take a complete script, which replaces the running one."""
        self.end()
        if self.safety == NORMAL and self.powered:
            self._starting = STARTING_CYCLES

    def other(self, program: str) -> None:
        """Run the program of another client, which turns the first joint to and fro."""
        self.end()
        self.program, self.runtime = program, PLAYING

    def end(self) -> None:
        """Stop the program; the joints slow down."""
        self.program = None
        self.runtime, self._starting = STOPPED, 0
        self._watchdog_s = None
        self._still()

    def written(self, name: str, value: float) -> None:
        """Take a client's value of an input register."""
        kind, _, number = name.rpartition("_")
        if kind == "input_int_register":
            self.ints_in[int(number)] = int(value)
            if number == "0":
                self._fed_at = self.time_s
        elif kind == "input_double_register":
            self.floats_in[int(number)] = value
        elif name == "speed_slider_fraction":
            self.scaling = max(0.0, min(1.0, value))

    def unlock(self) -> str:
        """Unlock a protective stop; returns the dashboard's answer."""
        if self.safety == PROTECTIVE and self.time_s - self._stopped_at < self._unlock_s:
            return f"Cannot unlock protective stop until {self._unlock_s:g}s after occurrence"
        if self.safety == PROTECTIVE:
            self.safety = NORMAL
        return "Protective stop releasing"

    # ---- events

    def halt(self, safety: str) -> None:
        """Stop the arm by the safety system: the program pauses, or ends at an emergency stop."""
        self.safety, self._stopped_at = safety, self.time_s
        paused = self.runtime == PLAYING and safety != EMERGENCY
        self._moving = brake(self.joints, self.velocities, STOP)
        self._inline = False
        self.runtime = PAUSED if paused else STOPPED
        self.powered = safety != EMERGENCY

    def release(self) -> None:
        """End a safeguard or emergency stop; a paused program resumes by itself.

        So do installations whose safeguard resets automatically: the last target holds again.
        """
        if self.safety == SAFEGUARD and self.runtime == PAUSED:
            self.runtime, self._moving = PLAYING, None
        if self.safety != PROTECTIVE:
            self.safety, self.powered = NORMAL, True

    def press(self, tcp: tuple[float, ...], force: tuple[float, ...]) -> None:
        """Press on the tcp, which is there (m and rad), by this force and torque (N and Nm)."""
        if not len(tcp) == len(force) == 6:
            raise ValueError(f"a tcp and a force of {len(tcp)} and {len(force)} numbers, not 6")
        self.tcp, self.force = tcp, force

    def place(self, joints: Joints) -> None:
        """Put the arm there, as after switching on."""
        self.end()
        self.joints = self.target = joints
        self.velocities, self._moving = (0.0,) * 6, None
        self.safety, self.powered = NORMAL, True

    def step(self) -> None:
        """Run one cycle."""
        self.time_s += CYCLE_S
        if self._starting:
            self._starting -= 1
            if not self._starting:
                self._begin()
        self._watch()
        if self.program is not None:
            turned = 0.2 * math.sin(2.0 * math.pi * self.time_s)
            self._speed = (turned, *(0.0,) * 5), STOP
        elif self.runtime == PLAYING and self._starting == 0:
            self._script()
        self._move_joints()

    # ---- the script

    def _begin(self) -> None:
        self.runtime, self._held = PLAYING, True  # the registers' content is old
        self.ints_out[0] = 0
        self.scripts += 1

    def _script(self) -> None:
        command = self.ints_in[0]
        if self._inline:
            if self._moving is None:
                self._inline = False
                self.ints_out[0] = DONE
        elif command in REALTIME:
            self._realtime(command)
            self.ints_out[0] = READY
        elif command == 0:
            self._held = False
            self.ints_out[0] = READY
        elif not self._held:
            self._held = True
            self._do(command)

    def _realtime(self, command: int) -> None:
        if command == 11:
            self._servo = (tuple(self.floats_in[:6]), self.floats_in[9])
        elif command == 9:
            self._speed = (tuple(self.floats_in[:6]), self.floats_in[6])

    def _do(self, command: int) -> None:
        values = self.floats_in
        if command == 255:
            self.end()
            return
        self.ints_out[0] = DONE
        if command == 1:
            self._still()
            self._moving = move(self.joints, tuple(values[:6]), values[6], values[7])
            self._inline = self.ints_in[1] == 0
        elif command in (15, 16, 33, 34):
            self._servo = self._speed = None
            self._moving = brake(self.joints, self.velocities, values[0])
            self._inline = True
        elif command == 17:
            x, y, z = values[1:4]
            self.payload, self.center = values[0], (x, y, z)
        elif command == 31:
            self.halt(PROTECTIVE)
        elif command == 35:
            self._watchdog_s, self._fed_at = 1.0 / max(values[0], 0.1), self.time_s
        elif command in (36, 37, 47):
            self.ints_out[1] = int(command != 47 or not any(self.velocities))
        if self._inline:
            self.ints_out[0] = 0

    def _still(self) -> None:
        self._servo = self._speed = None
        self._moving = brake(self.joints, self.velocities, STOP)
        self._inline = False

    def _watch(self) -> None:
        if self._watchdog_s is None or self.runtime != PLAYING:
            return
        if self.time_s - self._fed_at > self._watchdog_s:
            self.end()

    # ---- the joints

    def _move_joints(self) -> None:
        before = self.joints
        if self._moving is not None:
            self.joints = self.target = next(self._moving, before)
            if self.joints is before:
                self._moving = None
        elif self.runtime == PLAYING and self._servo is not None:
            self.target, lookahead = self._servo
            self.joints = servo(before, self.target, lookahead, self.scaling)
        elif self.runtime == PLAYING and self._speed is not None:
            wanted, acceleration = self._speed
            self.joints = self.target = speed(before, self.velocities, wanted, acceleration)
        self.velocities = tuple((b - a) / CYCLE_S for a, b in zip(before, self.joints, strict=True))
