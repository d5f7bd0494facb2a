"""RTDE as a UR controller speaks it on port 30004, for one client of the fake.

All numbers are big-endian. A package is its size (uint16, including its own 3 bytes), its kind
(uint8) and its content.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Collection, Mapping
from typing import Any

from hw.fakes.ur.cb3_controller import (
    BITS,
    MODES,
    NOTHING6,
    PLAYING,
    REGISTERS,
    FakeController,
)

Value = Callable[[FakeController], Any]
HEADER = struct.Struct(">HB")
FORMATS: Mapping[str, str] = {
    "BOOL": "?", "UINT8": "B", "UINT32": "I", "UINT64": "Q", "INT32": "i", "DOUBLE": "d",
    "VECTOR3D": "3d", "VECTOR6D": "6d", "VECTOR6INT32": "6i",
}  # fmt: skip


def _status(arm: FakeController) -> int:
    return int(arm.powered) | int(arm.runtime == PLAYING) << 1


def _register(name: str, number: int) -> Value:
    return lambda arm: getattr(arm, name)[number]


OUTPUTS: dict[str, tuple[str, Value]] = {
    "timestamp": ("DOUBLE", lambda arm: arm.time_s),
    "actual_q": ("VECTOR6D", lambda arm: arm.joints),
    "actual_qd": ("VECTOR6D", lambda arm: arm.velocities),
    "target_q": ("VECTOR6D", lambda arm: arm.target),
    "target_qd": ("VECTOR6D", lambda arm: arm.velocities),
    "robot_mode": ("INT32", lambda arm: 7 if arm.powered else 3),
    "joint_mode": ("VECTOR6INT32", lambda _: (253,) * 6),
    "safety_mode": ("INT32", lambda arm: MODES[arm.safety]),
    "runtime_state": ("UINT32", lambda arm: arm.runtime),
    "robot_status_bits": ("UINT32", _status),
    "safety_status_bits": ("UINT32", lambda arm: BITS[arm.safety]),
    "speed_scaling": ("DOUBLE", lambda _: 1.0),  # of the trajectory limiter; not of the slider
    "target_speed_fraction": ("DOUBLE", lambda arm: arm.scaling),
    "actual_TCP_pose": ("VECTOR6D", lambda arm: arm.tcp),
    "actual_TCP_force": ("VECTOR6D", lambda arm: arm.force),
    "payload": ("DOUBLE", lambda arm: arm.payload),
    "payload_cog": ("VECTOR3D", lambda arm: arm.center),
    "actual_tool_accelerometer": ("VECTOR3D", lambda _: (0.0, 0.0, 9.81)),
    "actual_digital_input_bits": ("UINT64", lambda _: 0),
    "actual_digital_output_bits": ("UINT64", lambda _: 0),
}
for _name in (
    "target_qdd", "target_current", "target_moment", "actual_current", "joint_control_output",
    "actual_TCP_speed", "target_TCP_pose", "target_TCP_speed", "joint_temperatures",
    "actual_joint_voltage", "payload_inertia",
):  # fmt: skip
    OUTPUTS[_name] = ("VECTOR6D", lambda _: NOTHING6)
for _name in (
    "actual_execution_time", "actual_momentum", "actual_main_voltage", "actual_robot_voltage",
    "actual_robot_current", "standard_analog_input0", "standard_analog_input1",
    "standard_analog_output0", "standard_analog_output1",
):  # fmt: skip
    OUTPUTS[_name] = ("DOUBLE", lambda _: 0.0)
INPUTS: dict[str, str] = {
    "speed_slider_mask": "UINT32", "speed_slider_fraction": "DOUBLE",
    "standard_digital_output_mask": "UINT8", "standard_digital_output": "UINT8",
    "configurable_digital_output_mask": "UINT8", "configurable_digital_output": "UINT8",
    "tool_digital_output_mask": "UINT8", "tool_digital_output": "UINT8",
    "standard_analog_output_mask": "UINT8", "standard_analog_output_type": "UINT8",
    "standard_analog_output_0": "DOUBLE", "standard_analog_output_1": "DOUBLE",
    "external_force_torque": "VECTOR6D",
}  # fmt: skip
for _n in range(REGISTERS):
    OUTPUTS[f"output_int_register_{_n}"] = ("INT32", _register("ints_out", _n))
    OUTPUTS[f"output_double_register_{_n}"] = ("DOUBLE", _register("floats_out", _n))
    INPUTS[f"input_int_register_{_n}"] = "INT32"
    INPUTS[f"input_double_register_{_n}"] = "DOUBLE"


class Rtde:
    """One client's RTDE session; `taken` answers its bytes.

    `refused` are outputs unknown to this controller, or inputs that another client has.
    """

    def __init__(self, arm: FakeController, refused: Collection[str]) -> None:
        self._arm, self._refused = arm, refused
        self._version = 1
        self._buffer = b""
        self._outputs: list[tuple[str, Value]] = []
        self._inputs: list[list[str]] = []
        self._every, self._count = 1, 0
        self._started = False

    def taken(self, data: bytes) -> bytes:
        """Take bytes; returns the answers.

        Raises:
            ValueError, struct.error: not RTDE.
        """
        self._buffer += data
        answers = b""
        while len(self._buffer) >= HEADER.size:
            size, kind = HEADER.unpack_from(self._buffer)
            if size < HEADER.size:
                raise ValueError(f"a package of {size} bytes")
            if len(self._buffer) < size:
                break
            content, self._buffer = self._buffer[HEADER.size : size], self._buffer[size:]
            answers += self._answer(chr(kind), content)
        return answers

    def package(self) -> bytes:
        """The package of this cycle; empty if none is due."""
        if not self._started:
            return b""
        self._count += 1
        if self._count % self._every:
            return b""
        content = bytes([1] if self._version > 1 else [])
        for kind, value in self._outputs:
            found = value(self._arm)
            values = found if isinstance(found, tuple) else (found,)
            content += struct.pack(">" + FORMATS[kind], *values)
        return _package("U", content)

    def _answer(self, kind: str, content: bytes) -> bytes:
        if kind == "V":
            [self._version] = struct.unpack(">H", content)
            return _package(kind, bytes([self._version in (1, 2)]))
        if kind == "v":
            return _package(kind, struct.pack(">4I", *self._arm.version))
        if kind == "O":
            return _package(kind, self._set_outputs(content))
        if kind == "I":
            return _package(kind, self._set_inputs(_names(content)))
        if kind in "SP":
            self._started = kind == "S" and bool(self._outputs)
            return _package(kind, bytes([kind == "P" or self._started]))
        if kind == "U":
            self._write(content)
        return b""

    def _set_outputs(self, content: bytes) -> bytes:
        if self._version > 1:
            [frequency] = struct.unpack_from(">d", content)
            self._every, content = max(1, round(125.0 / max(frequency, 1.0))), content[8:]
        names = _names(content)
        unknown = ("NOT_FOUND", None)
        found = [unknown if n in self._refused else OUTPUTS.get(n, unknown) for n in names]
        self._outputs = [(kind, value) for kind, value in found if value is not None]
        kinds = ",".join(kind for kind, _ in found).encode()
        return bytes([1]) + kinds if self._version > 1 else kinds

    def _set_inputs(self, names: list[str]) -> bytes:
        kinds = [INPUTS.get(name, "NOT_FOUND") for name in names]
        kinds = [
            "IN_USE" if n in self._refused else kind for n, kind in zip(names, kinds, strict=True)
        ]
        number = 0
        if not {"NOT_FOUND", "IN_USE"} & set(kinds):
            self._inputs.append(names)
            number = len(self._inputs)
        return bytes([number]) + ",".join(kinds).encode()

    def _write(self, content: bytes) -> None:
        if not 1 <= content[0] <= len(self._inputs):
            return
        names = self._inputs[content[0] - 1]
        layout = ">" + "".join(FORMATS[INPUTS[name]] for name in names)
        values = iter(struct.unpack(layout, content[1:]))
        for name in names:
            width = 6 if INPUTS[name].startswith("VECTOR6") else 1
            first, *_ = [next(values) for _ in range(width)]
            self._arm.written(name, first)


def _names(content: bytes) -> list[str]:
    return [name for name in content.decode().split(",") if name]


def _package(kind: str, content: bytes) -> bytes:
    return HEADER.pack(HEADER.size + len(content), ord(kind)) + content
