"""Stub parts for tests of states: they accept every command and record it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any


class StubPart:
    """A part that accepts every command; it counts as moving from any command until `stop`."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.moving = False
        self.commands: list[tuple[Any, ...]] = []

    def stop(self) -> None:
        """Stop; recorded as a command."""
        self.moving = False
        self.commands.append(("stop",))

    def release(self, source: str = "own") -> None:
        """Stop: a stub has no other source of velocities."""
        self.moving = False
        self.commands.append(("release", source))

    def __getattr__(self, name: str) -> Callable[..., None]:
        if name.startswith("_"):
            raise AttributeError(name)

        def command(*arguments: Any, **named: Any) -> None:
            self.moving = True
            self.commands.append((name, *arguments, *named.values()))

        return command


class Parts(dict[str, StubPart]):
    """Stub parts by name, made on first access."""

    def __missing__(self, name: str) -> StubPart:
        self[name] = StubPart(name)
        return self[name]

    @property
    def moving(self) -> list[str]:
        """The names of the parts that were commanded and not stopped."""
        return [name for name, part in self.items() if part.moving]
