"""Whatever becomes of its file, a run goes on, and no older file is touched."""

from __future__ import annotations

import errno
import io
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, strategies as st

import cobodeck.run.simulation
from cobodeck.__main__ import main
from cobodeck.record.format.sink import Sink, Taken, open_free
from cobodeck.record.read.reader import Record
from cobodeck.record.write.record_recovery import extent
from cobodeck.record.write.start import recorder
from cobodeck.run.simulation import RunResult, simulate
from cobodeck.setup.options import Options
from cobodeck.setup.setup import Setup, open_setup
from cobodeck.terminal.record_names import PART
from engine.files.finding import FileError
from engine.files.text import noting

AT = datetime(2026, 1, 2, 3, 4, 5, tzinfo=UTC)
OPTIONS = Options(duration_s=3.0)
WALL_TIME = {"wall_s", "realtime_factor", "cpu_us_per_tick", "overruns"}
SHORT = ["--scene", "study", "--duration", "2"]
OLD = "an older file"


class Small(io.FileIO):
    """A file on a disk with room for so many bytes, that takes up to `step` bytes at once."""

    room = 1 << 40
    step: int | None = None

    def write(self, data: Any) -> int:
        left = self.room - self.tell()
        if left <= 0:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        return super().write(data[:left][: self.step])


@pytest.fixture
def disk(monkeypatch: pytest.MonkeyPatch) -> Callable[[int], None]:
    """Sets the room for each file that is written from then on, bytes."""
    original = Path.open

    def opened(path: Path, mode: str = "r", *args: Any, **named: Any) -> Any:
        if path.suffix == PART and "x" in mode:
            return Small(path, mode)
        return original(path, mode, *args, **named)

    monkeypatch.setattr(Path, "open", opened)
    return lambda room: monkeypatch.setattr(Small, "room", room)


@pytest.fixture(scope="module")
def study() -> Iterator[Setup]:
    with noting():
        yield open_setup(scene="study")


def run(setup: Setup, path: Path, told: list[str]) -> RunResult:
    return simulate(setup, OPTIONS, recorder=recorder(setup, OPTIONS, path, AT, told.append))


def lasting(result: RunResult) -> dict[str, Any]:
    return {k: v for k, v in result.figures.items() if k not in WALL_TIME}


@pytest.fixture(scope="module")
def undisturbed(study: Setup, tmp_path_factory: pytest.TempPathFactory) -> tuple[RunResult, int]:
    """A run whose disk is not full, and the size of its record."""
    path = tmp_path_factory.mktemp("kept") / "run.mcap"
    result = run(study, path, [])
    return result, path.stat().st_size


@pytest.mark.parametrize(
    "places", [range(2, 20, 5), pytest.param(range(20), marks=pytest.mark.slow)], ids=len
)
def test_a_full_disk_is_told_once_and_changes_nothing(
    places: range,
    study: Setup,
    undisturbed: tuple[RunResult, int],
    disk: Callable[[int], None],
    tmp_path: Path,
    capfd: pytest.CaptureFixture[str],
) -> None:
    whole, size = undisturbed
    kept = 0
    for place in places:
        folder = tmp_path / str(place)
        folder.mkdir()
        (folder / "old.mcap").write_text(OLD)
        path, told = folder / "run.mcap", list[str]()
        disk(size * place // 20)

        result = run(study, path, told)

        assert result.record_file is None
        assert lasting(result) == lasting(whole)
        assert len(told) == 1
        assert told[0].startswith(f"no record: {path}: No space left on device")
        assert capfd.readouterr().err == ""
        assert (folder / "old.mcap").read_text() == OLD
        part = folder / f"run.mcap{PART}"
        assert set(folder.iterdir()) <= {folder / "old.mcap", part}
        assert part.exists() == ("cobodeck recover" in told[0])
        if part.exists():
            kept += 1
            assert extent(Record(part)).ticks > 0
    assert kept > len(places) // 4


@pytest.fixture
def tmpfs(tmp_path: Path) -> Iterator[Callable[[int], Path]]:
    """Mounts a small disk, by its size in kB, in place of the one before."""
    place = tmp_path / "disk"
    place.mkdir()

    def umount() -> None:
        if place.is_mount():
            subprocess.run(["umount", place], check=True)

    def mount(kilobytes: int) -> Path:
        umount()
        command = ["mount", "-t", "tmpfs", "-o", f"size={kilobytes}k", "tmpfs", place]
        try:
            subprocess.run(command, check=True, capture_output=True)
        except (OSError, subprocess.CalledProcessError) as error:
            pytest.skip(f"a disk of its own cannot be mounted here: {error}")
        return place

    yield mount
    umount()


@pytest.mark.slow
def test_on_a_disk_that_is_truly_full_a_run_goes_on(
    study: Setup, undisturbed: tuple[RunResult, int], tmpfs: Callable[[int], Path]
) -> None:
    whole, size = undisturbed
    for place in range(20):
        folder, told = tmpfs(8 + 4 * (size * place // 20 // 4096)), list[str]()
        (folder / "old.mcap").write_text(OLD)

        result = run(study, folder / "run.mcap", told)

        assert lasting(result) == lasting(whole)
        assert len(told) == 1
        assert (folder / "old.mcap").read_text() == OLD


@pytest.mark.parametrize(("given", "code"), [(["--record", "run.mcap"], 1), ([], 0)])
def test_a_full_disk_fails_a_run_only_if_its_record_was_asked_for(
    given: list[str],
    code: int,
    disk: Callable[[int], None],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    disk(10_000)

    assert main(["run", "cobodeck", "--robot", "mock", "--fast", *SHORT, *given]) == code

    found = capfd.readouterr()
    assert found.err.count("\n") == 1
    assert "No space left on device" in found.err
    assert "ended as asked: the time is up" in found.out


def test_of_a_trace_file_that_does_not_fit_nothing_is_left(
    disk: Callable[[int], None],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    disk(1000)

    assert main(["simulate", *SHORT, "--record", "run.jsonl"]) == 1

    assert capfd.readouterr().err == (
        "cobodeck: no trace file: run.jsonl: No space left on device\n"
    )
    assert list(tmp_path.iterdir()) == []


RUN = ["run", "cobodeck", "--robot", "mock", "--fast", *SHORT]


@pytest.mark.parametrize(
    ("arguments", "code", "told"),
    [
        (RUN, 0, "no record: out: Not a directory"),
        ([*RUN, "--record", "out/run.mcap"], 1, "no record: out: Not a directory"),
        (["simulate", *SHORT], 0, "no trace file: out: Not a directory"),
        (["simulate", *SHORT, "--record", "out/x"], 1, "no trace file: out: Not a directory"),
    ],
)
def test_a_folder_that_cannot_be_made_is_told_once(
    arguments: list[str],
    code: int,
    told: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "out").write_text(OLD)

    assert main(arguments) == code

    found = capfd.readouterr()
    assert found.err.startswith(f"cobodeck: {told}")
    assert found.err.count("\n") == 1
    assert "ended as asked: the time is up" in found.out
    assert (tmp_path / "out").read_text() == OLD


@pytest.mark.parametrize("name", ["run.mcap", "run.jsonl"])
@pytest.mark.parametrize("there", ["a file", "a folder", "a link to nothing", "an unfinished one"])
def test_what_is_there_is_refused_before_anything_runs(
    name: str,
    there: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    path = tmp_path / name
    if there == "a file":
        path.write_text(OLD)
    elif there == "a folder":
        path.mkdir()
    elif there == "a link to nothing":
        path.symlink_to("nothing")
    else:
        path = tmp_path / "run.mcap.part"
        path.write_text(OLD)
        name = "run.mcap"
    before = sorted(tmp_path.iterdir())

    def never(*_: object) -> None:
        pytest.fail("it runs")

    monkeypatch.setattr(cobodeck.run.simulation, "simulate", never)

    assert main(["simulate", *SHORT, "--record", name]) == 2

    assert f"{path.name} exists" in capsys.readouterr().err
    assert sorted(tmp_path.iterdir()) == before


def test_two_at_once_of_one_name_are_two_files(tmp_path: Path) -> None:
    sinks = [open_free(tmp_path / "a.b.mcap") for _ in range(3)]
    for number, sink in enumerate(sinks):
        sink.write(b"%d" % number)

    paths = [sink.finish() for sink in sinks]

    assert paths == [tmp_path / name for name in ("a.b.mcap", "a.b-2.mcap", "a.b-3.mcap")]
    assert [path.read_bytes() for path in paths if path] == [b"0", b"1", b"2"]
    assert len(list(tmp_path.iterdir())) == 3


def test_what_is_taken_in_pieces_is_whole(
    disk: Callable[[int], None], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Small, "step", 7)
    sink = Sink(tmp_path / "run.mcap")

    assert sink.write(b"a" * 100) == 100
    assert sink.finish() == sink.path
    assert sink.path.read_bytes() == b"a" * 100


@pytest.mark.parametrize("links", [True, False])
def test_a_name_that_is_taken_meanwhile_stays(
    links: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def no_link(*_: object) -> None:
        raise OSError(errno.EPERM, os.strerror(errno.EPERM))

    if not links:
        monkeypatch.setattr(os, "link", no_link)
    sink = Sink(tmp_path / "run.mcap")
    sink.write(b"new")
    (tmp_path / "run.mcap").write_text(OLD)

    assert sink.finish() == tmp_path / "run-2.mcap"
    assert (tmp_path / "run.mcap").read_text() == OLD
    assert (tmp_path / "run-2.mcap").read_bytes() == b"new"
    assert not sink.part.exists()


def test_a_file_that_cannot_be_brought_to_the_disk_keeps_its_temporary_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fails(_: int) -> None:
        raise OSError(errno.EIO, os.strerror(errno.EIO))

    monkeypatch.setattr(os, "fsync", fails)
    sink = Sink(tmp_path / "run.mcap")
    sink.write(b"new")

    assert sink.finish() is None
    assert sink.error is not None
    assert [path.name for path in tmp_path.iterdir()] == ["run.mcap.part"]


def test_one_file_is_written_by_one_run(tmp_path: Path) -> None:
    sink = Sink(tmp_path / "run.mcap")

    with pytest.raises(Taken, match="a run is writing it"):
        Sink(tmp_path / "run.mcap")
    sink.remove()


STARTING = """
import os, signal, sys
from pathlib import Path
from cobodeck.record.format.sink import Sink
sink = Sink(Path("run.mcap"))
sink.write(b"a header")
os.kill(os.getpid(), signal.SIGKILL)
"""


def test_a_run_that_is_killed_before_its_first_tick_leaves_its_name_free(tmp_path: Path) -> None:
    died = subprocess.run([sys.executable, "-c", STARTING], cwd=tmp_path, check=False)
    assert died.returncode == -9
    part = tmp_path / "run.mcap.part"
    assert part.read_bytes() == b""
    with pytest.raises(FileError, match="it is empty: its run wrote no tick"):
        Record(part)

    sink = Sink(tmp_path / "run.mcap")
    sink.write(b"new")

    assert sink.finish() == tmp_path / "run.mcap"
    assert sink.path.read_bytes() == b"new"
    assert not part.exists()


def test_of_two_at_once_one_takes_over_what_was_left_empty(tmp_path: Path) -> None:
    (tmp_path / "run.mcap.part").touch()
    sink = Sink(tmp_path / "run.mcap")

    with pytest.raises(Taken, match="a run is writing it"):
        Sink(tmp_path / "run.mcap")
    sink.write(b"new")
    sink.keep()
    sink.close()
    with pytest.raises(Taken, match="a run was broken off"):
        Sink(tmp_path / "run.mcap")
    assert sink.part.read_bytes() == b"new"


@given(
    steps=st.lists(
        st.tuples(st.sampled_from(("write", "back", "keep")), st.binary(max_size=9)), max_size=12
    )
)
def test_when_it_is_kept_changes_no_byte(steps: list[tuple[str, bytes]]) -> None:
    """Writers go back to fill in lengths; a plain file in memory is what it is compared with."""
    with tempfile.TemporaryDirectory() as folder:
        sink, plain = Sink(Path(folder) / "run.mcap"), io.BytesIO()
        for what, data in steps:
            if what == "keep":
                sink.keep()
            elif what == "back":
                at = max(0, plain.tell() - len(data))
                assert sink.seek(at) == plain.seek(at)
            else:
                assert sink.write(data) == plain.write(data)
            assert sink.tell() == plain.tell()
        path = sink.finish()
        assert path is not None
        assert path.read_bytes() == plain.getvalue()
