"""The files of the page: what they may hold, and colours that can be read."""

from __future__ import annotations

import re
from itertools import product
from pathlib import Path

import pytest

from engine.draw import style

PAGE = Path(__file__).parents[3] / "cobodeck" / "live" / "page"
CSS = (PAGE / "page.css").read_text(encoding="utf-8")
HTML = (PAGE / "index.html").read_text(encoding="utf-8")
MODULES = {file.name: file.read_text(encoding="utf-8") for file in PAGE.glob("*.js")}
COLOURS = {
    name: (light, dark)
    for name, light, dark in re.findall(r"--([\w-]+): light-dark\((#\w+), (#\w+)\);", CSS)
}
LONGEST = 120
MAP_STYLES = [
    *("wall", "inflation-0", "inflation-1", "inflation-2", "robot", "foam", "arm", "held", "user"),
    *("view", "zone", "path", "goal", "scan", "costmap", "chase", "escape", "haptic", "deep"),
    *("object", "place", "tracked", "trail-robot", "trail-user", "ring"),
]
DRAWN = {
    style.PAGE, style.INK, style.GREY, style.AMBER, style.RED, style.FRAME, *style.FILLS,
    *(colour for border, fill, _, _ in style.KINDS.values() for colour in (border, fill)),
}  # fmt: skip
"""What pictures of charts have where nothing is active."""


def luminance(colour: str) -> float:
    parts = [int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5)]
    r, g, b = (p / 12.92 if p <= 0.04045 else ((p + 0.055) / 1.055) ** 2.4 for p in parts)
    return 0.2126 * r + 0.7152 * g + 0.0722 * b


def contrast(one: str, other: str) -> float:
    low, high = sorted((luminance(one), luminance(other)))
    return (high + 0.05) / (low + 0.05)


GROUNDS = [
    *("chart-page", "chart-box-1", "chart-box-2", "chart-do-fill", "chart-watch-fill"),
    *("chart-use-fill", "chart-do-lit", "chart-watch-lit", "chart-use-lit"),
]
LETTERS = [
    *product(("ink", "soft", "accent", "bad", "warn", "good"), ("page", "pane")),
    *product(("ink",), ("button",)),
    *product(("chart-ink", "chart-grey"), GROUNDS),
    *product(("chart-amber", "chart-red"), GROUNDS[:3]),
    *product(("chart-amber",), ("chart-watch-fill",)),
    *product(("span-ink",), ("span", "span-now", "span-bad")),
    *product((f"series-{i}" for i in range(6)), ("pane",)),
    *product(("chart-do",), GROUNDS[:3]),
]


@pytest.mark.parametrize("theme", [0, 1], ids=["light", "dark"])
def test_letters_can_be_read_on_all_that_they_stand_on(theme: int) -> None:
    seen = {(a, b): contrast(COLOURS[a][theme], COLOURS[b][theme]) for a, b in LETTERS}

    assert {pair: round(ratio, 2) for pair, ratio in seen.items() if ratio < 4.5} == {}


@pytest.mark.parametrize("theme", [0, 1], ids=["light", "dark"])
def test_borders_and_what_is_active_stand_out(theme: int) -> None:
    pairs = [
        *product(("chart-do", "chart-watch", "chart-use"), ("chart-page", "chart-box-2")),
        *product(("c-wall", "c-robot", "c-user", "c-path", "c-scan", "c-arm"), ("pane",)),
    ]
    seen = {(a, b): contrast(COLOURS[a][theme], COLOURS[b][theme]) for a, b in pairs}

    assert {pair: round(ratio, 2) for pair, ratio in seen.items() if ratio < 3} == {}


def test_nothing_moves_by_itself() -> None:
    moving = r"animation|transition:|@keyframes|scroll-behavior"

    assert not re.findall(moving, CSS)
    assert not [name for name, text in MODULES.items() if re.findall(r"smooth|\.animate\(", text)]


def test_lines_are_as_long_as_can_be_read() -> None:
    files = {"page.css": CSS, "index.html": HTML, **MODULES}
    long = [
        (name, number)
        for name, text in files.items()
        for number, line in enumerate(text.splitlines(), 1)
        if len(line) > LONGEST and "Content-Security-Policy" not in line
    ]

    assert long == []


def test_stop_can_be_read() -> None:
    (red,) = re.findall(r"--stop: (#\w+);", CSS)

    assert contrast(red, "#ffffff") >= 4.5


def test_the_light_chart_has_the_colours_of_the_picture() -> None:
    rules = dict(
        re.findall(
            r'\.chart \[(?:fill|stroke)="(#\w+)"\][^{]*\{ (?:fill|stroke): var\(--([\w-]+)\)', CSS
        )
    )

    assert rules.keys() >= DRAWN
    assert {colour: COLOURS[name][0] for colour, name in rules.items()} == {c: c for c in rules}


@pytest.mark.parametrize("name", MAP_STYLES)
def test_each_meaning_has_a_colour_on_the_map(name: str) -> None:
    assert f"c-{name}" in COLOURS


def test_nothing_in_the_page_needs_a_lax_policy() -> None:
    assert re.search(r'Content-Security-Policy" content="default-src \'none\'', HTML)
    assert "unsafe" not in HTML
    assert not re.findall(r"<script(?![^>]* src=)|<style|\sstyle=|\son\w+=", HTML)
    for text in MODULES.values():
        assert not re.findall(
            r"innerHTML|insertAdjacentHTML|document\.write|\beval\(|new Function", text
        )
        assert not re.findall(r"setAttribute\(\"style\"", text)


def test_the_page_is_made_of_its_own_files_alone() -> None:
    for name, text in MODULES.items():
        for asked in re.findall(r'from "([^"]+)"', text):
            assert asked.removeprefix("./") in MODULES, name
    assert not [
        url
        for text in (HTML, CSS, *MODULES.values())
        for url in re.findall(r"https?://(?!www\.w3\.org)\S+", text)
    ]
    assert {url.removeprefix("/page/") for url in re.findall(r'(?:src|href)="([^"]+)"', HTML)} == {
        "data:,",
        "page.css",
        "main.js",
    }


def test_what_modules_look_for_is_in_the_page() -> None:
    ids = set(re.findall(r'\bid="([\w-]+)"', HTML))

    assert len(ids) == len(re.findall(r'\bid="', HTML))
    for name, text in MODULES.items():
        assert set(re.findall(r'\$\("([\w-]+)"\)', text)) <= ids, name


def test_a_style_sheet_uses_colours_that_it_has() -> None:
    defined = set(re.findall(r"--([\w-]+):", CSS))

    assert set(re.findall(r"var\(--([\w-]+)\)", CSS)) <= defined


@pytest.mark.requirement(54)
def test_the_key_that_stops_is_said() -> None:
    assert re.search(r'id="stop"[^>]*aria-keyshortcuts="Escape"[^>]*>STOP <kbd>Esc</kbd>', HTML)
    assert "<dt>Esc</dt><dd>stop the run" in HTML
    assert "a software stop, not a safety device" in HTML
