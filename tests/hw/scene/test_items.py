"""Items of a scene: what they stand on, and mistakes in their lists."""

from __future__ import annotations

from pathlib import Path

import pytest

from engine.files.finding import FileError
from hw.scene.items import PRESSED_IN, SURFACE, Graspable, surface_under
from hw.scene.scene import Scene, load_scene

SCENE = """
scene: mine
room: {{outer: [[0, 0], [10, 0], [10, 8], [0, 8]], columns: [[[4, 4], [5, 4], [5, 5], [4, 5]]]}}
robot: {{start: {{x: 2, y: 2}}}}
items:
  - {{name: cup, at: [4.5, 4.5, 80 cm], width: 6 cm, height: 10 cm, mass: 300 g}}
  - {0}
"""


def loaded(folder: Path, item: str) -> Scene:
    file = folder / "mine.yaml"
    file.write_text(SCENE.format(item))
    return load_scene(file)


def test_an_item_may_stand_on_a_table_that_is_a_column_or_on_the_floor(tmp_path: Path) -> None:
    cup, ball = loaded(tmp_path, "{name: ball, at: [1, 1, 0.1], width: 0.2, mass: 1}").items

    assert cup == Graspable("cup", (4.5, 4.5, 0.8), 0.06, 0.3, 0.1)
    assert cup.surface == pytest.approx(0.75)
    assert ball.surface == 0.0
    assert ball.half_height == 0.1


@pytest.mark.parametrize(
    ("item", "message"),
    [
        ("{name: cup, at: [1, 1, 1], width: 1 cm, mass: 1}", "cup is the name of another item"),
        ("{name: b, at: [1, 1, 0.1], width: 30 cm, mass: 1}", "its bottom is at -0.05 m"),
        ("{name: b, at: [11, 1, 1], width: 1 cm, mass: 1}", "(11, 1) is not in the room"),
        ("{name: b, at: [1, 1], width: 1 cm, mass: 1}", "needs 3 values, has 2"),
        ("{name: b, at: [1, 1, 1], width: 0, mass: 1}", "width: 0 is out of range"),
        ("{name: b, at: [1, 1, 1], width: 1 cm, weight: 1}", "items[1].weight: unknown key"),
    ],
)
def test_a_wrong_item_is_named_with_line_and_key(tmp_path: Path, item: str, message: str) -> None:
    with pytest.raises(FileError, match=r"mine\.yaml:\d+:\d+: ") as caught:
        loaded(tmp_path, item)
    assert message in str(caught.value)


def test_what_is_under_a_point_is_the_highest_surface_that_reaches_there() -> None:
    low = Graspable("low", (0.0, 0.0, 0.55), 0.1, 1.0)
    high = Graspable("high", (0.6, 0.0, 0.85), 0.1, 1.0)
    under = [
        surface_under((low, high), x, 0.0, z)
        for x, z in [(-SURFACE, 1.0), (0.3, 1.0), (0.3, 0.79), (0.3, 0.8 - 1.1 * PRESSED_IN)]
    ]

    assert under == pytest.approx([0.5, 0.8, 0.8, 0.5])
    assert surface_under((low, high), -1.1 * SURFACE, 0.0, 1.0) == 0.0
    assert surface_under((low, high), 0.0, 0.0, 0.5 - 1.1 * PRESSED_IN) == 0.0
