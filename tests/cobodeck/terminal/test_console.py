"""Whatever names, files, exceptions and arguments hold, a terminal is shown text, not commands."""

from __future__ import annotations

import contextlib
import io
import json
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import given, strategies as st

from cobodeck.__main__ import COMMANDS, main
from cobodeck.terminal import console, show_json
from cobodeck.terminal.console import FAILED, OK, USAGE

ROOT = Path(__file__).resolve().parents[3]
OBEYED = {*range(0x20), *range(0x7F, 0xA0), *range(0x202A, 0x202F), *range(0x2066, 0x206A)}
ANYTHING = st.text(st.characters() | st.sampled_from(sorted(map(chr, OBEYED))))
EVIL = "\x1b[2J\x07\x9b31m\x7f\u202e"
STATES = '''from engine.state import Action, Context, Run

class Breaks(Action):
    """Raises \\x1b[2J."""
    outcomes = ("done",)
    def run(self, ctx: Context) -> Run:
        yield
        raise RuntimeError("\\x1b[2J\\x9b31m broken")
'''


def printed(call: Callable[[], object], out: io.StringIO | None = None) -> str:
    shown = out or io.StringIO()
    with contextlib.redirect_stdout(shown), contextlib.redirect_stderr(shown):
        call()
    return shown.getvalue()


def obeyed(shown: str) -> set[int]:
    return set(map(ord, shown)) & OBEYED - {ord("\n"), ord("\t")}


@given(ANYTHING)
def test_results_and_complaints_hold_no_commands(text: str) -> None:
    assert not obeyed(printed(lambda: console.show(text)))
    assert not obeyed(printed(lambda: console.complain(text)))


@given(ANYTHING, ANYTHING)
def test_a_row_of_a_table_is_one_line_without_commands(text: str, other: str) -> None:
    shown = console.table([("a", "b"), (text, other)])

    assert not obeyed(shown)
    assert shown.count("\n") == 1


@given(st.dictionaries(ANYTHING, ANYTHING))
def test_json_holds_no_commands_and_means_the_same(value: dict[str, str]) -> None:
    shown = printed(lambda: show_json(value))

    assert not obeyed(shown)
    assert json.loads(shown) == json.loads(json.dumps(value))


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


@given(ANYTHING, ANYTHING)
def test_progress_is_one_line_with_no_commands_but_its_own(what: str, text: str) -> None:
    def show() -> None:
        progress = console.ProgressLine(what, every_s=0.0)
        progress.at(text)
        progress.done()

    shown = printed(show, Terminal())

    assert shown.startswith("\r")
    assert shown.endswith("\x1b[K\r\x1b[K")
    assert not obeyed(shown[1 : -len("\x1b[K\r\x1b[K")])
    assert "\n" not in shown


@given(st.sampled_from(sorted(COMMANDS)), ANYTHING)
def test_arguments_that_are_wrong_are_told_without_commands(command: str, text: str) -> None:
    assert not obeyed(printed(lambda: main([command, f"--nonsense={text}"])))


@pytest.fixture
def folder(folder: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(sys, "path", sys.path.copy())
    about = '"\\e[2J\\x9b31m\\x7f\\u202e"'  # as YAML writes it
    (folder / "evil_states.py").write_text(STATES)
    (folder / "pyproject.toml").write_text(
        '[project.entry-points."cobodeck.states"]\nown = "evil_states"\n'
    )
    chart = f"chart: CHART\nabout: {about}\noutcomes: [done]\n"
    (folder / f"{EVIL}.yaml").write_text(
        chart.replace("CHART", "evil") + "states:\n  a: {do: Breaks, next: {done: .done}}\n"
    )
    (folder / f"wrong{EVIL}.yaml").write_text(
        chart.replace("CHART", "wrong") + f"states:\n  a: {{do: {about}}}\n"
    )
    (folder / "scene.yaml").write_text(
        f"scene: s\nabout: {about}\nroom: {{outer: [[0, 0], [9, 0], [9, 9], [0, 9]]}}\n"
        f"robot: {{start: {{x: 4, y: 4}}}}\nuser: {{source: {about}, start: {{x: 5, y: 5}}}}\n"
    )
    return folder


SHOWN = r"\x1b[2J\x07\u009b31m\u007f\u202e"


@pytest.mark.parametrize(
    ("arguments", "code", "part"),
    [
        (("validate", f"{EVIL}.yaml", f"wrong{EVIL}.yaml"), FAILED, f"wrong{SHOWN}.yaml:5:11"),
        (("validate", "--format", "github", f"wrong{EVIL}.yaml"), FAILED, SHOWN),
        (("validate", "scene.yaml"), FAILED, r"\x1b[2J"),
        (("list", "states"), OK, r"Raises \x1b[2J"),
        (("simulate", f"{EVIL}.yaml", "--duration", "1"), FAILED, r"\x1b[2J\u009b31m broken"),
        (("simulate", f"{EVIL}.yaml", "--scene", "scene.yaml", "--user", EVIL), USAGE, SHOWN),
        (("simulate", EVIL), USAGE, "no chart"),
        (("simulate", "--requests", EVIL), USAGE, r"\x07"),
        (("render", f"{EVIL}.yaml", "-o", f"{EVIL}.dot"), OK, f"{SHOWN}.dot"),
        (("space", f"{EVIL}/x.yaml"), USAGE, f"{SHOWN}/x.yaml"),
        (("new", EVIL), USAGE, "cannot name a package"),
        ((EVIL,), USAGE, "no command"),
    ],
)
def test_what_files_hold_and_users_type_is_shown_not_obeyed(
    folder: Path,
    capsys: pytest.CaptureFixture[str],
    arguments: tuple[str, ...],
    code: int,
    part: str,
) -> None:
    assert main(arguments) == code

    out, err = capsys.readouterr()
    assert part in out + err
    assert not obeyed(out + err)


@pytest.mark.parametrize(
    "arguments",
    [
        ("validate", f"wrong{EVIL}.yaml", "--format", "json"),
        ("validate", f"wrong{EVIL}.yaml", "--format", "sarif"),
        ("simulate", f"{EVIL}.yaml", "--duration", "1", "--json"),
    ],
)
def test_json_with_hostile_text_can_be_read(
    folder: Path, capsys: pytest.CaptureFixture[str], arguments: tuple[str, ...]
) -> None:
    assert main(arguments) == FAILED

    out, err = capsys.readouterr()
    assert not obeyed(out + err)
    assert json.loads(out)


@pytest.mark.parametrize(
    ("arguments", "code", "shown"),
    [
        (("space", "危.yaml"), USAGE, rb"\u5371.yaml: cannot be read"),
        (("simulate", "--tier", "危"), USAGE, rb"\u5371"),
        (("schema",), OK, rb"\u00b0"),
    ],
)
def test_what_an_encoding_lacks_stands_as_an_escape(
    arguments: tuple[str, ...], code: int, shown: bytes
) -> None:
    environment = {**os.environ, "PYTHONIOENCODING": "ascii:strict"}
    result = subprocess.run(
        [sys.executable, "-m", "cobodeck", *arguments],
        cwd=ROOT, env=environment, capture_output=True, check=False,
    )  # fmt: skip

    assert result.returncode == code, result.stderr
    assert shown in result.stdout + result.stderr
    if result.stdout:
        assert json.loads(result.stdout)


def written(*calls: tuple[float, str, float | None]) -> list[str]:
    """The lines of a progress that is called at these seconds."""
    now = iter([0.0, *(at for at, _, _ in calls)])

    def show() -> None:
        progress = console.ProgressLine("work", 0.2, lambda: next(now))
        for _, text, share in calls:
            progress.at(text, share)

    return printed(show, Terminal()).replace("\x1b[K", "").split("\r")[1:]


def test_progress_tells_the_share_done_and_the_time_left() -> None:
    assert written((3.0, "a", None), (4.0, "b", 0.25), (100.0, "c", 0.1), (200.0, "d", 1.0)) == [
        "work: a",
        "work: b, 25 %, 12 s left",
        "work: c, 10 %, 15 min left",
        "work: d, 100 %, 0 s left",
    ]


def test_without_a_terminal_progress_is_a_few_lines(capsys: pytest.CaptureFixture[str]) -> None:
    """What it is, one in half a minute, and how long it took; short work is silent."""
    now = iter([0.0, 0.5, 2.0, 5.0, 33.0, 40.0])
    progress = console.ProgressLine("work", 0.0, lambda: next(now), plainly="about 1 min")
    for _ in range(4):
        progress.at("function", 0.5)
    progress.done()
    told = capsys.readouterr()
    assert told.err.splitlines() == [
        "work: about 1 min",
        "work: function, 50 %, 33 s left",
        "work: done in 40 s",
    ]
    assert told.out == ""

    for plainly, at in (("about 1 min", 0.9), ("", 50.0)):
        now = iter([0.0, at])
        progress = console.ProgressLine("work", 0.0, lambda: next(now), plainly=plainly)  # noqa: B023
        progress.at("function")
        progress.done()
    assert capsys.readouterr().err == ""


def test_progress_is_written_seldom() -> None:
    assert written((0.1, "a", None), (0.3, "b", 0.0), (0.4, "c", None)) == ["work: b, 0 %"]
