"""Beside a dummy: a connection's own person is left out, and the recorded one is served (R56)."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from cobodeck.__main__ import main
from cobodeck.real.dummy_connection import with_dummy
from cobodeck.real.release_stages import WORDS
from cobodeck.record.read.reader import Record
from cobodeck.record.read.replayed_person import past
from cobodeck.terminal.console import OK, REFUSED, USAGE
from hw.connection.connection import Connection, ServedPart
from hw.geometry import Pose2
from hw.people.live import LivePerson
from tests.repeats import long_form

SOMEBODY = LivePerson(Pose2(1.0, 1.0))


def served(kind: str, **arguments: Any) -> ServedPart:
    return ServedPart("tests_of_dummy", kind, arguments, "c.yaml:1:1")


@pytest.fixture
def drivers(monkeypatch: pytest.MonkeyPatch) -> None:
    import sys
    from types import SimpleNamespace

    class Trackers:
        signals = ("user.pose",)

    class Vr:
        signals = ("vr.haptic_request", "vr.release")

    class Rover:
        signals = ("rover.tracker",)

    class Arm:
        signals = ("arm.joints",)

    kinds = {kind.__name__: kind for kind in (Trackers, Vr, Rover, Arm)}
    monkeypatch.setitem(sys.modules, "tests_of_dummy", SimpleNamespace(**kinds))  # type: ignore[arg-type]


LINKS = {
    "chain": served("Chain", port=1),
    "ur": served("Arm", tells="chain"),
    "unity": served("Vr", port=2, tells="chain"),
}
VR = {
    "people": served("Trackers", link="unity"),
    "vr": served("Vr", link="unity"),
    "rover_trackers": served("Rover", link="unity"),
    "arm": served("Arm", link="ur"),
}


@pytest.mark.requirement(56)
def test_whoever_tells_of_a_person_is_left_out_and_the_link_tells_the_chain_by_the_dummy(
    drivers: None,
) -> None:
    found = with_dummy(Connection("c", "", "r", VR, LINKS), SOMEBODY)

    assert {name: one.arguments["link"] for name, one in found.parts.items()} == {
        "trackers": "dummy", "vr": "dummy", "rover_trackers": "unity", "arm": "ur",
    }  # fmt: skip
    tells = {name: one.arguments.get("tells") for name, one in found.links.items()}
    assert tells == {"chain": None, "ur": "chain", "unity": "dummy", "dummy": "chain"}
    order = list(found.links)
    assert order.index("chain") < order.index("dummy") < order.index("unity")
    assert found.links["dummy"].arguments["person"] is SOMEBODY


def test_without_a_chain_of_its_own_the_dummy_tells_the_engine_alone(drivers: None) -> None:
    found = with_dummy(Connection("c", "", "r", {"arm": served("Arm")}), SOMEBODY)

    assert set(found.parts) == {"arm", "trackers", "vr"}
    assert found.links["dummy"].arguments == {"person": SOMEBODY}


CHART = """chart: asked
outcomes: [asked, failed]
any:
  request: {watch: HapticRequest, next: {requested: .asked}}
  lost: {watch: UserLost, next: {lost: .failed}}
"""
ROBOT = """connection: real_one
model: rbkairos_ur10
real: true
scene: study
parts:
  lidar: {driver: "hw.connection.connection:Connection"}
"""


@pytest.fixture
def folder(folder: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(
        "hw.connection.connection.Connection.signals", ("base.scan",), raising=False
    )
    (folder / "asked.yaml").write_text(CHART)
    (folder / "real_one.yaml").write_text(ROBOT)
    (folder / "person.yaml").write_text(
        "user: person\nstart: {x: 6, y: 5}\nsteps: [{stand: 0.5}, {request: {hold: 6}}]\n"
    )
    (folder / "seen.yaml").write_text(
        CHART.replace("watch: HapticRequest", "watch: UserReady")
        .replace("requested", "restarted")
        .replace("chart: asked", "chart: seen")
    )
    person = ["--user", "person.yaml", "--record", "person.mcap", "--no-project"]
    assert main(["simulate", "seen.yaml", "--scene", "study", *person, "--duration", "3"]) == OK
    return folder


@pytest.mark.requirement(53, 56)
def test_a_recorded_person_is_served_by_real_parts_in_real_time_and_it_is_on_record(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    capsys.readouterr()
    call = ["run", "asked.yaml", "--robot", "real_one.yaml", "--no-project", "--json"]
    call += ["--duration", "30", "--although", WORDS["simulated"]]

    assert main([*call, "--user", "person.mcap", "--record", "dummy.mcap"]) == OK
    out = capsys.readouterr()
    figures = json.loads(out.out)

    assert figures["outcome"] == "asked"
    then, now = (past(Record(Path(name))) for name in ("person.mcap", "dummy.mcap"))
    assert [asked.deep for asked in now.asked] == [asked.deep for asked in then.asked]
    assert now.seen[-1].pose == then.seen[0].pose
    assert "nobody may be in the room" in out.err
    assert "although it was not simulated" in out.err
    assert "never run on the real devices" in out.err
    header = Record(Path("dummy.mcap")).header
    assert header["plant"] == header["connection"]["name"] == "real_one"
    assert header["connection"]["real"]
    assert set(header["parts"]) >= {"trackers", "vr"}
    assert main(["replay", "dummy.mcap", "--check", "--no-project"]) == OK
    capsys.readouterr()

    assert main([*call, "--passed", "dummy.mcap"]) == REFUSED
    told = capsys.readouterr().err
    assert "it was not tried with a dummy: dummy.mcap: " in told
    assert "served, 1 are wanted" in told
    assert "--user out/simulated.mcap" in told


def test_a_person_who_is_no_record_cannot_be_played_beside_real_parts(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = (folder / "real_one.yaml").read_text().replace("real: true", "real: false")
    (folder / "own.yaml").write_text(text)

    call = ["run", "asked.yaml", "--robot", "own.yaml", "--no-project", "--user", "cornering"]

    assert main(call) == USAGE
    assert "or a dummy: --user X.mcap, a record" in capsys.readouterr().err


@long_form
@pytest.mark.slow
@pytest.mark.requirement(56)
def test_beside_the_fakes_the_whole_robot_serves_a_person_who_is_not_there(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    person = ["--user", "brief", "--requests", "1", "--record", "person.mcap"]
    assert main(["simulate", "--scene", "lab_a", *person]) == OK
    capsys.readouterr()

    call = ["run", "cobodeck", "--robot", "fakes", "--user", "person.mcap", "--json"]
    assert main([*call, "--record", "dummy.mcap"]) == OK
    figures = json.loads(capsys.readouterr().out)

    assert figures["served"] == figures["requests"] == 1
    assert figures["measured"]  # the world of the fakes has nobody in it
    assert figures["person_watched"]
    assert figures["errors"] == []
    assert figures["localization"]["rmse_m"] < 0.1
    assert main(["replay", "dummy.mcap", "--check"]) == OK
