"""The gate: a real robot moves once the same was simulated, and then tried with a dummy (R53)."""

from __future__ import annotations

import re
import shlex
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, strategies as st

from cobodeck.__main__ import main
from cobodeck.real.release_stages import WORDS, Stage, Tried, Wanted, found_for, stages_of
from cobodeck.terminal.console import FAILED, OK, REFUSED, USAGE

NOW = Wanted(
    files={"charts/a.yaml": "a1", "hw/robots/r.yaml": "r1", "charts/profiles/p.yaml": "p1"},
    code={"engine": "e1", "own.states": "o1"},
    limits={"speed": 0.8},
    tick_hz=30,
    connection=("rover", "c1"),
    person=True,
    profile="v1",
)


def header(stage: Stage = "simulated", **other: Any) -> dict[str, Any]:
    simulated = stage == "simulated"
    found = {
        "plant": "simulation" if simulated else "rover",
        "files": {"charts/a.yaml": "a1", "elsewhere/r.yaml": "r1", "p.yaml": "p1", "x": "y"},
        "code": dict(NOW.code),
        "limits": {"speed": 0.8},
        "profile": {"name": "p", "sha256": "v1"},
        "tick_hz": 30,
        "connection": None if simulated else {"name": "rover", "sha256": "c1", "real": True},
        "options": {"user": None if simulated else "out/simulated.mcap"},
    }
    return found | other


def figures(**other: Any) -> dict[str, Any]:
    found = {"errors": [], "outcome": None, "served": 20, "contacts_by_robot": 0}
    return found | {"wall_hits": 0, "object_hits": 0} | other


def why(stage: Stage, head: dict[str, Any], found: dict[str, Any] | None) -> tuple[str, ...]:
    return found_for(stage, [Tried("x.mcap", head, found)], NOW).why


@pytest.mark.requirement(53)
def test_what_was_simulated_as_it_is_passes() -> None:
    assert found_for("simulated", [Tried("x.mcap", header(), figures())], NOW).passed


DIFFERENT: dict[str, dict[str, Any]] = {
    "charts/a.yaml has changed": {"files": {"charts/a.yaml": "a0", "r": "r1", "p": "p1"}},
    "hw/robots/r.yaml has changed": {"files": {"charts/a.yaml": "a1", "p.yaml": "p1"}},
    "charts/profiles/p.yaml has changed": {"files": {"charts/a.yaml": "a1", "r": "r1"}},
    "the code of engine has changed": {"code": {"engine": "e0", "own.states": "o1"}},
    "the code of own.states has changed": {"code": {"engine": "e1"}},
    "the code of gone has changed": {"code": {"engine": "e1", "own.states": "o1", "gone": "g"}},
    "it had other limits than those of the connection": {"limits": {"speed": None}},
    "the profile had other values": {"profile": {"name": "p", "sha256": "v0"}},
    "it ticked at 20 Hz": {"tick_hz": 20},
    "the chart had other inputs": {"inputs": {"goal": {"x": "1 m", "y": "2 m"}}},
}


@pytest.mark.requirement(53)
@pytest.mark.parametrize("difference", DIFFERENT)
@pytest.mark.parametrize("stage", WORDS)
def test_a_record_of_anything_else_does_not(stage: Stage, difference: str) -> None:
    assert why(stage, header(stage, **DIFFERENT[difference]), figures()) == (difference,)


def test_a_record_that_tells_of_no_limits_does_not() -> None:
    head = header()
    del head["limits"]

    assert why("simulated", head, figures()) == (
        "it had other limits than those of the connection",
    )


BAD: dict[str, dict[str, Any]] = {
    "errors: 1": {"errors": [{"error": "ValueError"}]},
    "the chart ended with failed": {"outcome": "failed"},
    "the chart ended with error": {"outcome": "error"},
    "it ran into walls: 2": {"wall_hits": 2},
    "it ran into objects: 1": {"object_hits": 1},
    "19 served, 20 are wanted": {"served": 19},
    "an unknown number served, 20 are wanted": {"served": None},
    "contacts by the robot: 1": {"contacts_by_robot": 1},
    "contacts are not known": {"contacts_by_robot": None},
}


@pytest.mark.requirement(53)
@pytest.mark.parametrize("shortcoming", BAD)
def test_a_simulation_that_went_badly_does_not_pass(shortcoming: str) -> None:
    assert why("simulated", header(), figures(**BAD[shortcoming])) == (shortcoming,)


def test_a_run_without_an_end_does_not_pass() -> None:
    assert why("simulated", header(), None) == ("it did not come to its end, or is damaged",)


@pytest.mark.requirement(56)
def test_a_dummy_beside_the_robot_passes_with_one_request_and_unknown_contacts() -> None:
    measured = figures(served=1, contacts_by_robot=None, wall_hits=None, object_hits=None)

    assert found_for("dummy", [Tried("x.mcap", header("dummy"), measured)], NOW).passed
    assert why("dummy", header("dummy"), figures(served=0)) == ("0 served, 1 are wanted",)
    assert why("dummy", header("dummy"), figures(contacts_by_robot=2)) == (
        "contacts by the robot: 2",
    )


OTHERS: dict[str, dict[str, Any]] = {
    "by another connection": {"plant": "other"},
    "beside a living person": {"options": {"user": None}},
    "beside a scripted person": {"options": {"user": "cornering"}},
    "on the mock": {"plant": "mock", "connection": {"name": "mock", "sha256": "", "real": False}},
    "simulated": {"plant": "simulation"},
    "replayed": {"plant": "replay"},
}


@pytest.mark.requirement(56)
@pytest.mark.parametrize("other", OTHERS)
def test_other_runs_are_none_with_a_dummy_beside_this_robot(other: str) -> None:
    tried = Tried("x.mcap", header("dummy", **OTHERS[other]), figures())

    assert found_for("dummy", [tried], NOW).file is None


def test_a_dummy_beside_a_connection_that_has_changed_does_not_pass() -> None:
    changed = {"name": "rover", "sha256": "c0", "real": True}

    assert why("dummy", header("dummy", connection=changed), figures()) == (
        "the connection has changed",
    )


def test_replays_and_runs_on_the_mock_are_no_simulations() -> None:
    for plant in ("replay", "mock", "logic", "rover"):
        tried = Tried("x.mcap", header(plant=plant), figures())
        assert found_for("simulated", [tried], NOW).file is None


def test_without_a_person_nobody_has_to_be_served_and_there_is_no_dummy() -> None:
    alone = replace(NOW, person=False)
    of_robot = {"errors": [], "outcome": None, "wall_hits": 0, "object_hits": 0}

    assert found_for("simulated", [Tried("x.mcap", header(), of_robot)], alone).passed
    assert stages_of(alone, with_dummy=False) == ("simulated",)
    assert stages_of(NOW, with_dummy=True) == ("simulated",)
    assert stages_of(NOW, with_dummy=False) == ("simulated", "dummy")


@given(st.lists(st.tuples(st.sampled_from(sorted(DIFFERENT)), st.sampled_from(sorted(BAD)))))
def test_the_record_that_lacks_least_is_named_unless_one_passes(wrong: list[Any]) -> None:
    bad = [
        Tried(f"{n}.mcap", header(**DIFFERENT[difference]), figures(**BAD[shortcoming]))
        for n, (difference, shortcoming) in enumerate(wrong)
    ]
    good = Tried("good.mcap", header(), figures())

    assert found_for("simulated", [*bad, good], NOW).file == "good.mcap"
    finding = found_for("simulated", bad, NOW)
    assert not finding.passed
    assert (finding.file is None) == (not bad)


# -- the command ---------------------------------------------------------------------------------

CHART = """chart: round
outcomes: [done, failed]
states:
  hold: {do: HoldProp, timeout: 5 s, next: {error: .failed, timeout: .done}}
"""
ROBOT = """connection: real_one
model: rbkairos_ur10
real: true
told: [its brakes squeak]
parts:
  arm: {driver: "hw.drivers.nothing:Arm"}
"""


@pytest.fixture
def folder(folder: Path) -> Path:
    (folder / "round.yaml").write_text(CHART)
    (folder / "real_one.yaml").write_text(ROBOT)
    return folder


RUN = ["run", "round.yaml", "--robot", "real_one.yaml", "--no-project"]


def simulated(record: str = "out/simulated.mcap") -> None:
    call = ["simulate", "round.yaml", "--robot", "real_one.yaml", "--no-project"]
    assert main([*call, "--record", record]) == OK


@pytest.mark.requirement(53)
def test_a_real_robot_does_not_move_before_a_simulation_and_what_is_typed_next_is_told(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(RUN) == REFUSED

    told = capsys.readouterr().err
    assert "it was not simulated: there is no record of it" in told
    assert not list(folder.glob("out/*"))
    commands = re.findall(r"^ {4}cobodeck (.*)$", told, flags=re.M)
    assert len(commands) == 1  # nobody is asked for a dummy: the chart has to do with nobody

    assert main([*shlex.split(commands[0]), "--no-project"]) == OK
    assert main(RUN) == REFUSED
    told = capsys.readouterr().err
    assert "simulated: out/simulated.mcap" in told
    assert "real_one: its brakes squeak" in told
    assert "not ready" in told  # the pre-flight: what is named there is no arm


@pytest.mark.requirement(53)
def test_after_a_change_it_has_to_be_simulated_again(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    simulated()
    (folder / "round.yaml").write_text(CHART.replace("5 s", "6 s"))

    assert main(RUN) == REFUSED

    assert "out/simulated.mcap: round.yaml has changed" in capsys.readouterr().err


@pytest.mark.requirement(53)
def test_it_has_to_be_simulated_with_the_same_inputs(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = CHART.replace("states:", "inputs: {limit: duration, to: any}\nstates:")
    (folder / "round.yaml").write_text(text)
    given = ["--in", "limit=5 s", "--in", "to=[1, up, 3 m]"]
    assert main([*RUN, *given]) == REFUSED
    commands = re.findall(r"^ {4}cobodeck (.*)$", capsys.readouterr().err, flags=re.M)

    assert main([*shlex.split(commands[0]), "--no-project"]) == OK
    capsys.readouterr()

    assert main([*RUN, *given]) == REFUSED
    assert "simulated: out/simulated.mcap" in capsys.readouterr().err
    assert main([*RUN, *given[2:], "--in", "limit=6 s"]) == REFUSED
    assert "out/simulated.mcap: the chart had other inputs" in capsys.readouterr().err


def test_records_elsewhere_are_looked_at_where_they_are_named(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    simulated("kept/first.mcap")
    (folder / "kept" / "none.mcap").write_bytes(b"no record")
    files = ["kept/none.mcap", "kept/first.mcap", "kept/not_there.mcap"]

    assert main(RUN) == REFUSED
    assert "there is no record of it" in capsys.readouterr().err
    assert main([*RUN, "--passed", *files]) == REFUSED
    assert "simulated: kept/first.mcap" in capsys.readouterr().err


@pytest.mark.requirement(53)
def test_it_can_be_told_otherwise_in_so_many_words_and_no_others(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([*RUN, "--although", "yes"]) == USAGE
    assert "it was not simulated" in capsys.readouterr().err

    assert main([*RUN, "--although", WORDS["dummy"]]) == REFUSED
    assert "it was not simulated: there" in capsys.readouterr().err

    assert main([*RUN, "--although", WORDS["simulated"]]) == REFUSED
    told = capsys.readouterr().err
    assert "although it was not simulated" in told
    assert "not ready" in told


def test_what_is_not_marked_as_real_is_asked_for_nothing(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (folder / "real_one.yaml").write_text(ROBOT.replace("real: true", "real: false"))

    assert main(RUN) == FAILED  # what is named there is no arm

    told = capsys.readouterr().err
    assert "its brakes squeak" in told
    assert "simulated" not in told


def test_of_records_that_come_as_near_the_newest_is_named() -> None:
    tried = [
        Tried("two.mcap", header(tick_hz=20), figures(served=0)),
        Tried("new.mcap", header(), figures(served=19)),
        Tried("old.mcap", header(), figures(served=18)),
    ]

    found = found_for("simulated", tried, NOW)

    assert (found.file, found.why) == ("new.mcap", ("19 served, 20 are wanted",))
