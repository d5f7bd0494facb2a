"""Text made safe to show: control and invisible characters become escapes."""

from __future__ import annotations

import json
import re
import unicodedata

_UNUSUAL = re.compile(r"[^ -~]")
_HIDDEN = frozenset(("Cc", "Cf", "Cs", "Zl", "Zp"))
"""Controls, formats (bidirectional overrides too), surrogates, line and paragraph separators."""


def visible(text: str, keep: str = "") -> str:
    r"""The text with hidden characters as `\x1b` or `\u202e`, but for those to `keep`.

    Text in JSON stays what it means: there C0 is escaped anyway, and the others become JSON's own
    escapes.
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
