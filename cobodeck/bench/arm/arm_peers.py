"""Inverse kinematics of other packages, where they are installed."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from importlib import import_module
from importlib.util import find_spec
from typing import Any

import numpy as np

from states.arm.kinematics import Array, Manipulator

MODULES = {
    "ompl": "ompl",
    "ur-analytic-ik": "ur_analytic_ik",
    "roboticstoolbox-python": "roboticstoolbox",
    "ikpy": "ikpy",
}


def found(names: Iterable[str]) -> list[str]:
    """The packages among these that can be imported."""
    return [name for name in names if _imports(MODULES[name])]


def _imports(module: str) -> bool:
    if find_spec(module) is None:
        return False
    try:
        import_module(module)
    except ImportError:  # installed, but not its dependencies
        return False
    return True


def _analytic(_: Manipulator) -> Callable[[Array], Any]:
    solve: Callable[[Array], Any] = import_module("ur_analytic_ik").ur10.inverse_kinematics
    return solve


def _toolbox(arm: Manipulator) -> Callable[[Array], Any]:
    toolbox = import_module("roboticstoolbox")
    links = [toolbox.RevoluteDH(d=d, a=a, alpha=alpha) for d, a, alpha in _dh(arm)]
    ets = toolbox.DHRobot(links).ets()

    def solve(pose: Array) -> Any:
        return ets.ik_LM(pose, tol=1e-12)

    return solve


def _ikpy(arm: Manipulator) -> Callable[[Array], Any]:
    links = [import_module("ikpy.link").DHLink(d=d, a=a, alpha=alpha) for d, a, alpha in _dh(arm)]
    chain = import_module("ikpy.chain").Chain(links, active_links_mask=[True] * len(links))

    def solve(pose: Array) -> Any:
        return chain.inverse_kinematics_frame(pose, orientation_mode="all")

    return solve


def _dh(arm: Manipulator) -> list[tuple[float, float, float]]:
    """The Denavit-Hartenberg parameters d, a (m) and alpha (rad) of the nominal chain."""
    d1, a2, a3, d4, d5, d6 = (float(value) for value in arm.dh)
    half = 0.5 * np.pi
    return [
        (d1, 0.0, half),
        (0.0, a2, 0.0),
        (0.0, a3, 0.0),
        (d4, 0.0, half),
        (d5, 0.0, -half),
        (d6, 0.0, 0.0),
    ]


def solutions(answer: Any) -> Array:
    """The joints (n, 6) in what a package answers: several, one, or one with more about it."""
    joints = answer[0] if isinstance(answer, tuple) else answer
    return np.atleast_2d(np.asarray(joints, dtype=np.float64))[:, :6]


IK_PEERS: dict[str, Callable[[Manipulator], Callable[[Array], Any]]] = {
    "ur-analytic-ik": _analytic,
    "roboticstoolbox-python": _toolbox,
    "ikpy": _ikpy,
}
"""By package: makes from an arm a solver for base_from_flange (4, 4)."""
