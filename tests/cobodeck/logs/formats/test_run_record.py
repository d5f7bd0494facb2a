"""The product's own records as logs."""

import gzip
from pathlib import Path

import pytest

from cobodeck.__main__ import main
from cobodeck.logs.log_files import open_log
from engine.files.finding import FileError


@pytest.fixture(scope="module")
def record(tmp_path_factory):
    path = tmp_path_factory.mktemp("records") / "run.mcap"
    words = "simulate --tier 2 --scene hall --duration 3.5 --record"
    main([*words.split(), str(path)])
    return path


def test_a_record_tells_sensors_truth_and_room(record):
    log = open_log(record)

    assert log.form == "record"
    assert {"base.odometry", "base.scan"} <= {sample.name for sample in log.samples}
    assert set(log.sensing.lidars) == {"front_laser", "rear_laser"}
    assert log.room is not None
    assert len(log.reference) > 30
    stamps = [sample.stamp_ns for sample in log.samples]
    assert stamps == sorted(stamps)


def test_a_packed_record_is_the_same(record, tmp_path):
    packed = tmp_path / "run.bin"
    packed.write_bytes(gzip.compress(record.read_bytes()))

    assert open_log(packed).samples == open_log(record).samples


def test_a_record_that_breaks_off_is_read_up_to_there(record, tmp_path):
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(record.read_bytes()[: int(0.7 * record.stat().st_size)])
    log = open_log(cut)

    assert 0 < len(log.samples) < len(open_log(record).samples)
    assert any("breaks off" in remark for remark in log.remarks)


def test_a_record_without_sensors_is_told(tmp_path):
    path = tmp_path / "tier1.mcap"
    main(["simulate", "--scene", "hall", "--duration", "0.5", "--record", str(path)])

    with pytest.raises(FileError, match="is a record without usable data"):
        open_log(Path(path))
