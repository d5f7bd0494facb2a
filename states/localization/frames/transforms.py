"""A tree of frames with a history, with the semantics of tf2.

An edge is the pose of a child frame in its parent: `parent_from_child`, metres and unit
quaternions. Static edges hold at all times; dynamic ones are kept for `cache` seconds and
interpolated between two stamps, positions linearly, orientations by slerp. Nothing is extrapolated.
Stamps are integer nanoseconds of any one clock; they may be negative.
"""

from __future__ import annotations

import math
from bisect import bisect_left
from dataclasses import dataclass
from typing import Literal

from hw import IDENTITY, Pose3, RigidMotion, between, inverse, product, unit_quaternion

CACHE_S = 10.0
"""Default length of the history of a dynamic edge, s."""

Reason = Literal["unknown", "unconnected", "loop", "one_value", "future", "past"]

_TRIM = 256  # least number of expired values that are freed at once


@dataclass(frozen=True, slots=True)
class NoTransform:
    """Why there is no transform, for programs (`reason`) and for people (`text`).

    `one_value`, `future` and `past`: an edge would have to be extrapolated, because it has a single
    value at another time, its newest value is older, or its oldest value is newer.
    """

    reason: Reason
    text: str

    def __str__(self) -> str:
        return self.text


class _History:
    """The values of one dynamic edge in order of stamps; those before index `first` have expired.

    `parent` is the common parent of all values, or None if it has changed within the history.
    """

    __slots__ = ("edges", "first", "parent", "parents", "stamps")

    def __init__(self) -> None:
        self.stamps: list[int] = []
        self.parents: list[str] = []
        self.edges: list[RigidMotion] = []
        self.first = 0
        self.parent: str | None = None

    def insert(self, stamp: int, parent: str, edge: RigidMotion, cache_ns: int) -> bool:
        """Add a value; False if it is older than the history. An equal stamp is overwritten."""
        stamps = self.stamps
        if stamps and stamp < stamps[-1] - cache_ns:
            return False
        if not stamps:
            self.parent = parent
        elif self.parent != parent:
            self.parent = None
        if not stamps or stamp > stamps[-1]:
            stamps.append(stamp)
            self.parents.append(parent)
            self.edges.append(edge)
            self._forget(stamp - cache_ns)
            return True
        at = bisect_left(stamps, stamp, self.first)
        if stamps[at] == stamp:
            self.parents[at], self.edges[at] = parent, edge
            return True
        stamps.insert(at, stamp)
        self.parents.insert(at, parent)
        self.edges.insert(at, edge)
        return True

    def _forget(self, oldest: int) -> None:
        stamps, first = self.stamps, self.first
        while stamps[first] < oldest:
            first += 1
        self.first = first
        if first > _TRIM and 2 * first > len(stamps):
            del stamps[:first], self.parents[:first], self.edges[:first]
            self.first = 0
            if self.parent is None and len(set(self.parents)) == 1:
                self.parent = self.parents[0]

    def find(self, stamp: int) -> int | Reason:
        """Index of the value at this stamp, or of the next one; the reason if there is none."""
        stamps, first = self.stamps, self.first
        at = bisect_left(stamps, stamp, first)
        if at == len(stamps):
            return "one_value" if at - first == 1 else "future"
        if at == first and stamps[at] != stamp:
            return "one_value" if len(stamps) - first == 1 else "past"
        return at

    def parent_at(self, at: int, stamp: int) -> str:
        return self.parents[at if self.stamps[at] == stamp else at - 1]

    def edge_at(self, at: int, stamp: int) -> RigidMotion:
        """The edge at a stamp: interpolated between values of one parent, else the older value."""
        after = self.stamps[at]
        if after == stamp:
            return self.edges[at]
        before = self.stamps[at - 1]
        if self.parent is None and self.parents[at - 1] != self.parents[at]:
            return self.edges[at - 1]
        return between(self.edges[at - 1], self.edges[at], (stamp - before) / (after - before))


class TransformBuffer:
    """A tree of frames with a history; each frame has at most one parent at a time."""

    def __init__(self, cache: float = CACHE_S) -> None:
        self._cache_ns = round(cache * 1e9)
        self._static: dict[str, tuple[str, RigidMotion]] = {}
        self._moving: dict[str, _History] = {}
        self._parents: set[str] = set()

    def fix(self, parent: str, child: str, parent_from_child: Pose3) -> None:
        """Set a static edge; it replaces everything known of the child.

        Raises:
            ValueError: a value is not finite, no unit quaternion, or a frame is its own parent.
        """
        edge = _checked(parent, child, parent_from_child)
        self._moving.pop(child, None)
        self._static[child] = (parent, edge)
        self._parents.add(parent)

    def set_transform(
        self, parent: str, child: str, stamp_ns: int, parent_from_child: Pose3
    ) -> bool:
        """Add a value of a dynamic edge; False, and ignored, if older than the cache.

        Values may come in any order; a second one for a stamp replaces the first. The parent may
        change.

        Raises:
            ValueError: a value is not finite, no unit quaternion, or a frame is its own parent.
        """
        edge = _checked(parent, child, parent_from_child)
        history = self._moving.get(child)
        if history is None:
            self._static.pop(child, None)
            history = self._moving[child] = _History()
            self._parents.add(parent)
        elif history.parent != parent:
            self._parents.add(parent)
        return history.insert(stamp_ns, parent, edge, self._cache_ns)

    def lookup(self, target: str, source: str, stamp_ns: int | None = None) -> Pose3 | NoTransform:
        """target_from_source at a stamp; None means the newest one at which all edges are known."""
        if stamp_ns is None:
            newest = self.newest_common(target, source)
            if isinstance(newest, NoTransform):
                return newest
            stamp_ns = newest
        up = self._chain(source, stamp_ns, target)
        if up[-1] == target and self._knows(target):
            return Pose3(*self._climb(up, len(up) - 1, stamp_ns))
        down = self._chain(target, stamp_ns, source)
        meeting = _meeting(up, down)
        if meeting is None or not self._knows(target):
            return self._failure(target, source, up, down, stamp_ns)
        from_source = self._climb(up, meeting[0], stamp_ns)
        from_target = self._climb(down, meeting[1], stamp_ns)
        return Pose3(*product(inverse(from_target), from_source))

    def newest_common(self, target: str, source: str) -> int | NoTransform:
        """The newest stamp at which all edges between two frames are known, ns.

        0 where all of them are static.
        """
        up, down = self._chain(source, None, target), self._chain(target, None, source)
        meeting = _meeting(up, down)
        if meeting is None or not self._knows(target):
            return self._failure(target, source, up, down, 0)
        frames = up[: meeting[0]] + down[: meeting[1]]
        moving = [self._moving[frame].stamps[-1] for frame in frames if frame in self._moving]
        return min(moving, default=0)

    def _chain(self, frame: str, stamp: int | None, goal: str) -> list[str]:
        """The frame and its ancestors, up to the goal or as far as they are known at the stamp."""
        static, moving = self._static, self._moving
        chain = [frame]
        longest = len(static) + len(moving)
        while frame != goal and len(chain) <= longest:
            fixed = static.get(frame)
            history = moving.get(frame) if fixed is None else None
            if fixed is not None:
                frame = fixed[0]
            elif history is None:
                break
            elif stamp is None:
                frame = history.parents[-1]
            else:
                at = history.find(stamp)
                if not isinstance(at, int):
                    break
                frame = history.parent or history.parent_at(at, stamp)
            chain.append(frame)
        return chain

    def _climb(self, chain: list[str], steps: int, stamp: int) -> RigidMotion:
        """ancestor_from_frame over the first `steps` edges of a chain known at the stamp."""
        whole = IDENTITY
        for frame in chain[:steps]:
            fixed = self._static.get(frame)
            if fixed is not None:
                edge = fixed[1]
            else:
                history = self._moving[frame]
                at = history.find(stamp)
                assert isinstance(at, int)
                edge = history.edge_at(at, stamp)
            whole = edge if whole is IDENTITY else product(edge, whole)
        return whole

    def _failure(
        self, target: str, source: str, up: list[str], down: list[str], stamp: int
    ) -> NoTransform:
        asked = f"{source} seen from {target}"
        for frame in (target, source):
            if not self._knows(frame):
                return NoTransform("unknown", f"{asked}: there is no frame {frame}")
        for chain in (up, down):
            if len(set(chain)) < len(chain):
                return NoTransform("loop", f"{asked}: {' in '.join(chain)} is a loop")
        for chain in (up, down):
            history = self._moving.get(chain[-1])
            reason = None if history is None else history.find(stamp)
            if history is None or reason is None or isinstance(reason, int):
                continue
            first, last = history.stamps[history.first], history.stamps[-1]
            known = f"only at {first} ns" if first == last else f"from {first} to {last} ns"
            return NoTransform(reason, f"{asked} at {stamp} ns: {chain[-1]} is known {known}")
        return NoTransform("unconnected", f"{asked}: {source} and {target} are not connected")

    def _knows(self, frame: str) -> bool:
        return frame in self._static or frame in self._moving or frame in self._parents


def _meeting(up: list[str], down: list[str]) -> tuple[int, int] | None:
    """Indices of the first common frame in both chains."""
    places = {frame: at for at, frame in enumerate(up)}
    for at, frame in enumerate(down):
        if frame in places:
            return places[frame], at
    return None


def _checked(parent: str, child: str, pose: Pose3) -> RigidMotion:
    """The pose of a child in its parent, with its quaternion normalised.

    Raises:
        ValueError: a value is not finite, no unit quaternion, or a frame is its own parent.
    """
    where = f"{child} in {parent}"
    if parent == child:
        raise ValueError(f"{where}: a frame cannot be its own parent")
    edge = pose.as_motion()
    if not math.isfinite(sum(edge)):
        raise ValueError(f"{where}: {pose} is not finite")
    try:
        return (pose.x, pose.y, pose.z, *unit_quaternion(*edge[3:]))
    except ValueError as error:
        raise ValueError(f"{where}: {error}") from None
