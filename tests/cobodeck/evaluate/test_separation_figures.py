"""What the records of the safety chain come to in a run."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from cobodeck.__main__ import main
from cobodeck.evaluate.separation_figures import SeparationWatch
from hw.geometry import STILL
from hw.safety.cycle_log import CycleLog
from hw.safety.cycle_record import SafetyRecord

CYCLE = 8_000_000


def record(cycle: int, gap: float | None, needed: float, *reasons: str) -> SafetyRecord:
    return SafetyRecord(cycle * CYCLE, STILL, STILL, gap, needed, reasons=reasons)


def test_time_below_the_separation_needed_is_counted_apart_from_granted_touches() -> None:
    cycles = CycleLog(10)
    watch, other = SeparationWatch(cycles), cycles.reader()
    first = [record(1, 2.0, 1.5), record(2, 1.0, 1.2), record(3, 0.9, 0.0)]
    then = [record(4, 0.8, 1.0, "separation"), record(5, 0.2, 0.6, "granted touch")]
    for records in (first, [*then, record(6, None, 0.0)]):
        for one in records:
            cycles.append(one)
        watch.watch(0)
        assert other.read_new() == records  # nobody takes them away from anybody

    found = watch.report()

    assert found["moving_s"] == pytest.approx(0.042)  # the first cycle counts 10 ms, the last none
    assert found["below_needed_s"] == pytest.approx(0.016)
    assert found["granted_s"] == pytest.approx(0.008)
    assert found["min_gap_m"] == 0.2
    assert found["min_margin_m"] == pytest.approx(-0.2)


def test_a_pause_between_two_drives_is_no_motion() -> None:
    cycles = CycleLog(10)
    cycles.append(record(0, 3.0, 1.0))
    cycles.append(record(1000, 3.0, 3.5))
    watch = SeparationWatch(cycles)
    watch.watch(0)

    assert watch.report()["moving_s"] == pytest.approx(0.02)
    assert watch.report()["below_needed_s"] == pytest.approx(0.01)


@pytest.mark.requirement(52)
@pytest.mark.parametrize("profile", ["tuned", "paper"])
@pytest.mark.few(1)
def test_a_run_reports_its_separation_whether_the_governor_keeps_it_or_not(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    profile: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    main(["simulate", "--scene", "study", "--requests", "1", "--profile", profile, "--json"])
    figures: Any = json.loads(capsys.readouterr().out)
    found = figures["separation"]

    assert figures["person_watched"] is True
    assert figures["governor"] is (profile == "tuned")
    assert found["moving_s"] > 5.0
    assert found["below_needed_s"] < 0.1 * found["moving_s"]
    assert (found["min_margin_m"] > -0.06) is (profile == "tuned")
    assert found["min_gap_m"] >= figures["min_gap_m"] - 0.02
