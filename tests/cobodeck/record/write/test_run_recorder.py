"""What a record holds, read by a library that knows nothing of us; and what recording changes."""

from __future__ import annotations

import json
import subprocess
import sys
from collections import Counter
from datetime import UTC, datetime
from enum import Enum
from pathlib import Path
from typing import Any

import pytest
from mcap.reader import make_reader

from cobodeck.record.write.start import recorder
from cobodeck.record.write.taps import Tapped
from cobodeck.run.simulation import RunResult, simulate
from cobodeck.setup.options import Options
from cobodeck.setup.setup import open_setup
from engine.files.text import noting

AT = datetime(2026, 1, 2, 3, 4, 5, tzinfo=UTC)
OPTIONS = Options(requests=1, duration_s=30.0)
WALL_TIME = {"wall_s", "realtime_factor", "cpu_us_per_tick", "overruns"}
FOXGLOVE = {
    "signal/base.pose": "foxglove.FrameTransform",
    "signal/user.pose": "foxglove.FrameTransforms",
    "signal/arm.joints": "foxglove.JointStates",
    "scene": "foxglove.SceneUpdate",
}
"""Schemas of Foxglove, as its documentation names them."""
FIELDS = {
    "foxglove.FrameTransform": {
        "timestamp", "parent_frame_id", "child_frame_id", "translation", "rotation",
    },
    "foxglove.FrameTransforms": {"transforms"},
    "foxglove.JointStates": {"timestamp", "joints"},
    "foxglove.SceneUpdate": {"deletions", "entities"},
}  # fmt: skip


def run(path: Path | None) -> RunResult:
    with noting():
        setup = open_setup(scene="study")
        writer = None if path is None else recorder(setup, OPTIONS, path, AT, pytest.fail)
        return simulate(setup, OPTIONS, recorder=writer)


@pytest.fixture(scope="module")
def kept(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, RunResult]:
    path = tmp_path_factory.mktemp("kept") / "run.mcap"
    return path, run(path)


def test_recording_changes_nothing(kept: tuple[Path, RunResult]) -> None:
    without = run(None).figures

    with_it = kept[1].figures
    counts = {*WALL_TIME, "signals"}  # a recorder gets all repeats, so that they are computed
    assert {k: v for k, v in with_it.items() if k not in counts} == {
        k: v for k, v in without.items() if k not in counts
    }


class Odd:
    """A part that is looked at in every way."""

    class Mode(Enum):
        FAST = 1

    def __init__(self) -> None:
        self.say = lambda: "one"

    @property
    def broken(self) -> float:
        raise ValueError("no such luck")


def test_a_part_behind_a_recorder_is_as_without() -> None:
    told: list[tuple[object, ...]] = []
    odd = Odd()
    tapped = Tapped("odd", odd, lambda *call: told.append(call))

    assert tapped.Mode.FAST is Odd.Mode.FAST
    assert tapped.say() == "one"
    tapped.say = lambda: "two"
    assert tapped.say() == odd.say() == "two"
    with pytest.raises(ValueError, match="no such luck"):
        _ = tapped.broken
    assert [call[1] for call in told] == [".Mode", "say", ".say =", "say", ".broken"]


def test_recording_asks_for_no_signal(kept: tuple[Path, RunResult]) -> None:
    built = {name for name, usage in kept[1].usage.items() if usage.built}

    assert built == {name for name, usage in run(None).usage.items() if usage.built}


def test_another_library_reads_it(kept: tuple[Path, RunResult]) -> None:
    path, result = kept
    schemas: dict[str, str] = {}
    counted = Counter[str]()
    last = 0
    with path.open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True)
        for schema, channel, message in reader.iter_messages(log_time_order=False):
            assert schema is not None
            schemas[channel.topic] = schema.name
            counted[channel.topic] += 1
            found = json.loads(message.data, parse_constant=pytest.fail)  # no NaN in JSON
            assert FIELDS.get(schema.name, set()) <= found.keys()
            assert found.keys() <= json.loads(schema.data)["properties"].keys(), schema.name
            assert message.log_time >= last
            last = message.log_time
        summary = reader.get_summary()
        metadata = {m.name: m.metadata for m in reader.iter_metadata()}
        texts = {a.name: a.data for a in reader.iter_attachments()}
    assert schemas.items() >= FOXGLOVE.items()
    assert summary is not None
    assert summary.statistics is not None
    assert summary.statistics.message_count == counted.total()
    assert counted["tick"] == result.loop.ticks + 1  # and the end
    assert counted["trace"] == len(list(result.wired.run.trace))
    assert json.loads(metadata["result"]["trace_sha256"]) == result.figures["trace_sha256"]
    root = Path(__file__).parents[4]
    assert texts["hw/scenes/study.yaml"] == (root / "hw/scenes/study.yaml").read_bytes()
    assert texts["charts/chase.yaml"] == (root / "charts/chase.yaml").read_bytes()


def test_the_analysis_on_the_page_works_as_it_stands(kept: tuple[Path, RunResult]) -> None:
    page = (Path(__file__).parents[4] / "cobodeck/record/FORMAT.md").read_text()
    code = page.partition("```python\n")[2].partition("```")[0]
    command = [sys.executable, "-c", code, str(kept[0])]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    rows = [[float(number) for number in line.split()] for line in done.stdout.splitlines()]

    assert rows[0][0] == 0.0
    assert rows[-1][0] == pytest.approx(kept[1].figures["sim_s"], abs=0.1)
    gap = kept[1].figures["min_gap_m"]
    assert gap + 0.5 < min(distance for _, distance in rows) < gap + 1.5


def test_poses_are_what_viewers_take_them_for(kept: tuple[Path, RunResult]) -> None:
    poses: list[Any] = []
    with kept[0].open("rb") as stream:
        for _, _, message in make_reader(stream).iter_messages(topics=["signal/base.pose"]):
            poses.append(json.loads(message.data))

    import math

    for pose in poses:
        z, w = pose["rotation"]["z"], pose["rotation"]["w"]
        assert math.hypot(z, w) == pytest.approx(1.0)
        assert math.remainder(2.0 * math.atan2(z, w) - pose["yaw"], 2 * math.pi) == pytest.approx(
            0.0, abs=1e-12
        )
    truth = kept[1].loop.plant.truth
    assert truth is not None
    assert truth.base is not None
    assert (poses[-1]["translation"]["x"], poses[-1]["translation"]["y"]) == (
        truth.base.x, truth.base.y,
    )  # fmt: skip


def test_the_same_run_gives_the_same_messages(kept: tuple[Path, RunResult], tmp_path: Path) -> None:
    run(tmp_path / "again.mcap")

    def messages(path: Path) -> list[tuple[str, int, bytes]]:
        with path.open("rb") as stream:
            read = make_reader(stream).iter_messages(log_time_order=False)
            return [(channel.topic, m.log_time, m.data) for _, channel, m in read]

    assert messages(tmp_path / "again.mcap") == messages(kept[0])


def test_a_record_stays_below_two_megabytes_a_minute(kept: tuple[Path, RunResult]) -> None:
    path, result = kept

    assert path.stat().st_size / (result.figures["sim_s"] / 60.0) < 2e6
