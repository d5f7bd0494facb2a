"""The runs of the evaluation: three conditions, random routes, one key at a time, other parts."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from cobodeck.campaign import CampaignCell
from cobodeck.setup import FULL, profile_with

CONDITIONS = ("chase", "corner", "center")
"""Where the robot is between requests, in the order of Table 2."""
NEAR_USER = CONDITIONS[0]
PARKED = {"paper": "paper_condition_parked", "tuned": "condition_parked"}
"""The charts of the other conditions, by the profile's policy."""
SCENE, ROUTE = "study", "route"
SEQUENCE = 7
"""Poses of a round, and requests of a sequence (5.2.1)."""
ROUTE_REQUESTS = 2 * SEQUENCE
"""Requests on each random route: two rounds."""
VARIED_REQUESTS = SEQUENCE
"""Requests with each varied key: one round."""

VARIED: tuple[tuple[str, ...], ...] = (
    (),
    ("robot.base_yaw_rate=0.5 rad/s",),
    ("robot.base_yaw_rate=0.3 rad/s",),
    ("robot.base_acceleration=6 m/s2",),
    ("robot.base_acceleration=0.6 m/s2",),
    ("robot.base_acceleration=0.35 m/s2",),
    ("navigation.haptic.max_speed=0.75 m/s",),
    ("navigation.haptic.tolerance=5 cm",),
    ("navigation.haptic.planner=navfn",),
    ("robot.arm_acceleration=0.6 rad/s2",),
    ("plant.latency=30 ms",),
    ("plant.tracking_delay=0.1 s",),
    ("escape.moving=0 m/s",),
    ("escape.distances=[1.0 m, 1.75 m, 2.5 m]",),
    ("robot.base_yaw_rate=0.5 rad/s", "robot.base_acceleration=0.35 m/s2",
     "robot.arm_acceleration=0.6 rad/s2"),
)  # fmt: skip
"""Values of the profile that are varied, mostly one at a time; the last set comes nearest to the
paper's three responses of a search over yaw rate, acceleration and speed."""
OWN_VARIED: dict[str, tuple[tuple[str, ...], ...]] = {
    "paper": (("charts.paper_chase.sample=0",), ("charts.paper_escape.must_reach=true",)),
    "tuned": (("charts.escape.must_reach=true",),),
}
"""More of them, of the charts of each policy."""

_SUBSYSTEMS = ("chase", "haptic", "escape")
_NAVFN = tuple(f"navigation.{name}.planner=navfn" for name in _SUBSYSTEMS)
_TEB = tuple(f"navigation.{name}.local_planner=teb" for name in _SUBSYSTEMS)
PARTS: dict[str, tuple[str, ...]] = {
    "as in the profile": (),
    "navfn, TEB": (*_NAVFN, *_TEB),
    "navfn, TEB, AMCL": (*_NAVFN, *_TEB, "localization=amcl"),
}
"""Planners and localizers with all sensors simulated; the last are the paper's own."""


def varied_values(profile: str) -> tuple[tuple[str, ...], ...]:
    """All sets of values that are varied with a profile, by its policy."""
    return (*VARIED, *OWN_VARIED[profile_with(profile, ()).policy])


@dataclass(frozen=True, slots=True)
class EvaluationPlan:
    """What is evaluated: `parts_requests` are those with other parts, 0: none."""

    requests: int = 100
    profile: str = "paper"
    tier: int = 1
    seeds: int = 20
    parts_requests: int = 0

    def cell(
        self, condition: str, sets: tuple[str, ...] = (), requests: int | None = None
    ) -> CampaignCell:
        """A run of a condition, by default the one of Table 2."""
        return replace(
            self._run(condition),
            sets=sets,
            tier=self.tier,
            requests=self.requests if requests is None else requests,
        )

    def route(self, condition: str, number: int) -> CampaignCell:
        """A run of a condition with the person on a random route, the same in all conditions."""
        return replace(
            self._run(condition),
            user=ROUTE,
            tier=self.tier,
            requests=ROUTE_REQUESTS,
            repetition=number,
        )

    def varied(self, condition: str, sets: tuple[str, ...]) -> CampaignCell:
        """A run of a condition with some values of the profile replaced."""
        return self.cell(condition, sets, VARIED_REQUESTS)

    def other_parts(self, condition: str, name: str) -> CampaignCell:
        """A run of a condition with the parts of this name and all sensors."""
        return replace(
            self._run(condition), sets=PARTS[name], tier=FULL, requests=self.parts_requests
        )

    def _run(self, condition: str) -> CampaignCell:
        """A run of a condition; near the user it is the chart that the profile names."""
        if condition == NEAR_USER:
            return CampaignCell(scene=SCENE, profile=self.profile)
        chart = PARKED[profile_with(self.profile, ()).policy]
        place = (f"parking={{place: {condition}}}",)
        return CampaignCell(chart=chart, scene=SCENE, profile=self.profile, inputs=place)

    def cells(self, varied: Sequence[tuple[str, ...]]) -> Iterator[CampaignCell]:
        """All runs; the long ones first, so that no worker is left with one at the end."""
        if self.parts_requests:
            for name in reversed(PARTS):
                yield from (self.other_parts(condition, name) for condition in CONDITIONS)
        yield from (self.cell(condition) for condition in CONDITIONS)
        for number in range(self.seeds):
            yield from (self.route(condition, number) for condition in CONDITIONS)
        for sets in varied:
            yield from (self.varied(condition, sets) for condition in CONDITIONS)
