"""The page in a browser, on the servers that users start: a run, a record, edited charts."""

from __future__ import annotations

import socket
from pathlib import Path

import pytest

from tests.cobodeck.live.browser import Browser
from tests.cobodeck.live.fake_page_server import FakePageServer
from tests.cobodeck.live.served import serving

pytestmark = [pytest.mark.slow, pytest.mark.realtime]
SIMULATE = ("simulate", "--scene", "study")


@pytest.fixture
def port() -> str:
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        return str(free.getsockname()[1])


def lit(path: str) -> str:
    return f"document.getElementById('a_s:{path}')?.classList.contains('active')"


def press(browser: Browser, *words: str) -> None:
    for word in words:
        browser.until(f"[...document.querySelectorAll('aside button')].some({_says(word)})")
        browser.see(f"[...document.querySelectorAll('aside button')].find({_says(word)}).click()")


def _says(word: str) -> str:
    return f"(b) => b.textContent === {word!r}"


def in_control(browser: Browser, token: str) -> None:
    browser.let_in("Ada", token)
    press(browser, "take control")
    browser.until_text("#holder", "You hold control as Ada")


def choose_level(browser: Browser, level: str) -> None:
    browser.see(
        f"((choice) => {{ choice.value = {level!r}; choice.dispatchEvent(new Event('change')); }})"
        "(document.querySelector('#tools select'))"
    )


@pytest.mark.requirement(21, 48, 145)
def test_a_run_is_stopped_by_anybody_steered_with_the_token_and_found_again_as_a_record(
    browser: Browser, tmp_path: Path, port: str
) -> None:
    with serving(tmp_path, *SIMULATE, "--live", port, "--record", "a.mcap") as run:
        browser.open(run.url)
        browser.until(lit("chase"))
        browser.until("document.getElementById('swatch-robot').children.length > 0")
        browser.find("chase/danger")
        browser.until_text("#details", "required")
        assert not browser.see("document.querySelector('#details-body button')")
        with FakePageServer("<svg/>") as anybody:  # which lets in pages of others
            elsewhere = f"{anybody.url}elsewhere"
            assert browser.opens_from(elsewhere, f"ws://127.0.0.1:{anybody.port}/ws")
            assert not browser.opens_from(elsewhere, f"ws://127.0.0.1:{port}/ws")

        browser.press("Escape")

        browser.until_text("#stop", "STOPPED")
        browser.until(lit("inform"))
        in_control(browser, run.token)
        press(browser, "reset", "sure? reset")
        browser.until("!document.querySelector('#stop').textContent.includes('STOPPED')")
        press(browser, "acknowledge")
        browser.until(lit("chase"))
        press(browser, "force required", "sure? force required")
        browser.until_text("#log", "chase.escape_required → escape")
        browser.until_text("#log", "Ada: ForceOutcome path chase/danger")
        assert browser.errors == []
    browser.until("document.body.classList.contains('lost')")

    with serving(tmp_path, "watch", "a.mcap", "--port", port):
        browser.see(
            "dispatchEvent(new Event('online'))"
        )  # it tries at once, not after some seconds
        browser.until_text("#clock", "0.0 s of ")
        browser.until("document.getElementById('banner').hidden")
        browser.until(lit("chase"))
        assert "Ada" not in browser.text("#log")
        before = browser.see("document.getElementById('map').toDataURL()")
        browser.focus("#slider")
        browser.press("End")
        browser.until_text("#log", "Ada: ForceOutcome path chase/danger")
        browser.until(f"document.getElementById('map').toDataURL() !== {before!r}")


ASK = """\
chart: ask
about: Counts, and asks before.
parameters: {pause: {type: duration, default: 30 s}}
inputs: {count: {type: integer}}
outcomes: [done]
states:
  wait:
    watch: Wait
    with: {time: $pause}
    autonomy: {over: high}
    timeout: 1 h
    next: {over: add, timeout: .done}
  add: {do: Sum, in: {a: count}, out: {sum: count}, next: {summed: wait}}
"""


@pytest.mark.requirement(21, 57)
def test_a_chart_is_edited_started_by_its_form_asks_for_consent_and_is_changed_while_it_runs(
    browser: Browser, tmp_path: Path
) -> None:
    file = tmp_path / "ask.yaml"
    file.write_text(ASK, encoding="utf-8")
    with serving(tmp_path, "watch", "ask.yaml") as charts:
        browser.open(charts.url)
        browser.until("document.getElementById('a_s:add')")

        file.write_text(ASK.replace("outcomes:", "outcomez:", 1), encoding="utf-8")
        browser.until_text("#findings", "unknown key 'outcomez'")
        browser.until_text("#banner", "this is the last good picture")
        assert browser.see("document.getElementById('a_s:add') !== null")
        file.write_text(ASK.replace("add", "more"), encoding="utf-8")
        browser.until("document.getElementById('a_s:more')")
        browser.until("document.getElementById('banner').hidden")

        browser.fill("#name", "Ada")
        browser.fill("#token", charts.token)
        browser.click("#auth button")
        browser.click("#start summary")
        browser.fill("#start label:has-text('pause') input", "0.2 s")
        browser.fill("#start label:has-text('count') input", "5")
        press(browser, "start", "sure? start")
        browser.until_text("#answer", "open its page")
        token = browser.text("#answer").split("token: ")[1].split()[0]
        browser.open(browser.see("document.querySelector('#answer a').href"))

        browser.until(lit("wait"))
        in_control(browser, token)
        choose_level(browser, "low")
        browser.until_text("#waiting", "wait: over waits for consent")
        press(browser, "refuse")
        browser.until_text("#log", "Ada: Answer")
        browser.until_text("#waiting", "wait: over waits for consent")
        browser.find("more")
        press(browser, "breakpoint", "consent")
        browser.until_text("#doing", "paused")
        press(browser, "resume")
        browser.until_text("#waiting", "wait: over waits for consent")
        press(browser, "no breakpoint")
        choose_level(browser, "")  # so that what has waited goes on
        browser.until("document.getElementById('waiting').children.length == 0")
        browser.click("#replace summary")
        changed = ASK.replace("30 s", "0.2 s").replace("add", "next_one")
        browser.fill("#replace textarea", changed)
        press(browser, "replace", "sure? replace")
        browser.until("document.getElementById('a_s:next_one')")
        browser.until_text("#log", "wait.over → next_one")
        assert browser.errors == []


@pytest.mark.requirement(21, 145)
def test_a_run_that_goes_on_is_looked_back_at_and_can_be_stopped_meanwhile(
    browser: Browser, tmp_path: Path, port: str
) -> None:
    with serving(tmp_path, *SIMULATE, "--live", port) as run:
        browser.open(run.url)
        browser.until(lit("chase"))
        browser.until("parseFloat(document.getElementById('clock').textContent) > 3")
        assert browser.see("document.getElementById('to-now').hidden")
        browser.see(
            "((slider) => { slider.value = 1; slider.dispatchEvent(new Event('input')); })"
            "(document.getElementById('slider'))"
        )
        browser.until_text("#banner", "You look back at 1.0 s; the run goes on.")
        assert browser.text("#clock").startswith("1.0 s")
        newest = "parseFloat(document.getElementById('slider').max)"
        later = browser.see(newest) + 2.0
        browser.until(f"{newest} > {later}")
        shown = browser.see("document.getElementById('map').toDataURL()")
        browser.until(f"{newest} > {later} + 1")
        assert browser.text("#clock").startswith("1.0 s")
        assert browser.see("document.getElementById('map').toDataURL()") == shown

        browser.press("Escape")

        browser.until_text("#stop", "STOPPED")
        browser.focus("#lanes")
        browser.press("ArrowLeft")
        browser.until("parseFloat(document.getElementById('clock').textContent) < 1")
        browser.press("n")
        browser.until("document.getElementById('banner').hidden")
        browser.until(f"parseFloat(document.getElementById('clock').textContent) > {later}")
        browser.until(lit("inform"))
        assert browser.errors == []
