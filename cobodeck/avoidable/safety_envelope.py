"""The safety envelope: from which distance a walking person can be escaped, and what was recorded.

The least distance of centres depends on the walking speed, the robot's acceleration, and the delay
until it moves. It is searched for (`envelope.least_distance`), so that stepping aside counts, too.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from cobodeck.avoidable.envelope import Oncoming, least_distance
from cobodeck.avoidable.futures import velocity_at
from cobodeck.avoidable.judged import question_at
from cobodeck.avoidable.motion_search import is_avoidable
from cobodeck.avoidable.motions import GAP
from cobodeck.avoidable.recorded_escapes import RecordedRun
from cobodeck.avoidable.shapes import Array

INTRUSION_M, ERRORS_M = 0.2, 0.15
"""C and Z of `separation`: reach of a hand before it is noticed, and errors of both poses, m."""


def separation(walking: float, driving: float, reaction_s: float, braking: float) -> float:
    """The protective separation of outlines in the manner of ISO/TS 15066 (5.5.4), m.

    S = v_h (T_r + T_s) + v_r T_r + S_s + C + Z, with the stopping time T_s = v_r / a and distance
    S_s = v_r^2 / 2a of a robot that drives at the person and brakes. A report, not conformity.
    """
    stopping_s = driving / braking
    stopped = driving**2 / (2.0 * braking)
    both = walking * (reaction_s + stopping_s) + driving * reaction_s
    return both + stopped + INTRUSION_M + ERRORS_M


def boundary(speeds: Sequence[float], acceleration: float) -> list[float | None]:
    """The least distances of centres at these walking speeds without a delay, m.

    A delay adds the way walked meanwhile, as the robot stands. None: farther than is searched.
    """
    return [least_distance(Oncoming(speed, acceleration, 0.0), GAP) for speed in speeds]


@dataclass(frozen=True, slots=True)
class EscapePoint:
    """A recorded Escape in the envelope.

    Attributes:
        at_s: when it was entered; `outcome`: None if it was left, or still ran.
        speed: of the person then, m/s; `distance` of centres, m.
        least: from which such a person, walking straight at the robot on open floor, can be escaped
            by a robot at rest with these limits, m; None: not below 10 m.
        free: whether from the entry on some motion touched nobody, had they walked straight on.
    """

    at_s: float
    outcome: str | None
    speed: float
    distance: float
    least: float | None
    free: bool

    @property
    def inside(self) -> bool:
        """Whether it began far enough away, however the person walks on."""
        return self.least is not None and self.distance >= self.least

    def plain(self) -> dict[str, Any]:
        """As values for JSON."""
        names = {"speed": "speed_m_s", "distance": "distance_m", "least": "least_m"}
        values = {names.get(name, name): value for name, value in asdict(self).items()}
        return {**values, "inside": self.inside}


def escape_points(run: RecordedRun) -> Iterator[EscapePoint]:
    """The Escapes of a run, in order."""
    for escape in run.escapes:
        at_s, limits = escape.start_s, run.limits
        robot, speed = run.robot_at(at_s), math.hypot(*velocity_at(run, at_s))
        x, y, _ = _place(run, at_s)
        approach = Oncoming(speed, limits.acceleration, run.profile.latency_s, limits=limits)
        question = question_at(run, at_s, at_s, "unwarned")
        yield EscapePoint(
            at_s,
            escape.outcome,
            speed,
            math.hypot(x - robot.x, y - robot.y),
            least_distance(approach, GAP),
            is_avoidable(question),
        )


def _place(run: RecordedRun, at_s: float) -> Array:
    found: Array = run.way.at([at_s])[0]
    return found
