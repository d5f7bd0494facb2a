"""A servo drive of a wheel on a CAN bus: CANopen with profile CiA 402, profile velocity mode.

Its object dictionary is kept by `canopen.LocalNode`, which answers SDO and network management;
process data, ramps, the state machine and the monitoring of the master's heartbeat are here. Time
is passed in by `step`, so that tests control it.

    drive = Drive(network, 3)
    drive.step(now_ns)           # after the network has delivered the frames received
"""

from __future__ import annotations

import struct
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import canopen
from canopen.objectdictionary import (
    INTEGER8,
    INTEGER16,
    INTEGER32,
    UNSIGNED8,
    UNSIGNED16,
    UNSIGNED32 as U32,
)

from hw.fakes.can.can_network import FakeNetwork

STATUS = {
    "disabled": 0x0240, "ready": 0x0221, "on": 0x0223, "enabled": 0x0227, "quick stop": 0x0207,
    "reaction": 0x020F, "fault": 0x0208,
}  # fmt: skip
VOLTAGE = 0x0010
_NODES: Any = canopen  # much of it has no types
COASTING = 400_000.0
"""Deceleration of a wheel without power, units/s2."""
NO_RTR = 0x4000_0000
UNIT_OBJECTS: Mapping[str, int] = {
    "rpm": 0x00B4_4700, "0.1 rpm": 0xFFB4_4700, "mrpm": 0xFDB4_4700, "rev/s": 0x00B4_0300,
    "not told": 0,
}  # fmt: skip
"""Object 0x60A9 of drives that have it."""
OBJECTS = (
    ("device type", 0x1000, U32, 0x0002_0192),
    ("error register", 0x1001, UNSIGNED8, 0),
    ("producer heartbeat", 0x1017, UNSIGNED16, 0),
    ("abort connection", 0x6007, INTEGER16, 1),
    ("control word", 0x6040, UNSIGNED16, 0),
    ("status word", 0x6041, UNSIGNED16, 0),
    ("quick stop option", 0x605A, INTEGER16, 2),
    ("fault reaction option", 0x605E, INTEGER16, 2),
    ("mode", 0x6060, INTEGER8, 0),
    ("velocity actual", 0x606C, INTEGER32, 0),
    ("acceleration", 0x6083, U32, 10_000),
    ("deceleration", 0x6084, U32, 10_000),
    ("quick stop deceleration", 0x6085, U32, 10_000),
    ("target velocity", 0x60FF, INTEGER32, 0),
)
OWN = {index: default for _, index, _, default in OBJECTS}
RECORDS = (
    ("consumer heartbeat", 0x1016, U32, (0,)),
    ("error behaviour", 0x1029, UNSIGNED8, (0,)),
)
MAPPINGS = {0x1400: 0x1600, 0x1800: 0x1A00}


@dataclass(frozen=True, slots=True)
class Traits:
    """What sets a make of drives apart.

    `rtr`: they take remote requests; without, bit 30 of a COB-ID stays set. `lacks` are objects
    that they do not have; `unit` is that of their velocities.
    """

    rtr: bool = True
    lacks: frozenset[int] = frozenset()
    unit: str = "increments/s"


def dictionary(node: int, traits: Traits) -> Any:
    """The objects of a drive: one process data object each way, not mapped yet."""
    found = _NODES.ObjectDictionary()
    units = [
        ("unit of velocity", 0x60A9, U32, n) for u, n in UNIT_OBJECTS.items() if u == traits.unit
    ]
    for name, index, kind, default in (*OBJECTS, *units):
        if index not in traits.lacks:
            found.add_object(_variable(name, index, 0, kind, default))
    for name, index, kind, defaults in RECORDS:
        if index not in traits.lacks:
            found.add_object(_record(name, index, len(defaults), [(kind, one) for one in defaults]))
    no_rtr = 0 if traits.rtr else NO_RTR
    for communication, mapping in MAPPINGS.items():
        frame = 0x8000_0000 | no_rtr | (0x200 if communication == 0x1400 else 0x180) + node
        members = [(U32, frame), (UNSIGNED8, 255)]
        found.add_object(_record("process data", communication, len(members), members))
        found.add_object(_record("mapping", mapping, 0, [(U32, 0), (U32, 0)]))
    return found


def _record(name: str, index: int, count: int, members: list[tuple[int, int]]) -> Any:
    """An object with members; its name includes the index to be unique."""
    made = canopen.objectdictionary.ODRecord(f"{name} {index:X}", index)
    made.add_member(_variable("count", index, 0, UNSIGNED8, count))
    for n, (kind, default) in enumerate(members, 1):
        made.add_member(_variable(f"entry {n}", index, n, kind, default))
    return made


def _variable(
    name: str, index: int, subindex: int, kind: int, default: int
) -> canopen.objectdictionary.ODVariable:
    made = canopen.objectdictionary.ODVariable(name, index, subindex)
    made.data_type, made.default, made.access_type = kind, default, "rw"
    return made


class FakeDrive:
    """One drive; `velocity` is that of its motor, units/s. Faults: see `hw.fakes.can.can_nodes`."""

    def __init__(self, network: FakeNetwork, number: int, traits: Traits | None = None) -> None:
        self.traits = traits or Traits()
        self.number, self.velocity = number, 0.0
        self.state = "disabled"
        self.relay_open = False  # opened by the bumper's line: no power for the motor
        self.silent = False  # sends no process data
        self.stuck = False  # repeats the same velocity
        self._network = network
        self._node = _NODES.LocalNode(number, dictionary(number, self.traits))
        self._node.add_write_callback(self._written)
        self._values: dict[tuple[int, int], int] = {}
        network.add_node(self._node)
        self._control = 0
        self._waiting: bytes | None = None
        self._told = b""
        self._beat_ns: int | None = None
        self._stepped_ns: int | None = None
        self.boot()

    def boot(self) -> None:
        """Restart: settings are lost, the motor has no power, a boot-up message is sent."""
        node = self._node
        node.nmt.stop_heartbeat()
        node.data_store.clear()
        self._values.clear()
        self.state, self._control, self._waiting, self._beat_ns = "disabled", 0, None, None
        node.nmt.state = "INITIALISING"
        node.nmt.state = "PRE-OPERATIONAL"

    def fail(self, code: int) -> None:
        """Fail: send an EMCY, and run the fault reaction."""
        self._node.emcy.send(code, 0x01)
        self.state = "reaction"

    def on_frame(self, identifier: int, data: bytes, now_ns: int) -> None:
        """Take a frame of the bus."""
        watched = self.value(0x1016, 1)
        if watched and identifier == 0x700 + (watched >> 16 & 0x7F):
            self._beat_ns = now_ns
        if self._node.nmt.state != "OPERATIONAL":
            return
        frame, kind = self.value(0x1400, 1) & ~NO_RTR, self.value(0x1400, 2)
        if identifier == frame:
            self._waiting = data
            if kind >= 254:
                self._obey()
        elif identifier == 0x80:
            self._obey()
            self._send_status()

    def step(self, now_ns: int) -> None:
        """Advance to now_ns: ramps, and the monitoring of the master."""
        if self._node.nmt.state == "INITIALISING":  # by command of the master
            self.boot()
        span = 0.0 if self._stepped_ns is None else 1e-9 * (now_ns - self._stepped_ns)
        self._stepped_ns = now_ns
        self._watch(now_ns)
        if self.relay_open and self.state in ("ready", "on", "enabled"):
            self.state = "quick stop" if self.state == "enabled" else "disabled"
        target, ramp = self._motion()
        change = target - self.velocity
        self.velocity += max(-ramp * span, min(ramp * span, change))
        if self.velocity == 0.0:
            if self.state == "quick stop" and self.value(0x605A) < 5:
                self.state = "disabled"
            elif self.state == "reaction":
                self.state = "fault"

    def value(self, index: int, subindex: int = 0) -> int:
        """The present value of an object; of one that it lacks, that of its maker."""
        if index in self.traits.lacks:
            return OWN.get(index, 0)
        found = self._values.get((index, subindex))
        if found is None:
            variable = self._node.object_dictionary.get_variable(index, subindex)
            assert variable is not None
            found = int(variable.decode_raw(self._node.get_data(index, subindex)))
            self._values[index, subindex] = found
        return found

    def _written(self, *, index: int, subindex: int, data: bytes, **_: object) -> None:
        frame = int.from_bytes(data, "little")
        if (index, subindex) == (0x1800, 1) and not self.traits.rtr and not frame & NO_RTR:
            raise _NODES.SdoAbortedError(0x0609_0030)
        self._values.pop((index, subindex), None)

    def _motion(self) -> tuple[float, float]:
        """The target velocity, and the ramp."""
        if self.state == "enabled" and self.value(0x6060) == 3:
            target = float(self.value(0x60FF))
            faster = abs(target) > abs(self.velocity)
            return target, float(self.value(0x6083 if faster else 0x6084))
        if self.state in ("quick stop", "reaction"):
            return 0.0, float(self.value(0x6085))
        return 0.0, COASTING

    def _watch(self, now_ns: int) -> None:
        """React to a lost master, which is monitored from its first heartbeat on (CiA 301)."""
        limit = self.value(0x1016, 1) & 0xFFFF
        if not limit or self._beat_ns is None or now_ns - self._beat_ns <= limit * 1_000_000:
            return
        self._beat_ns = None
        if self._node.nmt.state == "OPERATIONAL" and self.value(0x1029, 1) == 0:
            self._node.nmt.state = "PRE-OPERATIONAL"
        self._node.emcy.send(0x8130, 0x11)
        option = self.value(0x6007)
        if self.state == "enabled" and option:
            self.state = {1: "reaction", 2: "disabled", 3: "quick stop"}[option]

    def _obey(self) -> None:
        """Take the process data received."""
        data, self._waiting = self._waiting, None
        if data is None or len(data) < self._length(0x1600):
            return
        for index, size in self._mapped(0x1600):
            self._node.set_data(index, 0, data[:size])
            data = data[size:]
        control = self.value(0x6040)
        before, self._control = self._control, control
        self.state = self._next(control, reset=bool(control & ~before & 0x80))

    def _next(self, control: int, reset: bool) -> str:
        """The state after a control word."""
        state = self.state
        if state == "fault" and reset:
            self._node.emcy.reset()
            return "disabled"
        if state in ("fault", "reaction"):
            return state
        if not control & 0x02:  # disable voltage
            return "disabled"
        if not control & 0x04:  # quick stop
            return {"enabled": "quick stop", "quick stop": "quick stop"}.get(state, "disabled")
        wanted = control & 0x0F
        if wanted == 0x0F and state == "quick stop" and self.value(0x605A) >= 5:
            return "enabled"
        if self.relay_open:
            return state
        steps = {
            0x06: {"disabled": "ready", "on": "ready", "enabled": "ready"},
            0x07: {"ready": "on", "enabled": "on"},
            0x0F: {"on": "enabled"},
        }
        return steps.get(wanted, {}).get(state, state)

    def _send_status(self) -> None:
        """Send status word and velocity, as mapped."""
        frame = self.value(0x1800, 1) & ~NO_RTR
        if self.silent or frame & 0x8000_0000 or self.value(0x1800, 2) > 240:
            return
        status = STATUS[self.state] | (0 if self.relay_open else VOLTAGE)
        self._node.set_data(0x6041, 0, struct.pack("<H", status))
        self._node.set_data(0x606C, 0, struct.pack("<i", round(self.velocity)))
        data = b"".join(self._node.get_data(i, 0)[:size] for i, size in self._mapped(0x1A00))
        if not self.stuck:
            self._told = data
        if self._told:
            self._network.send_message(frame, self._told)

    def _mapped(self, mapping: int) -> list[tuple[int, int]]:
        """Index and size in bytes of the mapped objects."""
        entries = [self.value(mapping, n) for n in range(1, self.value(mapping) + 1)]
        return [(entry >> 16, (entry & 0xFF) // 8) for entry in entries]

    def _length(self, mapping: int) -> int:
        return sum(size for _, size in self._mapped(mapping))
