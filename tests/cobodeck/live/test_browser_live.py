"""The page in a browser, on the servers that users start: a run, a record, edited charts."""

from __future__ import annotations

import shutil
import socket
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.cobodeck.live.browser import Browser
from tests.cobodeck.live.served import Served
from tests.program import ROOT, python

pytestmark = [pytest.mark.slow, pytest.mark.realtime]
SIMULATE = ("simulate", "--scene", "study")


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with Browser() as running:
        yield running


def lit(path: str) -> str:
    return f"document.getElementById('a_s:{path}')?.classList.contains('active')"


def press(browser: Browser, *words: str) -> None:
    for word in words:
        browser.until(f"[...document.querySelectorAll('aside button')].some({_says(word)})")
        browser.see(f"[...document.querySelectorAll('aside button')].find({_says(word)}).click()")


def _says(word: str) -> str:
    return f"(b) => b.textContent === {word!r}"


def test_a_run_lights_up_is_stopped_by_anybody_and_steered_with_the_token(
    browser: Browser, tmp_path: Path
) -> None:
    with Served(tmp_path, *SIMULATE, "--live") as run:
        browser.open(run.url)
        browser.until(lit("chase"))
        browser.until("document.getElementById('swatch-robot').children.length > 0")
        browser.fill("#find", "chase/danger")
        browser.press("Enter")
        browser.until_text("#details", "required")
        assert not browser.see("document.querySelector('#details-body button')")

        browser.press("Escape")

        browser.until_text("#stop", "STOPPED")
        browser.until(lit("inform"))
        browser.fill("#name", "Ada")
        browser.fill("#token", run.token)
        browser.click("#auth button")
        press(browser, "take control", "reset", "sure? reset")
        browser.until("!document.querySelector('#stop').textContent.includes('STOPPED')")
        press(browser, "acknowledge")
        browser.until(lit("chase"))
        press(browser, "force required", "sure? force required")
        browser.until_text("#log", "chase.escape_required → escape")
        browser.until_text("#log", "Ada: ForceOutcome path chase/danger")
        assert browser.errors == []


def test_a_page_comes_back_when_a_run_begins_anew_on_its_port(
    browser: Browser, tmp_path: Path
) -> None:
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = str(free.getsockname()[1])
    with Served(tmp_path, *SIMULATE, "--live", port) as run:
        browser.open(run.url)
        browser.until(lit("chase"))
    browser.until("document.body.classList.contains('lost')")

    with Served(tmp_path, *SIMULATE, "--live", port):
        browser.until_text("#link", "connected")
        browser.until("document.getElementById('banner').hidden")
        browser.until(lit("chase"))


def test_the_slider_moves_a_record(browser: Browser, tmp_path: Path) -> None:
    done = python(tmp_path, "-m", "cobodeck", *SIMULATE, "--duration", "6", "--record", "a.mcap")
    assert done.returncode == 0, done.stderr
    with Served(tmp_path, "watch", "a.mcap") as record:
        browser.open(record.url)
        browser.until(lit("chase"))
        browser.until("document.getElementById('swatch-robot').children.length > 0")
        before = browser.see("document.getElementById('map').toDataURL()")

        browser.fill("#slider", "4")

        browser.until_text("#clock", "4.0 s of 6.0 s")
        browser.until(f"document.getElementById('map').toDataURL() !== {before!r}")
        assert browser.see(lit("chase"))
        assert browser.errors == []


def test_a_saved_chart_is_drawn_anew_and_a_broken_one_told_of(
    browser: Browser, tmp_path: Path
) -> None:
    file = tmp_path / "escape.yaml"
    shutil.copy(ROOT / "charts/escape.yaml", file)
    good = file.read_text(encoding="utf-8")
    with Served(tmp_path, "watch", "escape.yaml") as charts:
        browser.open(charts.url)
        browser.until("document.getElementById('a_s:sign/show')")

        file.write_text(good.replace("outcomes:", "outcomez:", 1), encoding="utf-8")

        browser.until_text("#findings", "unknown key 'outcomez'")
        browser.until_text("#banner", "this is the last good picture")
        assert browser.see("document.getElementById('a_s:sign/show') !== null")
        file.write_text(good.replace(" show:", " display:").replace("show}", "display}"), "utf-8")
        browser.until("document.getElementById('a_s:sign/display')")
        browser.until("document.getElementById('banner').hidden")
