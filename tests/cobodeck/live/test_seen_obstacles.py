"""What is in a room and on no map is in the costmap of pages once scanners have shown it."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from cobodeck.live.model import RunModel
from cobodeck.live.sources.seen_room import SeenRoom
from cobodeck.setup.options import Options
from cobodeck.setup.setup import open_setup
from hw.scene.objects import Thing
from tests.cobodeck.live.folding import Folding, recorded, study

CHAIR = (6.4, 4.2)
"""In the study, in sight of the robot."""
NEAR_M = 0.4


def is_shown(room: SeenRoom, model: RunModel) -> bool:
    """Whether a page that shows the costmap has something impassable where the chair is."""
    for shape in room.shapes(room.moment(model), {"costmap"}):
        places = zip(shape["p"][::2], shape["p"][1::2], strict=True)
        costs = shape.get("w") or [1.0] * (len(shape["p"]) // 2)
        if any(
            c == 1.0 and math.dist(at, CHAIR) < NEAR_M for at, c in zip(places, costs, strict=True)
        ):
            return True
    return False


@pytest.fixture(scope="module")
def watched() -> Folding:
    setup, folding = study(), Folding()
    assert setup.place is not None
    assert setup.scene is not None
    scene = replace(setup.scene, objects=(Thing("chair", CHAIR),))
    place = setup.place._replace(scene=scene)
    loop, _ = recorded(replace(setup, place=place), Options(tier=2, seed=3), folding)
    while loop.now_ns < 2_000_000_000:
        loop.tick()
    loop.wired.run.close()
    return folding


@pytest.mark.slow
@pytest.mark.parametrize("planner", ["exact", "theta_star"])
def test_an_object_that_scanners_have_shown_is_in_the_costmap(
    watched: Folding, planner: str
) -> None:
    sets = [f"navigation.chase.planner={planner}"]
    room = SeenRoom(open_setup(scene="study", sets=sets))
    assert not is_shown(room, watched.model)
    for group in watched.groups:
        room.obstacles.add(group)
    assert is_shown(room, watched.model)

    room.obstacles.restart()
    assert not is_shown(room, watched.model)


@pytest.mark.slow
def test_the_newest_scan_of_each_scanner_is_drawn(watched: Folding) -> None:
    model, sensors = watched.model, list[str]()
    for scan in model.scans():
        sensors.append(scan.sensor)
    assert len(set(sensors)) == len(sensors) == 2
    model.at_ns += 3_000_000_000
    assert list(model.scans()) == []
