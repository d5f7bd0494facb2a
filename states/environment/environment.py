"""The environment of a run: room, robot, limits, and what is built from them once.

The wiring provides one `Environment` as the constant signal `environment`. It does not change
during a run; costmaps, planners and distance fields are built when first needed.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache, cached_property
from types import ModuleType
from typing import TYPE_CHECKING

from hw import EXACT, Joints, Outline, Pose2, PoseSigma, Twist2
from hw.model import MotionLimits, RobotModel, Tracking
from hw.scene import NO_ZONES, Room, Zones
from states.subsystems import (
    OWN_EFFORT,
    SUBSYSTEMS,
    Localization,
    LocalizerEffort,
    Navigation,
    SubsystemName,
)

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from states.arm import Workspace
    from states.localization import Localizes
    from states.localization.matching import LocalizerValues
    from states.maps import Field, OccupancyMap
    from states.navigation import GlobalPlanner
    from states.navigation.exact import ExactPlanner
    from states.navigation.grid import Costmaps, ObstacleEstimator, Obstacles, StaticLayer


@dataclass(frozen=True, eq=False)
class Environment:
    """The environment of one run.

    `map` is a scanned map for the planners on costmaps; without one they draw the room's. `period`
    is the time between ticks, s; `latency` the time until the base receives a tick's command, s.
    `pose_sigma` is that of measured poses of the base; estimated ones have their own. `user_sigma`,
    m, and `user_delay`, s, are the standard deviation and the age on arrival of the user's poses.
    `calibration` is that of the tracking system; None: trackers are where the robot file has them,
    and the tracking frame is the map. `governor`: the arm, too, slows down near the user.
    """

    room: Room
    robot: RobotModel
    limits: MotionLimits
    navigation: Navigation
    period: float = 1.0 / 30.0
    latency: float = 0.0
    map: OccupancyMap | None = None
    pose_sigma: PoseSigma = EXACT
    user_sigma: float = 0.0
    user_delay: float = 0.0
    calibration: Tracking | None = None
    localization: Localization = "combined"
    effort: LocalizerEffort = OWN_EFFORT
    zones: Zones = NO_ZONES
    governor: bool = True

    @cached_property
    def _grounds(self) -> dict[float, StaticLayer]:
        return {}

    def ground(self, resolution: float) -> StaticLayer:
        """The static layer of map or room on cells of this size, shared by all subsystems."""
        if resolution not in self._grounds:
            from states.navigation.grid import ground_of, map_of

            drawn = self.map or map_of(self.room, resolution)
            walls = self.field if self.map is None else None
            self._grounds[resolution] = ground_of(drawn, resolution, self.zones.keepout, walls)
        return self._grounds[resolution]

    @property
    def user_margin(self) -> float:
        """How much nearer than tracked the user may be, two standard deviations, m."""
        return 2.0 * self.user_sigma

    @property
    def delay(self) -> float:
        """From what the user does to what the base does about it, by late poses and commands, s."""
        return self.user_delay + self.latency

    @cached_property
    def tracking(self) -> Tracking:
        """Pose of the tracking system in the map, and of its trackers on the robot."""
        return self.calibration or Tracking.of(self.robot.sensing)

    @cached_property
    def static_costmaps(self) -> Mapping[SubsystemName, Costmaps]:
        """Costmaps of each subsystem, from map or room alone."""
        from states.navigation.grid import costmaps_of

        found = {}
        for name in SUBSYSTEMS:
            subsystem = self.navigation.named(name)
            values = subsystem.costmap
            found[name] = costmaps_of(self.ground(values.resolution), subsystem.inflation, values)
        return found

    @cached_property
    def static_planners(self) -> Mapping[SubsystemName, GlobalPlanner]:
        """Global planner of each subsystem, from map or room alone, without scanned obstacles.

        States use the signal `<subsystem>.planner` instead.
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
        """Planners `exact` of the subsystems that use it, shared by those of the same inflation."""
        from states.navigation.exact import ExactPlanner

        @cache
        def exact(inflation: float) -> ExactPlanner:
            outer, obstacles = self.room.outer, (*self.room.obstacles, *self.zones.keepout)
            return ExactPlanner(outer, obstacles, inflation_radius=inflation)

        used = {name: self.navigation.named(name) for name in SUBSYSTEMS}
        return {n: exact(s.inflation) for n, s in used.items() if s.planner == "exact"}

    def planner_among(self, name: SubsystemName, obstacles: Obstacles) -> GlobalPlanner:
        """The global planner of a subsystem with scanned obstacles."""
        if not obstacles:
            return self.static_planners[name]
        from states.navigation.grid import exact_among

        kind = self.navigation.named(name).planner
        if kind == "exact":
            return exact_among(self._exact[name], obstacles)
        return self.costmaps_among(name, obstacles).planner(kind)

    def costmaps_among(self, name: SubsystemName, obstacles: Obstacles) -> Costmaps:
        """The costmaps of a subsystem with scanned obstacles."""
        static = self.static_costmaps[name]
        return static.among(obstacles) if obstacles else static

    def obstacle_estimator(self) -> ObstacleEstimator:
        """A new estimator of the obstacles that scans show and the map does not; one per run."""
        from states.navigation.grid import ObstacleEstimator, ObstacleValues, Scanner

        used = [self.navigation.named(name) for name in SUBSYSTEMS]
        maps = [subsystem.costmap for subsystem in used]
        ground = self.ground(min(values.resolution for values in maps))
        reach = max(max(s.inflation, s.costmap.inflation_radius) for s in used)
        window = ObstacleValues(max(v.width for v in maps), max(v.height for v in maps))
        scanner = Scanner(self.robot.sensing.mount, self.outline(), self.pose_sigma)
        return ObstacleEstimator(ground, reach, window, scanner)

    @cached_property
    def field(self) -> Field:
        """Distances to the walls: exact in a drawn room, by cells on a scanned map."""
        from states.maps import map_field, room_field

        return room_field(self.room) if self.map is None else map_field(self.map)

    def localizer(self, start: Pose2, seed: int) -> Localizes:
        """A new localizer with this start pose, map_from_base; one per run."""
        sensing, tracking = self.robot.sensing, self.tracking
        values = self._localizer_values()
        if self.localization == "amcl":
            from states.localization import ParticleLocalizer

            return ParticleLocalizer(self.field, sensing, tracking, start, seed, values.particles)
        from states.localization import Localizer

        return Localizer(self.field, sensing, tracking, start, seed, values)

    def _localizer_values(self) -> LocalizerValues:
        from states.localization.matching import LocalizerValues

        values, beams, count = LocalizerValues(), self.effort.beams, self.effort.particles
        matching, particles = values.matching, values.particles
        if beams is not None:
            matching = replace(matching, beams=beams)
            particles = replace(particles, laser_max_beams=beams)
        if count is not None:
            particles = replace(particles, min_particles=count, max_particles=count)
        return replace(values, matching=matching, particles=particles)

    def compiled(self, scanning: bool = True) -> list[ModuleType]:
        """The modules with compiled functions that the subsystems use; see `hw.jit`.

        `scanning`: whether scans will arrive.
        """
        from states.navigation.exact import visibility
        from states.navigation.local import profile_planner, straight_planner

        found = [visibility, profile_planner, straight_planner]
        if scanning:
            from states.navigation.grid import obstacles, scanning as scans

            found += [obstacles, scans]
        used = [self.navigation.named(name) for name in SUBSYSTEMS]
        if any(subsystem.planner != "exact" for subsystem in used):
            from states.navigation.grid import grid_planners

            found.append(grid_planners)
        if any(subsystem.local_planner == "teb" for subsystem in used):
            from states.navigation.local import teb_planner

            found.append(teb_planner)
        return found

    def standstill(self, pose: Pose2, twist: Twist2) -> Pose2:
        """Where the robot comes to rest if it brakes now: v^2 / 2a ahead; `twist` in base frame."""
        c, s = math.cos(pose.yaw), math.sin(pose.yaw)
        vx, vy = c * twist.vx - s * twist.vy, s * twist.vx + c * twist.vy
        stretch = math.hypot(vx, vy) / (2.0 * self.limits.base_acceleration)
        return Pose2(pose.x + stretch * vx, pose.y + stretch * vy, pose.yaw)

    @cached_property
    def walls(self) -> NDArray[np.float64]:
        """The sides of all walls and columns of the room, (n, 4): x1, y1, x2, y2 in m."""
        import numpy as np

        return np.array(self.room.segments, dtype=np.float64)

    def outline(self, joints: Joints | None = None) -> Outline:
        """Bounding rectangle of rover and arm at these joints; None: of the rover alone."""
        footprint = self.robot.footprint
        half = Outline(*2 * (footprint.half_length,), *2 * (footprint.half_width,))
        if joints is None or joints == self.robot.parked:
            return half
        from states.arm.kinematics import extent

        return Outline(*map(max, half, extent(self.workspace.arm, joints)))

    @cached_property
    def workspace(self) -> Workspace:
        """The arm in this room, built when first needed."""
        from states.arm import Workspace

        return Workspace.of(self.robot, self.limits, self.room.segments, governor=self.governor)
