"""Which requests were served, how soon and how well: the prop's pose against the DEEP."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from cobodeck.evaluate.figures import SPREAD, spread
from cobodeck.evaluate.proximity import DriveWatch
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
class WatchedRequest:
    """A request of the person: when they asked for what, where they stood, what became of it.

    Times in ns. `stood_ns`: when the base came to stand before it was served; `end_m`: path length
    of the base, m, when they let go. None: not yet, or not known.
    """

    since_ns: int
    deep: Pose3
    user: Pose2 | None
    stood_ns: int
    served_ns: int | None = None
    end_ns: int | None = None
    end_m: float | None = None

    @property
    def response_s(self) -> float | None:
        """Time from the request until it was served, s."""
        return None if self.served_ns is None else (self.served_ns - self.since_ns) / 1e9

    @property
    def arm_s(self) -> float | None:
        """The arm's part of it: from when the base stood until the request was served, s."""
        return None if self.served_ns is None else (self.served_ns - self.stood_ns) / 1e9


@dataclass(slots=True)
class RequestWatch:
    """Follows the requests of a person; `watch` once per tick.

    `prop_of` computes the prop's pose in the map from base and joints; None for a robot without an
    arm, which serves nothing. `heard`: a signal of requests flows. `base` follows the drives of
    the base meanwhile. `prop_errors` (m and rad) are of served requests, taken once the arm stands.
    """

    prop_of: PropOf | None = None
    heard: bool = True
    base: DriveWatch = field(default_factory=DriveWatch)
    asked: list[WatchedRequest] = field(default_factory=list)
    prop_errors: list[tuple[float, float]] = field(default_factory=list)
    _requested: Pose3 | None = None
    _settling: bool = False
    _still_since: int | None = None
    _seen: bool = False
    _missed: tuple[tuple[Pose2 | None, Joints | None, Pose3 | None], tuple[float, float]] = _NEVER

    @property
    def response_s(self) -> list[float]:
        """Times from request to prop, of those that were served, s."""
        return [taken for one in self.asked if (taken := one.response_s) is not None]

    @property
    def unserved(self) -> list[Unserved]:
        """The requests that ended without being served."""
        return [
            Unserved(one.since_ns, one.end_ns, one.deep, one.user)
            for one in self.asked
            if one.served_ns is None and one.end_ns is not None
        ]

    def watch(self, now_ns: int, truth: Truth) -> None:
        """Evaluate this instant."""
        deep, base = truth.request, truth.base
        if deep is not self._requested and deep != self._requested:
            self._change(now_ns, truth)
        joints, prop_of = truth.joints, self.prop_of
        if base is None or joints is None or prop_of is None:
            return
        self._seen = True
        if truth.arm_moving:
            self._still_since = None
        elif self._still_since is None:
            self._still_since = now_ns
        if deep is None:
            return
        request = self.asked[-1]
        if request.served_ns is None:
            if base is not self.base.stood:
                self.base.watch(now_ns, truth, base)
        elif not self._settling:
            return
        if math.hypot(deep.x - base.x, deep.y - base.y) < REACH_M:
            self._watch_prop(now_ns, request, *self._miss(base, joints, deep, prop_of))

    def _change(self, now_ns: int, truth: Truth) -> None:
        """A request has come, or gone, or both."""
        self.end(now_ns, truth)
        self._requested = deep = truth.request
        if deep is not None:
            self.asked.append(WatchedRequest(now_ns, deep, truth.body, now_ns))
            self.base.begin(now_ns, truth.base)

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

    def _watch_prop(self, now_ns: int, request: WatchedRequest, away: float, turned: float) -> None:
        if request.served_ns is None and away <= SERVED_M and turned <= SERVED_RAD:
            request.served_ns, request.stood_ns = now_ns, self.base.moved_ns
            self._settling = True
        still = self._still_since
        if self._settling and still is not None and now_ns - still >= STANDS_NS:
            self.prop_errors.append((away, turned))
            self._settling = False

    def end(self, now_ns: int, truth: Truth) -> None:
        """End the current request, if there is one; it counts as unserved unless it was served."""
        self._settling = False
        if self._requested is not None and self.asked[-1].end_ns is None:
            self.asked[-1].end_ns, self.asked[-1].end_m = now_ns, truth.distance_m

    def report(self, distance_m: float | None) -> dict[str, Any]:
        """The figures by their names in JSON, after this path of the base, m."""
        judged = self.heard and (self._seen or self.prop_of is None)
        times, arm_times = self.response_s, (one.arm_s for one in self.asked)
        return {
            "requests": len(self.asked) if self.heard else None,
            "served": len(times) if judged else None,
            "refused": len(self.unserved) if judged else None,
            "response_s": spread(times, SPREAD),
            "arm_s": spread((taken for taken in arm_times if taken is not None), SPREAD),
            "close_drives": self.base.report(),
            "prop_error_m": spread((away for away, _ in self.prop_errors), ("mean", "max")),
            "prop_error_rad": spread((turned for _, turned in self.prop_errors), ("mean", "max")),
            "request_list": self._listed(judged, distance_m) if self.heard else None,
        }

    def _listed(self, judged: bool, distance_m: float | None) -> list[dict[str, Any]]:
        """Each request; what was travelled after the last one is counted as part of it."""
        ends = [0.0, *(one.end_m for one in self.asked[:-1]), distance_m]
        return [
            {
                "asked_s": one.since_ns / 1e9,
                "served": one.served_ns is not None if judged else None,
                "response_s": one.response_s,
                "arm_s": one.arm_s,
                "travelled_m": None if before is None or after is None else after - before,
                "deep": [one.deep.x, one.deep.y, one.deep.z],
                "user": None if one.user is None else [one.user.x, one.user.y, one.user.yaw],
            }
            for one, before, after in zip(self.asked, ends, ends[1:], strict=False)
        ]
