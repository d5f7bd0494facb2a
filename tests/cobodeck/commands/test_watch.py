"""`cobodeck watch`: a page for charts, records and URLs, and the same in a terminal."""

from __future__ import annotations

import json
import os
import pty
import select
import signal
import subprocess
import sys
import termios
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from websockets.exceptions import InvalidStatus
from websockets.sync.client import ClientConnection, connect

from cobodeck.__main__ import main
from cobodeck.live.terminal_session import socket_url
from cobodeck.terminal.console import FAILED, OK, USAGE
from tests.cobodeck.live.served import serving

PATIENCE_S = 60.0
GOOD = """\
chart: mine
outcomes: [done]
states:
  park: {do: ParkArm, next: {parked: .done, failed: .done, error: .done}}
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "mine.yaml").write_text(GOOD)
    return tmp_path


WRONG = [
    (["nothing.yaml"], USAGE, "nothing.yaml: no such file"),
    (["mene"], USAGE, "no chart 'mene'"),
    (["a.mcap", "b.mcap", "c.mcap"], USAGE, "one record, or two"),
    (["a.mcap", "mine.yaml"], USAGE, "one record, or two"),
    (["mine.yaml", "mine.yaml"], USAGE, "one chart or folder at a time"),
    (["http://127.0.0.1:1/"], USAGE, "add --tty"),
    (["http://127.0.0.1:1/", "--tty"], FAILED, "no live page there"),
    (["ftp://127.0.0.1:1/", "--tty"], USAGE, "no chart 'ftp:"),
    pytest.param(["gone.mcap"], USAGE, "gone.mcap", marks=pytest.mark.slow),
    (["--port", "70000"], USAGE, "no port"),
    pytest.param(  # its findings tell
        ["--profile", "tunet", "mine.yaml", "--tty"], OK, "", marks=pytest.mark.slow
    ),
]


@pytest.mark.parametrize(("given", "code", "part"), WRONG)
def test_what_cannot_be_watched_is_told_in_a_sentence(
    folder: Path,
    given: list[str],
    code: int,
    part: str,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(folder)

    assert main(["watch", *given, "--no-project"]) == code

    told = capsys.readouterr()
    assert part in told.err
    assert "Traceback" not in told.err


def test_a_folder_without_charts_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["watch", str(tmp_path)]) == USAGE
    assert "no charts in this folder" in capsys.readouterr().err


@pytest.mark.usefixtures("without_shipped_charts")
def test_a_terminal_shows_charts_and_findings(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    within = folder / ("with_a_long_name" * 5)
    within.mkdir()
    (within / "mine.yaml").write_text(GOOD.replace("parked: .done", "parked: .gone"))

    assert main(["watch", str(within), "--tty", "--no-project"]) == OK

    told = capsys.readouterr().out
    assert "> mine" in told
    assert "name/mine.yaml:4:" in told
    assert "\x1b" not in told


def heard(page: ClientConnection, what: Callable[[Any], bool]) -> Any:
    """The next message that is so."""
    until = time.monotonic() + PATIENCE_S
    while not what(message := json.loads(page.recv(until - time.monotonic()))):
        pass
    return message


def say(page: ClientConnection, **message: Any) -> None:
    page.send(json.dumps(message))


@pytest.mark.realtime
@pytest.mark.slow
@pytest.mark.requirement(57)
def test_a_save_is_drawn_a_start_needs_the_token_and_ctrl_c_ends_it(folder: Path) -> None:
    with serving(folder, "watch", ".", "--no-project") as (running, url, token):
        with connect(socket_url(url)) as page:
            hello = heard(page, lambda m: m["t"] == "hello")
            chart = heard(page, lambda m: m["t"] == "chart")
            assert (hello["mode"], hello["commands"]) == ("charts", True)
            assert chart["name"] == "mine"

            (folder / "mine.yaml").write_text(GOOD.replace("park:", "fold:"))
            assert "fold" in heard(page, lambda m: m["t"] == "chart")["nodes"]

            say(page, t="cmd", id=1, do="start", chart="mine")
            assert "token" in heard(page, lambda m: m["t"] == "ack")["text"]
            say(page, t="auth", token=token, name="Ada")
            assert heard(page, lambda m: m["t"] == "ack")["ok"]
            say(page, t="cmd", id=2, do="start", chart="other")
            refused = heard(page, lambda m: m["t"] == "ack")
            assert (refused["ok"], refused["id"]) == (False, 2)
            assert "no chart 'other' here" in refused["text"]

        with pytest.raises(InvalidStatus), connect(socket_url(url), origin="http://evil"):  # type: ignore[arg-type]
            pass
        running.send_signal(signal.SIGINT)
        assert running.wait(PATIENCE_S) == OK
        assert running.stderr is not None
        assert "Traceback" not in running.stderr.read()


@pytest.mark.realtime
@pytest.mark.slow
def test_a_chart_is_started_with_its_form_and_ends_with_the_page(folder: Path) -> None:
    with serving(folder, "watch", "cobodeck", "--no-project") as (running, url, token):
        with connect(socket_url(url)) as page:
            say(page, t="auth", token=token, name="Ada")
            say(page, t="cmd", id=5, do="start", chart="cobodeck", scene="lab_a", inputs={})
            started = heard(page, lambda m: m["t"] == "ack" and m["id"] == 5)
            assert started["ok"], started
            with connect(socket_url(started["url"])) as run:
                assert heard(run, lambda m: m["t"] == "hello")["mode"] == "live"
                heard(run, lambda m: m["t"] == "chart")
        running.send_signal(signal.SIGINT)
        assert running.wait(PATIENCE_S) == OK
        with pytest.raises(OSError, match="refused"):
            connect(socket_url(started["url"]))


@pytest.mark.realtime
@pytest.mark.slow
def test_a_page_is_seen_in_a_terminal_of_its_own_until_q(folder: Path) -> None:
    with serving(folder, "watch", ".", "--no-project") as (_, url, _):
        told = in_terminal(["watch", url, "--tty"], b"> mine", b"q")

    assert b"\x1b[?1049h" in told  # a screen of its own, and the old one again
    assert told.index(b"\x1b[?1049l") > told.index(b"> mine")
    assert b"\x1b[7m" in told


@pytest.mark.realtime
@pytest.mark.slow
@pytest.mark.parametrize("end", [b"\x03", signal.SIGTERM, signal.SIGHUP], ids=str)
def test_a_terminal_is_as_before_however_it_ends(folder: Path, end: bytes | int) -> None:
    told = in_terminal(["watch", str(folder), "--tty"], b"> mine", end)

    assert told.endswith(b"fine\r\n")  # what was seen last stays
    assert told.index(b"\x1b[?25h\x1b[?1049l") > told.index(b"> mine")


def in_terminal(given: list[str], seen: bytes, end: bytes | int) -> bytes:
    """All that a program says in a terminal; once it has said `seen`, a key or a signal ends it."""
    ours, theirs = pty.openpty()
    before = termios.tcgetattr(theirs)
    command = [sys.executable, "-m", "cobodeck", *given, "--no-project"]
    environment = {**os.environ, "TERM": "xterm"}
    environment.pop("NO_COLOR", None)
    told, pressed = b"", False

    def begin() -> None:
        os.login_tty(theirs)  # so that Ctrl-C reaches it
        signal.signal(signal.SIGHUP, signal.SIG_DFL)  # also where tests are run by `nohup`

    with subprocess.Popen(
        command, stdin=theirs, stdout=theirs, env=environment, preexec_fn=begin
    ) as running:
        while running.poll() is None or select.select([ours], [], [], 0.0)[0]:
            if not select.select([ours], [], [], 0.1)[0]:
                continue
            told += os.read(ours, 4096)
            if seen in told and not pressed:
                pressed = True
                os.write(ours, end) if isinstance(end, bytes) else running.send_signal(end)
        assert running.returncode == OK, told
    assert termios.tcgetattr(theirs) == before
    os.close(ours)
    os.close(theirs)
    return told


@pytest.mark.slow
@pytest.mark.requirement(21, 145)
def test_a_record_is_seen_on_a_page_and_in_a_terminal(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    record = str(tmp_path / "x.mcap")
    assert main(["simulate", "--duration", "3", "--record", record, "--no-project"]) == OK
    capsys.readouterr()

    assert main(["watch", record, "--tty", "--no-project"]) == OK
    told = capsys.readouterr().out
    assert "cobodeck · record" in told

    words = ("watch", record, record, "--no-project")
    with serving(tmp_path, *words) as (_, url, _), connect(socket_url(url)) as page:
        assert heard(page, lambda m: m["t"] == "hello")["mode"] == "record"
        slots = {heard(page, lambda m: m["t"] == "chart").get("slot", 0) for _ in range(2)}
        assert slots == {0, 1}
