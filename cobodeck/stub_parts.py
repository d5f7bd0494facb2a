"""Parts for tests of states: they take every command and remember it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any


class StandIn:
    """A part that takes every command; it counts as moving from any command until `stop`."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.moving = False
        self.commands: list[tuple[Any, ...]] = []

    def stop(self) -> None:
        """Stands."""
        self.moving = False
        self.commands.append(("stop",))

    def release(self, source: str = "own") -> None:
        """A source of velocities is done; nobody else drives a stand-in."""
        self.moving = False
        self.commands.append(("release", source))

    def __getattr__(self, name: str) -> Callable[..., None]:
        if name.startswith("_"):
            raise AttributeError(name)

        def command(*arguments: Any, **named: Any) -> None:
            self.moving = True
            self.commands.append((name, *arguments, *named.values()))

        return command


class Parts(dict[str, StandIn]):
    """Stand-ins by name, made when first asked for."""

    def __missing__(self, name: str) -> StandIn:
        self[name] = StandIn(name)
        return self[name]

    @property
    def moving(self) -> list[str]:
        """The names of those that were not stopped."""
        return [name for name, part in self.items() if part.moving]
