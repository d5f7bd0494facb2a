"""Who publishes each topic of the VR link: one source, and who waits to become it.

A topic is published by the client that registered it first; the others wait in the order in which
they registered, and get it when those before them leave. One that comes back after a drop finds its
own former connection before it, which nobody has closed: it takes over the place of that one, if it
was opened from the same address after the last byte of the other, and nothing has come from the
other for CLIENT_QUIET_NS. Two clients that are both alive never exchange places.
"""

from __future__ import annotations

from hw.drivers.unity.protocol import Session


class TopicSources:
    """See the module; topics are named as in `Topics`."""

    def __init__(self) -> None:
        self._lines: dict[str, list[Session]] = {}

    def source(self, name: str) -> Session | None:
        """The source of a topic; None: it has none."""
        line = self._lines.get(name)
        return line[0] if line else None

    @property
    def all(self) -> dict[str, Session]:
        """The source of each topic that has one."""
        return {name: line[0] for name, line in self._lines.items() if line}

    def add(self, name: str, session: Session) -> None:
        """Register a client as a publisher of a topic."""
        line = self._lines.setdefault(name, [])
        if session not in line:
            line.append(session)
        session.published.add(name)

    def remove(self, name: str, session: Session) -> bool:
        """Remove a publisher; True if it was the source."""
        line = self._lines.get(name, [])
        was_source = bool(line) and line[0] is session
        if session in line:
            line.remove(session)
        session.published.discard(name)
        return was_source

    def succeed(self, now_ns: int) -> list[str]:
        """Let those who have come back take over their former places; topics with a new source."""
        changed = []
        for name, line in self._lines.items():
            source = self.source(name)
            for place, back in enumerate(line[1:], 1):
                before = [n for n in range(place) if back.succeeds(line[n], now_ns)]
                if before:
                    line[before[0]], line[place] = back, line[before[0]]
            if self.source(name) is not source:
                changed.append(name)
        return changed
