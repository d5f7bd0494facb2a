"""Others that do the same: chart engines (extra `peers`) and simulators (extra `sim-peers`).

A class makes the work of one engine; a test checks that its ticks call the step functions as often
as ours: one monitor and one action step per tick. Engines that are not installed are left out. The
scenes of simulators are frozen yardsticks: scene, steps and options stay as they are.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from importlib import import_module
from importlib.util import find_spec

_PEERS = {  # package: module that it needs, ours, class
    "py_trees": ("py_trees", "py_trees", "PyTrees"),
    "transitions": ("transitions", "transitions", "Transitions"),
    "python-statemachine": ("statemachine", "statemachine", "StateMachine"),
    "sismic": ("sismic", "sismic", "Sismic"),
}
SIMULATORS = {  # name: module that it needs, ours
    "MuJoCo": ("mujoco", "mujoco_robot"),
    "ir-sim": ("irsim", "irsim_robot"),
    "bare physics": ("numba", "rollout"),
}


def found() -> dict[str, type]:
    """The engines that are installed, by package name."""
    return {
        name: getattr(import_module(f"cobodeck.bench.peers.{module}"), cls)
        for name, (needed, module, cls) in _PEERS.items()
        if find_spec(needed) is not None
    }


def simulators() -> dict[str, Callable[[], float]]:
    """The simulators that can be imported; each call simulates and tells µs of CPU per 33 ms."""
    made = {}
    for name, (_, module) in SIMULATORS.items():
        # what it depends on may be missing as well
        with suppress(ImportError):
            made[name] = import_module(f"cobodeck.bench.peers.{module}").prepare()
    return made
