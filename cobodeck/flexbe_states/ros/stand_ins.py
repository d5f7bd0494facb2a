"""Modules that FlexBE states import and that are not here: made when they are asked for."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping
from importlib.util import find_spec
from types import ModuleType
from typing import Any

from cobodeck.flexbe_states.ros.flexbe_names import NAMES
from cobodeck.flexbe_states.ros.messages import message_class
from cobodeck.flexbe_states.ros.ros_names import CLOCK, ROS, TRANSFORMATIONS

OURS: Mapping[str, Mapping[str, Any]] = {
    "flexbe_core": NAMES,
    "rospy": ROS,
    "rclpy": ROS,
    "tf": TRANSFORMATIONS,
    "tf_transformations": TRANSFORMATIONS,
}
"""These are ours even where they are installed: the real ones want a ROS system around them."""
ABSENT = frozenset(
    (
        "actionlib",
        "ament_index_python",
        "cv_bridge",
        "dynamic_reconfigure",
        "flexbe_msgs",
        "genpy",
        "message_filters",
        "moveit_commander",
        "ros",
        "roslaunch",
        "roslib",
        "rosnode",
        "rospkg",
        "rosservice",
        "rostopic",
        "smach",
        "smach_ros",
        "tf2_geometry_msgs",
        "tf2_py",
        "tf2_ros",
    )
)
"""Packages of ROS that can be imported here, and do nothing."""
_MESSAGES = ("msg", "srv", "action")
_lock = threading.RLock()
_made: dict[str, ModuleType] = {}


class NotProvided:
    """Something of ROS that is not here; it can be named, and not used."""

    def __init__(self, name: str) -> None:
        self._name = name

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)
        return NotProvided(f"{self._name}.{name}")

    def __call__(self, *_any: Any, **_named: Any) -> Any:  # noqa: D102
        raise NotImplementedError(f"{self._name} needs ROS, and is not provided here")

    def __mro_entries__(self, _bases: tuple[Any, ...]) -> tuple[type, ...]:
        return (object,)


def stand_in(name: str) -> ModuleType | None:
    """The module that stands in for one of this dotted name; None if the real one is meant."""
    root = name.partition(".")[0]
    if name == "time":
        return _module(name, _clock)
    if root in OURS:
        return _module(name, lambda child: _of_ours(root, child))
    return _module(name, lambda child: _absent(name, child)) if has_stand_in(name) else None


def has_stand_in(name: str) -> bool:
    """Whether this dotted name is one of ROS or FlexBE that is not here; not so `time`."""
    root = name.partition(".")[0]
    if root in OURS:
        return True
    return (root in ABSENT or _is_messages(name)) and not _is_installed(root)


def _is_messages(name: str) -> bool:
    root, _, inner = name.partition(".")
    return inner.partition(".")[0] in _MESSAGES or (not inner and root.endswith("_msgs"))


def _is_installed(root: str) -> bool:
    try:
        return find_spec(root) is not None
    except (ImportError, ValueError):
        return False


def _module(name: str, find: Callable[[str], Any]) -> ModuleType:
    with _lock:
        if name not in _made:
            made = ModuleType(name, "It stands in for a module of ROS.")
            made.__path__ = []
            made.__all__ = []  # type: ignore[attr-defined]  # of a star only what is asked for
            made.__getattr__ = _getter(name, find)  # type: ignore[method-assign]
            _made[name] = made
            parent, _, child = name.rpartition(".")
            if parent and (above := stand_in(parent)) is not None:
                setattr(above, child, made)
        return _made[name]


def _getter(name: str, find: Callable[[str], Any]) -> Callable[[str], Any]:
    def get(child: str) -> Any:
        if child.startswith("__"):
            raise AttributeError(f"module {name!r} has no attribute {child!r}")
        return find(child)

    return get


def _clock(child: str) -> Any:
    import time

    return CLOCK[child] if child in CLOCK else getattr(time, child)


def _of_ours(root: str, child: str) -> Any:
    if child in OURS[root]:
        return OURS[root][child]
    if root in ("tf", "rclpy", "rospy", "flexbe_core") and child[:1].islower():
        return stand_in(f"{root}.{child}")
    return NotProvided(f"{root}.{child}")


def _absent(name: str, child: str) -> Any:
    inner = name.partition(".")[2].partition(".")[0]
    if inner in _MESSAGES:
        return message_class(child, name)
    if child in _MESSAGES:
        return stand_in(f"{name}.{child}")
    return NotProvided(f"{name}.{child}")
