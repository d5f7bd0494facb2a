"""Cases of a project with charts, states and files of its own, and of runs with an operator."""

from __future__ import annotations

import runpy
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest

from cobodeck.__main__ import main
from cobodeck.project import catalogue
from cobodeck.record.read.reader import Record
from cobodeck.review.case_file import CaseWritten, write_case
from cobodeck.setup.options import Options
from cobodeck.terminal import Problem
from cobodeck.testing.recorded_case import RecordedCase
from tests.cobodeck.record.read.test_operated_replays import errands, of_one_run  # noqa: F401
from tests.cobodeck.record.read.test_record_replay import Act, Jittering, recorded

pytestmark = pytest.mark.slow
ROVER = "rbkairos_ur10"


def run_of(acts: dict[float, Act] | None = None, **given: Any) -> Record:
    given = {"chart": "errands.yaml", "robot": ROVER, **given}
    recorded(Path("run.mcap"), Options(duration_s=9.0), acts, **given)
    return Record(Path("run.mcap"))


def play(written: CaseWritten, root: Path) -> None:
    """The test that was written, run as pytest runs it."""
    found = runpy.run_path(str(written.test))
    (test,) = (found[name] for name in found if name.startswith("test_"))
    test(lambda name, followed: RecordedCase(
        written.test.parent / name, root
    ).assert_followed(followed))  # fmt: skip


@pytest.mark.parametrize("at_s", [0.0, 0.7, 2.0, 5.0])
def test_a_case_in_a_folder_fails_once_the_chart_leads_elsewhere(
    errands: Path,  # noqa: F811
    at_s: float,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    Path("mine.yaml").write_text("profile: mine\nbase: tuned\n")
    record = run_of(robot=None, scene="lab_a", profile="mine.yaml")
    written = write_case(record, at_s, errands / "tests" / "test_it.py", catalogue())
    Path("run.mcap").unlink()
    monkeypatch.chdir("/")

    play(written, errands)

    chart = errands / "errands.yaml"
    chart.write_text(
        chart.read_text().replace("{done: work, failed: work}", "{done: fetch, failed: work}")
    )
    with pytest.raises(AssertionError, match=r"got .*fetch: done -> fetch"):
        play(written, errands)


def test_what_the_operator_did_happens_again(errands: Path) -> None:  # noqa: F811
    """At any moment of runs in which anything was done; a case is not written without it."""
    count = 0
    for seed in (2, 7, 11):
        record = run_of(of_one_run(seed))
        for at_s in (0.5, 1.5, 2.5, 3.5):
            with suppress(Problem):  # the chart was replaced, or nothing follows
                written = write_case(record, at_s, Path(f"test_{seed}_{at_s:.0f}.py"), catalogue())
                play(written, errands)
                count += 1
        Path("run.mcap").unlink()
    assert count >= 4


def test_a_case_of_a_run_in_real_time(errands: Path) -> None:  # noqa: F811
    """Of which ticks are late, missed, and added."""
    options = Options(duration_s=6.0, mock=True)
    recorded(Path("run.mcap"), options, scene="lab_a", clock=Jittering(3))
    record = Record(Path("run.mcap"))
    assert record.header["real_time"]

    play(write_case(record, 1.0, Path("test_it.py"), catalogue()), errands)


@pytest.mark.parametrize(
    ("at", "said"), [("9", "nothing is decided after 9 s"), ("100", "up to 9")]
)
def test_a_moment_that_is_not_in_the_record_is_refused(
    errands: Path,  # noqa: F811
    at: str,
    said: str,
    capsys: pytest.CaptureFixture[str],
) -> None:
    run_of()
    assert main(["case", "run.mcap", "--at", at]) != 0
    assert said in capsys.readouterr().err
    assert not [*Path().glob("test_*")]
