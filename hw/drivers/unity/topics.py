"""The topics of the VR link: what each is for, its name on the wire and its message.

A connection may rename a topic and change its message, by role:

    topics: {head: /hmd, release: {topic: /let_go, type: std_msgs/Empty}}

A message of a pose is any with `position` and `orientation` in it, or in its `pose`: `PoseStamped`,
`Pose`, `PoseWithCovarianceStamped`, `Odometry`, or one's own.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

POSE, FLAG, TIME = "geometry_msgs/PoseStamped", "std_msgs/Bool", "sensor_msgs/TimeReference"
INPUTS: Mapping[str, tuple[str, str]] = {
    "head": ("vr/head", POSE),
    "tailbone": ("vr/tailbone", POSE),
    "left_hand": ("vr/left_hand", POSE),
    "right_hand": ("vr/right_hand", POSE),
    "haptic_request": ("vr/haptic_request", POSE),
    "release": ("vr/release", FLAG),
    "restart": ("vr/restart", FLAG),
    "clock_answer": ("vr/clock_answer", TIME),
}
"""What Unity publishes, by role: topic and message. Trackers on the rover come on top."""
OUTPUTS: Mapping[str, tuple[str, str]] = {
    "robot": ("robot/pose", "nav_msgs/Odometry"),
    "joints": ("joint_states", "sensor_msgs/JointState"),
    "visible": ("robot/visible", FLAG),
    "stop_sign": ("robot/stop_sign", FLAG),
    "tf": ("tf", "tf2_msgs/TFMessage"),
    "clock_ask": ("vr/clock_ask", TIME),
}
"""What Unity can subscribe to."""
TRACKER = "tracker:"
"""Roles of trackers begin so; their names follow."""


@dataclass(frozen=True, slots=True)
class UnityTopic:
    """One topic: what it is for, its name with no slash in front, its message as `package/Type`."""

    role: str
    name: str
    type: str


@dataclass(frozen=True, slots=True)
class Topics:
    """All topics of a connection, by their names."""

    inputs: Mapping[str, UnityTopic]
    outputs: Mapping[str, UnityTopic]

    @classmethod
    def of(cls, changed: Mapping[str, Any], trackers: Mapping[str, str]) -> Topics:
        """The topics with changes by role, and those of trackers by the trackers' names.

        Raises:
            ValueError: no such role, no name or type, or one name twice.
        """
        known = [*INPUTS, *OUTPUTS]
        for role in changed:
            if role not in known:
                raise ValueError(f"topics: {role!r} is none of {', '.join(known)}")
        moved = {TRACKER + tracker: (name, POSE) for tracker, name in trackers.items()}
        inputs = [_topic(role, it, changed) for role, it in {**INPUTS, **moved}.items()]
        outputs = [_topic(role, it, changed) for role, it in OUTPUTS.items()]
        names = [topic.name for topic in (*inputs, *outputs)]
        for name in names:
            if names.count(name) > 1:
                raise ValueError(f"topics: {name!r} is named twice")
        return cls({t.name: t for t in inputs}, {t.name: t for t in outputs})

    def output(self, role: str) -> UnityTopic:
        """The topic of a role."""
        return next(topic for topic in self.outputs.values() if topic.role == role)


def plain_name(topic: str) -> str:
    """A topic's name with no slash in front: `/tf` and `tf` are one."""
    return topic.strip().lstrip("/")


def plain_type(kind: str) -> str:
    """A message's name as Unity writes it: `std_msgs/msg/Bool` and `std_msgs/Bool` are one."""
    return kind.strip().replace("/msg/", "/")


def _topic(role: str, usual: tuple[str, str], changed: Mapping[str, Any]) -> UnityTopic:
    change = changed.get(role, usual[0])
    given = change if isinstance(change, Mapping) else {"topic": change}
    strange = given.keys() - {"topic", "type"}
    name, kind = given.get("topic", usual[0]), given.get("type", usual[1])
    if strange or not (isinstance(name, str) and plain_name(name) and isinstance(kind, str)):
        raise ValueError(f"topics: {role}: needs a name, or {{topic: …, type: …}}")
    if kind.count("/") - kind.count("/msg/") != 1:
        raise ValueError(f"topics: {role}: {kind!r} is no message; write package/Type")
    return UnityTopic(role, plain_name(name), plain_type(kind))
