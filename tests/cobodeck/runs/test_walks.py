"""Real walks: the robot keeps near, touches nobody, and notices when tracking is lost."""

import json
from pathlib import Path
from typing import Any

import pytest

from cobodeck.__main__ import main
from cobodeck.terminal.console import OK

WALKING = Path(__file__).resolve().parents[4] / "shared" / "data" / "walking"
ROOM = WALKING / "tum_room3.txt"
PEOPLE = f"{WALKING / 'juelich_people.csv'}#9"

pytestmark = pytest.mark.skipif(
    not WALKING.is_dir(), reason="no recorded walks beside the checkout"
)


@pytest.fixture
def walked(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> Any:
    monkeypatch.chdir(tmp_path)

    def walk(user: object, *arguments: str) -> dict[str, Any]:
        command = ["simulate", "--user", str(user), *arguments, "--json"]
        assert main(command) == OK
        found: dict[str, Any] = json.loads(capsys.readouterr().out)
        return found

    return walk


@pytest.fixture(scope="module")
def walked_once() -> dict[Any, dict[str, Any]]:
    """Figures of walks that more than one test looks at, by user and arguments."""
    return {}


WALKS: list[tuple[object, tuple[str, ...]]] = [
    (ROOM, ("--scene", "lab_a")),
    (ROOM, ("--scene", "hall", "--stretch", "8")),
    (PEOPLE, ("--scene", "lab_a")),
]


@pytest.mark.requirement(24, 91)
@pytest.mark.parametrize(("user", "arguments"), WALKS)
@pytest.mark.few(1)
def test_the_base_keeps_near_a_walking_person_and_touches_nobody(
    walked: Any, walked_once: Any, user: object, arguments: tuple[str, ...]
) -> None:
    """Who is lost while they walk at the robot may touch it: it stands, as nobody is tracked."""
    figures = walked_once[user, arguments] = walked(user, *arguments)

    assert figures["contacts_by_robot"] == 0
    assert figures["contacts"] <= figures["faults"]
    assert figures["wall_hits"] == 0
    assert figures["beside_share"] >= 0.8


@pytest.mark.slow
def test_a_base_that_stands_would_be_noticed(walked: Any) -> None:
    figures = walked(ROOM, "--scene", "hall", "--stretch", "8", "--frozen-base")

    assert figures["distance_m"] == 0.0
    assert figures["beside_share"] < 0.8


def test_drop_outs_of_tracking_are_noticed_and_named(walked: Any, walked_once: Any) -> None:
    figures = walked_once.get(WALKS[0]) or walked(ROOM, *WALKS[0][1])

    assert len(figures["dropouts"]) > 0
    assert "tracking of the user is lost" in figures["fault_names"]
    assert figures["faults"] == sum(figures["fault_names"].values())


@pytest.mark.requirement(67)
@pytest.mark.slow
def test_a_walk_gives_the_same_trace_twice_and_without_skipping(walked: Any) -> None:
    hashes = {walked(PEOPLE, *more)["trace_sha256"] for more in ((), (), ("--no-skip",))}

    assert len(hashes) == 1
