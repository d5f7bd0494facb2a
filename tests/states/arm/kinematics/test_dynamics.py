"""Torque and momentum against energies: tau = d/dt dL/dv - dL/dq, by differences."""

from __future__ import annotations

import numpy as np
import pytest

from hw.model.arm import arm_names
from hw.model.robot import load_robot
from states.arm.kinematics.dynamics import Bodies, G, effort
from states.arm.kinematics.kinematics import link_frames
from states.arm.kinematics.model import Manipulator
from tests.states.arm.conftest import arm_named

ROBOT = load_robot("rbkairos_ur10")


def energies(arm: Manipulator, bodies: Bodies, q: np.ndarray, v: np.ndarray):
    """Kinetic and potential energy, J, and momentum (3,), from poses a moment apart."""
    h = 1e-5
    before, now, after = (link_frames(arm, q + s * h * v) for s in (-1.0, 0.0, 1.0))
    kinetic, potential, momentum = 0.0, 0.0, np.zeros(3)
    for link, mass, center, tensor in zip(
        bodies.links, bodies.masses, bodies.centers, bodies.inertias, strict=True
    ):
        a, b, c = (f[link, :3, :3] @ center + f[link, :3, 3] for f in (before, now, after))
        speed = (c - a) / (2.0 * h)
        turn = now[link, :3, :3]
        spin = ((after - before)[link, :3, :3] / (2.0 * h)) @ turn.T
        w = np.array([spin[2, 1], spin[0, 2], spin[1, 0]])
        kinetic += 0.5 * mass * speed @ speed + 0.5 * w @ (turn @ tensor @ turn.T) @ w
        potential += mass * G * b[2]
        momentum += mass * speed
    return kinetic, potential, momentum


@pytest.mark.parametrize("name", arm_names())
def test_torques_are_those_of_the_energies(name: str) -> None:
    arm = arm_named(name, "gripped")
    bodies = Bodies.of(arm)
    rng, h = np.random.default_rng(8), 1e-4
    q, v, a = rng.uniform(-2, 2, 6), rng.uniform(-1, 1, 6), rng.uniform(-3, 3, 6)

    def lagrangian(q: np.ndarray, v: np.ndarray) -> float:
        kinetic, potential, _ = energies(arm, bodies, q, v)
        return kinetic - potential

    def slope(q: np.ndarray, v: np.ndarray, k: int, of_v: bool) -> float:
        step = np.zeros(6)
        step[k] = h
        if of_v:
            return (lagrangian(q, v + step) - lagrangian(q, v - step)) / (2.0 * h)
        return (lagrangian(q + step, v) - lagrangian(q - step, v)) / (2.0 * h)

    expected = [
        (slope(q + h * v, v + h * a, k, True) - slope(q - h * v, v - h * a, k, True)) / (2.0 * h)
        - slope(q, v, k, False)
        for k in range(6)
    ]
    found = effort(arm, bodies, q[None], v[None], a[None])
    scale = np.abs(expected).max()
    assert found.torque[0] == pytest.approx(expected, abs=2e-4 * scale)
    assert found.power[0] == pytest.approx(abs(np.dot(expected, v)), abs=1e-3 * scale)
    _, _, momentum = energies(arm, bodies, q, v)
    assert found.momentum[0] == pytest.approx(np.linalg.norm(momentum), rel=1e-6)


def test_an_arm_at_rest_holds_its_own_weight() -> None:
    """Stretched out level, the shoulder holds every mass at its distance."""
    arm = arm_named("ur10e", "gripped")
    bodies = Bodies.of(arm)
    still = np.zeros((1, 6))
    found = effort(arm, bodies, still, still, still)
    frames = link_frames(arm, np.zeros(6))
    far = [
        frames[link, :2, :2] @ center[:2] + frames[link, :2, 2] * center[2] + frames[link, :2, 3]
        for link, center in zip(bodies.links, bodies.centers, strict=True)
    ]
    held = zip(bodies.links, bodies.masses, far, strict=True)
    shoulder = sum(mass * G * point[0] for link, mass, point in held if link > 1)
    assert abs(found.torque[0, 1]) == pytest.approx(abs(shoulder), rel=1e-9)
    assert found.torque[0, 0] == pytest.approx(0.0, abs=1e-9)
    assert found.momentum[0] == 0.0
