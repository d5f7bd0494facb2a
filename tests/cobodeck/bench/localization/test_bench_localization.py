"""The benchmark of localization: its drive goes where it should, its rows are complete."""

from __future__ import annotations

import json
import math
from pathlib import Path

import pytest

from cobodeck.bench.localization import localization_bench as localization
from cobodeck.pictures.benched import draw_bench
from cobodeck.terminal.console import Problem
from hw.scene.scene import load_scene

COMMITTED = Path(localization.__file__).with_name("localization.json")


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


def test_single_steps_have_a_time_over_what_they_may_take():
    rows = list(localization.step_rows(1))
    assert [(row.name, row.value) for row in rows] == [
        ("filter planar", None),
        ("filter 15 states", None),
        ("lookup 5 edges", 10.0),
        ("lookup 5 edges", 1000.0),
    ]
    for row in rows:
        most = float(row.ratio_to.removesuffix(" µs"))
        assert row.ratio == pytest.approx(row.time_us / most)


def test_the_committed_run_meets_its_goals():
    rows = json.loads(COMMITTED.read_text())["rows"]
    with_goals = [row for row in rows if row["goal"] is not None]
    assert len(with_goals) > 8
    assert all(row["error"] <= row["goal"] for row in with_goals)
    knobs = {(row["name"], row["knob"]) for row in rows}
    for knob in ("particles", "beams", "sigma_hit", "resolution"):
        assert ("amcl", knob) in knobs
    assert {("match", "beams"), ("match", "scale"), ("match", "resolution")} <= knobs


def test_time_against_error_is_drawn_and_the_same_each_time(tmp_path):
    rows = json.loads(COMMITTED.read_text())["rows"]
    files = tmp_path / "a.svg", tmp_path / "b.svg"
    for file in files:
        draw_bench(rows, file)
    assert files[0].read_bytes() == files[1].read_bytes()
    assert "amcl, particles" in files[0].read_text()


def test_rows_without_a_setting_are_no_picture(tmp_path):
    with pytest.raises(Problem, match="no row"):
        draw_bench(
            [{**json.loads(COMMITTED.read_text())["rows"][0], "knob": None}], tmp_path / "a.svg"
        )
