"""The benchmark of localization: its drive goes where it should, its rows are complete."""

from __future__ import annotations

import json
import math

from cobodeck.bench.localization import localization_bench as localization, localization_steps
from cobodeck.bench.table import RESULTS
from hw.scene.scene import load_scene


def test_the_drive_is_free_of_walls_and_passes_every_stop():
    ride = localization.ride(45.0)
    room = load_scene(localization.SCENE).room
    assert all(room.clearance(pose.x, pose.y) > 0.5 for pose in ride.poses[::25])
    for stop in localization.STOPS[1:]:
        assert min(math.dist(stop, (pose.x, pose.y)) for pose in ride.poses) < 0.15
    turns = sum(
        abs(b.yaw - a.yaw) > 0.001 for a, b in zip(ride.poses, ride.poses[1:], strict=False)
    )
    assert turns > 0.8 * len(ride.poses)


def test_single_steps_have_a_time_and_no_error(monkeypatch):
    monkeypatch.setattr(localization_steps, "CACHES_S", (1.0, 10.0))
    rows = list(localization_steps.step_rows(1))
    assert [(row.name, row.value) for row in rows] == [
        ("filter planar", None),
        ("filter 15 states", None),
        *(("lookup 5 edges", cache_s) for cache_s in (1.0, 10.0)),
    ]
    assert all(row.time_us > 0.0 and row.error is None for row in rows)


def test_the_committed_run_meets_its_goals():
    rows = json.loads((RESULTS / "localization.json").read_text())["rows"]
    with_goals = [row for row in rows if row["goal"] is not None]
    assert len(with_goals) > 8
    assert all(row["error"] <= row["goal"] for row in with_goals)
    knobs = {(row["name"], row["knob"]) for row in rows}
    for knob in ("particles", "beams", "sigma_hit", "resolution"):
        assert ("particle filter", knob) in knobs
    assert {("scan matching", knob) for knob in ("beams", "scale", "resolution", "cell")} <= knobs
