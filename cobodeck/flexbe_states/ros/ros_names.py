"""The names of rospy, rclpy and tf that states use."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from cobodeck.flexbe_states.ros.bridge import Blocks, current_bridge, now_ns, refuse_to_wait
from cobodeck.flexbe_states.ros.messages import RosMessage
from cobodeck.flexbe_states.ros.ros_time import (
    RosDuration,
    RosRate,
    RosTime,
)
from cobodeck.flexbe_states.ros.topic_table import plain_topic

_MISSING = object()


class RosError(Exception):
    """The errors of rospy."""


class RosPublisher:
    """`rospy.Publisher`."""

    def __init__(self, name: str, *_any: Any, **_named: Any) -> None:
        self.name = name

    def publish(self, *values: Any, **fields: Any) -> None:
        """Send a message, or the value of one that has a single field."""
        first = values[0] if values else None
        if not isinstance(first, RosMessage):
            first = RosMessage(**fields) if first is None else RosMessage(data=first)
        current_bridge().publish(self.name, first)

    def get_num_connections(self) -> int:
        """The part of the table hears it."""
        return 1

    def unregister(self) -> None:
        """Nothing has to be done."""


class RosSubscriber:
    """`rospy.Subscriber`: its callback is called before `execute`."""

    def __init__(
        self,
        name: str,
        data_class: Any = None,
        callback: Any = None,
        callback_args: Any = _MISSING,
        **_named: Any,
    ) -> None:
        self.name = name
        arguments = () if callback_args is _MISSING else (callback_args,)
        current_bridge().subscribe(name, data_class, callback, arguments)

    def unregister(self) -> None:
        """Hear it no more."""
        current_bridge().unsubscribe(self.name)


class RosServiceProxy:
    """`rospy.ServiceProxy`."""

    def __init__(self, name: str, *_any: Any, **_named: Any) -> None:
        self.name = name

    def call(self, *values: Any, **fields: Any) -> Any:
        """Call it, and return the answer."""
        first = values[0] if values else None
        if not isinstance(first, RosMessage):
            first = RosMessage(**fields) if first is None else RosMessage(data=first)
        return current_bridge().call(self.name, first)

    __call__ = call

    def wait_for_service(self, *_any: Any, **_named: Any) -> None:
        """Nothing has to be waited for."""


class RosClock:
    """The clock of a node of ROS 2."""

    def now(self) -> RosTime:
        """The present instant of the run."""
        return RosTime.now()


class RosLogger:
    """The logger of a node of ROS 2: what it is told becomes notes."""

    def info(self, text: Any, *_any: Any, **_named: Any) -> None:
        """A note."""
        current_bridge().note(str(text))

    debug = info

    def warning(self, text: Any, *_any: Any, **_named: Any) -> None:
        """A warning."""
        current_bridge().note(f"warning: {text}")

    warn = warning

    def error(self, text: Any, *_any: Any, **_named: Any) -> None:
        """An error."""
        current_bridge().note(f"error: {text}")

    fatal = error


class RosNode:
    """The node of ROS 2 that states find as `_node`."""

    def get_clock(self) -> RosClock:
        """The clock of the run."""
        return RosClock()

    def get_logger(self) -> RosLogger:
        """Notes in the trace."""
        return RosLogger()

    def get_name(self) -> str:
        """The name of the state."""
        return current_bridge().name

    def has_parameter(self, name: str) -> bool:
        """Whether the table has a parameter."""
        return has_param(name)

    def get_parameter(self, name: str) -> RosMessage:
        """A parameter of the table, as its `value`."""
        return RosMessage(value=get_param(name))

    def declare_parameter(self, name: str, value: Any = None, *_any: Any) -> RosMessage:
        """A parameter of the table, or this value."""
        return RosMessage(value=get_param(name, value))

    def create_publisher(self, _kind: Any, topic: str, *_any: Any, **_named: Any) -> RosPublisher:
        """A publisher."""
        return RosPublisher(topic)

    def create_subscription(
        self, kind: Any, topic: str, callback: Callable[..., Any], *_any: Any, **_named: Any
    ) -> RosSubscriber:
        """A subscription."""
        return RosSubscriber(topic, kind, callback)

    def create_rate(self, hz: float) -> RosRate:
        """A rate."""
        return RosRate(hz)


def get_param(name: str, default: Any = _MISSING) -> Any:
    """A parameter of the table.

    Raises:
        KeyError: there is none, and no default.
    """
    table = current_bridge().table
    found = table.parameters.get(plain_topic(name), default)
    if found is _MISSING:
        raise KeyError(f"no parameter {name!r}; add to {table.place}: `parameters: {{{name}: …}}`")
    return found


def has_param(name: str) -> bool:
    """Whether the table has a parameter, or a state has set it."""
    return plain_topic(name) in current_bridge().table.parameters


def set_param(name: str, value: Any) -> None:
    """Set a parameter for all states, until the run is over."""
    current_bridge().table.parameters[plain_topic(name)] = value


def delete_param(name: str) -> None:
    """Remove a parameter.

    Raises:
        KeyError: there is none.
    """
    del current_bridge().table.parameters[plain_topic(name)]


def sleep(duration: Any) -> None:
    """Let a short time, s or a duration, pass once the hook has returned; see `Bridge.sleep`."""
    current_bridge().sleep(duration.to_sec() if isinstance(duration, RosDuration) else duration)


def quaternion_from_euler(roll: float, pitch: float, yaw: float, *_axes: Any) -> list[float]:
    """A quaternion (x, y, z, w) of these angles about fixed axes, rad."""
    (cr, sr), (cp, sp), (cy, sy) = ((math.cos(a / 2), math.sin(a / 2)) for a in (roll, pitch, yaw))
    return [
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
        cr * cp * cy + sr * sp * sy,
    ]


def euler_from_quaternion(quaternion: Sequence[float], *_axes: Any) -> tuple[float, float, float]:
    """The angles (roll, pitch, yaw) about fixed axes of a quaternion (x, y, z, w), rad."""
    x, y, z, w = quaternion
    pitch = math.asin(max(-1.0, min(1.0, 2.0 * (w * y - z * x))))
    roll = math.atan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))
    return roll, pitch, math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))


def _note(kind: str) -> Callable[..., None]:
    def log(text: Any, *values: Any, **_named: Any) -> None:
        shown = str(text)
        current_bridge().note(kind + (shown % values if values and "%" in shown else shown))

    return log


def _throttled(kind: str) -> Callable[..., None]:
    log = _note(kind)
    return lambda _period, text, *values, **_named: log(text, *values)


_KINDS = {"debug": "", "info": "", "warn": "warning: ", "err": "error: ", "fatal": "error: "}
ROS: Mapping[str, Any] = {
    **{f"log{name}": _note(kind) for name, kind in _KINDS.items()},
    **{f"log{name}_once": _note(kind) for name, kind in _KINDS.items()},
    **{f"log{name}_throttle": _throttled(kind) for name, kind in _KINDS.items()},
    **dict.fromkeys(
        ("ROSException", "ROSInterruptException", "ServiceException", "ROSSerializationException"),
        RosError,
    ),
    "Time": RosTime,
    "Duration": RosDuration,
    "Rate": RosRate,
    "Publisher": RosPublisher,
    "Subscriber": RosSubscriber,
    "ServiceProxy": RosServiceProxy,
    "Node": RosNode,
    "get_time": lambda: now_ns() * 1e-9,
    "get_rostime": RosTime.now,
    "sleep": sleep,
    "spin": lambda *_: refuse_to_wait("spin()"),
    "wait_for_message": lambda *_, **__: refuse_to_wait("rospy.wait_for_message()"),
    "wait_for_service": lambda *_, **__: None,
    "get_param": get_param,
    "has_param": has_param,
    "set_param": set_param,
    "delete_param": delete_param,
    "get_param_names": lambda: list(current_bridge().table.parameters),
    "is_shutdown": lambda: False,
    "ok": lambda *_, **__: True,
    "init_node": lambda *_, **__: None,
    "get_name": lambda: current_bridge().name,
    "get_caller_id": lambda: current_bridge().name,
    "get_published_topics": lambda *_: [
        [name, ""] for name in current_bridge().table.topics("hears")
    ],
    "Blocks": Blocks,
}
"""What `rospy`, `rclpy` and the modules in them have."""
TRANSFORMATIONS: Mapping[str, Any] = {
    "quaternion_from_euler": quaternion_from_euler,
    "euler_from_quaternion": euler_from_quaternion,
}
"""What `tf.transformations` has."""
CLOCK: Mapping[str, Any] = {
    **dict.fromkeys(("time", "monotonic", "perf_counter"), lambda: now_ns() * 1e-9),
    **dict.fromkeys(("time_ns", "monotonic_ns", "perf_counter_ns"), now_ns),
    "sleep": sleep,
}
"""What `time` has in place of its own."""
