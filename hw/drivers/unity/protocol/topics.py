"""The topics of the VR link: role, name on the wire and message of each.

A connection may rename a topic and change its message, by role:

    topics: {head: /hmd, release: {topic: /let_go, type: std_msgs/Empty}}

A pose may be any message with `position` and `orientation`, at the top or within `pose`:
`PoseStamped`, `Pose`, `PoseWithCovarianceStamped`, `Odometry`, or a definition of one's own.
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
"""Publications of Unity, by role: topic and message. Trackers on the rover are added."""
OUTPUTS: Mapping[str, tuple[str, str]] = {
    "robot": ("robot/pose", "nav_msgs/Odometry"),
    "joints": ("joint_states", "sensor_msgs/JointState"),
    "visible": ("robot/visible", FLAG),
    "stop_sign": ("robot/stop_sign", FLAG),
    "tf": ("tf", "tf2_msgs/TFMessage"),
    "clock_ask": ("vr/clock_ask", TIME),
}
"""Topics to which Unity can subscribe."""
TRACKER = "tracker:"
"""Prefix of the roles of trackers, before their names."""


@dataclass(frozen=True, slots=True)
class UnityTopic:
    """One topic: role, name without a leading slash, message as `package/Type`."""

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
        """The topics with changes by role, and those of trackers by name.

        Raises:
            ValueError: an unknown role, a missing name or type, or a duplicate name.
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
    """A topic's name without a leading slash: `/tf` and `tf` are the same."""
    return topic.strip().lstrip("/")


def plain_type(kind: str) -> str:
    """A message's type as `package/Type`: `std_msgs/msg/Bool` is `std_msgs/Bool`."""
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
