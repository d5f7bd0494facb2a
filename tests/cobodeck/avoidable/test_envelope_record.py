"""Failed Escapes and contacts of a record: which could have been avoided, and until when."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cobodeck.__main__ import main
from cobodeck.avoidable import escape_report as told, judged
from cobodeck.avoidable.escape_report import JudgedRun, contacts_avoidable, judged_run, text
from cobodeck.avoidable.futures import sign_at, unwarned, walking_since
from cobodeck.avoidable.judged import decision_before, gap_between, judge, question_at
from cobodeck.avoidable.motion_search import RobotLimits
from cobodeck.avoidable.recorded_escapes import (
    EscapeProfile,
    EscapeVisit,
    RecordedRun,
    edges,
    read_run,
)
from cobodeck.pictures import envelope_picture as picture
from cobodeck.pictures.envelope_picture import draw_envelope
from cobodeck.pictures.judged_picture import events_of
from cobodeck.record.read.reader import Group, Record
from cobodeck.terminal.console import OK, USAGE
from engine.files.finding import FileError
from tests.cobodeck.record.partial import WithoutTruth

HALL = ((-10.0, -10.0), (10.0, -10.0), (10.0, 10.0), (-10.0, 10.0))
LIMITS = RobotLimits(1.0, 3.0, 2.5, 0.565, 0.455)
HZ = 30
TIGHT = """
scene: tight
room: {outer: [[0, 0], [7, 0], [7, 7], [0, 7]]}
robot: {file: rbkairos_ur10, start: {x: 1.0, y: 1.0, yaw: 0.785}}
"""


def walked(
    start_x: float, sign_s: float | None = None, until_s: float = 8.0, **more: Any
) -> RecordedRun:
    """Someone stands for a second, then walks at 1.5 m/s along x at a robot that stands at 0.

    They stop 0.3 s after the sign, at once.
    """
    times = np.arange(round(until_s * HZ) + 1) / HZ
    gone = 1.5 * np.maximum(0.0, times - 1.0)
    shown = np.zeros(len(times), dtype=np.bool_)
    if sign_s is not None:
        shown = times >= sign_s - 1e-9
        gone = np.minimum(gone, 1.5 * max(0.0, sign_s + 0.3 - 1.0))
    person = np.column_stack([start_x + gone, 0.0 * gone, 0.0 * gone])
    given = {
        "name": "made up",
        "profile": EscapeProfile("tuned", 1.0, 2.5, 1.5, 0.15),
        "limits": LIMITS,
        "rings": (HALL,),
        "walls": edges((HALL,)),
        "times": times,
        "robot": np.zeros((len(times), 3)),
        "person": person,
        "shown": shown,
        "seen": times,
        "escapes": (),
        "contacts": (),
    }
    return RecordedRun(**given | more)


def test_an_unwarned_person_goes_straight_on_to_the_wall() -> None:
    run = walked(-3.0, sign_s=1.6)

    walk = unwarned(run, 1.0, 5.0)

    times = np.array([1.0, 1.6, 2.6, 30.0])
    assert walk.at(times)[:, 0] == pytest.approx([-3.0, -2.1, -0.6, 9.5], abs=0.03)
    assert run.way.at(times)[-1, 0] == pytest.approx(-1.65)


def test_without_a_sign_the_unwarned_person_is_the_recorded_one() -> None:
    run = walked(-3.0, sign_s=6.0)

    assert (unwarned(run, 1.0, 4.0).places == run.person).all()
    assert sign_at(run, 1.0, 4.0) is None
    assert sign_at(run, 1.0, 6.5) == pytest.approx(6.0)


def test_a_sign_that_is_there_already_counts_until_it_was_obeyed() -> None:
    run = walked(-3.0, sign_s=1.6)

    assert sign_at(run, 2.0, 5.0) == pytest.approx(1.6)
    assert unwarned(run, 2.0, 5.0).at(np.array([3.0]))[0, 0] == pytest.approx(-1.65 + 1.5, abs=0.1)
    assert sign_at(run, 3.5, 6.0) is None


def test_a_failed_escape_is_judged_without_the_sign() -> None:
    """Entered 1.4 m before a touch, 1.3 s before it: too late, but a second earlier it was not."""
    late = EscapeVisit(2.0, 2.0, "failed")
    (event,) = judge(walked(-3.4, sign_s=2.0, escapes=(late,)))

    assert (event.what, event.future) == ("failed Escape", "unwarned")
    assert not event.avoidable
    assert event.best is not None
    assert event.best.gap < 0.0
    assert event.other is not None
    assert event.other.gap > 0.2
    assert event.real_gap == pytest.approx(3.4 - 1.5 * 1.3 - 0.565 - 0.5, abs=0.02)
    assert event.latest_s is not None
    assert -1.0 <= event.latest_s - event.decided_s < 0.0


@pytest.mark.requirement(149)
@pytest.mark.slow
def test_a_robot_that_has_lost_the_person_can_only_brake(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(judged, "EVERY_S", 0.5)  # when it was too late is not asked here
    run = walked(-3.0, contacts=((2.8, "person"),))
    times = run.times
    lost = walked(-3.0, contacts=((2.8, "person"),), seen=np.minimum(times, 1.2))
    found_again = walked(-3.0, contacts=((2.8, "person"),),
                         seen=np.where(times < 1.6, np.minimum(times, 1.2), times))  # fmt: skip

    gaps = [next(judge(r)).best.gap for r in (run, found_again, lost)]

    assert lost.blind_between(1.0, 9.0) == ((pytest.approx(1.2 + 8 / 30), math.inf),)
    assert found_again.blind_between(1.0, 9.0) == (
        (pytest.approx(1.2 + 8 / 30), pytest.approx(1.6)),
    )
    assert gaps[0] > gaps[1] > gaps[2]
    assert gaps[2] < 0.0  # it had 0.45 s to get out of the way


def test_a_failed_escape_in_time_was_avoidable_at_its_end_too() -> None:
    early = EscapeVisit(1.2, 1.6, "failed")
    (event,) = judge(walked(-3.9, sign_s=1.6, escapes=(EscapeVisit(0.2, 0.4, "safe"), early)))

    assert event.avoidable
    assert (event.decided_s, event.at_s) == (1.2, 1.6)
    assert event.latest_s == pytest.approx(1.6)


def test_a_contact_is_judged_by_what_the_person_did() -> None:
    contact_s = 1.0 + (2.9 - 1.065) / 1.5
    (event,) = judge(walked(-2.9, contacts=((contact_s, "person"),)))

    assert (event.what, event.future) == ("contact by the person", "recorded")
    assert event.decided_s == pytest.approx(1.0, abs=0.05)  # they began to walk
    assert event.avoidable
    assert event.real_gap == pytest.approx(-0.5)
    assert event.latest_s is not None
    assert event.decided_s < event.latest_s < contact_s - 0.5


def test_a_contact_belongs_to_the_last_escape_that_was_not_over() -> None:
    before = EscapeVisit(0.2, 0.6, "failed")
    during = EscapeVisit(1.3, 1.5, "failed")
    over = walked(-2.9, escapes=(before,))
    run = walked(-2.9, escapes=(before, during))

    assert decision_before(run, 2.2) == 1.3
    assert decision_before(over, 2.2) == pytest.approx(walking_since(over, 2.2))
    assert walking_since(over, 2.2) == pytest.approx(1.0, abs=0.05)


@pytest.mark.parametrize(("start_s", "horizon_s"), [(0.5, 5.5), (4.0, 3.0), (5.9, 3.0)])
def test_what_could_be_done_is_looked_at_until_the_event_is_over(
    start_s: float, horizon_s: float
) -> None:
    """A second after an event at 5 s, and 3 s at least."""
    found = question_at(walked(-3.0), 5.0, start_s, "recorded")

    assert (found.start_s, found.horizon_s) == (start_s, horizon_s)


def test_the_gap_between_two_ticks_counts() -> None:
    """Robot and person pass each other within one tick."""
    run = walked(-3.0)
    fast = np.column_stack([np.linspace(-900.0, 900.0, len(run.times)), 0.0 * run.times])
    crossing = np.column_stack([fast, 0.0 * run.times])

    swept = RecordedRun(**{**{n: getattr(run, n) for n in vars(run)}, "person": crossing})

    assert gap_between(swept, 0.0, 8.0) == pytest.approx(-0.5)


# a run on record


@pytest.fixture(scope="module")
def record(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Someone who walks at the robot again and again, in a small room."""
    folder: Path = tmp_path_factory.mktemp("runs")
    (folder / "tight.yaml").write_text(TIGHT)
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        walks = ["--user", "random:pursuer", "--seed", "3", "--duration", "40"]
        soon = ["--set", "charts.escape.within=0.2"]  # so that Escapes fail
        assert (
            main(["simulate", "--scene", "tight.yaml", *walks, *soon, "--record", "x.mcap"]) == OK
        )
    return folder / "x.mcap"


def test_what_is_read_is_what_the_figures_tell(record: Path) -> None:
    run, figures = read_run(Record(record)), Record(record).figures()

    assert figures is not None
    failed = [escape for escape in run.escapes if escape.outcome == "failed"]
    assert len(run.escapes) == figures["escapes"]
    assert len(failed) == figures["escape_failures"] > 2
    listed = [contact for contact in figures["contact_list"] if contact["part"] == "base"]
    assert run.contacts == tuple((c["at_s"], c["by"]) for c in listed)
    assert run.contacts
    assert gap_between(run, 0.0, 1e9) == pytest.approx(figures["min_gap_m"], abs=1e-3)
    assert run.limits == LIMITS
    assert run.rings == (((0.0, 0.0), (7.0, 0.0), (7.0, 7.0), (0.0, 7.0)),)


class LookingLeft(Record):
    """The same run, the person's head turned by 0.5 rad."""

    def groups(self) -> Iterator[Group]:
        for group in super().groups():
            turned = (
                t._replace(data=t.data.replace(b'"head_turn":0.0', b'"head_turn":0.5'))
                for t in group.told
            )
            yield Group(group.ticked, tuple(turned), group.closing)


def test_the_direction_of_view_is_that_of_the_head(record: Path) -> None:
    straight_on, left = read_run(Record(record)), read_run(LookingLeft(record))

    assert left.person[:, 2] - straight_on.person[:, 2] == pytest.approx(0.5)


def test_a_record_without_true_poses_is_refused(record: Path) -> None:
    with pytest.raises(FileError, match=r"truly were.*simulation"):
        read_run(WithoutTruth(record))


def test_a_record_that_breaks_off_is_judged_as_far_as_it_goes(
    record: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(told, "judge", lambda _: ())
    part = tmp_path / "x.mcap.part"
    part.write_bytes(record.read_bytes()[: record.stat().st_size * 3 // 4])

    found = judged_run(part)

    assert found.broken is not None
    assert found.broken in text([found])
    assert 1.0 < found.run.times[-1] < read_run(Record(record)).times[-1]


def test_a_text_that_was_altered_is_told(record: Path) -> None:
    """Whoever alters a record and its checksums as well gets no traceback either."""
    for name, what in (
        ("charts/escape.yaml", "the text of a chart"),
        ("hw/robots/rbkairos_ur10.yaml", "what limits an Escape"),
    ):
        altered = Record(record)
        altered.attachments[name] = b"\xff"
        with pytest.raises(FileError, match=f"{what} cannot be used"):
            read_run(altered)


@pytest.fixture(scope="module")
def found(record: Path) -> JudgedRun:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(judged, "EVERY_S", 0.5)  # five times faster
        return judged_run(record)


def test_what_the_robot_did_is_no_better_than_the_best_motion(found: JudgedRun) -> None:
    """Up to what the directions that are tried leave out, and what it did while it turned."""
    recorded = [e.best if e.future == "recorded" else e.other for e in found.events]

    assert len(found.events) > 3
    for event, best in zip(found.events, recorded, strict=True):
        assert best is not None
        assert best.gap >= event.real_gap - 0.03


def test_avoidable_contacts_are_those_of_the_judgement(record: Path, found: JudgedRun) -> None:
    contacts = [event for event in found.events if event.what.startswith("contact")]

    assert contacts_avoidable(record) == sum(event.best.gap > 0.0 for event in contacts)  # type: ignore[union-attr]


def test_a_simulation_judges_its_record(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "tight.yaml").write_text(TIGHT)
    walks = ["simulate", "--scene", "tight.yaml", "--user", "random:pursuer", "--seed", "3"]
    stands = [*walks, "--frozen-base", "--json", "--duration"]

    assert main([*stands, "0.2", "--record", "a.mcap", "--judge"]) == OK
    calm = json.loads(capsys.readouterr().out)
    assert main([*stands, "18", "--record", "b.mcap", "--judge"]) == OK
    touched = json.loads(capsys.readouterr().out)
    assert main([*stands, "0.2", "--record", "c.mcap"]) == OK
    unasked = json.loads(capsys.readouterr().out)

    assert (calm["contacts"], calm["contacts_avoidable"]) == (0, 0)
    assert touched["contacts_avoidable"] == contacts_avoidable(tmp_path / "b.mcap")
    assert 0 < touched["contacts_avoidable"] < touched["contacts"]
    assert unasked["contacts_avoidable"] is None
    assert main([*walks, "--judge"]) == USAGE
    assert "--record X.mcap" in capsys.readouterr().err


def test_a_row_of_the_table_is_an_event(found: JudgedRun) -> None:
    shown, run = text([found]), found.run

    failed = sum(escape.outcome == "failed" for escape in run.escapes)
    assert shown.count(" s  failed Escape") == failed
    assert shown.count(" s  contact by the ") == len(run.contacts)
    assert f"failed Escapes  {failed}, avoidable" in shown
    assert f"contacts        {len(run.contacts)}, avoidable" in shown


def test_the_table_and_the_picture_of_events_tell_what_was_judged(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(picture, "SPEEDS", (0.2, 0.4))
    monkeypatch.setattr(picture, "ACCELERATIONS", ())
    monkeypatch.setattr(picture, "DELAYS_S", (0.0,))
    late, early = EscapeVisit(2.0, 2.0, "failed"), EscapeVisit(1.2, 1.2, "failed")
    run = walked(-3.4, sign_s=2.0, escapes=(late, early))
    found = JudgedRun(Path("x.mcap"), run, tuple(judge(run)))

    draw_envelope(tmp_path / "x.svg", lambda _, __: None, [found])

    shown = text([found])
    assert [line.split()[5] for line in shown.splitlines()[3:5]] == ["yes", "no"]
    assert "failed Escapes  2, avoidable 1 (50%)" in shown
    drawn = (tmp_path / "x.svg").read_text()
    assert drawn.count("not avoidable") == 1
    assert drawn.count("avoidable") == 2


def test_a_run_without_failures_says_so() -> None:
    run = walked(-3.4)
    found = JudgedRun(Path("x.mcap"), run, tuple(judge(run)))

    assert "no failed Escape, no contact" in text([found])
    assert events_of([found]) == []


def test_records_are_judged_on_the_command_line(
    record: Path,
    found: JudgedRun,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setattr("cobodeck.avoidable.judged_run", {record: found}.__getitem__)

    assert main(["bench", "envelope", str(record), "--json"]) == OK

    (shown,) = json.loads(capsys.readouterr().out)["records"]
    assert shown == found.plain()
    assert len(shown["events"]) == shown["escape_failures"] + shown["contacts"]
    assert shown["contacts"] == len(found.run.contacts)
    assert len(shown["escapes"]) == len(found.run.escapes)


@pytest.mark.parametrize(
    ("names", "code", "message"),
    [
        (["x.mcap"], USAGE, "cobodeck bench envelope X.mcap"),
        (["engine", "x.mcap"], USAGE, "cobodeck bench envelope X.mcap"),
        (["envelope", "missing.mcap"], USAGE, "missing.mcap"),
    ],
)
def test_other_names_beside_records_are_refused(
    names: list[str], code: int, message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["bench", *names]) == code
    assert message in capsys.readouterr().err
