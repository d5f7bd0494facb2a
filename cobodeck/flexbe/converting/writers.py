"""Which keys the states of a concurrency container write: in a chart, each key has one writer."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from cobodeck.flexbe.behaviour import Json
from cobodeck.flexbe.converting.scopes import ContainerScope
from cobodeck.flexbe.converting.state_classes import StateClasses
from cobodeck.flexbe.names import bare, identifier


class KeyWriters:
    """The writers in one concurrency container in its place."""

    def __init__(
        self,
        containers: Mapping[str, Json],
        classes: StateClasses,
        outputs: Mapping[str, Iterable[str]],
    ) -> None:
        self._containers, self._classes, self._outputs = containers, classes, outputs
        self._owned: set[str] = set()

    def alone(self, state: Json, scope: ContainerScope) -> frozenset[str]:
        """The chart's keys that a child writes, and that one before it in the container does."""
        written = {scope.keys.get(key, key) for key in self._written(state)}
        twice = frozenset(written & self._owned)
        self._owned |= written
        return twice

    def _written(self, state: Json) -> set[str]:
        """The keys around a state that it writes, by their names there."""
        remapping = {identifier(k): identifier(o) for k, o in state.get("remapping", {}).items()}
        if "class" in state:
            return {
                identifier(outer)
                for key, outer in state.get("remapping", {}).items()
                if self._classes.writes(bare(state["class"]), key)
            }
        if "behavior" in state:
            inside = set(map(identifier, self._outputs.get(state["behavior"], ())))
        else:
            children = self._containers[state["container"]]["states"]
            inside = {key for child in children for key in self._written(child)}
        return {outer for key, outer in remapping.items() if key in inside}
