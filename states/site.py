"""What states know of the place they work in: room, robot, limits, navigation values.

The wiring puts one `Site` as the signal `site` at time 0; it never changes during a run.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Literal

from engine.types import Angle, Length, Speed
from hw.geometry import Outline, Pose2, Twist2
from hw.robot import MotionLimits, RobotModel
from hw.room import Room
from hw.samples import Joints
from states.ages import slowed

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from states.arm.motion import Workspace
    from states.navigation.profile import ProfilePlanner
    from states.navigation.visibility import ExactPlanner

SubsystemName = Literal["chase", "haptic", "escape"]


@dataclass(frozen=True, slots=True)
class Subsystem:
    """One of the three navigation subsystems, with values of its own (R35, R120, R129).

    `inflation` is kept from walls to the robot's centre, `user_radius` from the user's centre on
    the way (m); a goal counts as reached within `tolerance` and `yaw_tolerance`.
    """

    planner: Literal["exact"]
    max_speed: Speed
    inflation: Length
    user_radius: Length
    tolerance: Length
    yaw_tolerance: Angle


@dataclass(frozen=True, slots=True)
class Navigation:
    """The subsystems by name; Escape goes before Haptic before Chase (R71)."""

    chase: Subsystem
    haptic: Subsystem
    escape: Subsystem

    def named(self, name: SubsystemName) -> Subsystem:
        """The subsystem of a behaviour."""
        found: Subsystem = getattr(self, name)
        return found


@dataclass(frozen=True, eq=False)
class Site:
    """The place of one run.

    `period` is the time from tick to tick, s; `latency` how long it takes until the base has heard
    what a tick decided, s.
    """

    room: Room
    robot: RobotModel
    limits: MotionLimits
    navigation: Navigation
    period: float = 1.0 / 30.0
    latency: float = 0.0
    _planners: dict[float, ExactPlanner] = field(default_factory=dict, init=False, repr=False)

    def planner(self, name: SubsystemName) -> ExactPlanner:
        """The planner of a subsystem, made when first asked for."""
        from states.navigation.visibility import ExactPlanner

        inflation = self.navigation.named(name).inflation
        if inflation not in self._planners:
            room = self.room
            self._planners[inflation] = ExactPlanner(
                room.outer, room.obstacles, inflation_radius=inflation
            )
        return self._planners[inflation]

    def driver(self, name: SubsystemName) -> ProfilePlanner:
        """A new local planner with the values of a subsystem; one per drive."""
        from states.navigation.profile import Limits, ProfilePlanner, Tolerance

        subsystem, limits, base = self.navigation.named(name), self.limits, self.robot.base
        return ProfilePlanner(
            self.planner(name),
            Limits(
                min(subsystem.max_speed, limits.base_speed, base.max_speed),
                limits.base_acceleration,
                min(limits.base_yaw_rate, base.max_yaw_rate),
                limits.base_yaw_acceleration,
            ),
            Tolerance(subsystem.tolerance, subsystem.yaw_tolerance),
            latency=self.latency,
        )

    def slowed(self, command: Twist2, share: float, name: SubsystemName) -> Twist2:
        """A subsystem's command within this share of its speed; see `states.ages`."""
        if share >= 1.0:
            return command
        speed, yaw_rate = self.navigation.named(name).max_speed, self.limits.base_yaw_rate
        return slowed(command, share, speed, yaw_rate)

    def standstill(self, pose: Pose2, twist: Twist2) -> Pose2:
        """Where the robot comes to rest if it brakes now; `twist` in the base frame."""
        motion = twist.rotated(pose.yaw)
        stretch = motion.speed / (2.0 * self.limits.base_acceleration)
        return Pose2(pose.x + stretch * motion.vx, pose.y + stretch * motion.vy, pose.yaw)

    @cached_property
    def walls(self) -> NDArray[np.float64]:
        """The sides of all walls and columns of the room, (n, 4): x1, y1, x2, y2 in m."""
        import numpy as np

        return np.array(self.room.segments, dtype=np.float64)

    def outline(self, joints: Joints | None = None) -> Outline:
        """Of rover and arm as it stands; None: of the rover alone."""
        footprint = self.robot.footprint
        half = Outline(*2 * (footprint.half_length,), *2 * (footprint.half_width,))
        if joints is None or joints == self.robot.arm.parked:
            return half
        from states.arm.collision import extent

        return Outline(*map(max, half, extent(self.workspace.solid, joints)))

    @cached_property
    def workspace(self) -> Workspace:
        """The exact arm in this room, made when first asked for."""
        from states.arm.model import manipulator_of
        from states.arm.motion import Workspace

        robot = self.robot
        return Workspace.of(manipulator_of(robot), robot.arm, self.limits, self.room.segments)
