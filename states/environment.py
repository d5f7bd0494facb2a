"""What states know of the place they work in: room, robot, limits, navigation values.

The wiring gives one `Environment` as the constant signal `environment`. Nothing of it changes
during a run; what is derived from it is made when first asked for and is the same ever after.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache, cached_property
from typing import TYPE_CHECKING, Annotated, Literal, get_args

from engine.files.units import Angle, Length, Speed
from engine.files.values import Range, above_0
from hw.geometry import Outline, Pose2, Twist2
from hw.robot import MotionLimits, RobotModel
from hw.room import Room
from hw.samples import EXACT, Joints, PoseSigma
from hw.tracking import Tracking
from hw.zones import NO_ZONES, Zones
from states.ages import slowed

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from states.arm.motion import Workspace
    from states.localization.estimates import Localizes
    from states.maps.field import Field
    from states.maps.occupancy import OccupancyMap
    from states.navigation.costmap import StaticLayer
    from states.navigation.layers import Costmaps
    from states.navigation.local_planner import GlobalPlanner, LocalPlanner
    from states.navigation.scanning import ObstacleEstimator
    from states.navigation.unmapped import Obstacles
    from states.navigation.visibility import ExactPlanner

SubsystemName = Literal["chase", "haptic", "escape"]
Localization = Literal["combined", "amcl"]
"""Scans matched, particles for searches, a filter and trackers; or AMCL alone, as in the paper."""
SUBSYSTEMS: tuple[SubsystemName, ...] = get_args(SubsystemName)


@dataclass(frozen=True, slots=True)
class CostmapValues:
    """The costmaps of a subsystem that plans on cells, with costmap_2d's names.

    `inflation_radius` is how far costs reach beyond the subsystem's `inflation`, within which all
    is blocked: they fall with `cost_scaling_factor`, 1/m, and keep `navfn` off walls. `width` and
    `height` are those of the local window about the robot, m (R37).
    """

    resolution: Annotated[Length, Range(0.01, 0.25)]
    inflation_radius: Annotated[Length, Range(0.0, 5.0)]
    cost_scaling_factor: Annotated[float, Range(0.0, 100.0)]
    width: Annotated[Length, Range(1.0, 100.0)]
    height: Annotated[Length, Range(1.0, 100.0)]


@dataclass(frozen=True, slots=True)
class Subsystem:
    """One of the three navigation subsystems, with values of its own (R35, R120, R129).

    `planner` finds ways, `exact` among the room's polygons, the others on a costmap;
    `local_planner` drives them. `inflation` is kept from walls to the robot's centre, `user_radius`
    from the user's centre on the way (m); a goal counts as reached within `tolerance` and
    `yaw_tolerance`.
    """

    planner: Literal["exact", "theta_star", "navfn"]
    local_planner: Literal["profile", "teb"]
    max_speed: Annotated[Speed, above_0(5.0)]
    inflation: Annotated[Length, above_0(5.0)]
    user_radius: Annotated[Length, above_0(5.0)]
    tolerance: Annotated[Length, above_0(1.0)]
    yaw_tolerance: Annotated[Angle, above_0(math.pi)]
    costmap: CostmapValues


@dataclass(frozen=True, slots=True)
class Navigation:
    """The subsystems by name; Escape goes before Haptic before Chase (R71)."""

    chase: Subsystem
    haptic: Subsystem
    escape: Subsystem

    def capped(self, speed: float) -> Navigation:
        """The same with no subsystem faster than this, m/s."""
        return Navigation(
            *(
                replace(s, max_speed=min(s.max_speed, speed))
                for s in (self.chase, self.haptic, self.escape)
            )
        )

    def on_cells(self) -> Navigation:
        """The same, with `theta_star` in the place of `exact`."""
        return Navigation(
            *(
                replace(s, planner="theta_star") if s.planner == "exact" else s
                for s in (self.chase, self.haptic, self.escape)
            )
        )

    def named(self, name: SubsystemName) -> Subsystem:
        """The subsystem of a behaviour."""
        found: Subsystem = getattr(self, name)
        return found


@dataclass(frozen=True, eq=False)
class Environment:
    """The place of one run.

    `map` is a scanned map for the planners on costmaps; without one they draw the room's. `period`
    is the time from tick to tick, s; `latency` how long it takes until the base has heard what a
    tick decided, s. `pose_sigma`: of measured poses of the base; estimated ones have their own.
    `calibration`: of the room's tracking system; None: trackers as the robot file has them, in a
    tracking frame that is the map's.
    """

    room: Room
    robot: RobotModel
    limits: MotionLimits
    navigation: Navigation
    period: float = 1.0 / 30.0
    latency: float = 0.0
    map: OccupancyMap | None = None
    pose_sigma: PoseSigma = EXACT
    calibration: Tracking | None = None
    localization: Localization = "combined"
    zones: Zones = NO_ZONES

    @cached_property
    def _grounds(self) -> dict[float, StaticLayer]:
        return {}

    def ground(self, resolution: float) -> StaticLayer:
        """What the map shows, or the room, on cells of this size; the same for all subsystems."""
        if resolution not in self._grounds:
            from states.navigation.layers import ground_of, map_of

            drawn = self.map or map_of(self.room, resolution)
            walls = self.field if self.map is None else None
            self._grounds[resolution] = ground_of(drawn, resolution, self.zones.keepout, walls)
        return self._grounds[resolution]

    @cached_property
    def tracking(self) -> Tracking:
        """How the tracking system lies in the map, and its trackers on the robot."""
        return self.calibration or Tracking.of(self.robot.sensing)

    @cached_property
    def static_costmaps(self) -> Mapping[SubsystemName, Costmaps]:
        """Of each subsystem, from map or room alone."""
        from states.navigation.layers import costmaps_of

        found = {}
        for name in SUBSYSTEMS:
            subsystem = self.navigation.named(name)
            values = subsystem.costmap
            found[name] = costmaps_of(self.ground(values.resolution), subsystem.inflation, values)
        return found

    @cached_property
    def static_planners(self) -> Mapping[SubsystemName, GlobalPlanner]:
        """Of each subsystem, by map or room alone: what scans show they do not know.

        A state asks for the signal `<subsystem>.planner` instead.
        """
        found: dict[SubsystemName, GlobalPlanner] = {}
        for name in SUBSYSTEMS:
            kind = self.navigation.named(name).planner
            on_cells = kind != "exact"
            found[name] = (
                self.static_costmaps[name].planner(kind) if on_cells else self._exact[name]
            )
        return found

    @cached_property
    def _exact(self) -> Mapping[SubsystemName, ExactPlanner]:
        """Of the subsystems that plan so; one for all of the same inflation."""
        from states.navigation.visibility import ExactPlanner

        @cache
        def exact(inflation: float) -> ExactPlanner:
            outer, obstacles = self.room.outer, (*self.room.obstacles, *self.zones.keepout)
            return ExactPlanner(outer, obstacles, inflation_radius=inflation)

        used = {name: self.navigation.named(name) for name in SUBSYSTEMS}
        return {n: exact(s.inflation) for n, s in used.items() if s.planner == "exact"}

    def planner_among(self, name: SubsystemName, obstacles: Obstacles) -> GlobalPlanner:
        """The planner of a subsystem when scanners have shown these obstacles."""
        if not obstacles:
            return self.static_planners[name]
        from states.navigation.layers import exact_among

        kind = self.navigation.named(name).planner
        if kind == "exact":
            return exact_among(self._exact[name], obstacles)
        return self.costmaps_among(name, obstacles).planner(kind)

    def costmaps_among(self, name: SubsystemName, obstacles: Obstacles) -> Costmaps:
        """The costmaps of a subsystem when scanners have shown these obstacles."""
        static = self.static_costmaps[name]
        return static.among(obstacles) if obstacles else static

    def obstacle_estimator(self) -> ObstacleEstimator:
        """A new one of what scanners show and the map does not; one per run."""
        from states.navigation.obstacles import ObstacleValues
        from states.navigation.scanning import ObstacleEstimator, Scanner

        used = [self.navigation.named(name) for name in SUBSYSTEMS]
        maps = [subsystem.costmap for subsystem in used]
        ground = self.ground(min(values.resolution for values in maps))
        reach = max(max(s.inflation, s.costmap.inflation_radius) for s in used)
        window = ObstacleValues(max(v.width for v in maps), max(v.height for v in maps))
        scanner = Scanner(self.robot.sensing.mount, self.outline(), self.pose_sigma)
        return ObstacleEstimator(ground, reach, window, scanner)

    @cached_property
    def field(self) -> Field:
        """Distances to the walls, of the map or, exact, of the room."""
        from states.maps.field import map_field, room_field

        return room_field(self.room) if self.map is None else map_field(self.map)

    def localizer(self, start: Pose2, seed: int) -> Localizes:
        """A new one that takes the robot to start about here; one per run."""
        sensing, tracking = self.robot.sensing, self.tracking
        if self.localization == "amcl":
            from states.localization.particle_localizer import ParticleLocalizer

            return ParticleLocalizer(self.field, sensing, tracking, start, seed)
        from states.localization.localizer import Localizer

        return Localizer(self.field, sensing, tracking, start, seed)

    def driver(self, name: SubsystemName, planner: GlobalPlanner) -> LocalPlanner:
        """A new local planner with the values of a subsystem; one per drive."""
        from states.navigation.profile_planner import Limits, ProfilePlanner, Tolerance

        subsystem, room = self.navigation.named(name), self.room
        own, base = self.limits, self.robot.base
        limits = Limits(
            min(subsystem.max_speed, own.base_speed, base.max_speed),
            own.base_acceleration,
            min(own.base_yaw_rate, base.max_yaw_rate),
            own.base_yaw_acceleration,
        )
        tolerance, latency = Tolerance(subsystem.tolerance, subsystem.yaw_tolerance), self.latency
        driver: LocalPlanner
        if subsystem.local_planner == "profile":
            driver = ProfilePlanner(planner, limits, tolerance, latency=latency)
        else:
            from states.navigation.teb_planner import TebPlanner

            walls = (room.outer, *room.obstacles, *self.zones.keepout)
            kept = subsystem.inflation
            driver = TebPlanner(
                planner, limits, tolerance, latency=latency, walls=walls, wall_distance=kept
            )
        driver.zones = self.zones
        return driver

    def warm_up(self) -> None:
        """Compile, or load from the cache, what the subsystems drive by, and build their maps."""
        from states.navigation import profile_planner as profile
        from states.navigation import scanning

        profile.warm_up()
        scanning.warm_up()
        used = [self.navigation.named(name) for name in SUBSYSTEMS]
        if any(subsystem.planner != "exact" for subsystem in used):
            from states.navigation import grid_planners

            grid_planners.warm_up()
        if any(subsystem.local_planner == "teb" for subsystem in used):
            from states.navigation import teb_planner

            teb_planner.warm_up()
        _ = self.static_planners

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
        if joints is None or joints == self.robot.parked:
            return half
        from states.arm.collision import extent

        return Outline(*map(max, half, extent(self.workspace.solid, joints)))

    @cached_property
    def workspace(self) -> Workspace:
        """The exact arm in this room, made when first asked for."""
        from states.arm.motion import Workspace
        from states.arm.robot_arm import manipulator_of

        held = manipulator_of(self.robot)
        assert self.robot.arm is not None, "without one there is no manipulator"
        return Workspace.of(held, self.robot.arm, self.limits, self.room.segments)
