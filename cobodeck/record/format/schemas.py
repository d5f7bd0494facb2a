"""The topics of a record and the schemas of their messages.

Messages are JSON; those of Foxglove's schemas have additional members, so that a viewer and a
replay read the same messages. Only scans are protobuf, because text would take ten times as long.
"""

from __future__ import annotations

import json
from typing import Any, NamedTuple

from hw import Truth

NUMBER, INTEGER, TEXT, FLAG = ({"type": t} for t in ("number", "integer", "string", "boolean"))
ANY: dict[str, Any] = {}
TIME = {"type": "object", "properties": {"sec": INTEGER, "nsec": INTEGER}}
VECTOR = {"type": "object", "properties": dict.fromkeys("xyz", NUMBER)}
QUATERNION = {"type": "object", "properties": dict.fromkeys("xyzw", NUMBER)}
TRANSFORM = {
    "timestamp": TIME,
    "parent_frame_id": TEXT,
    "child_frame_id": TEXT,
    "translation": VECTOR,
    "rotation": QUATERNION,
}
JOINT = {"name": TEXT, "position": NUMBER, "velocity": NUMBER}


class MessageSchema(NamedTuple):
    """A schema's name, its encoding as MCAP names it, and its text."""

    name: str
    encoding: str
    data: bytes

    @property
    def message_encoding(self) -> str:
        """The encoding of its messages."""
        return "json" if self.encoding == "jsonschema" else self.encoding


def many(properties: dict[str, Any]) -> dict[str, Any]:
    """The JSON schema of a list of objects."""
    return {"type": "array", "items": {"type": "object", "properties": properties}}


def schema(name: str, /, **properties: Any) -> MessageSchema:
    """The schema of a JSON message with these properties."""
    content = {"title": name, "type": "object", "properties": properties}
    return MessageSchema(name, "jsonschema", json.dumps(content).encode())


FRAME = schema("foxglove.FrameTransform", **TRANSFORM, yaw=NUMBER, repeat=FLAG)
FRAMES = schema(
    "foxglove.FrameTransforms", transforms=many(TRANSFORM), yaw=NUMBER, head_yaw=NUMBER, repeat=FLAG
)
JOINTS = schema(
    "foxglove.JointStates",
    timestamp=TIME,
    joints=many(JOINT),
    moving=FLAG,
    course=INTEGER,
    refused=ANY,
    mode=TEXT,
    scaling=NUMBER,
    repeat=FLAG,
)
LOG = schema(
    "foxglove.Log",
    timestamp=TIME,
    level=INTEGER,
    message=TEXT,
    name=TEXT,
    file=TEXT,
    line=INTEGER,
)
SCENE = schema("foxglove.SceneUpdate", deletions=many({}), entities=many({}))
VALUE = schema("cobodeck.Value", stamp=INTEGER, value=ANY, repeat=FLAG)
REFUSED = schema("cobodeck.Refused", signal=TEXT, stamp=ANY, value=ANY, reason=TEXT)
COMMAND = schema("cobodeck.Command", command=TEXT, arguments=ANY, by=TEXT)
CALL = schema("cobodeck.Call", part=TEXT, what=TEXT, args=ANY, answer=ANY, raised=ANY)
FAILURE = schema("cobodeck.Failure", part=TEXT, raised=ANY)
SHADOW = schema("cobodeck.Shadow", at_ns=INTEGER, path=TEXT, ran=TEXT, shadow=TEXT)
TRACE = schema("cobodeck.Trace", line={"type": "array"})
CYCLE = schema(
    "cobodeck.SafetyCycle",
    stamp=INTEGER,
    **dict.fromkeys(
        (
            "command", "admitted", "separation", "needed", "allowed", "user_speed", "user_age",
            "reasons",
        ),
        ANY,
    ),
)  # fmt: skip
TRUTH = schema("cobodeck.Truth", **dict.fromkeys(Truth._fields, ANY))
TICK = schema(
    "cobodeck.Tick",
    at_ns=INTEGER,
    n=INTEGER,
    kind=TEXT,
    missed=INTEGER,
    late_ns=INTEGER,
    crc=INTEGER,
)


def scan_schema() -> MessageSchema:
    """Foxglove's LaserScan, as protobuf."""
    from foxglove.messages import LaserScan

    found = LaserScan.get_schema()
    return MessageSchema(found.name, found.encoding, found.data)


def time_of(stamp_ns: int) -> str:
    """A time, ns, as Foxglove writes it in JSON."""
    seconds, rest = divmod(stamp_ns, 10**9)
    return f'{{"sec":{seconds},"nsec":{rest}}}'


def stamp_of(time: dict[str, int]) -> int:
    """A Foxglove time in ns."""
    return time["sec"] * 10**9 + time["nsec"]
