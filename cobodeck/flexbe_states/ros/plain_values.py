"""Values of FlexBE states as charts hold them, and back: what can change becomes a `Record`.

| in a state | in a chart |
|---|---|
| list, deque; tuple; set | tuple; tuple; frozenset |
| dict, message, object with attributes | `Record` |
| numpy number, array | number, tuple of tuples |
| number, text, enum member, frozen dataclass, named tuple | as it is |

What comes back is a copy: lists for tuples, and objects of the class that they had.
"""

from __future__ import annotations

import sys
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, fields, is_dataclass
from enum import Enum
from typing import Any

from cobodeck.flexbe_states.ros.messages import Message, full, message_class

_PLAIN = (int, float, str, bytes, Enum, type(None))


@dataclass(frozen=True, slots=True)
class Record:
    """A mapping, a message or an object, immutable: `record.x` and `record["x"]`.

    Attributes:
        kind: `dict`, or module and name of its class.
        pairs: names and values.
    """

    kind: str
    pairs: tuple[tuple[Any, Any], ...]

    def __getitem__(self, name: Any) -> Any:
        for key, value in self.pairs:
            if key == name:
                return value
        raise KeyError(name)

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):
            raise AttributeError(name)
        for key, value in self.pairs:
            if key == name:
                return value
        raise AttributeError(f"a record of {self.kind} has no {name!r}")


def frozen(value: Any) -> Any:
    """A value that a state has given, as charts hold it.

    Raises:
        TypeError: it is a function, a class, a module or the like, or it contains itself.
    """
    try:
        return _frozen(value)
    except RecursionError:
        raise TypeError(f"a {type(value).__name__} contains itself") from None


def _frozen(value: Any) -> Any:
    if isinstance(value, _PLAIN):
        return value
    if isinstance(value, Message):
        return _record(_name_of(type(value)), full(value))
    if isinstance(value, Mapping):
        return _record("dict", value)
    if isinstance(value, tuple) and hasattr(value, "_fields"):
        return type(value)(*map(_frozen, value))
    if isinstance(value, list | tuple | deque):
        return tuple(map(_frozen, value))
    if isinstance(value, set | frozenset):
        return frozenset(map(_frozen, value))
    if is_dataclass(value) and getattr(value, "__dataclass_params__").frozen:  # noqa: B009
        return value
    if hasattr(value, "tolist") and hasattr(value, "dtype"):
        return _frozen(value.tolist())
    return _record(_name_of(type(value)), _attributes(value))


def _record(kind: str, found: Mapping[Any, Any]) -> Record:
    return Record(kind, tuple((key, _frozen(inner)) for key, inner in found.items()))


def _attributes(value: Any) -> dict[str, Any]:
    """The attributes of an object.

    Raises:
        TypeError: it is nothing that a copy could stand for.
    """
    if isinstance(value, type) or callable(value) or not hasattr(value, "__reduce_ex__"):
        raise TypeError(
            f"a {type(value).__name__} cannot be a value of a chart; give what it holds"
        )
    slots = [name for kind in type(value).__mro__ for name in getattr(kind, "__slots__", ())]
    found = {name: getattr(value, name) for name in slots if hasattr(value, name)}
    found |= getattr(value, "__dict__", {})
    if not found and type(value).__module__ != "__main__" and not hasattr(value, "__dict__"):
        raise TypeError(
            f"a {type(value).__name__} cannot be a value of a chart; give what it holds"
        )
    return found


def thawed(value: Any) -> Any:
    """A value of a chart, as a FlexBE state expects it: a copy that it may change."""
    if isinstance(value, Record):
        inner = {key: thawed(held) for key, held in value.pairs}
        return inner if value.kind == "dict" else _object(value.kind, inner)
    if isinstance(value, tuple) and not hasattr(value, "_fields"):
        return [thawed(item) for item in value]
    if isinstance(value, frozenset):
        return set(map(thawed, value))
    return value


def as_message(value: Any, kind: type[Message] | None = None) -> Any:
    """A value of a signal or of a part, as the message that a state expects.

    A mapping, record or dataclass becomes a message with its fields; a number, text or list becomes
    its `data`. A pose or velocity of the robot has the fields of the ROS type.
    """
    if isinstance(value, Message) or value is None:
        return value
    kind = kind or message_class("Message", __name__)
    if (shaped := _shaped(value, kind)) is not None:
        return shaped
    if isinstance(value, Record):
        return kind(**{str(key): thawed(held) for key, held in value.pairs})
    if isinstance(value, Mapping):
        return kind(**{str(key): _inner(held) for key, held in value.items()})
    if is_dataclass(value):
        return kind(**{item.name: _inner(getattr(value, item.name)) for item in fields(value)})
    return kind(data=_inner(value))


def _inner(value: Any) -> Any:
    if isinstance(value, Record | Mapping) or is_dataclass(value):
        return as_message(value)
    return [_inner(item) for item in value] if isinstance(value, list | tuple) else value


def _shaped(value: Any, kind: type[Message]) -> Message | None:
    """A pose or a velocity of the robot in a message of a type with a place for it."""
    import math

    from hw import Pose2, Twist2

    message = kind()
    inner: Any = message
    while type(inner).__name__ not in ("Pose", "Twist", "Pose2D"):
        step = "twist" if isinstance(value, Twist2) else "pose"
        if not isinstance(value, Pose2 | Twist2) or step not in _known(inner):
            return None
        inner = getattr(inner, step)
    if isinstance(value, Twist2):
        inner.linear.x, inner.linear.y, inner.angular.z = value.vx, value.vy, value.wz
    elif isinstance(value, Pose2) and type(inner).__name__ == "Pose2D":
        inner.x, inner.y, inner.theta = value.x, value.y, value.yaw
    elif isinstance(value, Pose2):
        inner.position.x, inner.position.y = value.x, value.y
        inner.orientation.z, inner.orientation.w = math.sin(value.yaw / 2), math.cos(value.yaw / 2)
    else:
        return None
    return message


def _known(message: Any) -> Mapping[str, Any]:
    from cobodeck.flexbe_states.ros.messages import FIELDS

    return FIELDS.get(type(message).__name__, {})


def as_command(message: Any) -> Any:
    """A message that a state sends, as parts take it: the inverse of `as_message`."""
    import math

    from hw import Pose2, Twist2

    kind = type(message).__name__
    if kind in ("PoseStamped", "TwistStamped"):
        return as_command(message.pose if kind == "PoseStamped" else message.twist)
    if kind == "Twist":
        return Twist2(message.linear.x, message.linear.y, message.angular.z)
    if kind == "Pose2D":
        return Pose2(message.x, message.y, message.theta)
    if kind == "Pose":
        turn = message.orientation
        siny = 2.0 * (turn.w * turn.z + turn.x * turn.y)
        yaw = math.atan2(siny, 1.0 - 2.0 * (turn.y**2 + turn.z**2))
        return Pose2(message.position.x, message.position.y, yaw)
    if isinstance(message, Message) and set(full(message)) == {"data"}:
        return frozen(message.data)
    return frozen(message)


def _name_of(kind: type) -> str:
    return f"{kind.__module__}:{kind.__qualname__}"


def _object(kind: str, attributes: Mapping[str, Any]) -> Any:
    """An object of a class that is known by name; a message if it is not."""
    module, _, name = kind.partition(":")
    cls: Any = sys.modules.get(module)
    for part in name.split("."):
        cls = getattr(cls, part, None)
    if not isinstance(cls, type) or issubclass(cls, Message):
        return message_class(name, module)(**attributes)
    made = object.__new__(cls)
    for key, value in attributes.items():
        object.__setattr__(made, key, value)
    return made
