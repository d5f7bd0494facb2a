"""Only regular files up to their limit are read."""

import os
from pathlib import Path

import pytest

from engine.files.declared.item import load_yaml
from engine.files.finding import FileError
from engine.files.text import instead, is_file, noting, read_bytes, read_text


def test_files_that_cannot_be_read_are_errors_of_the_file(tmp_path):
    for path in (tmp_path / "missing.yaml", tmp_path, Path("a\0b")):
        with pytest.raises(FileError, match="cannot be read"):
            load_yaml(path, lambda item: item)
    (tmp_path / "binary.yaml").write_bytes(b"a: 1\nb: \xff\xfe\n")
    with pytest.raises(FileError, match=r"binary.yaml:2:4: byte 0xff is not UTF-8"):
        load_yaml(tmp_path / "binary.yaml", lambda item: item)
    (tmp_path / "large.yaml").write_bytes(b"#" * 1_000_001)
    with pytest.raises(FileError, match="has 1000001 bytes; at most 1000000"):
        load_yaml(tmp_path / "large.yaml", lambda item: item)


def test_a_pipe_is_not_waited_for(tmp_path):
    os.mkfifo(tmp_path / "pipe.yaml")
    with pytest.raises(FileError, match="no regular file"):
        read_bytes(tmp_path / "pipe.yaml", 100)


def test_a_name_that_no_file_can_have_is_that_of_none(tmp_path):
    assert not any(map(is_file, (Path("x" * 5000), Path("a\0b"), tmp_path)))
    (tmp_path / "file").touch()
    assert is_file(tmp_path / "file")
    with pytest.raises(FileError, match="File name too long"):
        read_bytes(Path("x" * 5000), 10)


@pytest.mark.skipif(not Path("/dev/zero").exists(), reason="no /dev/zero")
def test_a_device_is_not_read_to_its_end():
    with pytest.raises(FileError, match="no regular file"):
        read_bytes(Path("/dev/zero"), 100)


def test_a_file_up_to_its_limit_is_read_and_a_byte_more_is_not(tmp_path):
    (tmp_path / "file").write_bytes(b"\xef\xbb\xbf\xc3\xa4")
    assert read_text(tmp_path / "file", 5) == "ä"
    with pytest.raises(FileError, match="at most 4"):
        read_text(tmp_path / "file", 4)


def test_the_line_of_a_byte_that_is_no_text_is_told(tmp_path):
    (tmp_path / "file").write_bytes(b"a\nb\n\xff")
    with pytest.raises(FileError, match=r"file:3:1: byte 0xff is not UTF-8"):
        read_text(tmp_path / "file", 10)


def test_what_is_read_in_place_of_a_file_is_noted_as_that_file(tmp_path):
    path = tmp_path / "a.yaml"
    path.write_bytes(b"of today")
    with noting() as noted, instead({path: b"of then"}):
        assert read_bytes(path, 100) == b"of then"
    assert noted == {path: b"of then"}
