"""Which requests were served, how soon and how well: the prop's pose against the DEEP."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from cobodeck.evaluate.figures import spread
from cobodeck.evaluate.refusals import Unserved
from hw import Joints, Pose2, Pose3, Truth

SERVED_M, SERVED_RAD = 0.02, 0.1
"""Largest error of the prop against the DEEP for a request to count as served, m, rad (R44)."""
REACH_M = 2.5
"""The prop is compared with the DEEP only while the base is nearer to it than this, m."""
STANDS_NS = 100_000_000
"""The arm stands once it has not moved for this long, ns; moves may follow a tick apart."""

PropOf = Callable[[Pose2, Joints], Pose3]
_NEVER = (None, None, None), (math.inf, math.inf)


@dataclass(slots=True)
class RequestWatch:
    """Follows the requests of a person; `watch` once per tick.

    `prop_of` computes the prop's pose in the map from base and joints; None for a robot without an
    arm, which serves nothing. `heard`: a signal of requests flows. `response_s` and `prop_errors`
    (m and rad, taken once the arm stands) are of served requests; `unserved` are the others.
    """

    prop_of: PropOf | None = None
    heard: bool = True
    requests: int = 0
    response_s: list[float] = field(default_factory=list)
    prop_errors: list[tuple[float, float]] = field(default_factory=list)
    unserved: list[Unserved] = field(default_factory=list)
    _requested: Pose3 | None = None
    _since: int | None = None
    _user: Pose2 | None = None
    _settling: bool = False
    _still_since: int | None = None
    _seen: bool = False
    _missed: tuple[tuple[Pose2 | None, Joints | None, Pose3 | None], tuple[float, float]] = _NEVER

    def watch(self, now_ns: int, truth: Truth) -> None:
        """Evaluate this instant."""
        deep = truth.request
        if deep is not self._requested and deep != self._requested:
            self.end(now_ns)
            self._requested = deep
            if deep is not None:
                self.requests += 1
                self._since, self._user = now_ns, truth.body
        base, joints, prop_of = truth.base, truth.joints, self.prop_of
        if base is None or joints is None or prop_of is None:
            return
        self._seen = True
        if truth.arm_moving:
            self._still_since = None
        elif self._still_since is None:
            self._still_since = now_ns
        if deep is None or (self._since is None and not self._settling):
            return
        if math.hypot(deep.x - base.x, deep.y - base.y) < REACH_M:
            self._watch_prop(now_ns, *self._miss(base, joints, deep, prop_of))

    def _miss(
        self, base: Pose2, joints: Joints, deep: Pose3, prop_of: PropOf
    ) -> tuple[float, float]:
        """How far the prop is off the DEEP, m and rad; computed where one of them has changed."""
        (base_before, joints_before, deep_before), missed = self._missed
        if base is base_before and joints is joints_before and deep is deep_before:
            return missed
        prop = prop_of(base, joints)
        missed = prop.distance_to(deep), prop.angle_to(deep)
        self._missed = (base, joints, deep), missed
        return missed

    def _watch_prop(self, now_ns: int, away: float, turned: float) -> None:
        if self._since is not None and away <= SERVED_M and turned <= SERVED_RAD:
            self.response_s.append((now_ns - self._since) / 1e9)
            self._since, self._settling = None, True
        still = self._still_since
        if self._settling and still is not None and now_ns - still >= STANDS_NS:
            self.prop_errors.append((away, turned))
            self._settling = False

    def end(self, now_ns: int) -> None:
        """End the current request, if there is one; it counts as unserved unless it was served."""
        self._settling = False
        if self._since is not None and self._requested is not None:
            self.unserved.append(Unserved(self._since, now_ns, self._requested, self._user))
            self._since = None

    def report(self) -> dict[str, Any]:
        """The figures by their names in JSON."""
        judged = self.heard and (self._seen or self.prop_of is None)
        return {
            "requests": self.requests if self.heard else None,
            "served": len(self.response_s) if judged else None,
            "refused": len(self.unserved) if judged else None,
            "response_s": spread(self.response_s, ("mean", "sd", "min", "max")),
            "prop_error_m": spread((away for away, _ in self.prop_errors), ("mean", "max")),
            "prop_error_rad": spread((turned for _, turned in self.prop_errors), ("mean", "max")),
        }
