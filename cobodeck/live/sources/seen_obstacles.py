"""What scanners have shown of the obstacles in a room, for the layers of pages that need it."""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING

from cobodeck.live.model import SCAN_TOPIC
from cobodeck.record.format import TOPIC, sample_of
from cobodeck.record.read import Group, RecordedMessage
from engine import Stamped
from states.environment import Environment

if TYPE_CHECKING:
    from states.navigation.grid import ObstacleEstimator, Obstacles

TAKEN = frozenset({SCAN_TOPIC, f"{TOPIC}base.pose", f"{TOPIC}user.pose"})
NEEDING = frozenset({"costmap", "path", "chase", "escape", "haptic"})
"""Layers that depend on obstacles."""
MOST_KEPT = 1500
"""Messages that are kept until a page shows such a layer: those of some 15 s."""


class SeenObstacles:
    """As the run's own planners have them, of what is on record.

    Messages are kept as they are, and read once somebody asks for the obstacles: nothing is
    estimated while no page shows them.
    """

    def __init__(self, environment: Environment) -> None:
        self._environment = environment
        self._window = _Window()

    def add(self, group: Group) -> None:
        """Take the messages of a tick."""
        window = self._window
        for told in group.told:
            if told.topic in TAKEN:
                window.messages.append(told)
                window.scanned |= told.topic == SCAN_TOPIC

    def restart(self) -> None:
        """Forget everything: what comes next is of another time."""
        self._window = _Window()

    def value(self) -> Obstacles | None:
        """The obstacles now, None without scans; in one thread at a time."""
        window = self._window
        if not window.scanned:
            return None
        if window.estimator is None:
            window.estimator = self._environment.obstacle_estimator()
        for _ in range(len(window.messages)):
            told = window.messages.popleft()
            name = told.topic.removeprefix(TOPIC)
            _, stamp_ns, value = sample_of(name, told.schema, told.data)
            window.estimator.update(name, Stamped(value, stamp_ns))
        return window.estimator.value()


class _Window:
    """Messages that follow each other, and what was made of them."""

    def __init__(self) -> None:
        self.messages = deque[RecordedMessage](maxlen=MOST_KEPT)
        self.estimator: ObstacleEstimator | None = None
        self.scanned = False
