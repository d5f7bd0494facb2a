"""Of a record that was broken off or damaged, all that is whole is recovered, up to a tick."""

from __future__ import annotations

import json
import random
import re
import subprocess
import sys
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

import pytest
from mcap.reader import make_reader

from cobodeck.__main__ import main
from cobodeck.record.read.reader import Record, RecordedMessage
from cobodeck.record.read.record_replay import stage_replay
from cobodeck.record.write.record_recovery import extent
from engine.files.finding import FileError
from tests.cobodeck.record import killed
from tests.cobodeck.record.killed import CLOSE, LINK, TICK, UNLINK, WRITE, Kill

FOR_EVER = 1 << 61
SECOND_NS = 10**9
MOCK = ["run", "cobodeck", "--robot", "mock", "--fast"]


class Whole(NamedTuple):
    """A record, and its ticks: messages and instants."""

    path: Path
    data: bytes
    ticks: list[tuple[RecordedMessage, ...]]
    instants: list[int]


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Whole:
    path = tmp_path_factory.mktemp("whole") / "run.mcap"
    assert main([*MOCK, "--duration", "8", "--record", str(path)]) == 0
    groups = list(Record(path).groups())
    ticks = [(*group.told, group.closing) for group in groups]
    return Whole(path, path.read_bytes(), ticks, [group.ticked.at_ns for group in groups])


def recovered(path: Path, capsys: pytest.CaptureFixture[str]) -> dict[str, Any]:
    """What `recover` says of a file."""
    capsys.readouterr()
    assert main(["recover", str(path), "--json"]) == 0
    found: dict[str, Any] = json.loads(capsys.readouterr().out)
    return found


def opened(path: Path) -> Record | None:
    """A record; None: it says that it is none."""
    try:
        return Record(path)
    except FileError:
        return None


def replay_to_its_end(path: Path) -> int:
    """Replay a record; how many ticks it had."""
    replay = stage_replay(Record(path))
    replay.loop.go(FOR_EVER)
    assert replay.difference is None
    return replay.checker.ticks


def contents(path: Path) -> tuple[Any, ...]:
    """All that is in a file, as another library reads it."""
    with path.open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True)
        metadata = {m.name: m.metadata for m in reader.iter_metadata()}
        attachments = [(a.name, a.media_type, a.data) for a in reader.iter_attachments()]
        messages = [
            (c.topic, c.message_encoding, s and (s.name, s.encoding, s.data), m.log_time, m.data)
            for s, c, m in reader.iter_messages(log_time_order=False)
        ]
    return metadata, attachments, messages


def test_what_is_recovered_is_the_same_up_to_its_end(
    whole: Whole, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "run.mcap.part"
    cut = whole.data[: len(whole.data) * 2 // 3]
    path.write_bytes(cut)

    found = recovered(path, capsys)

    metadata, attachments, messages = contents(whole.path)
    again = contents(tmp_path / "run.recovered.mcap")
    count = sum(map(len, whole.ticks[: found["ticks"]]))
    assert 0 < count < len(messages)
    assert again[1:] == (attachments, messages[:count])
    assert again[0]["run"] == metadata["run"]
    about = {name: json.loads(text) for name, text in again[0]["recovered"].items()}
    assert about == {
        "of": str(path),
        "end_ns": whole.instants[found["ticks"] - 1],
        "why": found["broken"],
    }
    assert "result" not in again[0]
    assert f"of {len(cut)}" in found["broken"]
    assert path.read_bytes() == cut
    assert found["recovered_file"] == str(tmp_path / "run.recovered.mcap")
    assert replay_to_its_end(tmp_path / "run.recovered.mcap") == found["ticks"]


def test_a_record_cut_in_its_summary_keeps_its_figures(
    whole: Whole, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "run.mcap"
    path.write_bytes(whole.data[:-40])

    found = recovered(path, capsys)

    metadata, *rest = contents(whole.path)
    again, *same = contents(Path(found["recovered_file"]))
    assert same == rest
    assert again["result"] == metadata["result"]
    assert found["ticks"] == len(whole.ticks) - 1  # and the end


@pytest.mark.slow
def test_a_chunk_ends_within_a_second(whole: Whole, tmp_path: Path) -> None:
    """Wherever the file is cut, what is lost of the part before is less than a second."""
    rng, path = random.Random(1), tmp_path / "cut.mcap.part"
    ends = dict[int, int]()
    for place in sorted(rng.sample(range(len(whole.data)), 200)):
        path.write_bytes(whole.data[:place])
        record = opened(path)
        if record is None:
            assert place < len(whole.data) // 4
            continue
        found = extent(record)
        assert found.broken is not None
        assert found.damaged == ()
        for group, tick in zip(Record(path).groups(), whole.ticks, strict=False):
            assert (*group.told, group.closing) == tick
        if found.end_ns is not None:
            assert found.end_ns == whole.instants[found.groups - 1]
            ends[found.end_ns] = place
    assert min(ends) == 0
    assert max(ends) == whole.instants[-1]
    assert all(after - before < SECOND_NS for before, after in pairwise(ends))


@pytest.mark.slow
def test_wherever_a_byte_is_damaged_what_is_recovered_is_a_beginning(
    whole: Whole, tmp_path: Path
) -> None:
    rng, path = random.Random(2), tmp_path / "damaged.mcap"
    header = Record(whole.path).header
    told = 0
    for place in rng.sample(range(len(whole.data)), 200):
        data = bytearray(whole.data)
        data[place] ^= 1 << rng.randrange(8)
        path.write_bytes(data)
        record = opened(path)
        if record is None:
            told += 1
            continue
        found = extent(record)
        groups = [g for g, _ in zip(record.groups(), range(found.groups), strict=False)]
        ticks = [(*group.told, group.closing) for group in groups]
        assert ticks == whole.ticks[: found.groups]
        if found.groups < len(whole.ticks) or found.damaged or record.header != header:
            assert found.broken is not None
        told += found.broken is not None
    assert told > 150


def test_what_stands_after_a_gap_is_not_recovered(
    whole: Whole, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A chunk whose kind is damaged looks like one that any reader may leave out."""
    chunks = [m.start() for m in re.finditer(rb"\x06.{7}\0.{28}\x04\0\0\0zstd", whole.data, re.S)]
    data = bytearray(whole.data)
    data[chunks[3]] = 0x80
    path = tmp_path / "run.mcap"
    path.write_bytes(data)

    found = recovered(path, capsys)

    assert 0 < found["ticks"] < len(whole.ticks) // 2
    assert "missing or altered" in found["broken"]
    assert replay_to_its_end(tmp_path / "run.recovered.mcap") == found["ticks"]


def test_a_damaged_attachment_is_named(
    whole: Whole, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "run.mcap.part"
    path.write_bytes(whole.data.replace(b"chart: chase", b"chart: chose")[:-100])

    assert recovered(path, capsys)["damaged"] == ["charts/chase.yaml"]


def test_of_a_whole_record_nothing_is_written(
    whole: Whole, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "run.mcap.part"
    path.write_bytes(whole.data)

    assert main(["recover", str(path)]) == 0

    assert f"rename it to {tmp_path / 'run.mcap'}" in capsys.readouterr().out
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize(
    ("size", "told"),
    [(0, "is no record of a run"), (50, "is no record of a run"), (20_000, "no complete tick")],
)
def test_what_holds_no_tick_is_told_in_a_sentence(
    size: int, told: str, whole: Whole, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "run.mcap.part"
    path.write_bytes(whole.data[:size])

    assert main(["recover", str(path)]) == 1

    found = capsys.readouterr()
    assert told in found.err
    assert found.err.count("\n") == 1
    assert list(tmp_path.iterdir()) == [path]


def test_a_text_is_no_record(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "run.mcap").write_text("a text\n" * 99)

    assert main(["recover", str(tmp_path / "run.mcap")]) == 1
    assert "is no record of a run: it is no MCAP file" in capsys.readouterr().err


def test_no_older_file_is_written_over(
    whole: Whole, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path, taken = tmp_path / "run.mcap.part", tmp_path / "run.recovered.mcap"
    path.write_bytes(whole.data[:-100])
    taken.write_text("an older file")

    assert recovered(path, capsys)["recovered_file"] == str(tmp_path / "run.recovered-2.mcap")
    assert main(["recover", str(path), "-o", str(taken)]) == 2
    assert "exists" in capsys.readouterr().err
    assert taken.read_text() == "an older file"


def run_and_kill(kill: Kill, arguments: list[str], folder: Path) -> float:
    """Run a program that kills itself; how far it had got, s."""
    program = [sys.executable, killed.__file__, kill.argument(), "reached"]
    died = subprocess.run(
        [*program, *arguments, "--record", "run.mcap"],
        cwd=folder, capture_output=True, timeout=300, check=False,
    )  # fmt: skip
    assert died.returncode == -9, died.stderr
    return int((folder / "reached").read_text()) / 1e9


STUDY = ["simulate", "--scene", "study", "--duration", "5"]
LASTING = [*MOCK, "--duration", "5"]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kill", "arguments"),
    [
        (Kill(TICK, 1, "after"), LASTING),
        (Kill(TICK, 100), STUDY),
        (Kill(WRITE, 70, "amid"), LASTING),
        (Kill(WRITE, 5, "amid", CLOSE), STUDY),
        (Kill(LINK), LASTING),
        (Kill(UNLINK, 1, "before", LINK), STUDY),
    ],
    ids=str,
)
def test_of_a_run_that_is_killed_less_than_a_second_is_lost(
    kill: Kill, arguments: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    reached = run_and_kill(kill, arguments, tmp_path)

    found = recovered(tmp_path / "run.mcap.part", capsys)

    assert reached - 1.0 < found["end_s"] <= reached
    assert replay_to_its_end(Path(found["recovered_file"] or found["file"])) == found["ticks"]
