"""Text made safe to show: control and invisible characters become escapes."""

from __future__ import annotations

import json
import re
import unicodedata

_UNUSUAL = re.compile(r"[^ -~]")
_HIDDEN = frozenset(("Cc", "Cf", "Cs", "Zl", "Zp"))
"""Unicode categories: control, format (with bidirectional overrides), surrogate, separators."""


def visible(text: str, keep: str = "") -> str:
    r"""The text with hidden characters escaped as `\x1b` or `\u202e`, except those in `keep`.

    JSON text keeps its meaning: C0 characters are escaped in it anyway, and the others become
    JSON's own escapes.
    """
    if text.isascii() and text.isprintable():
        return text

    def shown(match: re.Match[str]) -> str:
        character = match[0]
        is_hidden = unicodedata.category(character) in _HIDDEN and character not in keep
        return escaped(character) if is_hidden else character

    return _UNUSUAL.sub(shown, text)


def escaped(character: str) -> str:
    r"""One character in ASCII: `\n`, `\x1b` for C0, JSON's `\u202e` for all others."""
    return (repr(character) if character < " " else json.dumps(character))[1:-1]
