"""What names of data mean in nested containers.

In a chart a name means the key of that name, unless a container around says otherwise. In FlexBE
each container has keys of its own, but for those that are remapped to keys around it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from cobodeck.flexbe.behaviour import Json
from cobodeck.flexbe.names import identifier, unique


@dataclass(frozen=True, slots=True)
class ContainerScope:
    """A container in its place: its path and what the names of data mean in it.

    Attributes:
        keys: the chart's key of each name of the container.
        seen: the names that mean another key here than their own.
    """

    path: str
    container: Json
    keys: dict[str, str]
    seen: Mapping[str, str]

    def at(self, name: str) -> str:
        """The path of a child."""
        return f"{self.path}/{name}" if self.path else name


class ChartData:
    """The keys of one chart, and which of them somebody reads."""

    def __init__(self) -> None:
        self.taken: dict[str, None] = {}
        self.read: set[str] = set()
        self._bindings: dict[tuple[int, str], tuple[dict[str, str], str]] = {}

    def scope(
        self, path: str, container: Json, given: Mapping[str, str], at: ContainerScope | None
    ) -> ContainerScope:
        """What names mean in a container; `given` is what it is remapped to around it."""
        outer, seen = (at.keys, at.seen) if at else ({}, {})
        keys = {
            identifier(key): outer[identifier(name)]
            for key, name in given.items()
            if identifier(name) in outer
        }
        for key in _mentioned(container):
            if key not in keys:
                free = key not in self.taken and key not in seen
                own = key if free else unique(f"{path.rpartition('/')[2]}_{key}", self.taken)
                self.taken[own] = None
                keys[key] = own
        renamed = {key: real for key, real in keys.items() if seen.get(key, key) != real}
        return ContainerScope(path, container, keys, {**seen, **renamed})

    def reads(self, inputs: dict[str, str], key: str, outer: str, scope: ContainerScope) -> None:
        """Give the key `outer` to the input `key`."""
        self.read.add(scope.keys[outer])
        self.bind(inputs, key, outer, scope)

    def bind(self, entries: dict[str, str], key: str, outer: str, scope: ContainerScope) -> None:
        """Add an entry to `in` or `out`; it goes again if nobody reads what it means."""
        entries[key] = outer
        self._bindings[id(entries), key] = entries, scope.keys.get(outer, outer)

    def forget_unread(self) -> list[str]:
        """Leave out what is written and never read; returns these keys."""
        for (_, key), (entries, real) in self._bindings.items():
            if real not in self.read:
                del entries[key]
        unread = [key for key in self.taken if key not in self.read]
        for key in unread:
            del self.taken[key]
        return unread


def _mentioned(container: Json) -> dict[str, None]:
    """The keys that a container and its states name."""
    named = [*container.get("input_keys", ()), *container.get("output_keys", ())]
    for state in container["states"]:
        named += state.get("remapping", {}).values()
    return dict.fromkeys(identifier(key) for key in named)
