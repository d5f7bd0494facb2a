"""The page in a browser, on a server that plays a script."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.cobodeck.live.browser import Browser
from tests.cobodeck.live.fake_page_server import TOKEN, UNTIL, FakePageServer
from tests.cobodeck.live.pictures import drawn
from tests.waiting import until

pytestmark = [pytest.mark.slow]
OUT = Path(__file__).parents[3] / "out"
GO = "chase/follow/drive/go"
CONTRAST = Path(__file__).with_name("contrast.js").read_text(encoding="utf-8")
Server = FakePageServer


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with Browser() as running:
        yield running


@pytest.fixture
def serve(browser: Browser) -> Iterator[Any]:
    """`serve(mode, at=…)` opens the page on a server of this mode."""
    servers: list[Server] = []

    def start(mode: str, at: float = 20.0, still: bool = False, **size: Any) -> Server:
        server = FakePageServer(drawn("cobodeck", -1), mode, at=at)
        server.stopped = still
        servers.append(server.__enter__())
        browser.open(server.url, **size)
        browser.until_text("#link", "connected")
        browser.until("document.querySelector('.chart svg')")
        return server

    yield start
    for server in servers:
        server.__exit__()


def lit(path: str) -> str:
    return f"document.getElementById('a_s:{path}')?.classList.contains('leaf')"


def sent(server: Server, kind: str) -> list[dict[str, Any]]:
    return [m for m in server.received if kind in (m["t"], m.get("do"))]


def let_in(browser: Browser, token: str = TOKEN) -> None:
    browser.fill("#name", "anna")
    browser.fill("#token", token)
    browser.click("#auth button")


def in_control(browser: Browser) -> None:
    let_in(browser)
    browser.until_text("#commands", "take control")
    browser.click("text=take control")
    browser.until_text("#holder", "You hold control as anna")


def test_the_page_opens_without_errors_and_asks_nobody_else(browser: Browser, serve: Any) -> None:
    server = serve("live")

    browser.until_text("#clock", "of 60.0 s")
    assert browser.text("#title") == "cobodeck"
    assert browser.errors == []
    assert all(
        url.startswith((server.url, "data:", f"ws://127.0.0.1:{server.port}/"))
        for url in browser.urls
    )


def test_what_is_active_lights_up_and_the_transition_taken_is_bold(
    browser: Browser, serve: Any
) -> None:
    serve("live", at=22.5)

    browser.until(lit(GO))
    browser.until_text(".since", " s")
    assert browser.see("document.querySelectorAll('.since').length") == 1  # guards have none
    assert browser.see(lit("chase/danger"))
    assert browser.see(
        "document.getElementById('a_s:chase/follow/drive').classList.contains('active')"
    )
    browser.until(
        "document.getElementById('t:chase/follow/drive:arrived').classList.contains('taken')"
    )
    browser.until(lit("chase/follow/wait"))
    browser.until(f"!{lit(GO)}")
    browser.until("!document.querySelector('.taken')")
    browser.until_text("#spoken", "chase/follow/wait")
    browser.until_text("#log", "go.arrived → chase/follow/wait")


SEEN = """(() => {
  const map = document.getElementById('map'), found = {};
  const data = map.getContext('2d').getImageData(0, 0, map.width, map.height).data;
  for (let i = 0; i < data.length; i += 4) {
    const key = [data[i] >> 4, data[i + 1] >> 4, data[i + 2] >> 4].join();
    if (data[i + 3]) found[key] = (found[key] ?? 0) + 1;
  }
  return found; })()"""
"""How many pixels of the map have a colour, by its upper halves."""


def test_the_map_is_drawn_and_layers_can_be_taken_away(browser: Browser, serve: Any) -> None:
    server = serve("record")
    user = "11,1,1"  # #b71c1c

    browser.until(f"Object.keys({SEEN}).length > 20 && ({SEEN})['{user}'] > 300")
    browser.click("#layer-user")
    browser.until(f"!(({SEEN})['{user}'] > 60)")
    until(lambda: sent(server, "layers"))
    assert "user" not in sent(server, "layers")[-1]["on"]
    assert "robot" in sent(server, "layers")[-1]["on"]


def test_arrows_go_from_transition_to_transition_and_a_drag_takes_a_range(
    browser: Browser, serve: Any
) -> None:
    server = serve("record")
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
    browser.until_text("#figures", "of ")
    browser.press("Space")
    until(lambda: sent(server, "play"))
    assert sent(server, "play")[-1]["speed"] == 1


def test_a_signal_is_plotted_on_click(browser: Browser, serve: Any) -> None:
    server = serve("record")
    browser.click("summary:has-text('Signals')")
    browser.fill("#signal-filter", "twist")

    browser.click("#signals li:not([hidden]) button")

    browser.until_text("#plots figcaption", "yaw")
    browser.until(
        "document.querySelector('#plots canvas').getContext('2d')"
        ".getImageData(0, 0, 2000, 80).data.some((v) => v)"
    )
    assert sent(server, "plot") == [{"t": "plot", "signal": "base.twist", "on": True}]


def test_stop_works_without_a_token(browser: Browser, serve: Any) -> None:
    server = serve("live")

    browser.click("#stop")

    browser.until_text("#stop", "STOPPED")
    browser.until_text("#answer", "stopped")
    assert [m["do"] for m in sent(server, "cmd")] == ["stop"]


@pytest.mark.parametrize("where", ["body", "#token", "#map", "#find", "#speed"])
def test_the_keyboard_alone_can_stop(browser: Browser, serve: Any, where: str) -> None:
    server = serve("live")
    if where != "body":
        browser.focus(where)

    browser.press("Escape")

    browser.until_text("#stop", "STOPPED")
    assert sent(server, "stop")


def test_stop_is_reached_by_tab(browser: Browser, serve: Any) -> None:
    server = serve("live")
    for _ in range(10):
        browser.press("Tab")
        if browser.see("document.activeElement.id") == "stop":
            break

    browser.press("Enter")

    until(lambda: sent(server, "stop"))


def test_a_stop_that_cannot_be_sent_says_so(browser: Browser, serve: Any) -> None:
    server = serve("live")
    server.close()
    browser.until_text("#banner", "connection is lost")

    browser.press("Escape")

    browser.until_text("#answer", "NOT SENT")
    browser.until_text("#banner", "STOP WAS NOT SENT")
    server.start()
    browser.until("document.getElementById('banner').hidden")
    assert not sent(server, "stop")  # it is not sent late


def test_an_outcome_is_forced_only_with_the_token(browser: Browser, serve: Any) -> None:
    server = serve("live", at=14.1, still=True)
    browser.until(lit("chase/follow/choose"))
    browser.fill("#find", "chase/follow/choose")
    browser.press("Enter")
    browser.until_text("#details", "chosen → pose: Pose2")
    assert not browser.see("document.querySelector('#details button')")

    let_in(browser, "wrong")
    browser.until_text("#answer", "wrong token")
    in_control(browser)
    browser.until_text("#details", "force chosen")
    browser.click("#details summary")
    browser.click("text=force chosen")
    assert browser.see("document.querySelector('#details input').matches(':invalid')")
    browser.fill("#details input", "{x: 1 m, y: 2 m}")
    browser.click("text=force chosen")
    browser.click("text=sure? force chosen")
    browser.until_text("#answer", "force chase/follow/choose chosen: done")
    (force,) = sent(server, "force")
    assert force["path"] == "chase/follow/choose"
    assert force["outcome"] == "chosen"
    assert force["outputs"] == {"pose": "{x: 1 m, y: 2 m}"}


def test_a_refusal_of_the_server_is_shown_and_control_is_seen(browser: Browser, serve: Any) -> None:
    server = serve("live")
    in_control(browser)
    server.holder = object()  # another page

    browser.click("#commands button:text-is('pause')")

    browser.until_text("#answer.error", "somebody else holds control")
    server.tell({"t": "ev", "operator": {"name": "ben", "you": False}})
    browser.until_text("#holder", "ben holds control")
    browser.until_text("#commands", "take over from ben")
    assert not browser.see(
        "[...document.querySelectorAll('#commands button')].some((b) => b.textContent == 'pause')"
    )


def test_who_holds_control_beats(browser: Browser, serve: Any) -> None:
    server = serve("live")
    assert not sent(server, "beat")

    in_control(browser)

    until(lambda: len(sent(server, "beat")) >= 5)


def test_an_outcome_that_waits_is_consented_to(browser: Browser, serve: Any) -> None:
    server = serve("live")
    server.tell({"t": "ev", "waiting": {"chase/follow/drive": "far"}})
    browser.until_text("#commands", "chase/follow/drive: far waits for consent")
    browser.until(
        "document.getElementById('a_o:chase/follow/drive:far').classList.contains('waiting')"
    )

    in_control(browser)
    browser.click("#commands button:text-is('consent')")

    until(lambda: sent(server, "consent"))
    assert sent(server, "consent")[0]["path"] == "chase/follow/drive"


def test_reset_of_real_parts_stays_with_the_console(browser: Browser, serve: Any) -> None:
    server = serve("live")
    in_control(browser)
    browser.until_text("#commands", "reset")
    server.real = True
    server.close()
    server.start()

    browser.until_text("#commands", "take control")  # let in again by itself, but not in control
    browser.click("text=take control")
    browser.until_text("#commands", "reset: at the console")


def finding(**more: Any) -> dict[str, Any]:
    return {
        "code": "E201", "severity": "error", "message": "no node `parq`",
        "file": "charts/chase.yaml", "line": 41, "column": 9, "path": "chase/follow/park",
        "hint": "did you mean `park`?", **more,
    }  # fmt: skip


def test_the_last_good_picture_stays_while_the_text_is_broken(browser: Browser, serve: Any) -> None:
    server = serve("charts")
    browser.until_text("#findings-head", "No findings")
    assert not browser.see("document.querySelector('#stop').offsetParent")
    assert not browser.see("document.querySelector('#map').offsetParent")

    server.tell(server.chart(svg="", stale=True, findings=[finding()]))

    browser.until_text("#banner", "this is the last good picture")
    assert browser.see("document.querySelectorAll('.chart svg g[data-path]').length > 50")
    browser.until_text(".badge.error", "E201: no node `parq`")
    browser.click("#findings button")
    browser.until_text("#findings code:not([hidden])", "charts/chase.yaml:41:9")
    assert browser.see("document.querySelector('.picked').dataset.path") == "chase/follow/park"
    server.tell(server.chart())
    browser.until("document.getElementById('banner').hidden")


def test_a_saved_chart_is_drawn_anew_and_two_stand_side_by_side(
    browser: Browser, serve: Any
) -> None:
    server = serve("charts")

    server.tell(server.chart(svg=drawn("escape", 0), name="escape", nodes={}))
    browser.until_text("#chart-head", "escape")
    browser.until("!document.getElementById('a_s:chase/follow/park')")
    browser.fill("#second", "cobodeck")
    browser.press("Enter")
    until(lambda: sent(server, "second"))
    server.tell(server.chart(slot=1))
    browser.until("document.querySelectorAll('.chart svg').length == 2")
    browser.shot(OUT / "page-charts.png")
    assert browser.see(
        "new Set([...document.querySelectorAll('[id]')].map((e) => e.id)).size"
        " == document.querySelectorAll('[id]').length"
    )
    browser.see(
        "document.getElementById('profile').value = 'paper',"
        "document.getElementById('profile').dispatchEvent(new Event('change'))"
    )
    until(lambda: sent(server, "profile"))


def test_charts_of_a_folder_are_listed_and_shown(browser: Browser, serve: Any) -> None:
    server = serve("charts")

    listed = [
        {"name": n, "file": f"charts/{n}.yaml", "errors": e, "warnings": 0}
        for n, e in (("chase", 0), ("escape", 2))
    ]
    server.tell({"t": "charts", "charts": listed})
    browser.until_text("#chart-list", "escape 2 errors")
    browser.click("#chart-list li:nth-child(2) button")

    until(lambda: sent(server, "show"))
    assert sent(server, "show")[0]["chart"] == "escape"


def test_boxes_fold_and_used_charts_are_drawn_anew_by_the_server(
    browser: Browser, serve: Any
) -> None:
    server = serve("record")
    browser.until(lit(GO))
    browser.click("#chart-fit")

    browser.see(
        "document.querySelector('[data-fold=\"chase/follow\"]')"
        ".dispatchEvent(new MouseEvent('click', {bubbles: true}))"
    )

    browser.until("!document.getElementById('s:chase/follow/drive').getClientRects().length")
    assert browser.see("document.getElementById('a_s:chase/follow').classList.contains('leaf')")
    browser.until_text(".since", "drive/go")
    assert browser.see("document.getElementById('s:haptic/serve/drive').getClientRects().length")
    browser.focus(".chart")
    browser.press("f")
    assert browser.see("!document.getElementById('s:chase/follow/drive').getClientRects().length")
    browser.fill("#find", "chase/follow/drive")
    browser.press("Enter")
    browser.focus(".chart")
    browser.press("f")
    browser.until("document.getElementById('s:chase/follow/drive').getClientRects().length")
    nodes = server.chart()["nodes"]
    nodes["haptic"]["kind"] = "use"
    server.tell(server.chart(nodes=nodes, unfolded=["haptic"]))
    server.tell({"t": "say", "text": "drawn"})
    browser.until_text("#log", "drawn")
    browser.see(
        "document.querySelector('[data-fold=haptic]')"
        ".dispatchEvent(new MouseEvent('click', {bubbles: true}))"
    )
    until(lambda: sent(server, "unfold"))
    assert sent(server, "unfold")[0] == {"t": "unfold", "path": "haptic", "on": False, "slot": 0}


@pytest.mark.parametrize("mode", ["live", "record", "charts"])
def test_a_narrow_window_has_no_scroll_to_the_side(browser: Browser, serve: Any, mode: str) -> None:
    serve(mode, width=400, height=800)
    browser.until("document.querySelector('#details').offsetParent")

    assert browser.see("document.documentElement.scrollWidth <= 400")
    browser.see("document.querySelectorAll('details').forEach((d) => { d.open = true; })")
    browser.until("document.documentElement.scrollWidth <= 400")
    browser.see("scrollTo(0, document.documentElement.scrollHeight)")
    if mode == "live":
        browser.until(
            "(({ x, y, right, bottom }) => x >= 0 && y >= 0 && right <= 400 && bottom <= 800)"
            "(document.getElementById('stop').getBoundingClientRect())"
        )


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_letters_have_contrast(browser: Browser, serve: Any, scheme: str) -> None:
    server = serve("live", scheme=scheme)
    in_control(browser)
    server.tell(
        {"t": "ev", "faults": ["base: no answer"], "waiting": {"chase/follow/drive": "far"}}
    )
    server.tell(server.chart(findings=[finding(), finding(code="W3", severity="warning")]))
    browser.until_text("#doing", "base: no answer")
    browser.until_text("#findings", "W3")
    browser.see("document.querySelectorAll('details').forEach((d) => { d.open = true; })")

    seen = browser.see(CONTRAST)

    assert len(seen) > 60
    assert [one for one in seen if one["ratio"] < 4.5] == []


def test_a_stalled_page_catches_up_with_one_picture_for_each_frame(
    browser: Browser, serve: Any
) -> None:
    server = serve("record")
    browser.until(lit(GO))

    browser.see(
        "setTimeout(() => { const end = performance.now() + 1500;"
        " while (performance.now() < end); }, 0), 1"
    )
    for number in range(1000):
        server.tell(
            {
                "t": "ev",
                "at": 20.0 + number / 100,
                "last": [{"at": 20.0, "kind": "x", "path": "", "text": f"line {number}"}],
            }
        )
        server.tell({"t": "frame", "at": 20.0 + number / 100, "shapes": []})

    browser.until_text("#log", "line 999")
    browser.until_text("#clock", "30.0 s")
    assert browser.see("document.getElementById('log').children.length") <= 300
    assert browser.see("counts.maps <= counts.frames")


def test_texts_of_the_server_are_texts(browser: Browser, serve: Any) -> None:
    server = serve("live")

    server.tell({"t": "say", "text": "<img src=x onerror=document.title='owned'>"})
    server.tell(
        server.chart(
            svg=server.svg.replace("</svg>", "<script>document.title='owned'</script></svg>")
        )
    )
    server.tell({"t": "say", "text": "after"})

    browser.until_text("#log", "after")
    assert browser.see("document.querySelectorAll('#log img').length") == 0
    assert browser.see("document.title") == "cobodeck"


def test_a_reader_of_the_screen_finds_its_way(browser: Browser, serve: Any) -> None:
    serve("live")
    browser.until(lit(GO))

    unnamed = browser.see(
        "[...document.querySelectorAll('button, input, select, textarea, canvas, section, aside')]"
        ".filter((e) => !(e.textContent.trim() || e.ariaLabel || e.labels?.length"
        " || e.getAttribute('aria-labelledby'))).map((e) => e.outerHTML)"
    )
    assert unnamed == []
    assert browser.see("document.querySelectorAll('header, main, aside').length") == 3
    assert "active: " in browser.see(
        "document.querySelector('.chart svg').getAttribute('aria-label')"
    )


@pytest.mark.parametrize(
    ("name", "mode", "size"),
    [
        ("light", "live", {}),
        ("dark", "record", {"scheme": "dark"}),
        ("narrow", "live", {"width": 400, "height": 800}),
        ("middle", "live", {"width": 900, "height": 1000, "scheme": "dark"}),
    ],
)
def test_pictures_to_look_at(browser: Browser, serve: Any, name: str, mode: str, size: Any) -> None:
    serve(mode, at=33.0, **size)
    browser.until(lit("haptic/serve/drive"))
    browser.until_text("#figures", "Escapes")

    browser.shot(OUT / f"page-{name}.png")

    assert (OUT / f"page-{name}.png").stat().st_size > 20_000
