"""A whole run on fakes: every driver against its fake, one world, and a person who is served."""

from __future__ import annotations

import json
import os
import re
import select
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from cobodeck.__main__ import main
from cobodeck.record.read.reader import Record
from cobodeck.terminal.console import OK
from tests.repeats import long_form

ROOT = Path(__file__).resolve().parents[3]
PATIENCE_S = 240.0
BUSY = 0.005
"""If more of the steps of the world are late than this, the machine is too busy to tell."""
STARVED = 0.05
"""If more of the ticks are missed than this, the machine is too busy for a request to be served:
the base stops at each, as its command is old."""
PATIENT = """user: patient
about: Asks as `brief` does, but for 15 s instead of 6, so that a busy machine can serve, too.
repeat: true
steps:
  - stand: 2
  - request: {hold: 15}
  - stand: 2
"""
_LATE = re.compile(r"the world of the fakes was late in (\d+) of (\d+) steps")
_TICK = os.sysconf("SC_CLK_TCK") if hasattr(os, "sysconf") else 100


@dataclass(frozen=True)
class Ran:
    """What came of a run; `cores` is the processor time of the engine over that of the run."""

    figures: dict[str, Any]
    record: Path
    cores: float
    peak_mb: float
    took_s: float


def run(folder: Path, *arguments: str) -> Ran:
    """The command as a newcomer types it, but for the folder."""
    record = folder / "run.mcap"
    command = [sys.executable, "-m", "cobodeck", "run", "cobodeck", "--robot", "fakes", "--json",
               "--record", str(record), *arguments]  # fmt: skip
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    began = time.monotonic()
    with (folder / "stderr").open("w") as errors:
        process = subprocess.Popen(
            command, cwd=folder, env=environment, stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE, stderr=errors,
        )  # fmt: skip
        assert process.stdout is not None
        out, cpu_s, peak_mb = b"", 0.0, 0.0
        with process:
            while time.monotonic() - began < PATIENCE_S:
                if select.select([process.stdout], [], [], 0.5)[0]:
                    piece = os.read(process.stdout.fileno(), 1 << 16)
                    out += piece
                    if not piece:
                        break
                cpu_s, peak_mb = spent(process.pid) or (cpu_s, peak_mb)
            else:
                process.terminate()
    told = (folder / "stderr").read_text()
    assert process.returncode == OK, told
    late = _LATE.search(told)
    if late and int(late[1]) > BUSY * int(late[2]):
        pytest.skip(f"this machine is too busy: {late[0]}")
    figures = json.loads(out)
    return Ran(figures, record, cpu_s / figures["wall_s"], peak_mb, time.monotonic() - began)


def patient(folder: Path) -> str:
    """The file of a person who asks for long."""
    file = folder / "patient.yaml"
    file.write_text(PATIENT)
    return str(file)


def require_served(figures: dict[str, Any], count: int) -> None:
    """All were served; who was not tells nothing if the processor was not there for the run."""
    missed, ticks = figures["missed"], figures["ticks"]
    if figures["served"] != count and missed > STARVED * ticks:
        pytest.skip(f"this machine is too busy: {missed} of {ticks} ticks missed")
    assert figures["served"] == count, figures


def spent(pid: int) -> tuple[float, float] | None:
    """Processor time in s and the most memory in MB of a process; None once it has ended."""
    try:
        stat = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
        status = Path(f"/proc/{pid}/status").read_text()
    except OSError:
        return None
    peak = re.search(r"VmHWM:\s+(\d+) kB", status)
    return (int(stat[11]) + int(stat[12])) / _TICK, int(peak[1]) / 1e3 if peak else 0.0


def simulated_names(capsys: pytest.CaptureFixture[str], *arguments: str) -> set[str]:
    assert main(["simulate", "--tier", "2", "--json", *arguments]) == OK
    return set(json.loads(capsys.readouterr().out))


@pytest.mark.slow
@pytest.mark.requirement(9, 48, 114)
def test_a_request_is_served_on_fakes_and_the_record_replays(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    asks = ("--user", patient(tmp_path), "--requests", "1")
    ran = run(tmp_path, *asks)
    figures = ran.figures

    assert (figures["requests"], figures["contacts"]) == (1, 0)
    require_served(figures, 1)
    assert (figures["errors"], figures["measured"], figures["person_watched"]) == ([], False, True)
    assert figures["prop_error_m"]["max"] < 0.02
    assert figures["separation"]["moving_s"] > 0.0
    assert figures["localization"]["max_m"] < 0.15
    assert set(figures) == simulated_names(capsys, *asks)
    assert main(["replay", str(ran.record), "--check"]) == OK
    assert re.search(r"result +equal", capsys.readouterr().out)
    cycles = [cycle for group in Record(ran.record).groups() for cycle in group.messages("safety")]
    assert len(cycles) > 100
    assert all({"separation", "needed", "reasons"} <= cycle.keys() for cycle in cycles)


@long_form
@pytest.mark.slow
@pytest.mark.requirement(9, 48, 114)
def test_five_requests_are_served_on_fakes_within_one_core(
    tmp_path: Path, record_property: Any
) -> None:
    ran = run(tmp_path, "--scene", "lab_a", "--user", patient(tmp_path), "--requests", "5")
    figures = ran.figures
    for name in ("response_s", "missed", "overruns", "ticks", "localization", "min_gap_m"):
        record_property(name, figures[name])
    record_property("engine_cores", ran.cores)
    record_property("engine_mb", ran.peak_mb)

    assert (figures["requests"], figures["contacts"], figures["errors"]) == (5, 0, [])
    require_served(figures, 5)
    if sys.platform == "linux":
        assert 0.0 < ran.cores <= 1.0
        assert 0.0 < ran.peak_mb <= 500.0


STEPS_IN = """user: steps_in
about: Asks for a touch, and walks through the robot the moment they let go.
start: {x: 5.5, y: 5.0, yaw: 180 deg}
speed: 1.2
steps:
  - stand: 6
  - request: {hold: 16, ahead: 0.85, height: 1.2}
  - walk: {x: 2.5, y: 5.0, yaw: 180 deg}
  - stand: 2
"""


def judged(figures: dict[str, Any], record: Path) -> None:
    """Served, and what touched the person who stepped in closed slowly; S and S_p are recorded."""
    assert (figures["requests"], figures["errors"]) == (1, [])
    assert figures["contacts_by_robot"] == 0
    for contact in figures["contact_list"]:
        assert contact["robot_closing_m_s"] <= 0.25
    calls = [call for group in Record(record).groups() for call in group.messages("parts")]
    paces = [call["args"] for call in calls if (call["part"], call["what"]) == ("arm", "pace")]
    assert all(0.0 < share <= 1.0 and needed > 0.0 for share, _, needed in paces)
    require_served(figures, 1)
    assert len(paces) > 20
    assert min(gap for _, gap, _ in paces) < 0.5


@pytest.mark.slow
@pytest.mark.requirement(9, 45, 51)
def test_a_person_who_steps_in_while_the_arm_folds_is_not_hit_by_it_on_fakes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "steps_in.yaml").write_text(STEPS_IN)
    beside = ("--scene", "lab_a", "--user", "./steps_in.yaml:deaf", "--duration", "34")
    ran = run(tmp_path, *beside)
    judged(ran.figures, ran.record)


@pytest.mark.slow
@pytest.mark.requirement(45, 51)
@pytest.mark.parametrize("tier", ["1", "2"])
def test_a_person_who_steps_in_while_the_arm_folds_is_not_hit_by_it(
    tier: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "steps_in.yaml").write_text(STEPS_IN)
    beside = ["--scene", "lab_a", "--user", "./steps_in.yaml:deaf", "--tier", tier]
    assert main(["simulate", "cobodeck", *beside, "--record", "run.mcap", "--json"]) == OK
    judged(json.loads(capsys.readouterr().out), tmp_path / "run.mcap")
