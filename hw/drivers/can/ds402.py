"""One wheel's drive as its master sees it: CANopen, CiA 402, profile velocity mode (3).

Process data: 0x200 + node carries control word and target velocity, 0x180 + node status word and
actual velocity, both with each SYNC. The drive monitors the master's heartbeat: without it the
drive brakes by its quick-stop ramp and switches off. Nothing here waits; time comes in by `poll`.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass

from canopen.emcy import EMCY_STRUCT, EmcyError

from hw.drivers.can.sdo import SdoCheck, SdoWrite, Writer
from hw.drivers.gates import HEARTBEAT_NS, VELOCITY_NS

QUICK_STOP, OFF, RESET = 0x02, 0x00, 0x80
ENABLED = "operation enabled"
START, PRE_OPERATIONAL = 0x01, 0x80
OPERATIONAL = 5
NMT = {0: "initialising", 4: "stopped", OPERATIONAL: "operational", 127: "pre-operational"}
TOWARDS_ENABLED = {
    "switch on disabled": 0x06, "ready to switch on": 0x07, "switched on": 0x0F, ENABLED: 0x0F,
}  # fmt: skip
"""Control words towards `operation enabled`, by state; other states switch off first."""
_PROCESS = struct.Struct("<Hi")
Send = Callable[[int, bytes], None]


NO_RTR = 0x4000_0000
"""Bit of a COB-ID: no remote requests. Drives without them refuse to have it cleared."""
OPTIONAL: Mapping[int, str] = {
    0x1029: "once it has lost its master it may report no velocities; then end the run, start anew",
    0x6083: "it speeds up by a ramp of its own",
}
"""Objects that a drive may lack, and what that means."""
REMEDIES: Mapping[int, str] = {
    0x1016: "it does not watch its master: let a watchdog of its own stop it after {silence} ms",
    0x6007: "without its master it may drive on: set its reaction to a lost link to quick stop",
    0x605A: "set its quick stop to brake by the quick-stop ramp, then to switch off",
    0x605E: "set its reaction to a fault to brake by the quick-stop ramp",
    0x6084: "set its ramp for slowing down to {ramp} units/s2 at least",
    0x6085: "set its quick-stop ramp to {ramp} units/s2 at least",
}
"""Objects that a connection must say to be lacking, and what then has to be set at the drive."""
UNITS: Mapping[str, int] = {
    "increments/s": 0x00B5_0300, "rpm": 0x00B4_4700, "0.1 rpm": 0xFFB4_4700, "mrpm": 0xFDB4_4700,
}  # fmt: skip
"""Units of velocity, as object 0x60A9 writes them (CiA 303-2)."""


@dataclass(frozen=True, slots=True)
class Setting:
    """A drive's initial settings: `ramp` in its units/s2, `silence_ms` of the master.

    `without` are the objects of `REMEDIES` that it lacks, by the connection.
    """

    master: int
    silence_ms: int
    ramp: int
    unit: str = "increments/s"
    without: frozenset[int] = frozenset()

    def writes(self, node: int) -> list[SdoCheck | SdoWrite]:
        """What to check and write; process data can be mapped only in state pre-operational."""
        return [
            SdoCheck(0x60A9, 0, self._fault_of_unit),
            SdoWrite(0x1017, 0, 2, 50),  # own heartbeat, ms
            self._write(0x1016, 1, 4, self.master << 16 | self.silence_ms),  # the master's
            self._write(0x1029, 1, 1, 1),  # master lost: keep reporting the velocity
            *_mapped(0x1400, 0x1600, 0x200 + node, 0x60400010, 0x60FF0020),
            *_mapped(0x1800, 0x1A00, 0x180 + node, 0x60410010, 0x606C0020),
            SdoWrite(0x6060, 0, 1, 3),  # profile velocity
            self._write(0x605A, 0, 2, 2),  # quick stop: brake by its ramp, then switch off
            self._write(0x605E, 0, 2, 2),  # fault: the same ramp
            self._write(0x6007, 0, 2, 3),  # master lost: quick stop
            self._write(0x6085, 0, 4, self.ramp),  # quick-stop ramp
            self._write(0x6083, 0, 4, self.ramp),  # the same for speeding up and slowing down:
            self._write(0x6084, 0, 4, self.ramp),  # the chain has ramps of its own
            SdoWrite(0x60FF, 0, 4, 0),
        ]

    def _write(self, index: int, subindex: int, size: int, value: int) -> SdoWrite:
        """A write of an object that a drive may lack."""
        if index in OPTIONAL:
            return SdoWrite(index, subindex, size, value, 0, OPTIONAL[index], optional=True)
        lack = REMEDIES[index].format(silence=self.silence_ms, ramp=self.ramp)
        if index in self.without:
            return SdoWrite(index, subindex, size, value, 0, f"accepted: {lack}", optional=True)
        lack = f"{lack} with its maker's tool, then accept that (wheels: without: [0x{index:04X}])"
        return SdoWrite(index, subindex, size, value, 0, lack)

    def _fault_of_unit(self, number: int) -> str | None:
        """What is wrong with a drive whose object 0x60A9 is this number; 0: it says nothing."""
        if number in (0, UNITS[self.unit]):
            return None
        known = next((unit for unit, one in UNITS.items() if one == number), None)
        if known is not None:
            return f"counts velocities in {known}, and wheels: unit: is {self.unit!r}"
        right = f"0x{UNITS[self.unit]:08X} is {self.unit}"
        return f"counts velocities in an unknown unit (object 0x60A9: 0x{number:08X}; {right})"


def _mapped(communication: int, mapping: int, frame: int, *objects: int) -> list[SdoWrite]:
    """Disable a process data object, map it, set it to each SYNC, enable it again."""
    return [
        SdoWrite(communication, 1, 4, 0x8000_0000 | frame, NO_RTR),
        SdoWrite(mapping, 0, 1, 0),
        *(SdoWrite(mapping, n, 4, entry) for n, entry in enumerate(objects, 1)),
        SdoWrite(mapping, 0, 1, len(objects)),
        SdoWrite(communication, 2, 1, 1),
        SdoWrite(communication, 1, 4, frame, NO_RTR),
    ]


class Ds402Drive:
    """A drive by its node number; `fault` stays until `start`.

    `velocity` is the last one reported, in its own units/s; `fresh` says whether it is new,
    `configured` whether the drive has its settings.
    """

    def __init__(self, node: int, name: str, setting: Setting, send: Send) -> None:
        self.node, self.name = node, f"drive {node} ({name})"
        self.fault: str | None = None
        self.state = "unknown"
        self.configured = self._begun = False
        self.velocity = 0
        self.fresh = False
        self._send = send
        self._writer = Writer(node, send)
        self._setting = setting
        self._wanted = False  # to be enabled
        self._watched = False  # was enabled, and must stay so
        self._nmt: int | None = None
        self._beat_ns = self._told_ns = 0
        self._edge = False

    @property
    def enabled(self) -> bool:
        """True if it follows velocities."""
        return self._watched and self.state == ENABLED

    @property
    def lacking(self) -> Iterator[str]:
        """Objects that it lacks, and what that means."""
        for write in self._writer.lacking:
            yield f"no object 0x{write.index:04X}: {write.lack}"

    def start(self, now_ns: int) -> None:
        """Clear the fault, and enable the drive; nothing moves."""
        self.fault, self._wanted, self._watched = None, True, False
        self._beat_ns = self._told_ns = now_ns
        if self.configured:
            self.command(START)
        elif not self._begun or self._writer.fault is not None:
            self._begin_to_configure()

    def hold(self) -> None:
        """Brake by its quick stop, and stay stopped until `start`."""
        self._wanted = self._watched = False

    def alive(self, now_ns: int) -> bool:
        """True if it sends heartbeats and, when operational, velocities.

        Without its settings it is not alive; but if it refused them, `start` tries once more.
        """
        if not self.configured:
            return self._writer.fault is not None
        if now_ns - self._beat_ns > HEARTBEAT_NS:
            return False
        return self._nmt != OPERATIONAL or self.tells(now_ns)

    def tells(self, now_ns: int) -> bool:
        """True if it has reported its velocity recently."""
        return now_ns - self._told_ns <= VELOCITY_NS

    def poll(self, now_ns: int) -> None:
        """Check ages; write its settings, also during a fault: they move nothing."""
        if not self.configured:
            self._configure(now_ns)
        elif now_ns - self._beat_ns > HEARTBEAT_NS:
            self._fail("has no heartbeat")
        elif now_ns - self._told_ns > VELOCITY_NS:
            self._fail("reports no velocity")

    def control(self) -> int:
        """The control word due: towards `operation enabled`, or quick stop."""
        if not self._wanted or not self.configured:
            return QUICK_STOP
        if self.state == "fault":
            self._edge = not self._edge  # a reset is the rising edge of its bit
            return RESET if self._edge else OFF
        return TOWARDS_ENABLED.get(self.state, OFF)

    def send_command(self, control: int, velocity: int) -> None:
        """Send control word and target velocity; they take effect with the next SYNC."""
        self._send(0x200 + self.node, _PROCESS.pack(control, velocity))

    def command(self, code: int) -> None:
        """Send a network management command: `START` or `PRE_OPERATIONAL`."""
        self._send(0, bytes((code, self.node)))

    def switch_off(self) -> None:
        """Switch the power off with the next SYNC."""
        self.hold()
        self.send_command(OFF, 0)

    def on_heartbeat(self, data: bytes, now_ns: int) -> None:
        """Take a heartbeat: its network state, or a boot-up."""
        if len(data) != 1:
            return
        self._beat_ns, before = now_ns, self._nmt
        self._nmt = data[0] & 0x7F
        if self._nmt == 0 and before is not None:
            self._fail("has restarted")
            self._begin_to_configure()  # its settings are lost
        elif self._watched and self._nmt != OPERATIONAL:
            self._fail(f"is {NMT.get(self._nmt, self._nmt)}")

    def on_told(self, data: bytes, now_ns: int) -> None:
        """Take status word and velocity."""
        if len(data) != _PROCESS.size:
            return
        status, self.velocity = _PROCESS.unpack(data)
        self._told_ns, self.fresh = now_ns, True
        self.state = state_of(status)
        if self.state == ENABLED:
            self._watched = self._wanted
        elif self._watched:
            self._fail(f"is in {self.state!r}")

    def on_emergency(self, data: bytes, now_ns: int) -> None:
        """Take an EMCY object; code 0 means that an error is over."""
        if len(data) != EMCY_STRUCT.size:
            return
        code, register, more = EMCY_STRUCT.unpack(data)
        if code >> 8:
            told = EmcyError(code, register, more, 1e-9 * now_ns)
            self._fail(f"EMCY 0x{code:04X} {told.get_desc()}".rstrip())

    def on_answer(self, data: bytes, now_ns: int) -> None:
        """Take an answer to a write."""
        self._writer.on_answer(data, now_ns)

    def _begin_to_configure(self) -> None:
        self.configured, self._begun = False, True
        self.command(PRE_OPERATIONAL)
        self._writer.begin(self._setting.writes(self.node))

    def _configure(self, now_ns: int) -> None:
        self._writer.poll(now_ns)
        if self._writer.fault is not None:
            self._fail(self._writer.fault)
        elif self._begun and self._writer.done:
            self.configured, self._beat_ns, self._told_ns = True, now_ns, now_ns
            self.command(START)

    def _fail(self, why: str) -> None:
        if self.fault is None:
            self.fault = f"{self.name}: {why}"
        self.hold()


def state_of(status: int) -> str:
    """The state of a status word (CiA 402-2, table of states)."""
    by_four = {0x00: "not ready", 0x40: "switch on disabled", 0x0F: "fault reaction", 0x08: "fault"}
    by_five = {
        0x21: "ready to switch on", 0x23: "switched on", 0x27: ENABLED, 0x07: "quick stop",
    }  # fmt: skip
    found = by_four.get(status & 0x4F) or by_five.get(status & 0x6F)
    return found or f"status 0x{status:04X}"
