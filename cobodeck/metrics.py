"""What a run was worth, judged apart from the charts, on true poses.

Figures of things that did not occur are `None`, never 0.
"""

from __future__ import annotations

import math
import statistics
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

from cobodeck.arm_contact import ArmWatch
from cobodeck.separation import SeparationWatch
from engine.machine import Box
from engine.run import Run
from hw.geometry import Pose2, Pose3, wrap
from hw.log import Log
from hw.person import Person
from hw.samples import Joints, UserPose
from hw.sim.world import World

SERVED_M, SERVED_RAD = 0.02, 0.1
"""How near the prop must be to the DEEP (R44)."""
AHEAD_M, HALF_VIEW_RAD, AROUND_M = 2.5, math.pi / 5, 1.5
"""The Escape zones: within the view, and elsewhere (R104)."""
MOVING = 0.2
"""A slower user is in no Escape situation, and does not walk, m/s."""
NEAR_M, FAR_M = 1.5, 4.0
"""Where the base is to be while the user walks (R90, R91, R97)."""
STALE_NS = 150_000_000
"""A longer silence of tracking is a drop-out (R149)."""

PropOf = Callable[[Pose2, Joints], Pose3]


@dataclass(slots=True)
class Evaluator:
    """Watches a world from outside; `watch` once per tick.

    `prop_of` and `arm` are None for a robot without an arm, which serves nothing. `prop_errors` are
    those of the served requests where the prop was nearest, m and rad; `unserved` is when the
    others began and ended, ns.
    """

    world: World
    prop_of: PropOf | None
    arm: ArmWatch | None
    requests: int = 0
    response_s: list[float] = field(default_factory=list)
    prop_errors: list[tuple[float, float]] = field(default_factory=list)
    unserved: list[tuple[int, int]] = field(default_factory=list)
    situations: int = 0
    time_to_safety_s: list[float] = field(default_factory=list)
    dropouts: list[tuple[int, int]] = field(default_factory=list)
    walking_ns: int = 0
    beside_ns: int = 0
    _now: int = 0
    _requested: Pose3 | None = None
    _since: int | None = None
    _looked_at: tuple[Pose2, Joints] | None = None
    _danger_since: int | None = None
    _seen: int = 0
    _head_turn: float = 0.0

    @property
    def _person(self) -> Person:
        person = self.world.person
        assert person is not None, "only a world with a person can be judged"
        return person

    def watch(self, now_ns: int) -> None:
        """Look at the true state of this instant."""
        world = self.world
        base, person = world.base.pose, self._person
        body = person.body
        elapsed, self._now = now_ns - self._now, now_ns
        distance = math.hypot(body.x - base.x, body.y - base.y)
        moving = person.speed > MOVING
        if moving:
            self.walking_ns += elapsed
            if NEAR_M <= distance <= FAR_M:
                self.beside_ns += elapsed
        self._watch_tracking()
        if self.arm is not None:
            self.arm.watch()
        if distance < AHEAD_M or self._danger_since is not None:
            self._watch_zones(now_ns, distance, moving)
        if person.request is not None or self._requested is not None:
            self._watch_request(now_ns)

    def _watch_tracking(self) -> None:
        sample = self._person.measured
        if sample is None:
            return
        if sample.stamp_ns - self._seen > STALE_NS:
            self.dropouts.append((self._seen, sample.stamp_ns))
        self._seen = sample.stamp_ns
        pose = sample.value
        if isinstance(pose, UserPose):
            self._head_turn = pose.head_yaw - pose.body.yaw

    def _watch_zones(self, now_ns: int, distance: float, moving: bool) -> None:
        inside = distance < AROUND_M or (distance < AHEAD_M and self._in_view())
        if self._danger_since is None:
            if inside and moving:
                self._danger_since = now_ns
                self.situations += 1
        elif not inside:
            self.time_to_safety_s.append((now_ns - self._danger_since) / 1e9)
            self._danger_since = None

    def _in_view(self) -> bool:
        body = self._person.body
        bearing = body.bearing_to(self.world.base.pose)
        return abs(wrap(bearing - self._head_turn)) <= HALF_VIEW_RAD

    def _watch_request(self, now_ns: int) -> None:
        deep = self._person.request
        if deep is not self._requested:
            self._end_request(now_ns)
            self._requested = deep
            if deep is not None:
                self.requests += 1
                self._since = now_ns
        arm, prop_of = self.world.arm, self.prop_of
        if deep is None or arm is None or prop_of is None or not self._is_near(deep):
            return
        looked_at = self.world.base.pose, arm.state.joints
        if self._since is None and looked_at == self._looked_at:
            return
        self._looked_at = looked_at
        self._watch_prop(now_ns, deep, prop_of(*looked_at))

    def _end_request(self, now_ns: int) -> None:
        if self._since is not None:
            self.unserved.append((self._since, now_ns))
            self._since = None

    def _watch_prop(self, now_ns: int, deep: Pose3, prop: Pose3) -> None:
        error = prop.distance_to(deep), prop.angle_to(deep)
        if self._since is None:
            self.prop_errors[-1] = min(self.prop_errors[-1], error)
        elif error[0] <= SERVED_M and error[1] <= SERVED_RAD:
            self.response_s.append((now_ns - self._since) / 1e9)
            self.prop_errors.append(error)
            self._since = None

    def _is_near(self, deep: Pose3) -> bool:
        base = self.world.base.pose
        return math.hypot(deep.x - base.x, deep.y - base.y) < AHEAD_M

    def finish(self) -> None:
        """Count what tracking still owes at the end, and a request that is left."""
        self._end_request(self._now)
        if self._now - self._seen > STALE_NS:
            self.dropouts.append((self._seen, self._now))

    def report(self) -> dict[str, Any]:
        """The figures by their names in JSON."""
        world = self.world
        return {
            "requests": self.requests,
            "served": len(self.response_s),
            "refused": len(self.unserved),
            "response_s": spread(self.response_s, ("mean", "sd", "min", "max")),
            "prop_error_m": spread((away for away, _ in self.prop_errors), ("mean", "max")),
            "prop_error_rad": spread((turned for _, turned in self.prop_errors), ("mean", "max")),
            "distance_m": world.base.distance_m,
            "energy_j": world.base.energy_j,
            "situations": self.situations,
            "situations_open": int(self._danger_since is not None),
            "time_to_safety_s": spread(self.time_to_safety_s, ("mean", "min", "max")),
            "contacts": world.contacts + (0 if self.arm is None else self.arm.contacts),
            "wall_hits": world.wall_hits,
            "min_gap_m": world.min_gap,
            "walking_s": self.walking_ns / 1e9,
            "beside_share": self.beside_ns / self.walking_ns if self.walking_ns else None,
            "dropouts": [
                {"from_s": start / 1e9, "to_s": end / 1e9} for start, end in self.dropouts
            ],
        }


NOTHING: Mapping[str, Any] = {
    "governor": False,
    "person_watched": False,
    "requests": None,
    "served": None,
    "refused": None,
    "refusals": {},
    "response_s": dict.fromkeys(("mean", "sd", "min", "max")),
    "prop_error_m": dict.fromkeys(("mean", "max")),
    "prop_error_rad": dict.fromkeys(("mean", "max")),
    "distance_m": None,
    "energy_j": None,
    "situations": None,
    "situations_open": None,
    "time_to_safety_s": dict.fromkeys(("mean", "min", "max")),
    "contacts": None,
    "wall_hits": None,
    "min_gap_m": None,
    "walking_s": None,
    "beside_share": None,
    "dropouts": [],
    "faults": None,
    "fault_names": {},
    "separation": SeparationWatch(Log(1)).report(),
}
"""The figures of a run without a world."""


def spread(values: Iterable[float], names: tuple[str, ...]) -> dict[str, float | None]:
    """Mean, standard deviation of the sample, least and greatest; `None` where there is none."""
    found = list(values)
    if not found:
        return dict.fromkeys(names)
    figures: dict[str, float | None] = {
        "mean": statistics.fmean(found),
        "sd": statistics.stdev(found) if len(found) > 1 else None,
        "min": min(found),
        "max": max(found),
    }
    return {name: figures[name] for name in names}


def visits(run: Run, chart: str, outcome: str | None = None) -> int:
    """How often a used chart was entered, or ended with an outcome."""
    paths = {
        vertex.path
        for vertex in run.machine.vertices.values()
        if isinstance(vertex, Box) and vertex.chart == chart
    }
    kind = "enter" if outcome is None else "outcome"
    return sum(
        record.kind == kind
        and record.subject in paths
        and (outcome is None or record.detail[0] == outcome)
        for record in run.trace
    )
