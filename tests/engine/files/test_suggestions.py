"""What to write instead of words that are no names."""

from __future__ import annotations

import pytest

from engine.files.suggestions import help_with_name


@pytest.mark.parametrize(
    ("word", "told"),
    [
        ("d\u043ene", "write 'done' in Latin letters"),
        ("\u043e\u0431\u0445\u043e\u0434", "Latin letters, digits and _"),
        ("\u90e8\u5c4b", "Latin letters, digits and _"),
        ("two words", "write 'two_words'"),
    ],
)
def test_a_name_is_suggested_only_if_it_is_one(word: str, told: str) -> None:
    assert told in help_with_name(word)
