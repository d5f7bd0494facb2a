"""`KEY=VALUE`: what a command line gives, and how it is written again."""

from __future__ import annotations

import re
from typing import Any

import pytest
from hypothesis import given, strategies as st

from engine.files.assignments import assignment, written_text
from engine.files.finding import FileError
from engine.files.source import plain, read

READ: dict[str, tuple[str, Any]] = {
    "a=1": ("a", 1),
    " a.b = 2 m ": ("a.b", "2 m"),
    "goal={x: 2 m, y: -1}": ("goal", {"x": "2 m", "y": -1}),
    "a=b=c": ("a", "b=c"),
    "a=[1, none, ~]": ("a", [1, "none", None]),
}


@pytest.mark.parametrize("text", READ)
def test_the_value_is_yaml(text: str) -> None:
    key, source = assignment(text, "--in", "a=1")

    assert (key, plain(source.value)) == READ[text]


WRONG = {
    "a": "--in a: is not KEY=VALUE; write it as in a=1",
    "a=": "--in a=: is not KEY=VALUE",
    "=1": "--in =1: is not KEY=VALUE",
    "a..b=1": "--in a..b=1: is not KEY=VALUE",
    "a={x: 1": "--in a={x: 1: not YAML: the bracket `{` is never closed",
    "a={x: 1, x: 2}": "--in a={x: 1, x: 2}: key 'x' stands here again",
    "a=*b": "--in a=*b: alias *b",
}


@pytest.mark.parametrize("text", WRONG)
def test_a_mistake_is_told_with_the_text_as_a_whole(text: str) -> None:
    with pytest.raises(FileError, match=f"^{re.escape(WRONG[text])}"):
        assignment(text, "--in", "a=1")


WRITTEN: dict[str, Any] = {
    "{x: 2 m, y: -1, yaw: 90 deg}": {"x": "2 m", "y": -1, "yaw": "90 deg"},
    "[a, 1.5, null, true]": ["a", 1.5, None, True],
    '["1", "true", "", "a, b", "null"]': ["1", "true", "", "a, b", "null"],
    "$profile.escape.ahead": "$profile.escape.ahead",
    "none": "none",
}


@pytest.mark.parametrize("text", WRITTEN)
def test_values_are_written_as_one_would(text: str) -> None:
    assert written_text(WRITTEN[text]) == text


LETTERS = st.text(st.characters(blacklist_categories=("Cs", "Cc", "Zl", "Zp", "Co", "Cn")))
SIMPLE = st.none() | st.booleans() | st.integers(-(10**9), 10**9) | LETTERS
SIMPLE |= st.floats(allow_nan=False, allow_infinity=False)
NAMES = st.text("abcxyz_", min_size=1)


@given(st.recursive(SIMPLE, lambda inner: st.lists(inner) | st.dictionaries(NAMES, inner)))
def test_what_is_written_is_read_as_the_same(value: Any) -> None:
    source = read(written_text(value).encode(), "")

    assert not source.findings
    assert plain(source.value) == value
