"""A finished record is intact to the last bit, or it is told."""

from __future__ import annotations

import random
from collections.abc import Callable
from pathlib import Path

import pytest
from mcap.records import DataEnd, Footer
from mcap.stream_reader import StreamReader
from mcap.writer import Writer

from cobodeck.__main__ import main
from cobodeck.avoidable.recorded_escapes import read_run
from cobodeck.real.prior_run_search import tried
from cobodeck.real.release_stages import Wanted, found_for
from cobodeck.record.read.reader import Record
from cobodeck.record.read.replayed_person import past
from engine.files.finding import FileError

TAIL = 60
"""Bytes at the end that are tried one by one: summary offsets, footer, magic."""
SUMMARY = 22
"""Bytes about the end of the data that are tried likewise: the last data, and `DataEnd`."""


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("whole") / "run.mcap"
    given = ["--scene", "lab_a", "--duration", "1.5", "--record", str(path)]
    assert main(["simulate", *given]) == 0
    return path


def ends(path: Path) -> tuple[DataEnd, Footer]:
    """The two records that hold checksums, as another library reads them."""
    with path.open("rb") as stream:
        found = list(StreamReader(stream, emit_chunks=True).records)
    (data_end,) = (one for one in found if isinstance(one, DataEnd))
    (footer,) = (one for one in found if isinstance(one, Footer))
    return data_end, footer


def flipped(data: bytes, bit: int) -> bytes:
    altered = bytearray(data)
    altered[bit // 8] ^= 1 << bit % 8
    return bytes(altered)


def checked(path: Path, capsys: pytest.CaptureFixture[str]) -> tuple[int, str]:
    capsys.readouterr()
    return main(["replay", str(path), "--check"]), capsys.readouterr().err


def test_our_records_have_both_checksums_and_pass(
    whole: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    data_end, footer = ends(whole)

    assert 0 not in (data_end.data_section_crc, footer.summary_crc)
    assert checked(whole, capsys) == (0, "")


@pytest.mark.parametrize(
    ("count", "step", "replayed"),
    [(200, 11, 2), pytest.param(2000, 1, 200, marks=pytest.mark.slow)],
)
def test_no_single_flipped_bit_passes(
    count: int,
    step: int,
    replayed: int,
    whole: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """`replayed` of the flipped bits by the command, all by what it asks first.

    Besides, each `step`th bit of what no checksum covers.
    """
    path, data, intact = tmp_path / "run.mcap", whole.read_bytes(), Record(whole)
    summary = ends(whole)[1].summary_start
    border = range(8 * (summary - SUMMARY), 8 * (summary + SUMMARY), step)
    tail = range(8 * (len(data) - TAIL), 8 * len(data), step)
    bits = random.Random(1).sample(range(8 * len(data)), count)
    for number, bit in enumerate([*bits, *border, *tail]):
        path.write_bytes(flipped(data, bit))
        intact.path = path
        assert intact.damage() is not None, bit
        if number < replayed:
            code, told = checked(path, capsys)
            assert code == 1, bit
            assert told.startswith(f"cobodeck: {path}: is ")
            assert told.count("\n") == 1


@pytest.mark.parametrize("change", ["cut", "longer", "doubled"])
def test_a_finished_record_has_its_length(
    change: str, whole: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path, data = tmp_path / "run.mcap", whole.read_bytes()
    changed = {"cut": data[: len(data) // 2], "longer": data + b"\0", "doubled": data + data}
    path.write_bytes(changed[change])

    code, told = checked(path, capsys)

    assert (code, told.count("\n")) == (1, 1)
    assert "is damaged" in told


def test_an_unfinished_record_is_replayed_as_far_as_it_goes(
    whole: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path, data = tmp_path / "run.mcap.part", whole.read_bytes()
    path.write_bytes(data[: len(data) * 9 // 10])

    assert main(["replay", str(path), "--check"]) == 0
    assert "it breaks off at byte" in capsys.readouterr().out

    path.write_bytes(flipped(data, 4 * len(data)))  # it only lacks its name
    assert checked(path, capsys)[0] == 1


def test_a_damaged_record_differs_and_can_be_recovered(
    whole: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path, data = tmp_path / "run.mcap", whole.read_bytes()
    path.write_bytes(flipped(data, 8 * (ends(whole)[1].summary_start + 30)))

    assert main(["compare", str(path), str(whole)]) == 1
    assert "are not those that were written" in capsys.readouterr().out
    assert main(["recover", str(path)]) == 0
    assert checked(tmp_path / "run.recovered.mcap", capsys) == (0, "")


@pytest.mark.parametrize("reads", [past, read_run])
def test_a_damaged_record_has_no_person_and_nothing_to_judge(
    reads: Callable[[Record], object], whole: Path, tmp_path: Path
) -> None:
    path, data = tmp_path / "run.mcap", whole.read_bytes()
    path.write_bytes(flipped(data, 4 * len(data)))

    reads(Record(whole))
    with pytest.raises(FileError, match="is damaged"):
        reads(Record(path))


@pytest.mark.requirement(53)
def test_a_damaged_record_lets_no_robot_move(whole: Path, tmp_path: Path) -> None:
    path, data, header = tmp_path / "run.mcap", whole.read_bytes(), Record(whole).header
    path.write_bytes(flipped(data, 4 * len(data)))  # its figures can still be read
    assert Record(path).figures() == Record(whole).figures()
    wanted = Wanted(
        files={}, code=header["code"], limits=header["limits"], tick_hz=header["tick_hz"],
        connection=("rover", "c"), person=False, profile=header["profile"]["sha256"],
    )  # fmt: skip

    assert found_for("simulated", [*tried([whole], "simulated", wanted)], wanted).passed
    (why,) = found_for("simulated", [*tried([path], "simulated", wanted)], wanted).why
    assert why == "it did not come to its end, or is damaged"


def test_a_file_without_data_is_intact_by_another_writer(tmp_path: Path) -> None:
    """Checksums are those of the format, not of our writer."""
    for crcs in (True, False):
        path = tmp_path / f"{crcs}.mcap"
        with path.open("wb") as stream:
            writer = Writer(stream, enable_crcs=crcs, enable_data_crcs=crcs)
            writer.start()
            writer.add_metadata("run", {"format": '"cobodeck record 1"'})
            writer.finish()
        record = object.__new__(Record)
        record.path = path
        assert record.damage() is None
        path.write_bytes(path.read_bytes()[:-1])
        assert record.damage() is not None
