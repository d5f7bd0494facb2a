"""The table: every numeric part of the product under stress, and what must hold for it.

Each subject is an experiment that is run `elsewhere`; its answers at home and elsewhere differ by
at most `gain` times the error of what it is told, plus what the table allows besides.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from typing import Literal

import numpy as np

from states.maps.distance import Array
from tests.stress import behaviours, bodies, estimators, planners, runs
from tests.stress.elsewhere import HOME, Elsewhere

Turns = Literal["any", "quarter", "never"]
"""By which angles the world may be turned: some choose among directions of the map."""
DAY_NS = 86_400_000_000_000
EVER_NS, ALL_NS = 1 << 62, 1 << 63
"""The latest stamps: velocities of people know 146 years, all else the 292 years of 64 bits."""


@dataclass(frozen=True, slots=True)
class Subject:
    """One row of the table.

    `gain`: greatest error of an answer in errors of what is told. `turned` besides, absolute, if
    the world is turned: an unknown start has a prior about 0. `loose` besides, always: a solver's
    own tolerance, cells of 5 cm that do not move along, what a drive amplifies. `single`: the gain
    where all numbers are float32; None: a choice may differ.
    `far`: greatest coordinate, m. `wound`: most whole turns of a yaw.
    """

    run: Callable[[Elsewhere], list[float]]
    turns: Turns = "any"
    gain: float = 500.0
    turned: float = 0.0
    loose: float = 0.0
    single: float | None = 200.0
    far: float = 1e7
    latest_ns: int = ALL_NS
    wound: int = 1000
    heavy: bool = False
    """Not by default."""

    @property
    def name(self) -> str:
        return self.run.__name__

    def takes(self, at: Elsewhere) -> bool:
        """True if the table says something about this place."""
        quarters = at.turn / (0.5 * math.pi)
        turns = self.turns == "any" or (self.turns == "quarter" and quarters == round(quarters))
        near = max(abs(at.x), abs(at.y)) <= self.far
        told = not at.single or self.single is not None
        early = at.since_ns <= self.latest_ns - DAY_NS
        return (
            (turns or at.turn == 0.0)
            and near
            and told
            and early
            and (abs(at.windings) <= self.wound)
        )

    def bound(self, at: Elsewhere) -> float:
        """The greatest difference; none at all where only the time is another."""
        if at == replace(HOME, since_ns=at.since_ns):
            return 0.0
        gain = self.single if at.single and self.single is not None else self.gain
        return gain * at.error + self.loose + (self.turned if at.turn else 0.0)

    def check(self, at: Elsewhere) -> None:
        """Run it there, and compare."""
        home, there = at_home(self), np.array(self.run(at), np.float64)
        assert there.shape == home.shape, "other answers than at home"
        np.testing.assert_allclose(there, home, rtol=0.0, atol=self.bound(at))


@cache
def at_home(subject: Subject) -> Array:
    """The answers at home."""
    found = np.array(subject.run(HOME), np.float64)
    assert len(found) > 0
    return found


SUBJECTS = (
    Subject(bodies.planar_poses),
    Subject(bodies.spatial_poses),
    Subject(bodies.velocity, latest_ns=EVER_NS),
    Subject(bodies.reckoned),
    Subject(bodies.pose_histories),
    Subject(bodies.ramps),
    Subject(bodies.safety_rule, far=9_900.0, latest_ns=EVER_NS),
    Subject(bodies.rooms),
    Subject(bodies.rays),
    Subject(bodies.outlines),
    Subject(estimators.planar_filter, turned=1e-8, far=3e6),
    Subject(estimators.spatial_filter, turned=1e-7),
    Subject(estimators.fusion, gain=3e3, turned=1e-6),
    Subject(estimators.wheel_motion),
    Subject(estimators.drift_watch),
    Subject(estimators.tracker_feed),
    Subject(estimators.scan_match),
    Subject(estimators.window_search),
    Subject(estimators.distance_field),
    Subject(estimators.particles, loose=0.02, single=None),
    Subject(estimators.localizer, gain=1e5, turned=1e-5, single=None),
    Subject(estimators.particle_localizer, single=None),
    Subject(estimators.pose_graph),
    Subject(estimators.calibration, turned=1e-6, far=2e6),
    Subject(estimators.frames),
    Subject(estimators.user_velocity, latest_ns=EVER_NS),
    Subject(estimators.predicted_user),
    Subject(planners.exact_paths),
    Subject(planners.grid_paths, turns="never", single=None),
    Subject(planners.profile_drive, gain=1e6, far=1e6),
    Subject(planners.teb_drive, loose=1e-2),
    Subject(planners.floor_space),
    Subject(planners.arm_seen),
    Subject(planners.governed_arm, latest_ns=EVER_NS),
    Subject(planners.arm_kinematics),
    Subject(behaviours.rollouts, gain=5e3),
    Subject(behaviours.chase_places, turns="quarter"),
    Subject(behaviours.escape_choices),
    Subject(behaviours.haptic_choices),
    Subject(behaviours.drives_straight),
    Subject(behaviours.lines_of_walk),
    Subject(behaviours.waiting_risks, turns="quarter"),
    Subject(behaviours.refuges, turns="quarter"),
    Subject(behaviours.avoidable),
    Subject(
        runs.simulated, turns="quarter", gain=5e7, loose=1e-5, single=None, far=9_900.0, wound=1
    ),
    Subject(runs.sensed, turns="never", gain=1e6, single=None, far=9_900.0, wound=1, heavy=True),
    Subject(runs.grown_map, turns="quarter", loose=0.02),
    Subject(runs.map_floor),
    Subject(runs.people_recorded),
    Subject(runs.wandering, turns="never", gain=1e4, far=9_900.0),
    Subject(runs.things, gain=1e5),
)
