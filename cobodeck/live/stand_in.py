"""Stands in for the messages of charts and the list of shapes, until these are merged."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

from behaviors.profile import Profile
from cobodeck.live.model import RunModel
from cobodeck.setup import Setup
from engine.chart import Chart, Node
from engine.draw import CannotRender, dot, render
from hw import ArmState, Pose2, Scan, UserPose

LAYERS = {
    "room": True, "inflations": False, "objects": True, "places": False, "tracked": False,
    "robot": True, "arm": True, "user": True, "zones": True, "path": True, "goal": True,
    "scan": True, "costmap": False, "chase": False, "escape": False, "haptic": True, "deep": True,
    "trails": True,
}  # fmt: skip


def chart_message(
    chart: Chart, library: Mapping[str, Chart], profile: Profile, *, slot: int = 0
) -> dict[str, Any]:
    """The message `chart`."""
    try:
        drawn = render(dot(chart, dict(library), None, constants=profile.constants), "svg").decode()
    except CannotRender:
        drawn = ""
    nodes = dict(_nodes(chart.root, "", library))
    return {"t": "chart", "name": chart.name, "svg": drawn, "nodes": nodes, "findings": [],
            "stale": False, "slot": slot}  # fmt: skip


def _nodes(node: Node, path: str, library: Mapping[str, Chart]) -> Iterator[tuple[str, Any]]:
    yield path, {"kind": node.form, "about": "", "values": {}, "outcomes": {}, "break": False}
    inner = library[node.target].root if node.form == "use" else node
    for child in inner.children:
        yield from _nodes(child, f"{path}/{child.name}" if path else child.name, library)


def room_message(setup: Setup) -> dict[str, Any]:
    """The message `room`."""
    if setup.scene is None:
        return {"t": "room", "bounds": [-5.0, -5.0, 5.0, 5.0], "shapes": []}
    room = setup.scene.room
    rings = [list(ring) for ring in (room.outer, *room.obstacles)]
    xs, ys = [p[0] for p in rings[0]], [p[1] for p in rings[0]]
    walls = [
        {"l": "room", "k": "poly", "c": "wall", "p": [round(v, 3) for p in ring for v in p]}
        for ring in rings
    ]
    return {"t": "room", "bounds": [min(xs), min(ys), max(xs), max(ys)], "shapes": walls}


def frame_shapes(setup: Setup, model: RunModel) -> Iterator[dict[str, Any]]:
    """What moves."""
    truth = model.truth
    base = truth.base if truth is not None else None
    base = base or _value(model, "base.pose", Pose2)
    if base is not None:
        half = setup.robot.footprint.half_length, setup.robot.footprint.half_width
        corners = [base @ Pose2(sx * half[0], sy * half[1], 0.0)
                   for sx, sy in ((1, 1), (1, -1), (-1, -1), (-1, 1))]  # fmt: skip
        points = [round(v, 3) for c in corners for v in (c.x, c.y)]
        yield {"l": "robot", "k": "poly", "c": "robot", "p": points, "fill": True}
    user = _value(model, "user.pose", UserPose)
    if user is not None:
        yield {"l": "user", "k": "disc", "c": "user", "p": [user.body.x, user.body.y], "r": 0.3}
    scan = _value(model, "base.scan", Scan)
    if scan is not None and base is not None:
        angles = (scan.start + n * scan.step for n in range(len(scan.ranges)))
        points = [
            round(v, 2)
            for angle, r in zip(angles, scan.ranges, strict=True)
            if math.isfinite(r)
            for v in (
                base.x + r * math.cos(base.yaw + angle),
                base.y + r * math.sin(base.yaw + angle),
            )
        ]
        yield {"l": "scan", "k": "dots", "c": "scan", "p": points}
    arm = _value(model, "arm.joints", ArmState)
    if arm is not None and base is not None:
        yield {"l": "arm", "k": "disc", "c": "arm", "p": [base.x, base.y], "r": 0.1}


def _value(model: RunModel, name: str, kind: type) -> Any:
    sample = model.sample(name)
    return sample.value if sample is not None and isinstance(sample.value, kind) else None
