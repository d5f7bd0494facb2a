"""A simulated robot with sensors that is driven about, for tests of what they say."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import Any

from hw.geometry import Pose2, Twist2
from hw.model.robot import MotionLimits, load_robot
from hw.model.sensor_errors import LidarErrors, OdometryErrors, SensorErrors
from hw.model.sensor_model import SensorModel
from hw.people.live import LivePerson
from hw.samples import UserPose
from hw.scene.scene import Scene, load_scene
from hw.sim.world import World

ROBOT = load_robot("rbkairos_ur10")
PERFECT = SensorErrors(lidar=LidarErrors(0.0, 0.0), odometry=OdometryErrors(0.0, 0.0), slip=None)
HALL = replace(load_scene("hall"), robot_start=Pose2(7.0, 7.0, -0.785))
CORNER = Pose2(13.4, 0.6, 1.0)
SENSORS = ("lidar", "odometry", "imu", "rover_trackers")


def ticks(seconds: float, rate: float = 30.0) -> list[int]:
    return [round(n * 1e9 / rate) for n in range(round(seconds * rate))]


class Driven:
    """A run in a hall; `asked`: the sensors whose samples are taken, from `heard_from` ns on.

    `got` has the samples by name with the instants of their arrival, `truth` the poses of the base,
    `seen` what the truth says of when tracking had the person last.
    """

    def __init__(
        self,
        errors: SensorErrors = PERFECT,
        *,
        seed: int = 0,
        instants: Iterable[int] = (),
        asked: Iterable[str] = ("lidar", "odometry"),
        command: Callable[[int], Twist2] = lambda _: Twist2(0.8, 0.0, 0.4),
        walk: Callable[[int], Pose2] = lambda _: CORNER,
        scene: Scene | None = None,
        heard_from: int = 0,
    ) -> None:
        self.person = LivePerson(walk(0))
        scene = HALL if scene is None else scene
        self.world = World(
            scene, ROBOT, self.person, MotionLimits(1.0, 2.0),
            sensing=errors, sensors=SensorModel(seed=seed),
        )  # fmt: skip
        self.got: dict[str, list[tuple[int, int, Any]]] = {}
        self.seen: list[int | None] = []
        self.truth: list[tuple[int, Pose2]] = []
        asked = {*asked, "base", "arm", "trackers"}
        for now in instants or ticks(2.0):
            body = walk(now)
            self.person.push(now, UserPose(body, body.yaw))
            self.world.advance(now)
            self.truth.append((now, self.world.base.pose))
            self.seen.append(self.world.truth.seen_ns)
            for name in asked:
                if now < heard_from and name in SENSORS:
                    continue
                for sample in self.world.parts[name].samples(now):
                    self.world.guard.hear(sample, now)
                    self.got.setdefault(sample.name, []).append((now, *sample[1:]))
            self.world.guard.drive(command(now))
            self.world.guard.tick(now)

    def values(self, name: str) -> list[tuple[int, Any]]:
        return [(stamp, value) for _, stamp, value in self.got[name]]
