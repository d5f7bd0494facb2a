"""The simulated sensors of a robot, as parts that look back on the tracks of base and person."""

from __future__ import annotations

from collections.abc import Sequence

from hw.interfaces import RobotPart
from hw.jit import compile_examples
from hw.model import RobotModel, SensorErrors, Tracking
from hw.people.walking import Person
from hw.samples import USER_RADIUS
from hw.scene import Body, Point, Scene
from hw.sim import sensors
from hw.sim.sensors import (
    PersonView,
    Shapes,
    SimImu,
    SimLidar,
    SimOdometry,
    SimulatedTrackers,
    Track,
)
from hw.sim.sim_base import SimBase
from hw.sim.slip import SlipperyFloor

PERSON_HEIGHT = 1.8
"""Height of the cylinder that models the person, m."""


class Equipment:
    """All sensors of a robot file; a sensor that is not sampled costs nothing."""

    def __init__(
        self,
        robot: RobotModel,
        base: SimBase,
        person: Person | None,
        scene: Scene | None,
        errors: SensorErrors,
        seed: int,
        bodies: Sequence[Body] = (),
    ) -> None:
        compile_examples((sensors,))
        self._person = person
        self._body = Track(base.pose)
        wheels, floor = self._body, None
        if errors.slip is not None:
            wheels, floor = Track(base.pose), SlipperyFloor(errors.slip, seed)
        base.watch(self._body, wheels, floor)
        if person is not None:
            self._walked = Track(person.body)
            bodies = (Body(USER_RADIUS, PERSON_HEIGHT, self._walker), *bodies)
        room = None if scene is None else scene.room
        shapes, sensing = Shapes(room, bodies), robot.sensing.moved(errors.mount_error)
        seen = sensors.coverage.Coverage(room, shapes, errors.vive)
        calibrated = None if scene is None else scene.calibration
        tracking = Tracking.of(sensing) if calibrated is None else calibrated.poses()
        everywhere = scene is None or scene.tracking == "everywhere"
        self.view = PersonView(seen, errors.vive, seed, everywhere=everywhere)
        self.tracking_delay = errors.vive.delay
        self.parts: dict[str, RobotPart] = {}
        if sensing.lidars:
            self.parts["lidar"] = SimLidar(sensing.lidars, self._body, shapes, errors.lidar, seed)
        if sensing.odometry is not None:
            self.parts["odometry"] = SimOdometry(sensing.odometry, wheels, errors.odometry, seed)
        if sensing.imu is not None:
            self.parts["imu"] = SimImu(sensing.imu, self._body, errors.imu, seed)
        if sensing.trackers:
            self.parts["rover_trackers"] = SimulatedTrackers(
                robot, self._body, seen, errors.vive, seed, tracking.moved(errors.mount_error)
            )

    def note(self, now_ns: int) -> None:
        """Record the person's pose at now_ns."""
        if self._person is not None:
            self._walked.note(now_ns, self._person.body)

    def _walker(self, time_ns: int) -> Point:
        x, y, _ = self._walked.held(time_ns)
        return x, y
