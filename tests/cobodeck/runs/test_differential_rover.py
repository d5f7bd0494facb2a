"""A rover that only drives ahead and turns: patrols, people in its way, charts it cannot run."""

from pathlib import Path

import pytest

from cobodeck.__main__ import main
from cobodeck.run.build_run import stage
from cobodeck.setup.options import Options
from cobodeck.setup.setup import open_setup
from cobodeck.setup.warmup import warm_up
from cobodeck.terminal.console import FAILED, OK, Problem
from hw.geometry import wrap
from tests.hw.model.differential_rover import runner

NEXT = "no_path: .failed, stuck: .failed, lost: .failed, timeout: .failed, error: .failed"
PATROL = f"""\
chart: patrol
outcomes: [done, failed]
states:
  out:
    do: DriveTo
    in: {{goal: {{x: 8 m, y: 1.2 m}}}}
    timeout: 60 s
    retry: {{times: 20, on: [no_path, stuck], wait: 0.5 s}}
    next: {{arrived: back, {NEXT}}}
  back:
    do: DriveTo
    in: {{goal: {{x: 2 m, y: 1.2 m, yaw: 90 deg}}}}
    timeout: 60 s
    next: {{arrived: .done, {NEXT}}}
"""
SCENE = """\
scene: corridor
room:
  outer: [[0, 0], [14, 0], [14, 2.4], [0, 2.4]]
  columns: [[[5, 0], [5.4, 0], [5.4, 0.2], [5, 0.2]]]
robot: {file: ./runner.yaml, start: {x: 2, y: 1.2, yaw: 90 deg}}
user: {source: ./visitor.yaml}
"""
VISITOR = """\
user: visitor
start: {x: 11, y: 1.2, yaw: 180 deg}
speed: 1.0
steps:
  - walk: {x: 6.5, y: 1.2}
  - stand: 8
  - walk: {x: 13, y: 2}
  - stand: 60
"""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    runner(tmp_path)
    for name, text in (("patrol", PATROL), ("corridor", SCENE), ("visitor", VISITOR)):
        (tmp_path / f"{name}.yaml").write_text(text)
    return tmp_path


@pytest.mark.slow
@pytest.mark.parametrize(("tier", "off"), [(1, 0.02), (2, 0.15)])
def test_it_patrols_never_sideways_and_stops_for_a_person(
    folder: Path, tier: int, off: float
) -> None:
    """A person bars the corridor for a while; it waits at a distance until they have left."""
    setup = open_setup("patrol.yaml", "corridor.yaml")
    loop = stage(setup, Options(tier=tier))
    warm_up(setup, loop.wired.run.machine)
    stood, gap, sideways, before = 0, 9.0, 0.0, None
    while loop.wired.run.outcome is None and loop.next_ns < 120 * 10**9:
        loop.tick()
        truth = loop.plant.truth
        gap = truth.min_gap
        if before is not None:
            moved = before.inverse() @ truth.base
            sideways = max(sideways, abs(moved.y) - abs(moved.x * wrap(moved.yaw)))
            stood += abs(moved.x) < 1e-3 and truth.base.x > 2.1
        before = truth.base
    assert loop.wired.run.outcome == "done"
    assert truth.base.x == pytest.approx(2.0, abs=0.1 + off)
    assert wrap(truth.base.yaw) == pytest.approx(1.5708, abs=0.1 + off)
    assert stood > 2 * 30
    assert gap > 0.2
    assert sideways < 1e-3 if tier == 1 else sideways < 5e-3


def test_charts_that_go_sideways_are_refused_with_the_states(folder: Path) -> None:
    with pytest.raises(Problem) as refused:
        stage(open_setup("cobodeck", "corridor.yaml"), Options())
    told = str(refused.value)
    assert "runner drives as differential only (base.modes)" in told
    assert "chase/follow/make_room (MakeRoom) needs the drive mode omni" in told
    assert "(DriveToBest) needs the drive mode omni" in told


def test_a_mode_that_the_base_has_not_is_told(folder: Path) -> None:
    (folder / "patrol.yaml").write_text(
        PATROL.replace("DriveTo\n", "DriveTo\n    with: {mode: omni}\n")
    )
    with pytest.raises(Problem, match=r"out \(DriveTo\) needs the drive mode omni"):
        stage(open_setup("patrol.yaml", "corridor.yaml"), Options())


@pytest.mark.slow
def test_doctor_and_validate_tell_what_it_cannot_do(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    main(["doctor", "--scene", "corridor.yaml"])
    told = capsys.readouterr().out
    assert "runner drives along its heading only" in told
    lacking = told.partition("charts that need omni: ")[2].partition("\n")[0].split(", ")
    assert {"chase", "cobodeck", "escape"} <= {*lacking}
    assert not {"haptic", "inform"} & {*lacking}

    (folder / "own.yaml").write_text("profile: own\nbase: tuned\nchart: cobodeck\n")
    assert main(["validate", "runner.yaml", "own.yaml"]) == FAILED
    told = capsys.readouterr().out
    assert "own.yaml:3:8: error" in told
    assert "cobodeck needs omni (MakeRoom, DriveToBest); runner drives along its heading" in told
    assert main(["validate", "runner.yaml", "patrol.yaml", "corridor.yaml"]) == OK
