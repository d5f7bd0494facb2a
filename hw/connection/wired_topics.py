"""ROS topics that a driver carries for a project, as the project's table has them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

JsonMessage = Mapping[str, Any]


class HeardWire(NamedTuple):
    """A topic whose messages are the values of a signal; `kind` is its type as ROS 1 writes it.

    `value` makes a value of a message; it raises AttributeError, TypeError or ValueError for one of
    another type. `within` is the longest silence that is no fault, s; None: any.
    """

    topic: str
    kind: str
    signal: str
    value: Callable[[JsonMessage], object]
    within: float | None = None


class SentWire(NamedTuple):
    """A topic to which a command of a part is published; `message` makes one of its arguments."""

    topic: str
    kind: str
    part: str
    command: str
    message: Callable[..., JsonMessage]


class WiredTopics(NamedTuple):
    """All of them."""

    hears: tuple[HeardWire, ...] = ()
    sends: tuple[SentWire, ...] = ()
