"""What a motion asks of the joints: torque, power and momentum, by recursive Newton-Euler.

In the rover frame, with o_k and z_k origin and axis of joint k, link k has

    w_k = w_(k-1) + v_k z_k
    w'_k = w'_(k-1) + a_k z_k + w_(k-1) x v_k z_k
    o''_k = o''_(k-1) + w'_(k-1) x d + w_(k-1) x (w_(k-1) x d),  d = o_k - o_(k-1)

and its centre c, at r from o_k, the acceleration o''_k + w'_k x r + w_k x (w_k x r). The base
accelerates upwards with g, which stands for gravity. Force m c'' and moment I w' + w x I w of all
bodies from link k on give joint k the torque z_k . sum(moment + (c - o_k) x force). Friction and
the inertia of rotors are left out (Featherstone, Rigid Body Dynamics Algorithms, 5.3).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from states.arm.kinematics.kernels import Array, place_links
from states.arm.kinematics.model import Manipulator

G = 9.81
"""Acceleration of gravity, m/s2."""


@dataclass(frozen=True, slots=True, eq=False)
class Effort:
    """At n instants: torques (n, j), Nm; mechanical power of all joints (n,), W; momentum (n,)."""

    torque: Array
    power: Array
    momentum: Array


@dataclass(frozen=True, slots=True, eq=False)
class Bodies:
    """Masses (b,), kg, centres (b, 3), m, and inertias (b, 3, 3), in the frames of `links` (b,)."""

    links: tuple[int, ...]
    masses: Array
    centers: Array
    inertias: Array

    @classmethod
    def of(cls, arm: Manipulator) -> Bodies:
        """The moving links and, as a point, what the arm holds."""
        masses, held = arm.shape.masses.values(), arm.tool
        inertias = [_tensor(link.inertia) for link in masses]
        return cls(
            (*range(1, len(masses) + 1), arm.count),
            np.array([*(link.mass for link in masses), held.mass]),
            np.array([*(link.center for link in masses), held.center_of_mass]),
            np.array([*inertias, np.zeros((3, 3))]),
        )


def effort(
    arm: Manipulator, bodies: Bodies, joints: Array, velocities: Array, accelerations: Array
) -> Effort:
    """Torque, power and momentum for joints, velocities and accelerations (n, j) each."""
    rows = [_at(arm, bodies, *row) for row in zip(joints, velocities, accelerations, strict=True)]
    torque = np.array([row[0] for row in rows])
    momentum = np.array([row[1] for row in rows])
    return Effort(torque, np.abs((torque * velocities).sum(axis=1)), momentum)


def _at(arm: Manipulator, bodies: Bodies, q: Array, v: Array, a: Array) -> tuple[Array, float]:
    count = arm.count + 1
    frames = np.zeros((count, 4, 4))
    place_links(arm.base, arm.origins, np.ascontiguousarray(q), frames)
    origins, axes = frames[:, :3, 3], frames[:, :3, 2]
    spin, spun, speed = np.zeros((count, 3)), np.zeros((count, 3)), np.zeros((count, 3))
    gained = np.zeros((count, 3))
    gained[0, 2] = G
    for k in range(1, count):
        turn, d = v[k - 1] * axes[k], origins[k] - origins[k - 1]
        spin[k] = spin[k - 1] + turn
        spun[k] = spun[k - 1] + a[k - 1] * axes[k] + np.cross(spin[k - 1], turn)
        speed[k] = speed[k - 1] + np.cross(spin[k - 1], d)
        gained[k] = gained[k - 1] + _moved(spin[k - 1], spun[k - 1], d)
    torque, momentum = np.zeros(arm.count), np.zeros(3)
    for link, mass, center, tensor in zip(
        bodies.links, bodies.masses, bodies.centers, bodies.inertias, strict=True
    ):
        turned = frames[link, :3, :3]
        r, inertia = turned @ center, turned @ tensor @ turned.T
        force = mass * (gained[link] + _moved(spin[link], spun[link], r))
        moment = inertia @ spun[link] + np.cross(spin[link], inertia @ spin[link])
        momentum += mass * (speed[link] + np.cross(spin[link], r))
        for k in range(1, link + 1):
            lever = origins[link] + r - origins[k]
            torque[k - 1] += axes[k] @ (moment + np.cross(lever, force))
    return torque, float(np.linalg.norm(momentum))


def _moved(spin: Array, spun: Array, d: Array) -> Array:
    return np.asarray(np.cross(spun, d) + np.cross(spin, np.cross(spin, d)))


def _tensor(inertia: tuple[float, ...]) -> Array:
    xx, yy, zz, xy, xz, yz = inertia
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
