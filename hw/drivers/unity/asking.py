"""Questions for the time of the clients' clocks, and their answers.

See `hw.drivers.clock_offsets`.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from hw.drivers import gates
from hw.drivers.unity.protocol import SECOND, Messages, Session, UnityTopic, frame, time_of
from hw.samples import ClockState

EVERY_NS, FIRST = 1_000 * gates.MS, 20
"""A clock is asked once a second, and ten times as often for the FIRST times."""


class ClockQuestions:
    """Asks all clients that subscribe to the topic; `wall_ns`: our stamps less our clock, ns."""

    def __init__(self, topic: UnityTopic, messages: Messages, wall_ns: int) -> None:
        self._topic, self._messages, self._wall_ns = topic, messages, wall_ns
        self._count = 0

    def ask(self, sessions: Iterable[Session], now_ns: int) -> None:
        """Ask who has to be asked now."""
        for session in sessions:
            if self._topic.name in session.subscribed and now_ns >= session.ask_ns:
                self._ask(session, now_ns)

    def answered(self, session: Session, message: Any, now_ns: int) -> str | None:
        """Take an answer; why it is refused, or None."""
        token = str(message.source).rstrip("\0")
        asked = next((when for known, when in session.asked if known == token), None)
        if asked is None:
            return f"an answer to {token!r}, which was not asked"
        came, answered = time_of(message.time_ref), time_of(message.header.stamp)
        session.clock.trips.add(asked, came, answered, now_ns)
        return None

    def _ask(self, session: Session, now_ns: int) -> None:
        self._count += 1
        soon = len(session.asked) < FIRST
        session.ask_ns = now_ns + (EVERY_NS // 10 if soon else EVERY_NS)
        token, wall = str(self._count), now_ns + self._wall_ns
        session.asked.append((token, now_ns))
        body = self._messages.write(
            self._topic.type, self._messages.time_reference(wall, wall, token)
        )
        session.send_latest(self._topic.name, frame(session.subscribed[self._topic.name], body))


def clock_state(session: Session) -> ClockState | None:
    """What is known of a client's clock; None: nothing yet."""
    clock, offset = session.clock, session.clock.offset
    if offset is None:
        return None
    answers = clock.trips.best is not None
    return ClockState(offset.ns / SECOND, offset.error_ns / SECOND, clock.age_ns / SECOND, answers)
