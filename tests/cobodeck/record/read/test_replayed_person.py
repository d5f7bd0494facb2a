"""The person of a record walks beside a simulated robot as they did, is seen and asks as then."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pytest

from cobodeck.__main__ import main
from cobodeck.record.read.reader import Group, Record, RecordedMessage
from cobodeck.record.read.replayed_person import past
from cobodeck.record.write.start import recorder
from cobodeck.run.simulation import RunResult, simulate
from cobodeck.setup.options import Options
from cobodeck.setup.setup import open_setup
from cobodeck.terminal.console import FAILED, OK, USAGE
from hw.geometry import Pose3
from hw.people.user import open_user
from hw.people.walking.person import Person
from hw.samples import Sample, UserPose

AT = datetime(2026, 1, 2, 3, 4, 5, tzinfo=UTC)
SECONDS = 36.0
"""In which demo's person asks and lets go, and is not shown the robot."""
SCRIPT = """user: someone
steps:
  - walk: {x: 4.0, y: 5.0}
  - lose_tracking: 1.5
  - walk: {x: 5.5, y: 5.0}
  - stand: 2
"""
ASKING = """user: someone
steps:
  - stand: 1.01 s
  - request: {hold: 3 s}
  - stand: 1 s
"""
ROOT = Path(__file__).parents[4]
ASKED = "signal/vr.haptic_request"


def recorded(path: Path, user: str, duration_s: float = SECONDS, **given: Any) -> RunResult:
    setup = open_setup(**given)
    options = Options(user=user, duration_s=duration_s)
    return simulate(setup, options, recorder=recorder(setup, options, path, AT, pytest.fail))


@pytest.fixture(scope="module")
def demo(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, RunResult]:
    path = tmp_path_factory.mktemp("cornering") / "demo.mcap"
    return path, recorded(path, "cornering")


class Changed(Record):
    """A record of which some topics have not flowed."""

    without: tuple[str, ...] = ()

    def groups(self) -> Iterator[Group]:
        for group in super().groups():
            left = tuple(told for told in group.told if told.topic not in self.without)
            yield replace(group, told=left)


def test_beside_the_same_robot_the_run_is_the_same(demo: Any, tmp_path: Path) -> None:
    path, first = demo
    again = recorded(tmp_path / "again.mcap", str(path)).figures

    assert first.figures["served"] == 1
    for name in ("trace_sha256", "motion_sha256", "requests", "served", "sim_s", "response_s"):
        assert again[name] == first.figures[name], name


@pytest.mark.parametrize("scene", ["lab_b", "hall"])
@pytest.mark.slow
def test_they_walk_ask_and_are_seen_alike_whatever_the_robot_does(
    demo: Any, tmp_path: Path, scene: str
) -> None:
    path = tmp_path / "other.mcap"
    recorded(path, str(demo[0]), scene=scene)
    then, now = past(Record(demo[0])), past(Record(path))

    assert now.asked == then.asked
    assert now.seen == then.seen
    assert now.ways == then.ways


@pytest.mark.slow
def test_what_tracking_missed_by_then_it_misses_by_again(demo: Any, tmp_path: Path) -> None:
    profile = tmp_path / "noisy.yaml"
    plant = "{tracking_delay: 50 ms, tracking_noise: 1 cm}"
    profile.write_text(f"profile: noisy\nbase: tuned\nplant: {plant}\n")
    recorded(tmp_path / "noisy.mcap", "cornering", 14.0, profile=str(profile))
    recorded(tmp_path / "again.mcap", str(tmp_path / "noisy.mcap"))
    then, now = (past(Record(tmp_path / f"{name}.mcap")) for name in ("noisy", "again"))
    off = [
        row.pose.body.distance_to(way.body) for row, way in zip(now.seen, now.ways, strict=False)
    ]

    assert now.seen == then.seen
    assert 0.005 < sum(off) / len(off) < 0.03
    assert now.ways == then.ways == past(Record(demo[0])).ways[: len(now.ways)]


@pytest.mark.slow
def test_requests_between_two_ticks_are_made_there_again(tmp_path: Path) -> None:
    profile = tmp_path / "late.yaml"
    profile.write_text("profile: late\nbase: tuned\nplant: {latency: 20 ms}\n")
    script = tmp_path / "someone.yaml"
    script.write_text(ASKING)
    recorded(tmp_path / "a.mcap", str(script), profile=str(profile))
    recorded(tmp_path / "b.mcap", str(tmp_path / "a.mcap"), profile=str(profile))
    then, now = (past(Record(tmp_path / f"{name}.mcap")) for name in "ab")

    assert now.asked == then.asked
    assert [row.at_ns * 30 % 10**9 > 3 * 10**8 for row in now.asked] == [False, True, True]


@pytest.mark.slow
def test_a_drop_out_stays_one(tmp_path: Path) -> None:
    script = tmp_path / "someone.yaml"
    script.write_text(SCRIPT)
    first = recorded(tmp_path / "a.mcap", str(script)).figures
    again = recorded(tmp_path / "b.mcap", str(tmp_path / "a.mcap")).figures

    assert first["dropouts"] == again["dropouts"]
    [only] = again["dropouts"]
    assert only["to_s"] - only["from_s"] == pytest.approx(1.5, abs=0.1)


class Handed:
    """A person whose hands and head are tracked, and swing."""

    def __init__(self, person: Person) -> None:
        self._person = person
        self.measured: Sample | None = None

    def __getattr__(self, name: str) -> Any:
        return getattr(self._person, name)

    def step(self, *given: Any) -> None:
        self._person.step(*given)
        self.measured = found = self._person.measured
        if found is None:
            return
        pose, swing = found.value, 0.1 * (found.stamp_ns % 10**9) * 1e-9
        assert isinstance(pose, UserPose)
        x, y = pose.body.x, pose.body.y
        hands = Pose3.from_yaw(x + swing, y + 0.3, 1.0, 0.1), Pose3(x - swing, y - 0.3, 1.2)
        head = Pose3(x, y, 1.7 - swing, 0.6, 0.0, 0.0, 0.8)
        self.measured = Sample(
            "user.pose", found.stamp_ns, UserPose(pose.body, pose.head_yaw, head, *hands)
        )


def test_head_and_hands_are_seen_exactly_as_they_were(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(
        "cobodeck.run.build_run.open_user", lambda *given: Handed(open_user(*given))
    )
    recorded(tmp_path / "a.mcap", "cornering", 4.0)
    recorded(tmp_path / "b.mcap", str(tmp_path / "a.mcap"), 4.0)
    then, now = past(Record(tmp_path / "a.mcap")), past(Record(tmp_path / "b.mcap"))

    assert all(row.pose.left_hand != row.pose.right_hand for row in then.seen)
    assert len({row.pose.head for row in then.seen}) > 100
    assert now.seen == then.seen


def test_without_the_truth_they_walk_through_what_was_measured(demo: Any) -> None:
    record = Changed(demo[0])
    record.without = ("truth",)
    true, measured = past(Record(demo[0])), past(record)

    assert [row[:2] for row in measured.ways] == [row[:2] for row in true.ways]
    assert measured.asked == true.asked
    fast = [row.speed for row in true.ways]
    assert max(row.speed for row in measured.ways) == pytest.approx(max(fast), rel=0.05)


def test_samples_that_the_chart_had_no_use_for_come_from_the_truth(demo: Any) -> None:
    record = Changed(demo[0])
    record.without = ("signal/user.pose", "signal/vr.haptic_request")
    record.header = {**record.header, "flowing": []}
    flowed, true = past(Record(demo[0])), past(record)

    assert true.seen == flowed.seen
    assert [row for row in flowed.asked if row.at_ns] == list(true.asked)


def test_a_record_that_breaks_off_has_a_person_up_to_there(demo: Any, tmp_path: Path) -> None:
    path = tmp_path / "cut.mcap.part"
    path.write_bytes(demo[0].read_bytes()[: demo[0].stat().st_size // 2])
    whole, cut = past(Record(demo[0])), past(Record(path))

    assert 5 * 10**9 < cut.until_ns < whole.until_ns - 5 * 10**9
    assert cut.ways == whole.ways[: len(cut.ways)]
    result = recorded(tmp_path / "beside.mcap", str(path))
    assert result.figures["sim_s"] == pytest.approx(cut.until_ns * 1e-9)


def test_the_record_of_the_run_beside_them_has_the_hash_of_theirs(
    demo: Any, tmp_path: Path
) -> None:
    recorded(tmp_path / "again.mcap", str(demo[0]), 1.0)
    record = Record(tmp_path / "again.mcap")

    assert record.header["files"][str(demo[0])] == hashlib.sha256(demo[0].read_bytes()).hexdigest()
    assert str(demo[0]) not in record.attachments


@pytest.mark.parametrize(
    ("behind", "given", "told"),
    [
        ("", ("--requests", "3"), "leave out --requests"),
        ("", ("--stretch", "3"), "leave out --stretch"),
        ("", ("--heading", "causal"), "leave out --heading"),
        ("@1,2,0", (), "leave out @1,2,0"),
        ("#2", (), "leave out #2"),
    ],
)
def test_what_they_did_not_do_cannot_be_asked_of_them(
    demo: Any, capsys: pytest.CaptureFixture[str], behind: str, given: tuple[str, ...], told: str
) -> None:
    assert main(["simulate", "--user", f"{demo[0]}{behind}", *given]) == USAGE
    assert capsys.readouterr().err.rstrip().endswith(told)


def test_a_record_without_a_person_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["simulate", "--tier", "0", "--duration", "2", "--record", "a.mcap"]) == OK
    capsys.readouterr()

    assert main(["simulate", "--user", "a.mcap"]) == FAILED
    assert "a.mcap: has no person in it; take the record" in capsys.readouterr().err


@pytest.mark.slow
def test_the_mock_and_pictures_take_them_too(
    demo: Any, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    picture = ["render", "--scene", "lab_a", "--user", str(demo[0]), "--at", "13", "-o", "x.svg"]
    mock = ["run", "cobodeck", "--robot", "mock", "--fast", "--duration", "14", "--json"]

    assert main(picture) == OK
    assert b"<svg" in Path("x.svg").read_bytes()
    capsys.readouterr()
    assert main([*mock, "--user", str(demo[0])]) == OK
    assert json.loads(capsys.readouterr().out)["walking_s"] > 0.0


class Misheard(Record):
    """A record in which requests were told of 3 mm beside where they were meant."""

    def groups(self) -> Iterator[Group]:
        for group in super().groups():
            yield replace(group, told=tuple(map(self._beside, group.told)))

    def _beside(self, told: RecordedMessage) -> RecordedMessage:
        value = json.loads(told.data)["value"] if told.topic == ASKED else None
        if value is None:
            return told
        value["Pose3"][0] += 0.003
        stamp = json.loads(told.data)["stamp"]
        return told._replace(data=json.dumps({"stamp": stamp, "value": value}).encode())


def test_they_ask_once_where_they_were_understood_to_ask(demo: Any) -> None:
    true, told = past(Record(demo[0])).asked, past(Misheard(demo[0])).asked

    assert [one.at_ns for one in told] == [one.at_ns for one in true]
    moved = [(a.deep, b.deep) for a, b in zip(true, told, strict=True)]
    assert all(b is None if a is None else b.x == a.x + 0.003 for a, b in moved)
    assert any(a is not None for a, _ in moved)
