"""Which keys states write: those of FlexBE itself, and a guess for those whose text is not here."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from typing import Any

from cobodeck.flexbe.behaviour import ROOT, Behaviour, Json
from cobodeck.flexbe.names import bare

WRITES = {
    "CalculationState": ("output_value",),
    "FlexibleCalculationState": ("output_value",),
    "InputState": ("data",),
    "SetKey": ("Key", "output_key"),
    "SubscriberState": ("message",),
    "UserdataState": ("data",),
}
"""The keys that states write which FlexBE brings along, or which everybody has."""


def guessed_outputs(behaviours: Iterable[Behaviour]) -> set[tuple[str, str]]:
    """What states seem to write: the first to name a key that nothing else gives a value.

    A key that only states of one class name, by one name of theirs, says nothing after the first.
    """
    votes: Counter[tuple[str, str]] = Counter()
    for behaviour in behaviours:
        for name, container in behaviour.json["containers"].items():
            if name == ROOT and not behaviour.is_python:
                continue  # its userdata are not known
            given = (*container.get("input_keys", ()), *behaviour.userdata.get(name, ()))
            sources: dict[str, set[Any]] = {key: {None} for key in given}
            for state in _in_flow_order(container["states"]):
                for key, outer in state.get("remapping", {}).items():
                    asks = (bare(state["class"]), key) if "class" in state else None
                    if asks and key not in WRITES.get(asks[0], ()) and sources.get(outer) != {asks}:
                        votes[asks] += 1 if outer not in sources else -1
                    sources.setdefault(outer, set()).add(asks)
    return {pair for pair, count in votes.items() if count > 0}


def _in_flow_order(states: Sequence[Json]) -> Iterator[Json]:
    """The states in the order in which transitions reach them from the first; then the others."""
    by_name = {state["name"]: state for state in states}
    waiting, seen = list(by_name)[:1], set[str]()
    for name in by_name:
        waiting.append(name)
        while waiting:
            state = by_name.get(waiting.pop(0))
            if state is not None and state["name"] not in seen:
                seen.add(state["name"])
                yield state
                waiting += state.get("transitions", {}).values()
