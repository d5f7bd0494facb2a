"""A test written from a record passes with the code that made it, and fails once that differs."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from cobodeck.__main__ import main
from cobodeck.record.read.reader import Record
from cobodeck.setup.options import Options
from cobodeck.testing.recorded_case import RecordedCase
from tests.cobodeck.review.runs import recorded

pytestmark = pytest.mark.slow
AT_S = 3.0
PROFILE = "profile: mine\nbase: tuned\ncharts:\n  chase:\n    near: {near}\n"


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A record of a run by a profile of its own."""
    folder = tmp_path_factory.mktemp("case")
    (folder / "mine.yaml").write_text(PROFILE.format(near="3.4 m"))
    path = folder / "run.mcap"
    recorded(path, Options(duration_s=5.0), scene="lab_a", profile=str(folder / "mine.yaml"))
    return path


def test_a_case_passes_and_fails_once_a_parameter_is_another(
    run: Path, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["case", str(run), "--at", "1", "-o", "test_near.py"]) == 0
    assert "plays" in capsys.readouterr().out

    case = RecordedCase(Path("near.mcap"))
    lines = [line for line in Path("test_near.py").read_text().splitlines() if " s " in line]
    expected = [line.strip(' ",') for line in lines if line.startswith("    ")]
    assert expected
    case.assert_followed(expected)

    profile = run.with_name("mine.yaml")
    before = profile.read_text()
    try:
        profile.write_text(PROFILE.format(near="3.1 m"))
        with pytest.raises(AssertionError, match="decisions that are as on record"):
            case.assert_followed(expected)
    finally:
        profile.write_text(before)


def test_the_file_is_a_test_of_pytest(run: Path, folder: Path) -> None:
    odd = shutil.copy(run, Path('a"""b\\N.mcap'))
    assert main(["case", odd.name, "--at", str(AT_S), "-o", 'test_"x".py']) == 0
    (test,) = Path().glob("test_*.py")

    asked = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", str(test)]
    found = subprocess.run(asked, capture_output=True, text=True, cwd=folder)

    assert found.returncode == 0, found.stdout + found.stderr
    assert "1 passed" in found.stdout


def test_a_case_is_small_and_begins_in_the_middle(run: Path, folder: Path) -> None:
    assert main(["case", str(run), "--at", str(AT_S), "-o", "test_x.py"]) == 0

    case = RecordedCase(Path("x.mcap"))

    assert 0 < case.start.at_ns <= AT_S * 1e9
    assert case.start.place is not None
    assert not case.record.attachments
    ticks = [group.ticked.at_ns for group in Record(Path("x.mcap")).groups()]
    assert ticks[0] >= case.start.at_ns - 3_000_000_000
    assert {m.topic for g in case.record.groups() for m in g.told}.isdisjoint({"trace", "truth"})


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["RUN", "--at", "4.99"], "nothing is decided after 4.99 s"),
        (["RUN", "--at", "1", "-o", "x.txt"], "a test is a file FILE.py"),
        (["RUN", "--at", "1", "-o", "test_there.py"], "test_there.py: exists"),
        (["none.mcap", "--at", "1"], "none.mcap: cannot be read"),
    ],
)
def test_what_cannot_be_written_is_said(
    run: Path, folder: Path, capsys: pytest.CaptureFixture[str], arguments: list[str], said: str
) -> None:
    Path("test_there.py").write_text("kept")
    given = [str(run) if argument == "RUN" else argument for argument in arguments]

    assert main(["case", *given]) != 0

    assert said in capsys.readouterr().err
    assert Path("test_there.py").read_text() == "kept"
    assert not [*Path().glob("*.mcap*")]


def test_a_record_is_no_case(run: Path) -> None:
    with pytest.raises(Exception, match="is no case"):
        RecordedCase(run)
