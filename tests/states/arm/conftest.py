"""The arm, sets of joints and a second forward kinematics that shares no code."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from behaviors.profile.profile import load_profile
from hw.model.arm import load_arm
from hw.model.prop import load_prop
from hw.model.robot import load_robot
from states.arm.description.robot_arm import manipulator_of
from states.arm.kinematics.collision import Surroundings
from states.arm.kinematics.model import Manipulator
from states.arm.planning.planning import Plan
from states.environment.environment import Environment
from tests.states.arm.stepping import HALL, plan_to_deep


@pytest.fixture(scope="session")
def arm() -> Manipulator:
    return manipulator_of(load_robot("rbkairos_ur10"))


class ScrewArm:
    """UR10 as a product of exponentials: six screw axes read off the arm stretched along -x."""

    axes = np.array([[0, 0, 1], [0, -1, 0], [0, -1, 0], [0, -1, 0], [0, 0, -1], [0, -1, 0]], float)
    points = np.array(
        [
            [0, 0, 0],
            [0, 0, 0.1273],
            [-0.612, 0, 0.1273],
            [-1.1843, 0, 0.1273],
            [-1.1843, -0.163941, 0.1273],
            [-1.1843, -0.163941, 0.0116],
        ]
    )
    home = np.array(
        [[1, 0, 0, -1.1843], [0, 0, -1, -0.256141], [0, 1, 0, 0.0116], [0, 0, 0, 1]], float
    )

    def flange(self, q: np.ndarray) -> np.ndarray:
        """base_from_flange (n, 4, 4) at joints (n, 6)."""
        pose = np.broadcast_to(np.eye(4), (len(q), 4, 4))
        for axis, point, angle in zip(self.axes, self.points, q.T, strict=True):
            pose = pose @ self._screw(axis, point, angle)
        return pose @ self.home

    def tcp(self, q: np.ndarray) -> np.ndarray:
        """rover_from_tcp (n, 4, 4) with the mount of ur10.yaml and the 0.15 m prop."""
        mount = np.array([[-1, 0, 0, 0], [0, -1, 0, 0], [0, 0, 1, 0.511], [0, 0, 0, 1]], float)
        tip = np.array([[0, 0, 1, 0], [0, 1, 0, 0], [-1, 0, 0, 0.15], [0, 0, 0, 1]], float)
        return mount @ self.flange(q) @ tip

    @staticmethod
    def _screw(axis: np.ndarray, point: np.ndarray, angle: np.ndarray) -> np.ndarray:
        x, y, z = axis
        cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
        turn = (
            np.eye(3)
            + np.sin(angle)[:, None, None] * cross
            + (1.0 - np.cos(angle))[:, None, None] * (cross @ cross)
        )
        pose = np.zeros((len(angle), 4, 4))
        pose[:, :3, :3] = turn
        pose[:, :3, 3] = point - turn @ point
        pose[:, 3, 3] = 1.0
        return pose


@pytest.fixture(scope="session")
def screws() -> ScrewArm:
    return ScrewArm()


class JointSets:
    """Seeded sets of joints (n, 6): anywhere, or at and near one kind of singularity.

    A tenth of a singular set is exactly singular, the rest 1e-12 to 1e-2 rad off.
    """

    def __init__(self, seed: int = 1) -> None:
        self.rng = np.random.default_rng(seed)

    def anywhere(self, n: int) -> np.ndarray:
        return self.rng.uniform(-np.pi, np.pi, (n, 6))

    def wrist(self, n: int) -> np.ndarray:
        q = self.anywhere(n)
        q[:, 4] = self.rng.choice([0.0, np.pi], n) + self.offsets(n)
        return q

    def elbow(self, n: int) -> np.ndarray:
        q = self.anywhere(n)
        q[:, 2] = np.clip(self.rng.choice([0.0, -np.pi, np.pi], n) + self.offsets(n), -np.pi, np.pi)
        return q

    def shoulder(self, n: int) -> np.ndarray:
        """The wrist straight above or below the shoulder's axis."""
        q = self.anywhere(n)
        a2, a3, d5 = -0.612, -0.5723, 0.1157
        along = a2 + a3 * np.cos(q[:, 2]) + d5 * np.sin(q[:, 2] + q[:, 3])
        across = -a3 * np.sin(q[:, 2]) + d5 * np.cos(q[:, 2] + q[:, 3])
        q[:, 1] = np.arctan2(-along, across) + self.rng.choice([0.0, np.pi], n) + self.offsets(n)
        return q

    def offsets(self, n: int) -> np.ndarray:
        off = 10.0 ** self.rng.uniform(-12, -2, n) * self.rng.choice([-1.0, 1.0], n)
        off[: n // 10] = 0.0
        return off


@pytest.fixture
def sets() -> JointSets:
    return JointSets()


@dataclass(frozen=True)
class ReachProblem:
    """A DEEP seen from the rover (rover_from_deep, 4x4), with the person behind it and a pillar."""

    deep: np.ndarray
    around: Surroundings


def reach_problem(rng: np.random.Generator) -> ReachProblem:
    """The rover faces a DEEP 0.5 to 1.6 m high and 0.8 to 1.2 m away, from one of seven angles.

    The person stands 0.85 m behind the DEEP; a pillar stands somewhere ahead of the rover, not on
    it and not where the prop has to go.
    """
    height, distance = rng.uniform(0.5, 1.6), rng.uniform(0.8, 1.2)
    yaw = np.pi - np.radians(rng.choice([-90, -60, -30, 0, 30, 60, 90]))
    pitch = rng.uniform(-np.radians(20), np.radians(20))
    deep = np.eye(4)
    deep[:3, :3] = Rotation.from_euler("ZY", [yaw, pitch]).as_matrix()
    deep[:3, 3] = distance, 0.0, height
    person = deep[:2, 3] - 0.85 * np.array([np.cos(yaw), np.sin(yaw)])
    while True:
        radius, angle, away = rng.uniform(0.05, 0.15), rng.uniform(-1.7, 1.7), rng.uniform(0.7, 1.2)
        pillar = away * np.array([np.cos(angle), np.sin(angle)])
        outside = np.maximum(np.abs(pillar) - [0.565, 0.455], 0.0)
        if np.hypot(*outside) > radius + 0.02 and np.hypot(*(pillar - deep[:2, 3])) > radius + 0.2:
            break
    cylinders = np.array([[*person, 0.5, 0.0, 1.8], [*pillar, radius, 0.0, 2.5]])
    return ReachProblem(deep, Surroundings(np.zeros((0, 6)), cylinders))


@pytest.fixture(scope="session")
def problems() -> list[ReachProblem]:
    rng = np.random.default_rng(42)
    return [reach_problem(rng) for _ in range(500)]


@pytest.fixture(scope="session")
def tuned() -> Environment:
    """A hall as Haptic's planners see it, with the tuned profile."""
    return load_profile("tuned").environment(HALL, load_robot("rbkairos_ur10"))


@pytest.fixture(scope="session")
def reach(tuned: Environment) -> Plan:
    return plan_to_deep(tuned)


def arm_named(name: str, prop: str = "prop") -> Manipulator:
    """A shipped arm on the rover, with a shipped prop."""
    rover, shape = load_robot("rbkairos_ur10"), load_arm(name)
    held = load_prop(prop).also(name, shape.parked).on(name)
    return Manipulator(shape, rover.arm.mount, rover.chassis, held)
