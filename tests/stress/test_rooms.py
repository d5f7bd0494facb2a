"""Rooms of 18 km, far from the origin, and beyond: they work, or are refused in one sentence."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from cobodeck.__main__ import main
from cobodeck.terminal import FAILED, OK
from hw.scene.room import Room
from states.floors.floor_plan import RoomFloor
from states.floors.usable_space import without_haptic_pose
from states.maps.cells import MOST_CELLS, grid_over
from tests.stress.bodies import ROOM

ROOM_FILE = """\
scene: {name}
room: {{outer: [[{x}, {y}], [{far}, {y}], [{far}, {top}], [{x}, {top}]]}}
robot: {{start: {{x: {cx}, y: {cy}, yaw: 0}}}}
user: {{source: asks.yaml, start: {{x: {ux}, y: {cy}, yaw: 180 deg}}}}
"""
USER_FILE = "user: asks\nsteps:\n  - stand: 1\n  - request: {hold: 20}\n  - stand: 1\n"


def room(folder: Path, x: float, y: float, width: float, height: float) -> Path:
    """A scene of a rectangle, robot and person in its middle."""
    file = folder / "large.yaml"
    (folder / "asks.yaml").write_text(USER_FILE)
    cx, cy = x + 0.5 * width, y + 0.5 * height
    numbers = {"x": x, "y": y, "far": x + width, "top": y + height, "cx": cx, "cy": cy}
    file.write_text(ROOM_FILE.format(name="large", ux=cx + 4.0, **numbers))
    return file


WIDE = (-9e3, -9e3, 18e3, 18e3)
LONG = (-9e3, 0.0, 18e3, 8.0)
RUN = ("simulate", "cobodeck", "--requests", "1", "--seed", "3", "--duration", "40", "--json")


@pytest.mark.parametrize("size", [WIDE, pytest.param(LONG, marks=pytest.mark.slow)])
def test_a_person_is_served_in_a_room_of_18_km(
    size: tuple[float, float, float, float], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = room(tmp_path, *size)
    assert main(["validate", str(file)]) == OK
    capsys.readouterr()
    assert main([*RUN, "--scene", str(file)]) == OK

    told = json.loads(capsys.readouterr().out)
    assert told["served"] == 1
    assert told["contacts_by_robot"] == 0


@pytest.mark.slow
@pytest.mark.parametrize("size", [WIDE, LONG])
def test_its_space_is_measured_and_its_picture_drawn(
    size: tuple[float, float, float, float], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = room(tmp_path, *size)
    assert main(["space", str(file), "--json"]) == OK
    told = json.loads(capsys.readouterr().out)
    assert told["free_m2"] == pytest.approx(size[2] * size[3], rel=1e-9)
    assert told["usable_m2"] == pytest.approx((size[2] - 2.0) * (size[3] - 2.0), rel=1e-6)
    picture = tmp_path / "large.png"
    assert main(["render", "--scene", str(file), "-o", str(picture)]) == OK
    assert picture.stat().st_size > 1000


@pytest.mark.parametrize(
    "more", [("--tier", "2"), ("--set", "navigation.chase.planner=navfn")], ids=["tier", "planner"]
)
def test_what_needs_costmaps_refuses_it_and_says_what_would_do(
    more: tuple[str, ...], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([*RUN, "--scene", str(room(tmp_path, *WIDE)), *more]) == FAILED

    told = capsys.readouterr().err
    assert "scene large: the room is too large for costmaps: 18000 x 18000 m" in told
    assert "tier 1 with the planner exact" in told
    assert "Traceback" not in told


def test_a_room_a_thousand_kilometres_off_is_refused_where_it_says_so(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["validate", str(room(tmp_path, 1e6, 1e6, 10.0, 10.0))]) == FAILED

    told = capsys.readouterr().out
    assert "large.yaml:2:" in told
    assert "is out of range, -1e+04 to 1e+04 m is allowed" in told


def test_a_grid_has_as_many_cells_as_fit_and_not_one_more() -> None:
    side = 0.05 * MOST_CELLS**0.5
    square = [(0.0, 0.0), (side - 0.1, 0.0), (side - 0.1, side - 0.1), (0.0, side - 0.1)]
    assert grid_over([square], 0.05).rows > 7000
    with pytest.raises(ValueError, match=r"cells of 0\.05 m; 5e\+07 are possible"):
        grid_over([square], 0.05, margin=1.0)


def test_a_floor_is_looked_at_more_coarsely_only_where_it_is_large() -> None:
    poses = [(1.85, 0.0), (1.75, 0.5)]
    small = without_haptic_pose(RoomFloor(ROOM), poses, 1.0, headings=4)
    large = without_haptic_pose(
        RoomFloor(Room(((0, 0), (900, 0), (900, 800), (0, 800)))), poses, 1.0, headings=4
    )

    assert small.step == 0.25
    assert 4.0 < large.step < 4.5
    assert len(large.x) <= 40_000
    assert np.isfinite(large.share).all()
