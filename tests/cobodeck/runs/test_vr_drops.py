"""A whole run on fakes whose VR link is lost by radio: before, during and after a touch."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

from cobodeck.record.read.reader import Record
from hw.connection.connection import FOLDER
from tests.cobodeck.real.test_fakes_run import require_served, run

pytestmark = [pytest.mark.slow, pytest.mark.realtime]
TWICE = """user: twice
about: Asks for a touch twice, and stands for a while before, between and after.
start: {x: 5.5, y: 5.0, yaw: 180 deg}
steps:
  - stand: 6
  - request: {hold: 22, ahead: 0.85, height: 1.2}
  - stand: 9
  - request: {hold: 22, ahead: 0.85, height: 1.2}
  - stand: 2
"""
LOST = ((2.0, 4.0), (20.0, 21.0), (36.0, 41.0))
"""From when to when, in s since the robot was first shown; asked is from about 10 to 23 s."""
GIVEN_UP_S, WITHIN_S = 1.2, 1.0


def samples(record: Path, name: str) -> list[tuple[float, Any]]:
    """The samples of a signal, each with the time of its tick, s."""
    return [
        (group.ticked.at_ns * 1e-9, sample)
        for group in Record(record).groups()
        for sample in group.messages(f"signal/{name}")
    ]


@pytest.mark.requirement(48, 149)
def test_a_session_goes_on_after_each_drop_of_its_vr_link(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    text = (FOLDER / "fakes.yaml").read_text()
    faults = [[at, name] for lost in LOST for at, name in zip(lost, ("lost", "none"), strict=True)]
    wanted = "clock_offset: 1000.5\n"
    assert text.count(wanted) == 1
    (tmp_path / "drops.yaml").write_text(text.replace(wanted, f"{wanted}    faults: {faults}\n"))
    (tmp_path / "twice.yaml").write_text(TWICE)
    ran = run(tmp_path, "--robot", "./drops.yaml", "--scene", "lab_a", "--user", "./twice.yaml")

    figures = ran.figures
    assert (figures["requests"], figures["contacts"], figures["errors"]) == (2, 0, [])
    require_served(figures, 2)
    assert figures["fault_names"] == {"tracking of the user is lost": len(LOST)}
    stops = [bool(sample["value"]) for _, sample in samples(ran.record, "stop.engaged")]
    assert stops == [False, *[True, False] * len(LOST)]
    seen = [at for at, _ in samples(ran.record, "user.pose")]
    gaps = [after - before for before, after in pairwise(seen)]
    long = [gap for gap in gaps if gap > 0.5]
    assert len(long) == len(LOST)
    for gap, (gone, back) in zip(long, LOST, strict=True):
        assert gap <= max(GIVEN_UP_S, back - gone) + WITHIN_S
