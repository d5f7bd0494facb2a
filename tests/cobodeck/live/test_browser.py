"""The page in a browser, on a server that plays a script; one page for all tests, begun anew."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from websockets.sync.client import connect

from tests.cobodeck.live.browser import Browser
from tests.cobodeck.live.fake_page_server import HEALTH, UNTIL, FakePageServer, lanes, running
from tests.cobodeck.live.pictures import drawn
from tests.waiting import until

pytestmark = [pytest.mark.slow]
OUT = Path(__file__).parents[3] / "out"
GO = "chase/follow/drive/go"
CONTRAST = Path(__file__).with_name("contrast.js").read_text(encoding="utf-8")
AT_REST = """
document.activeElement.blur();
document.getElementById('log').replaceChildren();
document.getElementById('signal-filter').value = '';
for (const b of document.querySelectorAll('#plots button')) b.click();
for (const d of document.querySelectorAll('details')) {
  d.open = !d.querySelector('.keys, #health, #signals');
}
document.getElementById('chart-follow').checked = true;
"""
COUNTED = """
(() => {
  const counts = window.counts = { frames: 0, maps: 0, ended: false };
  (function frame() { counts.frames += 1; counts.ended || requestAnimationFrame(frame); })();
  const draw = CanvasRenderingContext2D.prototype.drawImage;
  CanvasRenderingContext2D.prototype.drawImage = function (...all) {
    counts.maps += 1;
    return draw.apply(this, all);
  };
})()
"""
"""Counts frames and pictures of the map from now on."""
OURS = ("WebSocket connection to", "Canvas2D: Multiple readback")
"""Beginnings of errors that the tests bring about."""
Show = Callable[..., FakePageServer]


@pytest.fixture(scope="module")
def server(browser: Browser) -> Iterator[FakePageServer]:
    with FakePageServer(drawn("cobodeck", -1)) as running:
        browser.open(running.url)
        browser.until_text("#link", "connected")
        yield running


@pytest.fixture
def show(browser: Browser, server: FakePageServer) -> Iterator[Show]:
    """`show(mode, at=…)` begins anew: another run, record or folder, in the page that is open."""

    def begun(
        mode: str,
        at: float = 20.0,
        speed: float = 0.0,
        size: Any = (1440, 900),
        scheme: str = "light",
    ) -> FakePageServer:
        browser.resize(*size)
        browser.scheme(scheme)
        browser.see(f"(() => {{ {AT_REST} }})()")
        if not server.listens:  # a test before has failed meanwhile
            server.start()
        until(lambda: server.pages)
        knew = any(server.pages.values())
        server.begin(mode, at, speed)
        server.renew()
        if knew:  # it tells the token of before, which is refused
            until(lambda: sent(server, "auth"))
        browser.until_text("#log", server.marked())
        server.received.clear()
        return server

    yield begun
    assert [error for error in browser.errors if not error.startswith(OURS)] == []


def lit(path: str) -> str:
    return f"document.getElementById('a_s:{path}')?.classList.contains('leaf')"


def sent(server: FakePageServer, kind: str) -> list[dict[str, Any]]:
    return [m for m in server.received if kind in (m["t"], m.get("do"))]


def commanded(server: FakePageServer, do: str) -> dict[str, Any]:
    """The command of a kind that has come, without its number."""
    until(lambda: sent(server, do))
    return {k: v for k, v in sent(server, do)[-1].items() if k not in ("t", "id", "do")}


def in_control(browser: Browser, server: FakePageServer) -> None:
    browser.let_in("anna", server.token)
    browser.until_text("#control", "take control")
    browser.click("#control button")
    browser.until_text("#holder", "You hold control as anna")


def surely(browser: Browser, on: str) -> None:
    """Pressed twice."""
    browser.click(on)
    browser.until_text(f"{on}.sure", "sure?")
    browser.click(on)


def test_the_page_opens_without_errors_and_asks_nobody_else(
    browser: Browser, server: FakePageServer
) -> None:
    browser.until_text("#clock", "of 60.0 s")
    assert browser.text("#title") == "cobodeck"
    assert browser.text("#about").endswith("demo · began 2026-11-28 04:40")
    assert "04:40:56.491+00:00" in browser.see("document.getElementById('about').title")
    assert browser.errors == []
    assert all(
        url.startswith((server.url, "data:", f"ws://127.0.0.1:{server.port}/"))
        for url in browser.urls
    )


@pytest.mark.requirement(21, 57)
def test_what_is_active_lights_up_and_the_transition_taken_is_bold(
    browser: Browser, show: Show
) -> None:
    show("live", at=23.8)
    browser.until(lit(GO))
    browser.until_text(".since", " s")
    around = browser.see("[...document.querySelectorAll('.around')].map((e) => e.textContent)")
    assert around == ["23.8 s", "23.8 s"]  # of its boxes, but not of one that is narrow
    assert browser.see("document.querySelectorAll('.since').length") == 3  # guards have none
    assert browser.see(lit("chase/danger"))
    drive = "document.getElementById('a_s:chase/follow/drive')"
    assert browser.see(f"{drive}.classList.contains('active')")

    show("live", at=23.8, speed=1.0)

    browser.until(
        "document.getElementById('t:chase/follow/drive:arrived').classList.contains('taken')"
    )
    browser.until(lit("chase/follow/wait"))
    browser.until(f"!{lit(GO)}")
    browser.until("!document.querySelector('.taken')")
    browser.until_text("#spoken", "chase/follow/wait")
    browser.until_text("#log", "go.arrived → chase/follow/wait")


def focused(browser: Browser) -> tuple[str, str]:
    """Path and name of the node that has the focus."""
    path, name = browser.see(
        "[document.activeElement.dataset.path ?? null, document.activeElement.ariaLabel]"
    )
    return path, name


def test_the_chart_is_walked_by_keyboard_as_a_tree(browser: Browser, show: Show) -> None:
    show("live")
    browser.until(lit(GO))
    browser.focus("#chart-fit")

    browser.press("Tab")
    assert focused(browser) == ("", "cobodeck, states, active")
    browser.press("ArrowRight", "ArrowRight", "ArrowDown")
    first = focused(browser)[0]
    assert first.startswith("chase/")
    browser.press("ArrowUp", "ArrowLeft")
    assert focused(browser)[0] == first.split("/")[0] == "chase"
    browser.press("End", "ArrowDown")  # there is no next one
    last = focused(browser)[0]
    browser.press("Home")
    assert focused(browser)[0] == ""
    assert last.count("/") > 0

    browser.find("chase/follow/choose")
    browser.until("document.activeElement.dataset.path == 'chase/follow/choose'")
    browser.press("ArrowUp")
    path, _ = focused(browser)
    seen = "(({x, y, right, bottom}, all) => x >= all.x && y >= all.y && right <= all.right"
    seen += " && bottom <= all.bottom)(document.activeElement.getBoundingClientRect(),"
    browser.until(f"{seen} document.querySelector('.chart').getBoundingClientRect())")
    border = "document.activeElement.querySelector(':is(path, polygon)[stroke]:not([stroke=none])')"
    outline = f"getComputedStyle({border}).strokeWidth"
    assert browser.see(outline) == "4px"  # to be seen where it is
    browser.press("Enter")
    browser.until_text("#details-head", path)
    browser.press("Tab")
    assert browser.see("document.activeElement.closest('.chart')") is None


def test_a_reader_of_the_screen_finds_its_way_and_is_not_talked_to_death(
    browser: Browser, show: Show
) -> None:
    server = show("live")
    browser.until(lit(GO))

    unnamed = browser.see(
        "[...document.querySelectorAll('button, input, select, textarea, canvas, section, aside')]"
        ".filter((e) => !(e.textContent.trim() || e.ariaLabel || e.labels?.length"
        " || e.getAttribute('aria-labelledby'))).map((e) => e.outerHTML)"
    )
    assert unnamed == []
    assert browser.see("document.querySelectorAll('header, main, aside').length") == 3
    assert "active: " in browser.see("document.querySelector('.chart svg').ariaLabel")
    browser.until("document.getElementById('map').ariaLabel.includes('robot at')")
    lanes_now = "document.getElementById('lanes').ariaLabel"
    browser.until(f"{lanes_now}.includes('chase since 0.0 s; ')")
    assert browser.see(lanes_now).endswith("; 16.0 s command: anna: SetLevel")
    server.tell({"t": "ev", "active": {"": 0.0, "chase": 0.0}, "locks": ["chase"]})
    browser.until("document.getElementById('a_s:chase').ariaLabel.includes('active, locked')")
    alive = "'output, [aria-live], [role=status], [role=alert], [role=log]'"
    assert browser.see(f"document.querySelector('#clock').closest({alive})") is None
    browser.see(
        "window.spoken = 0, new MutationObserver(() => { window.spoken += 1; })"
        ".observe(document.getElementById('spoken'), {childList: true}), window.begun = Date.now()"
    )
    for number in range(10):
        server.tell({"t": "ev", "active": {"": 0.0, f"chase/x{number}": 0.0}})
        browser.until_text("#doing", f"x{number}")
    browser.until_text("#spoken", "x9")
    assert browser.see("window.spoken <= 2 + (Date.now() - window.begun) / 1500")


SEEN = """((id) => {
  const map = document.getElementById(id), found = {};
  const data = map.getContext('2d').getImageData(0, 0, map.width, map.height).data;
  for (let i = 0; i < data.length; i += 4) {
    const key = [data[i] >> 4, data[i + 1] >> 4, data[i + 2] >> 4].join();
    if (data[i + 3]) found[key] = (found[key] ?? 0) + 1;
  }
  return found; })"""
"""How many pixels of a canvas have a colour, by its upper halves."""


def layers_of(server: FakePageServer) -> list[str]:
    """Those that the page has told of last."""
    until(lambda: sent(server, "layers"))
    return list(sent(server, "layers")[-1]["on"])


@pytest.mark.requirement(21, 134)
def test_the_map_is_drawn_and_layers_can_be_taken_away(browser: Browser, show: Show) -> None:
    server = show("record")
    user, path = "11,1,1", "0,7,7"  # #b71c1c, #00727d

    browser.until(f"Object.keys({SEEN}('map')).length > 20 && {SEEN}('map')['{user}'] > 300")
    browser.until(f"{SEEN}('map')['{path}'] > 60")
    white = browser.see(f"{SEEN}('map')['15,15,15']")  # around what may lie on cells
    browser.click("#layer-escape")
    browser.until(f"{SEEN}('map')['15,15,15'] < {white} - 200")
    browser.click("#layer-escape")
    browser.click("#layer-user")
    browser.click("#layer-path")
    browser.click("#layer-goal")
    browser.until(f"!({SEEN}('map')['{user}'] > 60)")
    browser.until(f"!({SEEN}('map')['{path}'] > 10)")
    until(lambda: not {"user", "path", "goal"} & {*layers_of(server)})
    on = layers_of(server)
    assert "robot" in on

    server.received.clear()
    server.renew()  # as after a drop: what was chosen holds

    until(lambda: layers_of(server) == on)
    assert not browser.see("document.getElementById('layer-user').checked")
    for layer in ("user", "path", "goal"):
        browser.click(f"#layer-{layer}")
    browser.until(f"{SEEN}('map')['{user}'] > 300")


def test_requests_escapes_stops_and_commands_are_marked_on_the_lanes(
    browser: Browser, show: Show
) -> None:
    show("record")
    colours = {"request": "12,1,5", "escape": "11,6,0", "stop": "11,1,1", "command": "8,5,0"}

    for colour in colours.values():
        browser.until(f"{SEEN}('lanes')['{colour}'] > 8")
    for at, told in (
        (12.0, "12.0 s command: anna: stop"),
        (30.0, "30.0 s request: asked for a prop"),
        (50.0, "50.0 s escape: the user comes near"),
    ):
        title = browser.see(
            "((canvas) => { const box = canvas.getBoundingClientRect();"
            f" const x = box.x + 140 + (box.width - 140) * {at / UNTIL};"
            " canvas.dispatchEvent("
            "new PointerEvent('pointermove', {clientX: x, clientY: box.y + 14}));"
            " return canvas.title; })(document.getElementById('lanes'))"
        )
        assert title == told


@pytest.mark.requirement(145)
def test_arrows_go_from_transition_to_transition_and_a_drag_takes_a_range(
    browser: Browser, show: Show
) -> None:
    server = show("record")
    browser.until(lit(GO))

    browser.press("ArrowRight")
    until(lambda: sent(server, "seek"))
    browser.press("ArrowLeft")
    until(lambda: len(sent(server, "seek")) == 2)
    assert [m["at"] for m in sent(server, "seek")] == pytest.approx([24.0, 14.2])
    browser.drag("#lanes", (0.4, 0.5), (0.7, 0.5))
    until(lambda: sent(server, "range"))
    taken = sent(server, "range")[-1]
    assert 0 < taken["from"] < taken["to"] < UNTIL
    browser.until_text("#figures", f"of {taken['from']:.1f} s")
    browser.press("Space")
    until(lambda: sent(server, "play"))
    assert sent(server, "play")[-1]["speed"] == 1


def test_a_record_at_its_end_is_played_again_from_its_start(browser: Browser, show: Show) -> None:
    server = show("record", at=UNTIL)

    browser.press("Space")

    until(lambda: sent(server, "play"))
    assert [m["at"] for m in sent(server, "seek")] == [0.0]


@pytest.mark.requirement(19, 21)
def test_a_signal_is_plotted_on_click(browser: Browser, show: Show) -> None:
    server = show("record")
    browser.click("summary:has-text('Signals')")
    browser.fill("#signal-filter", "twist")

    browser.click("#signals li:not([hidden]) button")

    browser.until_text("#plots figcaption", "yaw")
    browser.until(
        "document.querySelector('#plots canvas').getContext('2d')"
        ".getImageData(0, 0, 2000, 80).data.some((v) => v)"
    )
    assert sent(server, "plot") == [{"t": "plot", "signal": "base.twist", "on": True}]


@pytest.mark.requirement(48, 54)
def test_stop_works_without_a_token(browser: Browser, show: Show) -> None:
    server = show("live")

    browser.click("#stop")

    browser.until_text("#stop", "STOPPED")
    browser.until_text("#answer", "stopped")
    assert [m["do"] for m in sent(server, "cmd")] == ["stop"]


def test_the_keyboard_alone_can_stop(browser: Browser, show: Show) -> None:
    server = show("live")
    for number, where in enumerate(["", "#token", "#map", "[role=treeitem]"]):
        if where:
            browser.focus(where)

        browser.press("Escape")

        browser.until_text("#stop", "STOPPED")
        assert len(sent(server, "stop")) == number + 1, where
        server.tell({"t": "ev", "stop": False})
        browser.until_text("#stop", "STOP ")
    server.received.clear()
    browser.see("Object.assign(document.getElementById('title'), {tabIndex: -1}).focus()")
    for _ in range(10):
        browser.press("Tab")
        if browser.see("document.activeElement.id") == "stop":
            break

    browser.press("Enter")

    until(lambda: sent(server, "stop"))


@pytest.mark.requirement(54)
def test_a_stop_that_cannot_be_sent_says_so(browser: Browser, show: Show) -> None:
    server = show("live")
    server.close()
    browser.until_text("#banner", "connection is lost")

    browser.press("Escape")

    browser.until_text("#answer", "NOT SENT")
    browser.until_text("#banner", "STOP WAS NOT SENT")
    server.start()
    browser.until("document.getElementById('banner').hidden")
    assert not sent(server, "stop")  # it is not sent late


def test_open_faults_are_shown_and_a_run_that_is_over_says_so(browser: Browser, show: Show) -> None:
    server = show("live")

    browser.until_text("#figures", "so far")
    server.tell({"t": "ev", "faults": ["base: no answer"]})
    browser.until_text("#doing.error", "base: no answer")
    server.tell({"t": "ev", "faults": []})
    browser.until("!document.querySelector('#doing.error')")
    server.tell({**server.figures(None), "final": True})
    browser.until_text("#figures", "of the whole run")
    server.tell({"t": "ev", "over": True, "ended": "preempted", "active": {}})
    server.close()

    browser.until_text("#banner.over", "The run is over")
    browser.until_text("#doing", "ended: preempted")
    browser.until("document.body.classList.contains('lost')")
    assert browser.text("#banner").startswith("The run is over")
    server.start()
    browser.until("document.getElementById('banner').hidden")


def test_an_outcome_is_forced_only_with_the_token(browser: Browser, show: Show) -> None:
    server = show("live", at=14.1)
    browser.until(lit("chase/follow/choose"))
    browser.find("chase/follow/choose")
    browser.until_text("#details", "chosen → pose: Pose2")
    assert not browser.see("document.querySelector('#details button')")

    browser.let_in("anna", "wrong")
    browser.until_text("#answer", "wrong token")
    in_control(browser, server)
    browser.until_text("#details", "force chosen")
    browser.click("#details summary")
    browser.click("text=force chosen")
    assert browser.see("document.querySelector('#details input').matches(':invalid')")
    browser.fill("#details input", "{x: 1 m, y: 2 m}")
    server.tell({"t": "ev", "data": {"chase/follow/choose": {"seen": "1"}}})
    browser.until_text("#details", "seen")  # and what was typed is still there
    browser.click("text=force chosen")
    browser.click("text=sure? force chosen")
    browser.until_text("#answer", "force chase/follow/choose chosen: done")
    assert commanded(server, "force") == {
        "path": "chase/follow/choose",
        "outcome": "chosen",
        "outputs": {"pose": "{x: 1 m, y: 2 m}"},
    }


def test_control_is_handed_over_both_pages_see_it_and_refusals_of_the_server_are_shown(
    browser: Browser, show: Show
) -> None:
    server = show("live")
    assert not sent(server, "beat")
    in_control(browser, server)
    until(lambda: len(sent(server, "beat")) >= 3)

    with connect(f"ws://127.0.0.1:{server.port}/ws") as ben:

        def hear(kind: str) -> dict[str, Any]:
            while (message := json.loads(ben.recv(20)))["t"] != kind:
                pass
            return dict(message)

        ben.send(json.dumps({"t": "auth", "token": server.token, "name": "ben"}))
        ben.send(json.dumps({"t": "cmd", "id": 1, "do": "take"}))
        browser.until_text("#holder", "ben holds control")
        browser.until("!document.querySelector('#tools button')")
        while hear("ev").get("operator") != {"name": "ben", "you": True}:
            pass
        surely(browser, "#control button")
        browser.until_text("#holder", "You hold control as anna")
        assert hear("ev")["operator"] == {"name": "anna", "you": False}
    server.holder = object()  # another page, of which this one has not heard yet
    browser.click("#tools button:text-is('pause')")
    browser.until_text("#answer.error", "somebody else holds control")
    browser.click("#control button")
    browser.until_text("#holder", "Nobody holds control")


def test_an_outcome_that_waits_is_consented_to_or_refused(browser: Browser, show: Show) -> None:
    server = show("live")
    server.tell({"t": "ev", "waiting": {"chase/follow/drive": "far"}})
    browser.until_text("#waiting", "chase/follow/drive: far waits for consent")
    browser.until(
        "document.getElementById('a_o:chase/follow/drive:far').classList.contains('waiting')"
    )
    assert not browser.see("document.querySelector('#waiting button')")

    in_control(browser, server)
    for what in ("refuse", "consent"):
        browser.click(f"#waiting button:text-is('{what}')")
        asked = {"path": "chase/follow/drive", "outcome": "far"}
        assert commanded(server, what) == asked
    server.tell({"t": "ev", "waiting": {}})
    browser.until("document.getElementById('waiting').children.length == 0")


def test_a_node_is_locked_and_gets_a_breakpoint_that_holds_the_run_which_steps_and_goes_on(
    browser: Browser, show: Show
) -> None:
    server = show("live")
    in_control(browser, server)
    browser.find(GO)

    browser.click("#details button:text-is('lock')")
    assert commanded(server, "lock") == {"path": GO}
    browser.click("#details button:text-is('breakpoint')")
    assert commanded(server, "break") == {"path": GO}
    server.tell({"t": "ev", "locks": [GO], "breaks": [GO], "paused": True})
    browser.until_text("#doing", "paused")
    browser.until_text("#details-body", "locked · breakpoint")
    browser.until("document.querySelector('.badge.break') && document.querySelector('.badge.lock')")
    browser.click("#tools button:text-is('step')")
    assert commanded(server, "step") == {}
    browser.focus("#tools button")
    browser.press("Enter")
    assert commanded(server, "resume") == {}
    server.tell({"t": "ev", "locks": [], "breaks": [], "paused": False})
    browser.until("document.activeElement.textContent == 'pause'")  # the focus has stayed
    browser.click("#details button:text-is('breakpoint')")
    browser.until("!document.querySelector('.badge.break')")


def test_level_of_autonomy_and_another_chart_are_sent_and_what_is_typed_stays(
    browser: Browser, show: Show
) -> None:
    server = show("live")
    in_control(browser, server)
    browser.click("#replace summary")
    browser.until("document.querySelector('#replace textarea').value == 'chart: cobodeck  # runs'")
    browser.see(
        "((one) => { one.value = 'chase'; one.dispatchEvent(new Event('change')); })"
        "(document.querySelector('#replace select'))"
    )
    browser.until("document.querySelector('#replace textarea').value == 'chart: chase  # runs'")
    browser.fill("#replace textarea", "chart: cobodeck")
    server.tell(running("cobodeck"))  # which comes late
    browser.until_text("#log", server.marked())
    browser.see(
        "((level) => { level.value = 'low'; level.dispatchEvent(new Event('change')); })"
        "(document.querySelector('#tools select'))"
    )
    assert commanded(server, "level") == {"level": "low"}
    server.tell({"t": "ev", "level": "low", "waiting": {GO: "stuck"}, "paused": True})
    browser.until("document.querySelector('#tools select').value == 'low'")

    surely(browser, "#replace button")

    assert commanded(server, "replace") == {"text": "chart: cobodeck"}
    server.tell({"t": "ack", "id": 99, "ok": False, "text": "a.yaml:1:8: error\n1 | chart"})
    browser.until("document.getElementById('answer').innerText.includes('error\\n1')")
    browser.see("document.querySelector('#replace textarea').value = '\"'.repeat(40000)")
    browser.click("#replace button")  # would break the connection, and lose control
    browser.until_text("#answer", "the text is too long")
    assert not browser.see("document.querySelector('#replace .sure')")


def test_what_is_typed_and_shown_larger_stays_after_a_drop_and_a_lost_connection(
    browser: Browser, show: Show
) -> None:
    server = show("live")
    in_control(browser, server)
    browser.click("#replace summary")
    browser.until("document.querySelector('#replace textarea').value != ''")
    browser.fill("#replace textarea", "chart: typed")
    browser.focus("#lanes")
    browser.press("+")
    larger = browser.text("#range-text")
    server.received.clear()

    server.renew()

    browser.until_text("#log", server.marked())
    assert larger == browser.text("#range-text") != ""
    assert browser.see("document.querySelector('#replace textarea').value") == "chart: typed"
    assert not sent(server, "auth")
    server.close()
    browser.until("document.body.classList.contains('lost')")
    browser.until("!document.querySelector('#replace').checkVisibility()")
    server.start()
    browser.until("document.querySelector('#replace textarea').checkVisibility()")
    assert browser.see("document.querySelector('#replace textarea').value") == "chart: typed"


@pytest.mark.requirement(49)
def test_reset_of_real_parts_stays_with_the_console(browser: Browser, show: Show) -> None:
    server = show("live")
    server.parts = True  # those that move by themselves, real or not
    server.renew()
    browser.until_text("#log", server.marked())
    in_control(browser, server)
    browser.until_text("#tools", "reset")
    browser.until_text("#holder", "Keep this tab in front")
    assert not browser.see("document.getElementById('speed-label').offsetParent")
    server.real = True
    server.close()
    server.start()

    browser.until_text("#control", "take control")  # let in again by itself, but not in control
    browser.click("#control button")
    browser.until_text("#tools", "reset: at the console")


def test_where_a_shadow_decided_otherwise_is_listed_and_gone_to(
    browser: Browser, show: Show
) -> None:
    server = show("record")
    assert not browser.see("document.getElementById('shadow').offsetParent")

    told = {"path": GO, "ran": "x = 3.0250000000000004", "shadow": "stuck"}
    for number, at in enumerate((14.5, 15.5)):
        server.tell({"t": "shadow", "rows": [{"at": at, **told}], "more": number > 0})

    browser.until("document.getElementById('shadow').offsetParent")
    assert browser.text("#shadow li") == f"14.5 s {GO}ran x = 3.025, shadow stuck"
    assert browser.text("#shadow li:last-child button") == f"15.5 s {GO}"
    browser.click("#shadow li:last-child button")
    until(lambda: sent(server, "seek"))
    assert sent(server, "seek")[-1]["at"] == 15.5
    browser.until_text("#details-head", GO)
    server.renew()
    browser.until("!document.getElementById('shadow').offsetParent")


def test_of_two_records_each_has_its_chart_its_lanes_its_figures_and_its_details(
    browser: Browser, show: Show
) -> None:
    server = show("record")
    nodes = server.chart()["nodes"]
    nodes["chase"]["kind"] = "use"
    signals = [{"name": "arm.joints", "type": "ArmState"}]
    runs = [{"title": f"{slot}.mcap", "signals": slot * signals} for slot in (0, 1)]
    server.tell({**server.hello(), "runs": runs})
    for slot in (0, 1):
        state = {**server.state(), "data": {"chase": {"goal": f"{slot + 1} m"}, "": {"goal": "0"}}}
        server.tell(server.chart(nodes=nodes, slot=slot))
        server.tell({**state, "active": {GO: 14.2 + slot, "chase": 3.0}, "slot": slot})
        server.tell({**lanes(UNTIL), "slot": slot})
        server.tell({**server.figures(None), "slot": slot})
        server.tell({**HEALTH, "missed": 3 + slot, "slot": slot})
    browser.until("document.querySelectorAll('.chart svg').length == 2")
    browser.until_text("#figures th", "record")
    browser.until_text("#health", "missed ticks34")
    assert "arm.joints" in browser.text("#signals")
    said = browser.see("[...document.querySelectorAll('#log li')].map((e) => e.textContent)")
    assert [one.split(" ")[0] for one in said[-6:]] == 3 * ["0.mcap", "1.mcap"]
    pick = f"querySelector('.chart [data-path=\"{GO}\"]').dispatchEvent("
    pick += "new MouseEvent('click', {bubbles: true}))"

    for slot in (0, 1):
        browser.see(f"document.querySelectorAll('.place')[{slot}].{pick}")

        browser.until_text("#details-body", f"← goal = {slot + 1} m")
        assert browser.text("#details-head") == GO + slot * " (second)"
        assert f"since {14.2 + slot} s, for {5.8 - slot:.1f} s" in browser.text("#details-body")
    browser.shot(OUT / "page-two.png")
    server.tell(server.hello())
    browser.until("document.getElementById('health-box').hidden")


def finding(**more: Any) -> dict[str, Any]:
    return {
        "code": "E201", "severity": "error", "message": "no node `parq`",
        "file": "charts/chase.yaml", "line": 41, "column": 9, "path": "chase/follow/park",
        "hint": "did you mean `park`?", **more,
    }  # fmt: skip


def test_the_last_good_picture_stays_while_the_text_is_broken(browser: Browser, show: Show) -> None:
    server = show("charts")
    browser.until_text("#findings-head", "No findings")
    assert not browser.see("document.querySelector('#stop').offsetParent")
    assert not browser.see("document.querySelector('#map').offsetParent")

    server.tell(server.chart(svg="", stale=True, findings=[finding()]))

    browser.until_text("#banner", "this is the last good picture")
    assert browser.see("document.querySelectorAll('.chart svg g[data-path]').length > 50")
    browser.until_text(".badge.error", "E201: no node `parq`")
    browser.until_text("#findings code", "charts/chase.yaml:41:9")
    browser.click("#findings button")
    browser.until("document.querySelector('.picked')?.dataset.path == 'chase/follow/park'")
    browser.shot(OUT / "page-finding.png")
    server.tell(server.chart())
    browser.until("document.getElementById('banner').hidden")


@pytest.mark.requirement(57)
def test_a_saved_chart_is_drawn_anew_and_two_stand_side_by_side_each_with_its_profile(
    browser: Browser, show: Show
) -> None:
    server = show("charts")
    listed = [
        {"name": n, "file": f"charts/{n}.yaml", "errors": e, "warnings": 0}
        for n, e in (("cobodeck", 0), ("escape", 2))
    ]
    server.tell({"t": "charts", "charts": listed})
    browser.until_text("#chart-list li:nth-child(2)", "2 errors")

    browser.click("#chart-list li:nth-child(2) button")
    until(lambda: sent(server, "show"))
    assert sent(server, "show")[0] == {"t": "show", "chart": "escape", "slot": 0}
    server.tell(server.chart(svg=drawn("escape", 0), name="escape", nodes={}))
    browser.until_text(".place b", "escape")
    browser.until("!document.getElementById('a_s:chase/follow/park')")
    browser.click("#chart-list li:first-child button:last-of-type")
    until(lambda: sent(server, "second"))
    assert sent(server, "second")[0] == {"t": "second", "chart": "cobodeck"}
    server.tell(server.chart(slot=1, profile="base"))
    browser.until("document.querySelectorAll('.chart svg').length == 2")
    browser.shot(OUT / "page-charts.png")
    assert browser.see(
        "new Set([...document.querySelectorAll('[id]')].map((e) => e.id)).size"
        " == document.querySelectorAll('[id]').length"
    )
    assert browser.see(
        "((profile) => { const was = profile.value; profile.value = 'paper';"
        " profile.dispatchEvent(new Event('change')); return was; })"
        "(document.querySelector('.place + .place select'))"
    ) == "base"  # fmt: skip
    until(lambda: sent(server, "profile"))
    assert sent(server, "profile")[0] == {"t": "profile", "name": "paper", "slot": 1}
    browser.click(".place + .place .bar button")
    until(lambda: len(sent(server, "second")) == 2)
    assert browser.see("document.querySelectorAll('.chart').length") == 1


FORM: list[dict[str, Any]] = [
    {"name": "goal", "kind": "input", "default": None, "what": "a pose", "unit": ""},
    {"name": "speed", "kind": "parameter", "default": "0.5", "what": "a speed", "unit": "m/s"},
    {"name": "tries", "kind": "parameter", "default": "3", "what": "a number", "unit": ""},
]


def test_a_chart_is_started_with_its_parameters_and_inputs(browser: Browser, show: Show) -> None:
    server = show("charts")
    server.form = [{"about": "", **field} for field in FORM]
    server.renew()
    browser.until_text("#log", server.marked())
    assert not browser.see("document.querySelector('#start').checkVisibility()")
    browser.let_in("anna", server.token)
    browser.until_text("#start summary", "start cobodeck")
    browser.click("#start summary")

    browser.click("#start button")
    assert browser.see("document.querySelector('#start :invalid input, #start input:invalid')")
    assert not browser.see("document.querySelector('#start .sure')")
    browser.fill("#start label:has-text('goal') input", "{x: 1 m, y: 2 m}")
    browser.fill("#start label:has-text('speed, m/s') input", "1 m/s")
    browser.fill("#start label:has-text('scene') input", "lab_a")
    server.close()
    browser.until("document.getElementById('start').hidden")
    server.start()
    browser.until("!document.getElementById('start').hidden")
    surely(browser, "#start button")

    assert commanded(server, "start") == {
        "chart": "cobodeck",
        "parameters": {"speed": "1 m/s"},
        "inputs": {"goal": "{x: 1 m, y: 2 m}"},
        "scene": "lab_a",
        "user": "",
    }
    browser.until_text("#answer a", "open its page")
    assert browser.see("document.querySelector('#answer a').href") == "http://127.0.0.1:1/"


def test_boxes_fold_and_used_charts_are_drawn_anew_by_the_server(
    browser: Browser, show: Show
) -> None:
    server = show("record")
    browser.until(lit(GO))
    browser.click("#chart-fit")
    inside = "document.getElementById('s:chase/follow/drive').getClientRects().length"

    browser.see(
        "document.querySelector('[data-fold=\"chase/follow\"]')"
        ".dispatchEvent(new MouseEvent('click', {bubbles: true}))"
    )

    browser.until(f"!{inside}")
    assert browser.see("document.getElementById('a_s:chase/follow').classList.contains('leaf')")
    browser.until_text(".since", "drive/go")
    assert browser.see("document.getElementById('s:haptic/serve/drive').getClientRects().length")
    browser.focus("#find")
    browser.fill("#find", "nowhere")
    browser.press("Enter")
    browser.until("document.getElementById('find').classList.contains('error')")
    browser.fill("#find", "drive")  # its name is enough
    browser.press("Enter")
    browser.until_text("#details-head", "drive")
    assert not browser.see("document.getElementById('find').classList.contains('error')")
    browser.find("chase/follow/drive")  # which is hidden: the box around it is found
    browser.until("document.activeElement.dataset.path == 'chase/follow'")
    assert "folded" in browser.see("document.activeElement.ariaLabel")
    browser.press("f")
    browser.until(inside)
    nodes = server.chart()["nodes"]
    nodes["haptic"]["kind"] = "use"
    nodes[GO]["break"] = True
    server.tell(server.chart(nodes=nodes, unfolded=["haptic"]))
    browser.until_text("#log", server.marked())
    assert browser.see("document.querySelector('.badge.break').dataset.path") == GO  # as written
    browser.see(
        "document.querySelector('[data-fold=haptic]')"
        ".dispatchEvent(new MouseEvent('click', {bubbles: true}))"
    )
    until(lambda: sent(server, "unfold"))
    assert sent(server, "unfold")[0] == {"t": "unfold", "path": "haptic", "on": False, "slot": 0}


def test_a_narrow_window_has_no_scroll_to_the_side(browser: Browser, show: Show) -> None:
    for mode in ("live", "record", "charts"):
        show(mode, size=(360, 780))
        browser.until("document.querySelector('#details').offsetParent")

        assert browser.see("document.documentElement.scrollWidth <= 360"), mode
        browser.see("document.querySelectorAll('details').forEach((d) => { d.open = true; })")
        browser.until("document.documentElement.scrollWidth <= 360")
        browser.see("scrollTo(0, document.documentElement.scrollHeight)")
        if mode == "live":
            browser.shot(OUT / "page-narrow.png")
            browser.until(
                "(({ x, y, right, bottom }) => x >= 0 && y >= 0 && right <= 360 && bottom <= 780)"
                "(document.getElementById('stop').getBoundingClientRect())"
            )


def test_letters_have_contrast(browser: Browser, show: Show) -> None:
    for mode, schemes in (("live", ("light", "dark")), ("charts", ("dark", "light"))):
        server = show(mode, scheme=schemes[0])
        if mode == "live":
            in_control(browser, server)
        server.tell(
            {"t": "ev", "faults": ["base: no answer"], "waiting": {"chase/follow/drive": "far"}}
        )
        server.tell(server.chart(findings=[finding(), finding(code="W3", severity="warning")]))
        row = {"at": 1.0, "path": "chase", "ran": "near", "shadow": "lost"}
        server.tell({"t": "shadow", "rows": [row], "more": False})
        browser.until_text("#findings", "W3")
        browser.until_text("#log", server.marked())
        browser.see("document.querySelectorAll('details').forEach((d) => { d.open = true; })")
        for scheme in schemes:
            browser.scheme(scheme)

            seen = browser.see(CONTRAST)

            assert len(seen) > (60 if mode == "live" else 20)
            assert [one for one in seen if one["ratio"] < 4.5] == [], (mode, scheme)


def test_a_stalled_page_catches_up_with_one_picture_for_each_frame(
    browser: Browser, show: Show
) -> None:
    server = show("record")
    browser.until(lit(GO))

    browser.see(COUNTED)
    browser.see(
        "setTimeout(() => { const end = performance.now() + 500;"
        " while (performance.now() < end); }, 0), counts.frames = counts.maps = 0, 1"
    )
    for number in range(400):
        at = 20.0 + number / 100
        line = {"at": at, "kind": "x", "path": "", "text": f"line {number}"}
        server.tell({"t": "ev", "at": at, "last": [line]})
        server.tell({"t": "frame", "at": at, "shapes": []})

    browser.until_text("#log", "line 399")
    browser.until_text("#clock", "24.0 s")
    assert browser.see("document.getElementById('log').children.length") == 300
    assert 0 < browser.see("counts.maps") <= browser.see("counts.frames") + 1
    browser.see("counts.ended = true")


def test_texts_of_the_server_are_texts(browser: Browser, show: Show) -> None:
    server = show("live")

    server.tell({"t": "say", "text": "<img src=x onerror=document.title='owned'>"})
    script = "<script>document.title='owned'</script></svg>"
    server.tell(server.chart(svg=server.svg.replace("</svg>", script)))

    browser.until_text("#log", server.marked())
    assert browser.see("document.querySelectorAll('#log img').length") == 0
    assert browser.see("document.title") == "cobodeck"


@pytest.mark.parametrize(
    ("name", "mode", "more"),
    [
        ("light", "live", {}),
        ("wide", "record", {"size": (1920, 1080), "scheme": "dark"}),
    ],
)
def test_pictures_to_look_at(browser: Browser, show: Show, name: str, mode: str, more: Any) -> None:
    show(mode, at=33.0, **more)
    browser.until(lit("haptic/serve/drive"))
    browser.until_text("#figures", "Escapes")

    browser.shot(OUT / f"page-{name}.png")

    assert (OUT / f"page-{name}.png").stat().st_size > 20_000
