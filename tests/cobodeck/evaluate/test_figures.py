"""Figures that are told from the trace, and contacts as figures."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from cobodeck.evaluate.figures import Visit, contact_figures, escape_figures, shown_figures, visits
from cobodeck.run.run_summary import summary
from cobodeck.run.simulation import simulate
from cobodeck.run.topics import COMPANY, ESCAPES, REQUESTS, topics_of
from cobodeck.setup.options import Options
from cobodeck.setup.setup import open_setup
from cobodeck.testing.testing import ChartTester
from hw.truth import Contact

FLEES = """
chart: flees
outcomes: [over]
states:
  first: {use: escape, next: {safe: second, failed: second, user_lost: .over, fault: .over}}
  second: {use: escape, next: {safe: first, failed: first, user_lost: .over, fault: .over}}
"""


def test_the_time_of_an_escape_is_from_entering_it_to_being_safe(sim: ChartTester) -> None:
    sim.start(FLEES)
    for name, seconds, outcome in [
        ("first/away/drive/safe", 0.5, "safe"),
        ("second/away/drive/go", 0.2, "no_way"),
        ("first/away/drive/safe", 1.5, "safe"),
    ]:
        sim.wait(seconds)
        sim.end(name, outcome)
        sim.until("second/tracking" if "first" in name else "first/tracking")
    sim.wait(2.0)

    found = escape_figures(sim.run)

    assert (found["escapes"], found["escape_failures"]) == (4, 1)
    told = [(one["outcome"], one["time_s"]) for one in found["escape_list"]]
    assert told[-1] == (None, None)
    assert [outcome for outcome, _ in told] == ["safe", "failed", "safe", None]
    assert [time for _, time in told[:3]] == pytest.approx([0.5, 0.2, 1.5], abs=0.04)
    assert [one["at_s"] for one in found["escape_list"][1:]] == pytest.approx(
        [one["at_s"] + one["time_s"] for one in found["escape_list"][:3]], abs=1e-6
    )
    assert found["escape_time_s"]["min"] == pytest.approx(0.5, abs=0.04)
    assert found["escape_time_s"]["max"] == pytest.approx(1.5, abs=0.04)
    assert found["escape_time_s"]["mean"] == pytest.approx(1.0, abs=0.04)
    assert visits(sim.run, "escape")[-1] == Visit(visits(sim.run, "escape")[-1].entered_ns)


def test_without_an_escape_there_is_no_time_of_one(sim: ChartTester) -> None:
    sim.start(FLEES)

    found = escape_figures(sim.run)

    assert found["escapes"] == 0
    assert found["escape_time_s"] == {"mean": None, "min": None, "max": None}


VARIANTS = {
    "paper_escape": """
chart: paper_escape
outcomes: [safe, failed]
states:
  flee: {watch: FaultRaised, next: {raised: .safe}}
""",
    "careful_escape": """
chart: careful_escape
outcomes: [safe, failed]
states:
  inner: {use: paper_escape, next: {safe: .failed, failed: .failed}}
""",
    "ways": """
chart: ways
outcomes: [over]
states:
  first: {use: paper_escape, next: {safe: second, failed: second}}
  second: {use: careful_escape, next: {safe: .over, failed: last}}
  last: {watch: FaultRaised, next: {raised: .over}}
""",
}


def test_every_chart_of_an_escape_counts_and_one_inside_another_does_not(
    sim: ChartTester, tmp_path: Path
) -> None:
    for name, text in VARIANTS.items():
        (tmp_path / f"{name}.yaml").write_text(text)
    sim.start(str(tmp_path / "ways.yaml"))
    for name in ("first/flee", "second/inner/flee"):
        sim.end(name, "raised")
        sim.wait(0.2)

    found = escape_figures(sim.run)

    assert [one["outcome"] for one in found["escape_list"]] == ["safe", "failed"]
    assert found["escape_failures"] == 1


WARNS = """
chart: warns
outcomes: [over]
states:
  idle: {watch: FaultRaised, next: {raised: away}}
  away:
    use: escape
    next: {safe: idle, failed: warned, user_lost: warned, fault: warned}
  warned: {use: inform, next: {restarted: idle}}
"""


@pytest.mark.requirement(117)
@pytest.mark.parametrize(
    ("entered", "loops"),
    [
        ([], 0),
        ([1.0], 0),
        ([1.0, 2.0], 0),
        ([1.0, 5.0, 10.9], 1),
        ([1.0, 5.0, 11.1], 0),
        ([1.0, 2.0, 3.0, 4.0], 2),
        ([1.0, 2.0, 3.0, 20.0, 21.0, 22.0], 2),
        ([1.0, 9.0, 17.0, 25.0, 33.0], 0),
    ],
)
@pytest.mark.parametrize("because", [("away/away/drive/go", "no_way"), ("away/tracking", "lost")])
def test_three_failures_of_escape_within_ten_seconds_are_a_loop_lost_tracking_is_none(
    sim: ChartTester, because: tuple[str, str], entered: list[float], loops: int
) -> None:
    sim.start(WARNS)
    for at in entered:
        sim.until(lambda at=at: sim.now >= at - 0.05, timeout=40)
        sim.end("idle", "raised")
        sim.until("away", timeout=0.2)
        sim.end(*because)
        sim.until("warned", timeout=0.2)
        sim.end("warned/ready", "restarted")
        sim.until("idle", timeout=0.2)

    found = escape_figures(sim.run)

    assert found["informs"] == len(entered)
    assert found["loops"] == (loops if because[1] == "no_way" else 0)


@pytest.mark.requirement(18)
def test_the_time_shown_outside_inform_is_told_apart(sim: ChartTester) -> None:
    sim.start(WARNS)
    sim.end("idle", "raised")
    sim.until("away")
    sim.end("away/tracking", "lost")
    sim.until("warned")
    sim.wait(1.0)
    entered = visits(sim.run, "inform")[0].entered_ns

    def shown(*spans: tuple[float, float]) -> tuple[float, float]:
        found = shown_figures(
            sim.run, [(entered + round(a * 1e9), entered + round(b * 1e9)) for a, b in spans]
        )
        return found["shown_s"], found["shown_outside_inform_s"]

    assert shown() == (0.0, 0.0)
    assert shown((0.0, 0.5)) == (0.5, 0.0)
    assert shown((-0.25, 0.5)) == (0.75, 0.25)
    sim.end("warned/ready", "restarted")
    sim.until("idle")
    ended = visits(sim.run, "inform")[0].ended_ns
    assert ended is not None
    lasted = (ended - entered) / 1e9
    assert shown((0.0, lasted), (lasted + 1.0, lasted + 2.0)) == pytest.approx((lasted + 1.0, 1.0))
    assert shown((lasted - 0.5, lasted + 0.25)) == pytest.approx((0.75, 0.25))
    assert set(shown_figures(sim.run, None).values()) == {None}


CONTACTS = [
    Contact(12_300_000_000, 1.2, 3.4, "base", 0.4, 0.0, False),
    Contact(13_000_000_000, 1.0, 3.0, "wrist_2", 0.2, 0.1, True),
    Contact(15_000_000_000, 2.0, 3.0, "prop", 0.0, 0.7, False),
]


def test_contacts_are_counted_by_whose_doing_they_were() -> None:
    found = contact_figures(CONTACTS)

    counts = [found[name] for name in ("contacts", "contacts_by_robot", "contacts_slow_arm")]
    assert counts == [3, 1, 1]
    assert found["arm_closing_m_s"] == 0.2
    assert found["contact_list"][1] == {
        "at_s": 13.0,
        "x": 1.0,
        "y": 3.0,
        "part": "wrist_2",
        "by": "slow_arm",
        "robot_closing_m_s": 0.2,
        "person_closing_m_s": 0.1,
        "granted": True,
        "who": "user",
    }


def test_nobody_touched_is_an_empty_list_and_not_known_is_null() -> None:
    assert contact_figures([])["contact_list"] == []
    assert contact_figures([])["contacts_by_robot"] == 0
    assert set(contact_figures(None).values()) == {None}


@pytest.fixture(scope="module")
def figures() -> dict[str, Any]:
    """Of a run of no more than an instant."""
    result = simulate(open_setup(), Options(duration_s=0.1))
    return {**result.figures, "trace_file": None, "record_file": None}


def row(shown: str, name: str) -> str:
    (line,) = (line for line in shown.splitlines() if line.startswith(f"{name} "))
    return line[len(name) :].strip()


def test_the_summary_tells_each_contact_those_by_the_robot_first(figures: dict[str, Any]) -> None:
    by_person_first = [CONTACTS[2], CONTACTS[1], CONTACTS[0]]

    shown = summary(figures | contact_figures(by_person_first) | {"min_gap_m": -0.01})

    told = "3, of which 1 by the robot and 1 by its arm, slowly, least gap -0.01 m"
    assert row(shown, "contacts") == told
    lines = [line.strip() for line in shown.splitlines()]
    after = lines.index(f"contacts           {told}") + 1
    assert lines[after : after + 3] == [
        "12.3 s base at (1.2, 3.4), robot 0.40 m/s, person 0.00 m/s",
        "13.0 s wrist_2 at (1.0, 3.0), robot 0.20 m/s, person 0.10 m/s, in a requested touch",
        "15.0 s prop at (2.0, 3.0), robot 0.00 m/s, person 0.70 m/s",
    ]


def test_the_summary_tells_close_drives_and_contacts_that_were_avoidable(
    figures: dict[str, Any],
) -> None:
    close = {"close_drives": {"number": 2, "mean_s": 4.66, "below_0_4_m_s": 1.5}}
    judged = contact_figures(CONTACTS[:1]) | {"contacts_avoidable": 1, "min_gap_m": -0.01}

    shown = summary(figures | close | judged)

    assert row(shown, "close drives") == "2, 4.7 s each, 1.5 s of it within 0.4 m of the user"
    assert row(shown, "contacts") == "1, of which 1 by the robot, avoidable 1, least gap -0.01 m"
    assert "close drives" not in summary(figures)
    assert "avoidable" not in summary(figures)


def test_the_summary_of_a_run_without_contacts_says_so_in_a_line(figures: dict[str, Any]) -> None:
    shown = summary(figures)

    assert row(shown, "contacts").startswith("0, least gap ")
    assert "measured" not in shown


def test_the_summary_tells_both_shares_beside_the_user(figures: dict[str, Any]) -> None:
    shares = {"beside_share": 0.92, "beside_share_3_4": 0.4, "walking_s": 94.2}

    told = row(summary(figures | shares), "beside the user")

    assert told == "1.5 to 4 m away for 92% of 94 s of walking, 3 to 4 m for 40%"


def test_the_summary_leaves_out_what_the_chart_does_not_deal_with(
    figures: dict[str, Any], tmp_path: Path
) -> None:
    alone = tmp_path / "alone.yaml"
    alone.write_text(
        "chart: alone\noutcomes: [over]\nstates:\n"
        "  rest: {watch: Wait, with: {time: 1 s}, next: {over: .over}}\n"
    )
    person = ["beside the user", "requests served", "response", "escapes", "escape situations"]

    assert topics_of(open_setup()) == {COMPANY, REQUESTS, ESCAPES}
    assert topics_of(open_setup("chase")) == {COMPANY, REQUESTS}
    assert topics_of(open_setup(str(alone))) == frozenset()
    shown = summary(figures | {"situations": 0}, topics=())
    assert not [name for name in person if f"\n{name} " in shown]
    assert row(shown, "contacts").startswith("0, least gap ")
    assert row(summary(figures | {"situations": 2}, topics=()), "escape situations") == "2"
