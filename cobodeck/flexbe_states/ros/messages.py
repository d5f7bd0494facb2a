"""Messages without ROS: records with any fields, and the common types with those they have.

A field that nobody has set is a record of its own, which counts as nothing (0, empty, false) until
something is put into it; so `goal.pose.position.x = 1.0` works for types that are not known here.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

_XYZ = {"x": 0.0, "y": 0.0, "z": 0.0}
_STAMPED = {"header": "Header"}
FIELDS: Mapping[str, Mapping[str, Any]] = {
    **{name: {"data": 0} for name in ("Byte", "Char")},
    **{f"{sign}Int{bits}": {"data": 0} for sign in ("", "U") for bits in (8, 16, 32, 64)},
    **{f"Float{bits}": {"data": 0.0} for bits in (32, 64)},
    "Bool": {"data": False},
    "String": {"data": ""},
    "Header": {"seq": 0, "frame_id": ""},
    **dict.fromkeys(("Point", "Point32", "Vector3"), _XYZ),
    "Quaternion": {**_XYZ, "w": 1.0},
    "Pose2D": {"x": 0.0, "y": 0.0, "theta": 0.0},
    "Pose": {"position": "Point", "orientation": "Quaternion"},
    "PoseStamped": {**_STAMPED, "pose": "Pose"},
    "PoseWithCovariance": {"pose": "Pose"},
    "PoseWithCovarianceStamped": {**_STAMPED, "pose": "PoseWithCovariance"},
    "PointStamped": {**_STAMPED, "point": "Point"},
    "Twist": {"linear": "Vector3", "angular": "Vector3"},
    "TwistStamped": {**_STAMPED, "twist": "Twist"},
    "TwistWithCovariance": {"twist": "Twist"},
    "Odometry": {
        **_STAMPED,
        "child_frame_id": "",
        "pose": "PoseWithCovariance",
        "twist": "TwistWithCovariance",
    },
    "GoalStatus": {"status": 0, "text": ""},
}
"""The fields of common types: a default, or the name of their type."""
CONSTANTS: Mapping[str, int] = {
    "PENDING": 0,
    "ACTIVE": 1,
    "PREEMPTED": 2,
    "SUCCEEDED": 3,
    "ABORTED": 4,
    "REJECTED": 5,
    "PREEMPTING": 6,
    "RECALLING": 7,
    "RECALLED": 8,
    "LOST": 9,
    "STATUS_UNKNOWN": 0,
    "STATUS_ACCEPTED": 1,
    "STATUS_EXECUTING": 2,
    "STATUS_CANCELING": 3,
    "STATUS_SUCCEEDED": 4,
    "STATUS_CANCELED": 5,
    "STATUS_ABORTED": 6,
}
"""The states of a goal, of `actionlib_msgs` and of `action_msgs`; others are their name."""
_INNER = ("Goal", "Result", "Feedback", "Request", "Response", "Impl")


class MessageType(type):
    """The type of message classes: it has constants, and ROS 2's `Goal`, `Request` and the like."""

    def __getattr__(cls, name: str) -> Any:
        if name in _INNER:
            value: Any = message_class(f"{cls.__name__}{name}", cls.__module__)
        elif name.isupper():
            value = CONSTANTS.get(name, name)
        else:
            raise AttributeError(f"{cls.__name__} has no {name}")
        setattr(cls, name, value)
        return value


class Message(metaclass=MessageType):
    """A message: fields by name; given in order, they are those of a type that is known here."""

    def __init__(self, *values: Any, **fields: Any) -> None:
        self.__dict__.update(zip(FIELDS.get(type(self).__name__, ()), values, strict=False))
        self.__dict__.update(fields)

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)
        if name.isupper():
            return getattr(type(self), name)
        known = FIELDS.get(type(self).__name__, {}).get(name)
        if known is None or known in FIELDS:
            known = message_class(known or "Unset", type(self).__module__)()
        self.__dict__[name] = known
        return known

    @property
    def is_unset(self) -> bool:
        """Whether it is a field that nobody has set."""
        return type(self).__name__ == "Unset" and not any(
            not isinstance(inner, Message) or not inner.is_unset for inner in vars(self).values()
        )

    def __bool__(self) -> bool:
        return not self.is_unset

    def __eq__(self, other: object) -> bool:
        if isinstance(other, Message):
            return full(self) == full(other)
        return self.is_unset and not other

    def __hash__(self) -> int:
        raise TypeError(f"a {type(self).__name__} can change; it is no key")

    def __iter__(self) -> Iterator[Any]:
        return iter(self.__dict__.get("items_", ()))

    def __len__(self) -> int:
        return len(self.__dict__.get("items_", ()))

    def __getitem__(self, index: Any) -> Any:
        return self.__dict__.get("items_", [])[index]

    def __add__(self, other: Any) -> Any:
        return other

    __radd__ = __add__

    def append(self, item: Any) -> None:
        """Add to a list that nobody has set."""
        self.__dict__.setdefault("items_", []).append(item)

    def __repr__(self) -> str:
        inner = ", ".join(f"{name}={value!r}" for name, value in full(self).items())
        return f"{type(self).__name__}({inner})"


def full(message: Message) -> dict[str, Any]:
    """The fields of a message, those of its type that nobody has set included."""
    for name in FIELDS.get(type(message).__name__, ()):
        getattr(message, name)
    return {
        name: list(value) if isinstance(value, Message) and "items_" in vars(value) else value
        for name, value in vars(message).items()
        if not (isinstance(value, Message) and value.is_unset)
    }


_classes: dict[tuple[str, str], Any] = {}


def message_class(name: str, module: str) -> Any:
    """The class of messages of this name; the same one whenever it is asked for."""
    if (module, name) not in _classes:
        _classes[module, name] = MessageType(name, (Message,), {"__module__": module})
    return _classes[module, name]
