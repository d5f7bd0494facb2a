"""Ten minutes with the page open: every command is typed; of each page that opens, all is there."""

from __future__ import annotations

import re
import urllib.request
from pathlib import Path

import pytest

from tests.cobodeck.docs.test_first_hour import ROOT, write
from tests.cobodeck.live.served import serving
from tests.program import python

MINUTES = (ROOT / "cobodeck/docs/ten-minutes.md").read_text(encoding="utf-8")
PAGES = 4


def steps() -> list[tuple[str, str]]:
    """Language and text of each block."""
    return re.findall(r"^```(\w+)\n(.*?)^```", MINUTES, flags=re.M | re.S)


@pytest.mark.slow
def test_every_command_of_the_ten_minutes_works_as_it_is_typed(tmp_path: Path) -> None:
    opened = 0
    for language, text in steps():
        if language != "sh":
            write(tmp_path, text)
            continue
        for line in text.splitlines():
            program, *words = line.split()
            assert program == "cobodeck"
            if words[0] != "watch" and "--live" not in words:
                done = python(tmp_path, "-m", "cobodeck", *words)
                assert done.returncode == 0, f"{line}\n{done.stdout}{done.stderr}"
                continue
            opened += 1
            with serving(tmp_path, *words) as page, urllib.request.urlopen(page.url) as got:
                assert b'id="charts"' in got.read()
                assert bool(page.token) is not any(word.endswith(".mcap") for word in words), line
    assert opened == PAGES


def test_what_the_page_calls_its_buttons_stands_in_its_scripts() -> None:
    scripts = "".join(
        file.read_text(encoding="utf-8")
        for file in (ROOT / "cobodeck/live/page").iterdir()
        if file.suffix in (".js", ".html")
    )

    named = ("unlock", "take control", "reset", "acknowledge", "pause", "resume", "step", "force")
    for word in (*named, "breakpoint", "lock", "speed", "beside", "profile"):
        assert f"*{word}*" in MINUTES
        assert word in scripts
