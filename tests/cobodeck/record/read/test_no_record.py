"""What is no record of a run is told in one sentence, and waited for by nobody."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from cobodeck.record.read.reader import Record
from engine.files.finding import FileError


def test_only_regular_files_are_opened(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe.mcap"
    os.mkfifo(pipe)

    for path in (pipe, tmp_path, Path(os.devnull)):
        with pytest.raises(FileError, match="it is no regular file"):
            Record(path)


@pytest.mark.parametrize("content", [b"", b"\x89MCAP0\r\n", b"{}\n", bytes(1000)])
def test_what_is_in_it_is_told(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "other.mcap"
    path.write_bytes(content)

    with pytest.raises(FileError, match="is no record of a run"):
        Record(path)
