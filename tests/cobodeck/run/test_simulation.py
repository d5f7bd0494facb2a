"""The main job, from the command line: figures, records, repeatability."""

import json
import re
from pathlib import Path
from typing import Any

import pytest

from cobodeck.__main__ import main
from cobodeck.terminal.console import FAILED, OK

SPREADS = {
    "response_s": {"mean", "sd", "min", "max"},
    "arm_s": {"mean", "sd", "min", "max"},
    "close_drives": {"number", "mean_s", "below_0_4_m_s"},
    "time_to_safety_s": {"mean", "min", "max"},
    "escape_time_s": {"mean", "min", "max"},
}
NAMES = {
    "chart",
    "scene",
    "user",
    "profile",
    "tier",
    "seed",
    "tick_hz",
    "sim_s",
    "wall_s",
    "realtime_factor",
    "cpu_us_per_tick",
    "ticks",
    "transitions",
    "trace_sha256",
    "requests",
    "served",
    "refused",
    "refusals",
    "response_s",
    "arm_s",
    "request_list",
    "escape_list",
    "distance_m",
    "energy_j",
    "escapes",
    "escape_failures",
    "situations",
    "time_to_safety_s",
    "escape_time_s",
    "contacts",
    "contacts_by_robot",
    "contacts_slow_arm",
    "contact_list",
    "beside_share",
    "beside_share_3_4",
    "measured",
    "motion_sha256",
    "localization",
    "min_gap_m",
    "least_gap_walking_m",
    "faults",
    "overruns",
    "signals",
}


@pytest.fixture
def simulated(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> Any:
    monkeypatch.chdir(tmp_path)

    def simulate(*arguments: str, code: int = OK) -> dict[str, Any]:
        assert main(["simulate", *arguments, "--json"]) == code
        found: dict[str, Any] = json.loads(capsys.readouterr().out)
        return found

    return simulate


def test_the_figures_have_the_agreed_names(simulated: Any) -> None:
    figures = simulated("--duration", "20")

    assert figures.keys() >= NAMES
    for name, parts in SPREADS.items():
        assert set(figures[name]) == parts
    for usage in figures["signals"].values():
        assert set(usage) == {"evaluated", "skipped"}
    assert (figures["chart"], figures["scene"], figures["user"]) == (
        "cobodeck",
        "lab_a",
        "demo",
    )
    assert (figures["profile"], figures["tier"], figures["seed"]) == ("tuned", 1, 0)


def test_ticks_are_at_n_over_the_rate(simulated: Any) -> None:
    figures = simulated("--duration", "1", "--tick-hz", "50")

    assert (figures["tick_hz"], figures["ticks"], figures["sim_s"]) == (50, 51, 1.0)


@pytest.mark.requirement(67)
def test_the_same_seed_gives_the_same_trace_with_skipping_on_and_off(simulated: Any) -> None:
    runs = [simulated("--duration", "30", *more) for more in ([], [], ["--no-skip"])]

    assert len({run["trace_sha256"] for run in runs}) == 1
    assert len({run["distance_m"] for run in runs}) == 1
    assert runs[0]["transitions"] > 5
    computed = [sum(s["evaluated"] for s in run["signals"].values()) for run in runs]
    assert computed[0] == computed[1] < computed[2]


@pytest.mark.parametrize("scene", ["lab_b", "lab_a", "study"])  # lab_a is above, too
@pytest.mark.few(1)
def test_skipping_changes_no_trace_in_any_scene(simulated: Any, scene: str) -> None:
    arguments = ("--scene", scene, "--duration", "30")

    assert (
        simulated(*arguments)["trace_sha256"]
        == (simulated(*arguments, "--no-skip")["trace_sha256"])
    )


def test_a_trace_file_says_what_was_run(simulated: Any, tmp_path: Path) -> None:
    figures = simulated("--duration", "10", "--seed", "5")

    path = tmp_path / figures["trace_file"]
    assert path.parent == tmp_path / "out"
    assert re.fullmatch(
        r"simulation-cobodeck-lab_a-demo-tuned-5-\d{8}T\d{6}\.trace\.jsonl", path.name
    )
    head, *lines = [json.loads(line) for line in path.read_text().splitlines()]
    assert head["format"] == "cobodeck trace 1"
    assert head["trace_sha256"] == figures["trace_sha256"]
    for name in ("chart", "profile", "scene"):
        assert len(head[name]["sha256"]) == 64
    assert lines[0][1:] == ["enter", ""]
    assert len(lines) > 10


def test_the_hash_of_a_chart_is_that_of_all_it_uses(simulated: Any, tmp_path: Path) -> None:
    inner = (
        "chart: inner\noutcomes: [done]\n"
        "states:\n  park: {do: ParkArm, next: {parked: .done, failed: .done, error: .done}}\n"
    )
    outer = "chart: outer\noutcomes: [done]\nstates:\n  in: {use: inner, next: {done: .done}}\n"
    (tmp_path / "outer.yaml").write_text(outer)
    hashes = []
    for text in (inner, inner, inner + "# changed\n"):
        (tmp_path / "inner.yaml").write_text(text)
        figures = simulated("outer.yaml")
        head = json.loads((tmp_path / figures["trace_file"]).read_text().partition("\n")[0])
        hashes.append(head["chart"]["sha256"])

    assert hashes[0] == hashes[1] != hashes[2]


def test_a_folder_that_cannot_be_written_to_does_not_end_the_run(
    simulated: Any, tmp_path: Path
) -> None:
    (tmp_path / "out").write_text("in the way")

    assert simulated("--duration", "1")["trace_file"] is None


def test_a_chart_that_ends_ends_the_run(simulated: Any, tmp_path: Path) -> None:
    (tmp_path / "short.yaml").write_text(
        "chart: short\noutcomes: [done]\n"
        "states:\n  park: {do: ParkArm, next: {parked: .done, failed: .done, error: .done}}\n"
    )

    figures = simulated("short.yaml")

    assert (figures["outcome"], figures["ticks"]) == ("done", 1)
    assert "escape.required" in figures["signals"]
    assert figures["signals"]["escape.required"]["evaluated"] == 0


def test_the_logic_alone_takes_many_ways_and_the_same_ones_for_a_seed(simulated: Any) -> None:
    first, again, other = (
        simulated("--tier", "0", "--seed", seed, "--duration", "600") for seed in ("1", "1", "2")
    )

    assert first["trace_sha256"] == again["trace_sha256"] != other["trace_sha256"]
    assert first["transitions"] > 50
    assert first["escapes"] > 0
    assert first["served"] is None
    assert first["distance_m"] is None


OWN_STATE = '''from engine.state import Action, Context, Run

class Breaks(Action):
    """Raises."""
    outcomes = ("done",)
    def run(self, ctx: Context) -> Run:
        yield
        raise RuntimeError("broken")
'''


def test_a_run_that_ends_with_an_error_fails(simulated: Any, tmp_path: Path) -> None:
    (tmp_path / "pyproject.toml").write_text(
        '[project.entry-points."cobodeck.states"]\nown = "own_breaking.states"\n'
    )
    (tmp_path / "own_breaking").mkdir()
    (tmp_path / "own_breaking" / "states.py").write_text(OWN_STATE)
    (tmp_path / "own_breaking" / "breaks.yaml").write_text(
        "chart: breaks\noutcomes: [done]\nstates:\n  a: {do: Breaks, next: {done: .done}}\n"
    )

    assert simulated("breaks", code=FAILED)["outcome"] == "error"


def test_explaining_tells_what_was_built_and_what_not(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "short.yaml").write_text(
        "chart: short\noutcomes: [done]\n"
        "states:\n  park: {do: ParkArm, next: {parked: .done, failed: .done, error: .done}}\n"
    )

    assert main(["simulate", "short.yaml", "--explain"]) == OK

    shown = capsys.readouterr().out
    built, _, rest = shown.partition("not built")
    assert "arm.joints" in built
    assert "ParkArm" in built
    assert "escape.required" in rest
    assert re.search(r"parts not sampled +.*\bbumper\b", rest)


def test_the_mock_runs_the_same_chart_as_fast_as_it_goes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    command = ["run", "cobodeck", "--robot", "mock", "--fast", "--duration", "30", "--json"]

    assert main(command) == OK

    figures = json.loads(capsys.readouterr().out)
    assert figures["sim_s"] == 30.0
    assert figures["distance_m"] > 0.0


ASKS = """
chart: asks
outcomes: [helped]
states:
  operator:
    do: CallOperator
    with: {patience: 0.5 s}
    next: {helped: .helped}
"""


@pytest.mark.requirement(48)
def test_what_a_run_reports_is_shown_when_it_happens_though_results_are_for_programs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "asks.yaml").write_text(ASKS)

    main(["run", "asks.yaml", "--robot", "mock", "--fast", "--duration", "1", "--json"])

    shown = capsys.readouterr()
    [fault] = json.loads(shown.out)["fault_names"]
    assert f"cobodeck: fault: {fault}\n" in shown.err


@pytest.mark.requirement(11, 74)
def test_at_a_virtual_wall_requests_arise_from_walking(simulated: Any, tmp_path: Path) -> None:
    figures = simulated("--scene", "virtual_wall", "--requests", "2")

    assert figures["requests"] == 2
    assert figures["served"] >= 1
    assert figures["contacts"] == 0
    # the user sees the wall; the robot is shown in Inform only, which was not needed
    assert "inform" not in (tmp_path / figures["trace_file"]).read_text()


@pytest.mark.slow
def test_a_random_user_goes_by_the_seed(simulated: Any) -> None:
    runs = [
        simulated("--user", "random", "--duration", "40", "--seed", seed)
        for seed in ("1", "1", "2")
    ]

    assert len({run["trace_sha256"] for run in runs[:2]}) == 1
    assert runs[2]["trace_sha256"] != runs[0]["trace_sha256"]


def room(folder: Path, side: float) -> str:
    path = folder / "my_room.yaml"
    path.write_text(
        f"scene: mine\nroom: {{outer: [[0, 0], [{side}, 0], [{side}, {side}], [0, {side}]]}}\n"
        "robot: {start: {x: 1.2, y: 1.2, yaw: 0.8}}\n"
        "user: {source: random, start: {x: 3.8, y: 3.8, yaw: 3.1}}\n"
    )
    return str(path)


@pytest.mark.requirement(124)
def test_a_room_too_small_for_all_behaviours_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["simulate", "--scene", room(tmp_path, 5.0)]) == FAILED

    shown = capsys.readouterr().err
    assert "scene mine: the floor of 5 x 5 m is too small for all behaviours" in shown
    assert "needs 6 x 6 m" in shown


@pytest.mark.requirement(124)
def test_a_room_of_six_by_six_metres_runs(simulated: Any, tmp_path: Path) -> None:
    figures = simulated("--scene", room(tmp_path, 6.0), "--duration", "60")

    assert figures["sim_s"] == 60.0
    assert figures["requests"] >= 1
