"""Zones of a scene: kept out of, or driven through slowly."""

from __future__ import annotations

import math

import pytest

from engine.files.declared.item import parse_yaml
from engine.files.finding import FileError
from hw.scene.scene import Scene, scene_from
from hw.scene.zones import SpeedZone, Zones

SQUARE = ((1.0, 1.0), (3.0, 1.0), (3.0, 3.0), (1.0, 3.0))
TEXT = """
scene: zoned
room: {outer: [[0, 0], [9, 0], [9, 6], [0, 6]]}
robot: {start: {x: 5.0, y: 5.0}}
zones:
  keepout: [[[1, 1], [3, 1], [3, 3], [1, 3]]]
  speed: [{area: [[6, 0], [9, 0], [9, 3], [6, 3]], limit: 50 cm/s}]
"""


def read(text: str) -> Scene:
    return parse_yaml(text, "zoned.yaml", scene_from)


def test_a_scene_names_its_zones() -> None:
    zones = read(TEXT).zones
    assert zones.keepout == (SQUARE,)
    assert [zone.limit for zone in zones.speed] == [0.5]
    assert zones.keeps_out(2.0, 2.0)
    assert not zones.keeps_out(3.1, 2.0)


@pytest.mark.parametrize(
    ("was", "now", "told"),
    [
        ("x: 5.0, y: 5.0", "x: 2.0, y: 2.0", "is in a zone that the robot keeps out of"),
        ("50 cm/s", "0 m/s", "limit"),
        ("50 cm/s", "50 cm", "limit"),
        ("[1, 3]]]", "[3, 1]]]", "same corner twice"),
        ("keepout:", "keep_out:", "keepout"),
    ],
)
def test_wrong_zones_are_told_where_they_stand(was: str, now: str, told: str) -> None:
    with pytest.raises(FileError, match=r"zoned\.yaml") as refused:
        read(TEXT.replace(was, now))
    assert told in str(refused.value)


def test_a_robot_that_brakes_as_hard_keeps_the_limit_in_the_zone() -> None:
    zone = SpeedZone(SQUARE, 0.5)
    assert zone.speed_at(2.0, 2.0, 1.0) == 0.5
    x, speed = -3.0, zone.speed_at(-3.0, 2.0, 1.0)
    assert speed > 2.5
    while x < 1.0:
        x += 0.001
        speed = math.sqrt(max(0.0, speed * speed - 2.0 * 0.001))
        assert speed == pytest.approx(zone.speed_at(min(x, 1.0), 2.0, 1.0), abs=4e-3)


def test_the_slowest_of_all_zones_counts_and_without_any_nothing_does() -> None:
    far = tuple((x, y + 1.5) for x, y in SQUARE)
    zones = Zones(speed=(SpeedZone(SQUARE, 0.8), SpeedZone(far, 0.5)))
    assert zones.speed_at(2.0, 2.8, 1.0) == 0.5
    assert zones.speed_at(2.0, 2.4, 1.0) == pytest.approx(math.sqrt(0.25 + 0.2))
    assert Zones().speed_at(2.0, 2.0, 1.0) == math.inf
