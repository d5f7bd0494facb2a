"""Samples as messages, and back: poses, joints and scans by Foxglove's schemas, others as values.

If the value is the same object as in the sample before, the message says `repeat`, because charts
do not treat that as news; a reader returns the same object again, too.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping
from typing import Any

from cobodeck.record.format import schemas, value_codec
from cobodeck.record.format.scan_messages import LASER, read_scan, write_scan
from cobodeck.record.format.schemas import MessageSchema, stamp_of, time_of
from hw import ArmState, Pose2, Pose3, Sample, Scan, UserPose

TOPIC = "signal/"
UR_JOINTS = (
    "shoulder_pan_joint", "shoulder_lift_joint", "elbow_joint",
    "wrist_1_joint", "wrist_2_joint", "wrist_3_joint",
)  # fmt: skip
BODY, HEAD, HANDS = "user", "user_head", ("user_left_hand", "user_right_hand")


def kind_of(name: str, value: object) -> str:
    """The name of the schema by which a sample is written."""
    kind = _KINDS.get(name)
    if kind is None or type(value) is not kind:
        return "cobodeck.Value"
    if isinstance(value, ArmState):
        fits = len(value.velocities) == len(value.joints)
        return "foxglove.JointStates" if fits else "cobodeck.Value"
    if isinstance(value, Scan):
        return LASER if set(map(type, value.ranges)) <= {float} else "cobodeck.Value"
    return "foxglove.FrameTransform" if kind is Pose2 else "foxglove.FrameTransforms"


def schema_of(kind: str) -> MessageSchema:
    """The schema of this name."""
    return _SCHEMAS[kind] if kind in _SCHEMAS else schemas.scan_schema()


class SampleWriter:
    """Writes the samples of one signal; caches the last one, because many repeat."""

    def __init__(self, name: str) -> None:
        self._name = name
        self._last: object = self  # identical to no sample's value
        self._kind = ""
        self._write: Callable[[str, str], str] = _no_value

    def write(self, stamp: int, value: object) -> tuple[str, bytes]:
        """The name of the schema, and the message."""
        again = value is self._last
        if not again:
            self._last = value
            self._kind = kind_of(self._name, value)
            if self._kind != LASER:
                self._write = _WRITERS[self._kind](value)
        if isinstance(value, Scan) and self._kind == LASER:
            return self._kind, write_scan(stamp, value, again)
        time = str(stamp) if self._kind == "cobodeck.Value" else time_of(stamp)
        return self._kind, self._write(time, _REPEAT if again else "").encode()


_REPEAT = ',"repeat":true'


def _no_value(_time: str, _repeat: str) -> str:
    raise AssertionError("nothing has been written yet")


def _value(value: object) -> Callable[[str, str], str]:
    content = value_codec.text(value)
    return lambda time, repeat: f'{{"stamp":{time},"value":{content}{repeat}}}'


def _rotation(yaw: float) -> str:
    return f'{{"x":0,"y":0,"z":{math.sin(0.5 * yaw)!r},"w":{math.cos(0.5 * yaw)!r}}}'


def _frame(pose: Pose2) -> Callable[[str, str], str]:
    where = (
        f'"parent_frame_id":"map","child_frame_id":"base_link",'
        f'"translation":{{"x":{pose.x!r},"y":{pose.y!r},"z":0}},'
        f'"rotation":{_rotation(pose.yaw)},"yaw":{pose.yaw!r}'
    )
    return lambda time, repeat: f'{{"timestamp":{time},{where}{repeat}}}'


def _space(child: str, pose: Pose3) -> str:
    p = pose
    return (
        f'"parent_frame_id":"map","child_frame_id":"{child}",'
        f'"translation":{{"x":{p.x!r},"y":{p.y!r},"z":{p.z!r}}},'
        f'"rotation":{{"x":{p.qx!r},"y":{p.qy!r},"z":{p.qz!r},"w":{p.qw!r}}}}}'
    )


def _frames(user: UserPose) -> Callable[[str, str], str]:
    body = user.body
    parts = [
        f'"parent_frame_id":"map","child_frame_id":"{BODY}",'
        f'"translation":{{"x":{body.x!r},"y":{body.y!r},"z":0}},'
        f'"rotation":{_rotation(body.yaw)}}}'
    ]
    named = zip((HEAD, *HANDS), (user.head, user.left_hand, user.right_hand), strict=True)
    parts += [_space(child, pose) for child, pose in named if pose is not None]
    ends = f'],"yaw":{body.yaw!r},"head_yaw":{user.head_yaw!r}'

    def write(time: str, repeat: str) -> str:
        stamped = ",".join([f'{{"timestamp":{time},{part}' for part in parts])
        return f'{{"transforms":[{stamped}{ends}{repeat}}}'

    return write


def _joints(arm: ArmState) -> Callable[[str, str], str]:
    count = len(arm.joints)
    names = UR_JOINTS if count == len(UR_JOINTS) else [f"joint_{n + 1}" for n in range(count)]
    joints = ",".join(
        f'{{"name":"{name}","position":{angle!r},"velocity":{velocity!r}}}'
        for name, angle, velocity in zip(names, arm.joints, arm.velocities, strict=True)
    )
    told = {"moving": arm.moving, "course": arm.course, "refused": arm.refused, "mode": arm.mode}
    state = json.dumps(told, separators=(",", ":"))[1:-1]
    ends = f'"joints":[{joints}],{state},"scaling":{arm.scaling!r}'
    return lambda time, repeat: f'{{"timestamp":{time},{ends}{repeat}}}'


_KINDS: Mapping[str, type] = {
    "base.pose": Pose2, "user.pose": UserPose, "arm.joints": ArmState, "base.scan": Scan,
}  # fmt: skip
_SCHEMAS: Mapping[str, MessageSchema] = {
    found.name: found for found in (schemas.VALUE, schemas.FRAME, schemas.FRAMES, schemas.JOINTS)
}
_WRITERS: Mapping[str, Callable[[Any], Callable[[str, str], str]]] = {
    "cobodeck.Value": _value,
    "foxglove.FrameTransform": _frame,
    "foxglove.FrameTransforms": _frames,
    "foxglove.JointStates": _joints,
}


class SampleReader:
    """Reads the samples of one signal; a repeat gives the same object as the sample before.

    If it is the first one, as in a part of a record, it is read like any other.
    """

    def __init__(self, name: str) -> None:
        self._name = name
        self._last: Any = None
        self._begun = False

    def read(self, kind: str, data: bytes) -> Sample:
        """The sample of a message.

        Raises:
            value_codec.Unknown: its class is not loaded or does not exist any more.
        """
        found: Any
        if kind == LASER:
            stamp, found, again = read_scan(data)
        else:
            message = json.loads(data)
            stamp = message["stamp"] if kind == "cobodeck.Value" else _stamp(kind, message)
            again = self._begun and message.get("repeat", False)
            found = None if again else _READERS[kind](message)
        if not (again and self._begun):
            self._last, self._begun = found, True
        return Sample(self._name, stamp, self._last)


def sample_of(name: str, kind: str, data: bytes) -> Sample:
    """The sample of a message by itself, whether it repeats the one before or not.

    Raises:
        value_codec.Unknown: its class is not loaded or does not exist any more.
    """
    if kind == LASER:
        stamp, scan, _ = read_scan(data)
        return Sample(name, stamp, scan)
    message = json.loads(data)
    stamp = message["stamp"] if kind == "cobodeck.Value" else _stamp(kind, message)
    return Sample(name, stamp, _READERS[kind](message))


def _stamp(kind: str, message: Any) -> int:
    first = message["transforms"][0] if kind == "foxglove.FrameTransforms" else message
    return stamp_of(first["timestamp"])


def _read_frame(message: Any) -> Pose2:
    at = message["translation"]
    return Pose2(at["x"], at["y"], message["yaw"])


def _read_frames(message: Any) -> UserPose:
    parts = {part["child_frame_id"]: part for part in message["transforms"]}
    at = parts[BODY]["translation"]
    head, left, right = (_read_space(parts.get(child)) for child in (HEAD, *HANDS))
    return UserPose(Pose2(at["x"], at["y"], message["yaw"]), message["head_yaw"], head, left, right)


def _read_space(part: Any) -> Pose3 | None:
    if part is None:
        return None
    at, turned = part["translation"], part["rotation"]
    return Pose3(*(at[axis] for axis in "xyz"), *(turned[axis] for axis in "xyzw"))


def _read_joints(message: Any) -> ArmState:
    joints = message["joints"]
    return ArmState(
        tuple(joint["position"] for joint in joints),
        tuple(joint["velocity"] for joint in joints),
        message["moving"],
        message.get("course", 0),
        message.get("refused"),
        message.get("mode", "normal"),
        message.get("scaling", 1.0),
    )


_READERS: Mapping[str, Callable[[Any], Any]] = {
    "cobodeck.Value": lambda message: value_codec.value(message["value"]),
    "foxglove.FrameTransform": _read_frame,
    "foxglove.FrameTransforms": _read_frames,
    "foxglove.JointStates": _read_joints,
}
