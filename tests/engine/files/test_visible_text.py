"""What a terminal obeys, or a reader cannot see, stands as an escape."""

import json

import pytest
from hypothesis import given, strategies as st

from engine.files.visible_text import visible

COMMANDS = {*range(0x20), *range(0x7F, 0xA0), *range(0x202A, 0x202F), *range(0x2066, 0x206A)}
ANYTHING = st.text(st.characters() | st.sampled_from(sorted(map(chr, COMMANDS))))


@given(ANYTHING)
def test_nothing_that_a_terminal_obeys_is_left(text: str) -> None:
    assert not COMMANDS & set(map(ord, visible(text)))


@given(ANYTHING)
def test_all_that_is_shown_can_be_encoded(text: str) -> None:
    visible(text).encode()


@given(st.text(st.characters(categories=("L", "M", "N", "P", "S", "Zs"))))
def test_what_can_be_seen_stays_as_it_is(text: str) -> None:
    assert visible(text) == text


@given(ANYTHING)
def test_json_stays_what_it_means(text: str) -> None:
    shown = visible(json.dumps([text], indent=1, ensure_ascii=False), keep="\n")

    assert json.loads(shown) == json.loads(json.dumps([text]))


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("\x1b[2J", r"\x1b[2J"),
        ("a\r\nb\x00", r"a\r\nb\x00"),
        ("\x7f\x9b", r"\u007f\u009b"),
        ("x\u202ey", r"x\u202ey"),
        ("\udcff", r"\udcff"),
        ("°ü危", "°ü危"),
    ],
)
def test_an_escape_names_the_character(text: str, shown: str) -> None:
    assert visible(text) == shown


def test_layout_may_be_kept() -> None:
    assert visible("a\n\tb\r", keep="\n\t") == "a\n\tb\\r"
