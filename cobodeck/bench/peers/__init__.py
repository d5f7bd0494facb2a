"""The same charts in other engines (extra `peers`): one monitor and one action step per tick.

A class makes the work of one engine; a test checks that its ticks call the step functions as often
as ours. Peers that are not installed are left out.
"""

from __future__ import annotations

from importlib import import_module
from importlib.util import find_spec

_PEERS = {  # package: module that it needs, ours, class
    "py_trees": ("py_trees", "py_trees", "PyTrees"),
    "transitions": ("transitions", "transitions", "Transitions"),
    "python-statemachine": ("statemachine", "statemachine", "StateMachine"),
    "sismic": ("sismic", "sismic", "Sismic"),
}


def found() -> dict[str, type]:
    """The peers that are installed, by package name."""
    return {
        name: getattr(import_module(f"cobodeck.bench.peers.{module}"), cls)
        for name, (needed, module, cls) in _PEERS.items()
        if find_spec(needed) is not None
    }
