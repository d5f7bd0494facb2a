"""A person out of a record does again what they did, and stands while the robot is shown."""

import itertools
from dataclasses import replace

import pytest

from engine.files.finding import FileError
from hw.geometry import Pose2, Pose3
from hw.people.recorded.from_run_record import Asked, Past, Recalled, SeenPerson, Stood
from hw.people.walking.manner import INSTANT
from hw.samples import UserPose
from hw.scene.scene import load_scene

LAB = load_scene("lab_a").room
FAR = Pose2(100.0, 100.0)
HZ = 30
SPEED = 0.5
END_S = 8


def tick(n):
    return n * 10**9 // HZ


def body(at_ns):
    return Pose2(2.0 + SPEED * at_ns * 1e-9, 5.0, 0.3)


def seen(at_ns):
    """A little beside the truth, hands and a nodding head included."""
    at = body(at_ns)
    head = Pose3(at.x + 0.1, at.y, 1.7, 0.0, 0.1, 0.0, 0.995)
    left = Pose3.from_yaw(at.x + 0.4, at.y + 0.2, 1.1, 0.7)
    return UserPose(Pose2(at.x + 0.003, at.y, 0.31), 0.4, head, left, None)


def past(blind=(99, 99), first=0, asked=()):
    stamps = [tick(n) for n in range(first, END_S * HZ + 1)]
    return Past(
        name="run.mcap",
        until_ns=stamps[-1],
        ways=tuple(Stood(stamp, body(stamp), SPEED) for stamp in stamps),
        seen=tuple(
            SeenPerson(stamp, seen(stamp))
            for stamp in stamps
            if not blind[0] * 10**9 < stamp < blind[1] * 10**9
        ),
        asked=tuple(asked),
    )


def play(person, ticks, informed=lambda n: False):
    """Body, request and sample, tick by tick."""
    rows = []
    for n in range(ticks + 1):
        person.step(tick(n), FAR, informed(n))
        rows.append((person.body, person.request, person.measured, person.finished))
    return rows


def test_they_are_where_they_were_and_are_seen_as_they_were_to_the_bit():
    known = past()
    rows = play(Recalled(known, LAB), END_S * HZ)

    assert [row[0] for row in rows] == [row.body for row in known.ways]
    assert [(row[2].stamp_ns, row[2].value) for row in rows] == list(known.seen)
    assert [row[3] for row in rows] == [False] * (END_S * HZ) + [True]


def test_between_two_rows_they_go_straight():
    person = Recalled(past(), LAB)
    person.step(0, FAR, False)
    person.step(tick(10) + 11_111_111, FAR, False)

    assert person.body.x == pytest.approx(body(tick(10) + 11_111_111).x, abs=1e-9)
    assert person.speed == pytest.approx(SPEED)
    assert person.measured == ("user.pose", tick(10), seen(tick(10)))


def test_before_the_first_row_they_stand_there_and_nobody_sees_them():
    known = past(first=60)
    person = Recalled(known, LAB)
    assert person.body == known.ways[0].body
    rows = play(person, 61)

    assert {row[0] for row in rows[:61]} == {known.ways[0].body}
    assert [row[2] is None for row in rows] == [True] * 60 + [False] * 2


def test_they_ask_and_let_go_when_they_did():
    deep = Pose3.from_yaw(3.0, 5.0, 1.5, 0.2)
    asked = Asked(0, None), Asked(tick(45), deep), Asked(tick(75) + 5, None)
    rows = play(Recalled(past(asked=asked), LAB), 90)

    assert [row[1] for row in rows] == [None] * 45 + [deep] * 31 + [None] * 15


def test_what_tracking_did_not_see_it_does_not_see_again():
    rows = play(Recalled(past(blind=(2.0, 3.5)), LAB), 150)

    blind = [n for n, row in enumerate(rows) if row[2] is None]
    assert blind == [n for n in range(151) if 2 * HZ < n < 3.5 * HZ]
    assert rows[80][0] == body(tick(80))


def test_shown_the_robot_they_slow_down_to_a_stand_and_are_seen_all_the_while():
    calm = play(Recalled(past(), LAB), END_S * HZ)
    hasty = replace(INSTANT, pause_s=(0.0, 0.0))
    rows = play(Recalled(past(), LAB, hasty), 200, lambda n: 30 < n <= 90)

    assert [row[0] for row in rows[:31]] == [row[0] for row in calm[:31]]
    assert len({row[0] for row in rows[50:90]}) == 1
    stamps = [row[2].stamp_ns for row in rows]
    assert stamps == sorted(set(stamps))
    assert max(now - then for now, then in zip(stamps[1:], stamps, strict=False)) < 2 * tick(1)
    later = rows[150][0].x - rows[120][0].x
    assert later == pytest.approx(SPEED, abs=1e-3)
    assert rows[150][0].x == pytest.approx(body(tick(150) - 2 * 10**9).x, abs=SPEED * 0.05)


def test_seen_while_they_slow_down_head_and_hands_come_along():
    rows = play(Recalled(past(), LAB), 60, lambda n: n > 30)

    for at, _, sample, _ in rows[1:]:
        pose = sample.value
        assert pose.body.x - at.x == pytest.approx(0.003, abs=1e-9)
        assert pose.head.x - pose.body.x == pytest.approx(0.097, abs=1e-9)
        assert pose.left_hand.y - pose.body.y == pytest.approx(0.2, abs=1e-9)
        assert (pose.left_hand.z, pose.right_hand) == (1.1, None)
        assert pose.head_yaw == pytest.approx(0.4)


def test_a_drop_out_is_over_once_it_has_lasted_as_long_as_it_did_though_they_stand():
    rows = play(Recalled(past(blind=(2.0, 3.5)), LAB, INSTANT), 240, lambda n: 75 < n <= 135)

    blind = [n for n, row in enumerate(rows) if row[2] is None]
    assert blind == list(range(2 * HZ + 1, round(3.5 * HZ)))
    assert rows[120][0] == rows[110][0]
    assert rows[120][2].value.body.x == pytest.approx(rows[120][0].x + 0.003, abs=1e-9)
    assert rows[150][2].value.body.x == pytest.approx(rows[150][0].x + 0.003, abs=1e-9)


def test_who_would_be_in_a_wall_is_told_where_and_when():
    in_wall = Past(
        "run.mcap", 10**9, (Stood(0, body(0), 0.0), Stood(10**9, Pose2(6.75, 5.15), 0.0)), (), ()
    )

    with pytest.raises(FileError, match=r"run.mcap: .*\(6.75, 5.15\) after 1.00 s.*free floor"):
        Recalled(in_wall, LAB)


def test_they_leave_the_shown_robot_and_come_back_to_what_they_did():
    deep = Pose3.from_yaw(3.0, 5.0, 1.5, 0.2)
    known = past(asked=(Asked(0, None), Asked(tick(45), deep)))
    person, rows = Recalled(known, LAB), []
    for n in range(900):
        robot = body(tick(60)).transform(1.0, 0.0)
        person.step(tick(n), Pose2(*robot), 60 < n <= 360)
        rows.append((person.body, person.request, person.measured))

    assert rows[360][0].distance_to(Pose2(*robot)) == pytest.approx(3.0, abs=0.1)
    assert rows[100][1] == deep
    assert rows[360][1] is None
    assert rows[-1][0] == known.ways[-1].body
    assert rows[-1][1] == deep
    stamps = [row[2].stamp_ns for row in rows if row[2] is not None]
    assert all(a < b <= a + 2 * tick(1) for a, b in itertools.pairwise(stamps))
