"""The room of a run on pages, and what moves in it, by the shapes that pictures have, too."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import replace
from threading import Lock
from typing import Any

from cobodeck.live.clients import Page, PageMessage, Pages, encoded
from cobodeck.live.model import RunModel
from cobodeck.live.sources.seen_obstacles import NEEDING, SeenObstacles
from cobodeck.record.format import value
from cobodeck.setup import Setup
from cobodeck.shapes import (
    LAYERS,
    Backdrop,
    Moment,
    MomentTrail,
    room_shapes,
    shapes_of,
    wire,
    with_drive,
)
from hw import ArmState, Pose2, Pose3, Truth, UserPose
from hw.scene import Point
from states import SUBSYSTEMS, SubsystemName
from states.environment import Environment

FRAME_S = 0.05
"""Between two frames, s."""
FIRST_OFF = frozenset({"inflations", "places", "tracked", "costmap", "chase", "escape", "haptic"})
"""Layers that a page shows only when asked: what nobody needs always, or what takes long."""
ALL = frozenset(LAYERS)
SHOWN = ALL - FIRST_OFF
PLAN_S = 0.25
"""Between two plans of the path to a goal, s in the run."""
CHASE_CELL = 0.1
"""Side of the Chase cells on pages, m: those of the profile are ten times as many bytes."""
TRAIL_S = 30.0
"""Duration of the past paths on pages, s."""
TRAIL_APART = 0.05
"""Between two points of these, m."""
UNSEEN_NS = 2_000_000_000
"""Without a page for longer, in the run, a path begins anew: nobody knows how it went on."""
_ONE = Lock()
"""Two instants of a run share its environment, which is for one thread at a time."""
BOUNDS = [-5.0, -5.0, 5.0, 5.0]
"""Of the map where there is no room, m."""


def layers() -> list[PageMessage]:
    """All layers, and which are on at first."""
    return [{"name": name, "on": name in SHOWN} for name in LAYERS]


class SeenRoom:
    """The room of a run; without one there is nothing to draw."""

    def __init__(self, setup: Setup) -> None:
        scene = setup.scene
        self._around: Backdrop | None = None
        if scene is not None:
            self._around = Backdrop(scene, setup.environment, setup.profile, chase_cell=CHASE_CELL)
        self.obstacles = SeenObstacles(setup.environment)
        self._trail, self._last_ns = MomentTrail(TRAIL_S, TRAIL_APART), -1
        self._planned: tuple[object, tuple[Point, ...]] = None, ()

    def restart(self) -> None:
        """Forget what was before: what comes next is of another time."""
        self._trail, self._last_ns = MomentTrail(TRAIL_S, TRAIL_APART), -1
        self.obstacles.restart()

    def message(self) -> dict[str, Any]:
        """What does not move."""
        if self._around is None:
            return {"t": "room", "bounds": BOUNDS, "shapes": []}
        outer = list(self._around.scene.room.outer)
        xs, ys = [x for x, _ in outer], [y for _, y in outer]
        bounds = [min(xs), min(ys), max(xs), max(ys)]
        return {"t": "room", "bounds": bounds, "shapes": [*map(wire, room_shapes(self._around))]}

    def moment(self, model: RunModel) -> Moment:
        """What is known of robot and user now."""
        if model.at_ns - self._last_ns > UNSEEN_NS:
            self._trail = MomentTrail(TRAIL_S, TRAIL_APART)
        if model.at_ns != self._last_ns:
            self._trail.add(model.at_ns, model.truth or measured(model))
        self._last_ns = model.at_ns
        found = self._trail.moment()
        base = found.robot
        scans = () if base is None else tuple((base, scan) for scan in model.scans())
        goal, subsystem = _goal(model)
        return replace(found, scans=scans, goal=goal, subsystem=subsystem)

    def shapes(self, moment: Moment, shown: Collection[str]) -> list[dict[str, Any]]:
        """What moves, of these layers; may take a while at first."""
        if self._around is None:
            return []
        with _ONE:
            if NEEDING & set(shown):
                moment = replace(moment, obstacles=self.obstacles.value())
            if "path" in shown:
                moment = replace(moment, path=self._path(moment, self._around.environment))
            return [*map(wire, shapes_of(moment, self._around, shown))]

    def _path(self, moment: Moment, environment: Environment) -> tuple[Point, ...]:
        """The path to the goal, planned anew at most once in `PLAN_S`."""
        goal, subsystem = moment.goal, moment.subsystem
        if goal is None or subsystem is None:
            return ()
        asked = goal, subsystem, round((moment.at_s or 0.0) / PLAN_S)
        if self._planned[0] != asked:
            found = with_drive(moment, environment, subsystem, goal)
            self._planned = asked, found.path
        return self._planned[1]


def measured(model: RunModel) -> Truth:
    """Poses as they were measured, of a run whose true state nobody knows."""
    user, arm = _newest(model, "user.pose", UserPose), _newest(model, "arm.joints", ArmState)
    return Truth(
        base=_newest(model, "base.pose", Pose2),
        body=None if user is None else user.body,
        head_turn=0.0 if user is None else user.head_yaw - user.body.yaw,
        joints=None if arm is None else arm.joints,
        request=_newest(model, "vr.haptic_request", Pose3),
    )


def _newest(model: RunModel, name: str, kind: type) -> Any:
    sample = model.sample(name)
    return sample.value if sample is not None and isinstance(sample.value, kind) else None


def _goal(model: RunModel) -> tuple[Pose2 | None, SubsystemName | None]:
    """The goal of the chart that was entered last and has one, and whose distances it keeps."""
    for path in sorted(model.active, key=lambda path: model.active[path], reverse=True):
        written = model.data.get(path, {}).get("goal")
        if written is not None:
            found = value(json.loads(written))
            named = [name for name in SUBSYSTEMS if name in path.split("/")]
            if isinstance(found, Pose2):
                return found, named[0] if named else "chase"
            return None, None
    return None, None


Seen = Callable[[], Iterable[tuple[SeenRoom, RunModel, int]]]
"""The rooms that are shown now, each with its run and its slot."""


async def tell_frames(pages: Pages, seen: Seen) -> None:
    """Tell pages what moves, each its layers, as often as it changes; until cancelled."""
    told: object = None
    while True:
        await pages.some()
        await asyncio.sleep(FRAME_S)
        asked = {page: shown_on(page) for page in pages}
        runs = list(seen())
        state = [(p.number, p.snapshots, *sorted(shown)) for p, shown in asked.items()]
        now = [model.at_ns for _, model, _ in runs], state
        if now == told or not asked:
            continue
        told = now
        try:
            for run in runs:
                await _tell_frame(asked, *run)
        except Exception as error:  # noqa: BLE001  who watches can still stop
            pages.unforeseen(error)


def shown_on(page: Page) -> frozenset[str]:
    """The layers that a page shows."""
    return SHOWN if page.layers is None else ALL & page.layers


async def _tell_frame(
    asked: Mapping[Page, frozenset[str]], room: SeenRoom, model: RunModel, slot: int
) -> None:
    """Only layers that somebody shows are made; pages with the same ones get the same text."""
    wanted = frozenset().union(*asked.values())
    at, moment = model.at_ns / 1e9, room.moment(model)
    shapes = await asyncio.to_thread(room.shapes, moment, wanted)
    slotted = {"slot": slot} if slot else {}
    texts = {}
    for shown in set(asked.values()):
        seen_shapes = [shape for shape in shapes if shape["l"] in shown]
        texts[shown] = encoded({"t": "frame", "at": at, "shapes": seen_shapes, **slotted})
    for page, shown in asked.items():
        page.put(texts[shown], f"frame{slot}")
