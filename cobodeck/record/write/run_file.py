"""What a recorder writes to: a file, or whoever watches the run."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Protocol

from cobodeck.record.format import MessageSchema

WriteBytes = Callable[[bytes, int], None]
"""Writes a message, given its bytes and its time in the file, ns."""


class RunFile(Protocol):
    """Takes the header, then the messages of each tick; any method may raise."""

    @property
    def error(self) -> Exception | None:
        """Why nothing more can be written; None while all is well."""
        ...

    def begin(self, header: Mapping[str, Any], attachments: Mapping[str, bytes]) -> None:
        """Write the header and the attachments, before the first tick."""
        ...

    def channel(self, topic: str, schema: MessageSchema) -> WriteBytes:
        """A function that writes to a new channel."""
        ...

    def end_tick(self, now_ns: int) -> None:
        """A tick is complete."""
        ...

    def write_metadata(self, name: str, values: Mapping[str, Any]) -> None:
        """Write values, such as the figures."""
        ...

    def finish(self) -> Path | None:
        """Complete it; returns the path of a file, None of what is none."""
        ...

    def give_up(self, error: Exception | None = None) -> str | None:
        """End it, because of an `error`, or because the run did not take place.

        Returns what the user is told of it, None: nothing.
        """
        ...
