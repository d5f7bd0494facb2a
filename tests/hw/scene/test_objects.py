"""Objects of a scene: where they are when, and mistakes in their lists."""

from __future__ import annotations

from pathlib import Path

import pytest

from engine.files.finding import FileError
from hw.scene.objects import Thing
from hw.scene.scene import Scene, load_scene

SCENE = """
scene: mine
room: {{outer: [[0, 0], [10, 0], [10, 8], [0, 8]], columns: [[[4, 4], [5, 4], [5, 5], [4, 5]]]}}
robot: {{start: {{x: 2, y: 2}}}}
objects:
  - {0}
"""


def loaded(folder: Path, thing: str) -> Scene:
    file = folder / "mine.yaml"
    file.write_text(SCENE.format(thing))
    return load_scene(file)


def at(thing: Thing, seconds: float) -> tuple[float, float] | None:
    return thing.place(round(seconds * 1e9))


def test_a_chair_stands_from_when_it_appears_until_it_leaves(tmp_path: Path) -> None:
    scene = loaded(tmp_path, "{kind: chair, at: [3, 2], appears: 12 s, leaves: 1 min}")
    (chair,) = scene.objects
    assert [at(chair, t) for t in (0.0, 11.9, 12.0, 59.9, 60.0)] == [
        None, None, (3.0, 2.0), (3.0, 2.0), None,
    ]  # fmt: skip
    assert chair.body[:2] == (0.25, 0.9)


def test_a_person_walks_through_places_and_back_again() -> None:
    thing = Thing("person", (1.0, 1.0), walks=((3.0, 1.0), (3.0, 2.0)), speed=0.5, appears=2.0)
    assert [at(thing, t) for t in (1.0, 2.0, 4.0, 7.0, 8.0, 100.0)] == [
        None, (1.0, 1.0), (2.0, 1.0), (3.0, 1.5), (3.0, 2.0), (3.0, 2.0),
    ]  # fmt: skip
    back = Thing("person", (1.0, 1.0), walks=((3.0, 1.0),), speed=1.0, again=True)
    assert [at(back, t) for t in (0.5, 2.0, 3.0, 4.0, 5.0)] == [
        (1.5, 1.0), (3.0, 1.0), (2.0, 1.0), (1.0, 1.0), (2.0, 1.0),
    ]  # fmt: skip
    assert back.body[:2] == (0.5, 1.8)


@pytest.mark.parametrize(
    ("thing", "told"),
    [
        ("{kind: table, at: [3, 2]}", "kind"),
        ("{kind: chair}", "at"),
        ("{kind: chair, at: [4.5, 4.5]}", "not on the free floor"),
        ("{kind: person, at: [1, 1], walks: [[4.5, 4.5]]}", "not on the free floor"),
        ("{kind: chair, at: [3, 2], radius: 20 m}", "radius"),
        ("{kind: chair, at: [3, 2], appears: 5 s, leaves: 4 s}", "leaves"),
        ("{kind: person, at: [3, 2], again: true}", "no places to walk through"),
        ("{kind: person, at: [3, 2], walks: [[3, 2]]}", "twice in a row"),
        ("{kind: person, at: [3, 2], walk: [[3, 2]]}", "unknown key"),
    ],
)
def test_mistakes_are_told(tmp_path: Path, thing: str, told: str) -> None:
    with pytest.raises(FileError, match=told):
        loaded(tmp_path, thing)


def test_objects_are_part_of_what_a_scene_says(tmp_path: Path) -> None:
    hashes = {
        loaded(tmp_path, f"{{kind: chair, at: [{x}, 2]}}").sha256 for x in ("3", "3.0", "3.5")
    }
    assert len(hashes) == 2
