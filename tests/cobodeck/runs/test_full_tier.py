"""Tier 2, end to end: with all sensors, wheels that slip, and a pose that is an estimate."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import pytest

from behaviors.signal_table import ESTIMATE
from cobodeck.evaluate.figures import visits
from cobodeck.run.build_run import stage
from cobodeck.run.explanation import explain
from cobodeck.run.simulation import RunResult, simulate
from cobodeck.setup.options import Options
from cobodeck.setup.setup import Setup, open_setup
from cobodeck.terminal.console import Problem
from engine.files.finding import FileError
from hw.model.sensing import Sensing
from hw.sim.contact.contact import gap
from states import LocalizerEffort
from tests.repeats import fewer

SERVE_M, SERVE_RAD = 0.02, 0.1


def run(scene: str, requests: int | None = 2, seed: int = 0, **options: Any) -> RunResult:
    setup = open_setup(scene=scene)
    given = {"duration_s": 180.0 * (requests or 1), "tier": 2, **options}
    return simulate(setup, Options(requests=requests, seed=seed, **given))


@cache
def study() -> RunResult:
    return run("study", 1)


@pytest.mark.requirement(22, 25, 33)
def test_requests_are_served_by_an_estimated_pose() -> None:
    figures = study().figures

    assert (figures["served"], figures["requests"]) == (1, 1)
    assert figures["contacts"] == 0
    assert figures["prop_error_m"]["max"] <= SERVE_M
    assert figures["prop_error_rad"]["max"] <= SERVE_RAD
    assert figures["errors"] == []
    assert figures["refused_samples"] == {}


@pytest.mark.requirement(28, 29, 33)
def test_the_estimate_is_good_and_as_good_as_it_says() -> None:
    found = study().figures["localization"]

    assert found["rmse_m"] <= 0.03
    assert found["max_m"] <= 0.10
    assert found["reaching_p95_m"] <= 0.01
    assert found["reaching_p95_rad"] <= 0.005
    assert found["within_3_sigma"] >= 0.95
    assert found["unknown_s"] < 0.1


@pytest.mark.requirement(146)
@pytest.mark.slow
def test_wheels_alone_would_lose_the_robot() -> None:
    """The floor is slippery: what the estimate makes up for is not small."""
    loop = stage(open_setup(scene="study"), Options(requests=1, tier=2))
    start, ways = loop.plant.truth.base, list[Any]()
    loop.wired.inlet.listen("base.odometry", lambda sample, _: ways.append(sample.value.pose))
    while not loop.finished and loop.now_ns < 60 * 10**9:
        loop.tick()
    reckoned = start @ (ways[0].inverse() @ ways[-1])
    assert reckoned.distance_to(loop.plant.truth.base) > 0.1


@pytest.mark.requirement(52)
@pytest.mark.slow
def test_the_chain_knows_the_gap_though_nobody_tells_it_where_the_base_is() -> None:
    """By trackers, by the estimate, and in between by the wheels, in a frame of their own."""
    setup = open_setup(scene="study")
    loop = stage(setup, Options(requests=1, tier=2))
    reader, worst, seen = loop.plant.cycles.reader(), 0.0, 0
    while not loop.finished and loop.now_ns < 60 * 10**9:
        loop.tick()
        truth, cycles = loop.plant.truth, reader.read_new()
        if not cycles or cycles[-1].separation is None or truth.body is None:
            continue
        true = gap(setup.robot.footprint, truth.base, truth.body.x, truth.body.y)
        worst, seen = max(worst, abs(cycles[-1].separation - true)), seen + 1
    assert seen > 100
    assert worst <= 0.15  # of a person who walks 5 cm from pose to pose


LENGTHS = pytest.mark.parametrize(
    "duration_s", [12.0, pytest.param(180.0, marks=pytest.mark.slow)], ids=["short", "served"]
)


@LENGTHS
@pytest.mark.requirement(67)
@pytest.mark.slow
def test_the_same_seed_gives_the_same_run_and_another_another(duration_s: float) -> None:
    first, again, other = (run("study", 1, s, duration_s=duration_s) for s in (5, 5, 6))

    names = ("trace_sha256", "motion_sha256", "localization")
    assert [first.figures[name] for name in names] == [again.figures[name] for name in names]
    assert first.figures["motion_sha256"] != other.figures["motion_sha256"]


@LENGTHS
@pytest.mark.slow
def test_skipping_changes_no_trace(duration_s: float) -> None:
    asked = run("study", 1, duration_s=duration_s)
    all_of_it = run("study", 1, duration_s=duration_s, eager=True)

    for name in ("trace_sha256", "motion_sha256", "served"):
        assert asked.figures[name] == all_of_it.figures[name]
    usage = asked.usage
    assert usage["base.scan"].built
    assert not usage["user.distance"].built


def test_while_the_robot_stands_scans_are_not_matched() -> None:
    """The person stands for 10 s and holds the prop for 30: most scans show nothing new."""
    counts = study().wired.board.slots[ESTIMATE].estimator.localizer.counts

    assert counts["skipped"] > counts["matched"] > 0
    assert f"skipped {counts['skipped']}" in explain(study())


@pytest.mark.requirement(6, 114)
def test_who_leaves_the_tracked_area_is_shown_the_robot_and_it_stands() -> None:
    result = run("tracked_area", None, duration_s=45.0)
    loop, figures = result.loop, result.figures

    assert figures["served"] >= 1
    assert len(figures["dropouts"]) == 1
    lost = figures["dropouts"][0]["from_s"]
    shown = [v.entered_ns / 1e9 for v in visits(loop.wired.run, "inform") if v.entered_ns]
    assert any(lost < at < lost + 1.0 for at in shown)
    assert loop.plant.guard.chain.latched == "tracking of the user is lost"
    assert figures["contacts"] == 0


def test_a_robot_without_sensors_or_room_is_refused() -> None:
    setup = open_setup(scene="study")
    blind = replace(setup, robot=replace(setup.robot, sensing=Sensing()))

    with pytest.raises(Problem, match=r"rbkairos_ur10: tier 2 needs wheels .* sensing\.odometry"):
        stage(blind, Options(tier=2))
    nowhere = open_setup(robot="rbkairos_ur10")
    with pytest.raises(Problem, match="tier 2 needs a room"):
        stage(nowhere, Options(tier=2))


def served_share(setup: Setup, requests: int, seed: int) -> tuple[int, int, int]:
    figures = simulate(setup, Options(requests=requests, tier=2, seed=seed)).figures
    return figures["served"], figures["requests"], figures["contacts_by_robot"]


@pytest.mark.slow
@pytest.mark.parametrize("seed", fewer([12, 11], of=2))
def test_twenty_requests_are_served_without_a_contact_by_the_robot(seed: int) -> None:
    assert served_share(open_setup(scene="study"), 20, seed) == (20, 20, 0)


@pytest.mark.slow
@pytest.mark.requirement(30, 32)
def test_after_a_restart_of_the_tracking_the_robot_goes_by_the_tracking() -> None:
    """Person and DEEP are told in a frame that has turned by 0.9 degrees: drift is noticed."""
    setup = open_setup(scene="study")
    plant = setup.profile.plant
    vive = replace(plant.sensing.vive, restart=type(plant.sensing.vive.restart)(0.0, 0.0, 0.0157))
    plant = replace(plant, sensing=replace(plant.sensing, vive=vive))
    turned = replace(setup, profile=replace(setup.profile, plant=plant))
    result = simulate(turned, Options(requests=3, tier=2))

    assert result.figures["contacts_by_robot"] == 0
    assert result.figures["localization"]["drift"]


@pytest.mark.slow
@pytest.mark.requirement(26, 27, 30)
def test_amcl_alone_can_be_chosen_by_name() -> None:
    setup = open_setup(scene="study")
    chosen = replace(setup, profile=replace(setup.profile, localization="amcl"))
    found = [simulate(chosen, Options(duration_s=15.0, tier=2)).figures for _ in range(2)]

    assert found[0]["localization"]["rmse_m"] <= 0.06
    assert found[0]["localization"]["max_m"] <= 0.5
    assert found[0]["motion_sha256"] == found[1]["motion_sha256"]
    assert found[0]["contacts"] == 0


@pytest.mark.slow
def test_fewer_beams_and_particles_cost_accuracy() -> None:
    setup = open_setup(scene="study")

    def rmse(localization: str, **effort: int) -> float:
        profile = replace(setup.profile, localization=localization)
        profile = replace(profile, localizer=LocalizerEffort(**effort))
        options = Options(duration_s=15.0, tier=2)
        found = simulate(replace(setup, profile=profile), options).figures
        return float(found["localization"]["rmse_m"])

    assert rmse("combined", beams=20) > 1.2 * rmse("combined", beams=180)
    assert rmse("amcl", particles=10) > 1.2 * rmse("amcl", particles=1000)


TURNED = """tracking: turned
map_from_vive: {xyz: [3.0, -2.0, 0.1], rpy: [0, 0, 140 deg]}
mounts:
  front_tracker: {xyz: [0.30, 0.21, 0.45], rpy: [0, 0, 20 deg]}
  rear_tracker: {xyz: [-0.31, -0.22, 0.45], rpy: [0, 0, 0]}
scanner_yaws: {front_laser: 1 deg}
residual: {position: 2 mm, yaw: 0.05 deg}
"""


def scene_beside(folder: Path, calibration: str) -> str:
    """`study` with its tracking calibrated by a file beside it."""
    text = (Path(__file__).parents[3] / "hw" / "scenes" / "study.yaml").read_text()
    scene = folder / "here.yaml"
    scene.write_text(text.replace("scene: study", f"scene: here\ncalibration: {calibration}"))
    return str(scene)


def test_a_calibration_that_there_is_not_is_named_with_its_place(tmp_path: Path) -> None:
    with pytest.raises(FileError, match=r"here\.yaml:2:\d+: calibration"):
        open_setup(scene=scene_beside(tmp_path, "nowhere"))


@pytest.mark.slow
@pytest.mark.requirement(12, 20)
def test_a_scene_names_its_calibrated_tracking(tmp_path: Path) -> None:
    (tmp_path / "turned.yaml").write_text(TURNED)
    result = run(scene_beside(tmp_path, "turned.yaml"), 1)

    assert result.figures["served"] == 1
    assert result.figures["localization"]["rmse_m"] <= 0.01
    assert result.figures["localization"]["drift"] is None
    counts = result.wired.board.slots[ESTIMATE].estimator.localizer.counts
    assert counts["trackers"] >= 2
