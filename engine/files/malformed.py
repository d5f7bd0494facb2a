"""What is probably wrong with text that is not YAML: a table of checks for typical mistakes.

libyaml reports where it gave up, often lines below the mistake. Each check looks at the problem and
the lines around it; if it applies, it returns the place of the mistake and how to fix it.
"""

from __future__ import annotations

import re
from collections.abc import Callable

from engine.files.indentation import (
    KEY,
    Diagnosis,
    Malformed,
    Spot,
    depth,
    indentation,
    line_above,
)
from engine.files.suggestions import invisible, name_of, smart_quote

_MERGE = re.compile(r"(?:<{7}|>{7}|\|{7})(?: |\Z)|={7}\Z")
_WORD = re.compile(r"\s*(?:- +)*([^\s:={}\[\],：]+)")
_PAIR = {"{": "}", "[": "]"}


def diagnose(text: Malformed) -> Diagnosis:
    """The result of the first check that applies; otherwise libyaml's message, at its place."""
    for looks_for in _TABLE:
        found = looks_for(text)
        if found is not None:
            return found
    return Diagnosis(text.at, text.problem, "")


def _merge_marker(text: Malformed) -> Diagnosis | None:
    for number, line in enumerate(text.lines[: text.at[0]], 1):
        if _MERGE.match(line):
            message = "a merge marker: two versions of the file are not merged yet"
            return Diagnosis((number, 1), message, "keep one version and delete the marker lines")
    return None


def _tab(text: Malformed) -> Diagnosis | None:
    for number, line in text.near():
        indentation = line[: len(line) - len(line.lstrip())]
        if "\t" in indentation and line.strip():
            at = (number, indentation.index("\t") + 1)
            return Diagnosis(at, "a tab in the indentation", "indent with spaces, not with tabs")
    return None


def _invisible_character(text: Malformed) -> Diagnosis | None:
    for number, line in text.near():
        found = invisible(line.partition("#")[0])
        if found is not None:
            message = f"an invisible character, {name_of(found[0])}"
            return Diagnosis((number, found.start() + 1), message, "type a plain space instead")
    return None


def _smart_quotes(text: Malformed) -> Diagnosis | None:
    at = smart_quote(text.before)
    if at < 0:
        return None
    message = "typographic quotation marks quote nothing in YAML"
    return Diagnosis((text.at[0], at + 1), message, "use straight quotes, \" or '")


def _unclosed_quote(text: Malformed) -> Diagnosis | None:
    if "end of stream" not in text.problem or text.begun is None:
        return None
    line, column = text.begun
    mark = text.lines[line - 1][column - 1 : column]
    if mark not in ("'", '"'):
        return None
    return Diagnosis(
        text.begun, f"the quotation mark `{mark}` is never closed", f"close it: `{mark}`"
    )


def _text_after_quotes(text: Malformed) -> Diagnosis | None:
    before = text.before.rstrip()
    if before[-1:] not in ("'", '"') or not text.character or text.character in ",}]:#":
        return None
    mark = before[-1]
    opened = _opened(text, len(before) - 1)
    if opened is not None and opened[0] < text.at[0]:
        return Diagnosis(
            opened, f"the quotation mark `{mark}` is never closed", f"close it: `{mark}`"
        )
    hint = f"put the whole text in one pair of quotes; `{mark}` inside is written " + (
        '`\\"`' if mark == '"' else "`''`"
    )
    return Diagnosis(text.at, "text goes on after its closing quote", hint)


def _opened(text: Malformed, closing: int) -> Spot | None:
    """Where the quotation mark that closes at index `closing` of the problem's line was opened."""
    opened: Spot | None = None
    for number, line in enumerate(text.lines[: text.at[0]], 1):
        end = closing if number == text.at[0] else len(line)
        for index, character in enumerate(line[:end]):
            if opened is None:
                if character == "#" and line[:index].strip(" ") in ("", line[:index].lstrip(" ")):
                    break
                if character in "\"'" and (not index or line[index - 1] in " {[,"):
                    opened = (number, index + 1)
            elif character == text.lines[opened[0] - 1][opened[1] - 1]:
                opened = None
    return opened


def _flow(text: Malformed) -> Diagnosis | None:
    """In `{…}` or `[…]`: a colon in text, a forgotten comma, or no closing bracket."""
    if not text.problem.startswith("did not find expected ','") or text.begun is None:
        return None
    opening = text.lines[text.begun[0] - 1][text.begun[1] - 1 : text.begun[1]]
    if text.character == ":" and not _is_next_key(text, text.begun[0]):
        return _colon_in_flow(text)
    closing = _PAIR.get(opening, "")
    if not closing:
        return None
    message = f"the bracket `{opening}` is never closed"
    if text.character in ("}", "]"):
        message = f"the bracket `{opening}` is closed by `{text.character}`"
    return Diagnosis(text.begun, message, f"close it with `{closing}`")


def _is_next_key(text: Malformed, begun: int) -> bool:
    """True if the problem's line is a key of the block around the flow mapping, not inside it."""
    return text.at[0] > begun and depth(text.line) <= depth(text.lines[begun - 1])


def _colon_in_flow(text: Malformed) -> Diagnosis:
    start = max(text.before.rfind(": ") + 2, text.before.rfind(", ") + 2, 0)
    value = text.before[start:].rstrip()
    key = re.search(r"([^\s{\[,]+): *\Z", text.before[:start])
    first, gap, last = value.rpartition(" ")
    if not gap or (key is not None and key[1] == "about"):
        return _colon(text.at)
    semicolon = value.find(";")
    if semicolon >= 0:
        at = (text.at[0], start + semicolon + 1)
        return Diagnosis(at, "`;` separates nothing", "put a comma instead")
    at = (text.at[0], start + len(first.rstrip()) + 1)
    hint = f"put a comma before `{last}`; if the colon is part of a text, put that in quotes"
    return Diagnosis(at, "a comma is missing", hint)


def _colon(at: Spot) -> Diagnosis:
    return Diagnosis(at, "a colon in plain text", 'put the text in quotes: `about: "Note: …"`')


def _colon_in_text(text: Malformed) -> Diagnosis | None:
    if "mapping values are not allowed" in text.problem and KEY.match(text.before):
        return _colon(text.at)
    return None


def _no_colon_above(text: Malformed) -> Diagnosis | None:
    """`name` without a colon, with its content indented below."""
    if "mapping values are not allowed" not in text.problem:
        return None
    above = line_above(text)
    if above is None or KEY.match(text.lines[above - 1]):
        return None
    line = text.lines[above - 1].rstrip()
    return _no_colon((above, len(line) + 1), line.split()[-1])


def _no_colon(at: Spot, key: str) -> Diagnosis:
    return Diagnosis(at, f"no `:` after the key {key!r}", f"write `{key}: …`")


def _simple_key(text: Malformed) -> Diagnosis | None:
    """A line that should be `key: value` and has no colon followed by a space."""
    if "could not find expected ':'" not in text.problem or text.begun is None:
        return None
    number = text.begun[0]
    line = text.lines[number - 1]
    if line.lstrip().startswith("//"):
        return Diagnosis(text.begun, "`//` begins no comment", "comments begin with `#`")
    word = _WORD.match(line)
    if word is None:
        return None
    at, rest = (number, word.end() + 1), line[word.end() :]
    if rest.startswith(":"):
        message = f"no space after the colon of {word[1]!r}"
        return Diagnosis(at, message, f"put a space after it: `{word[1]}: {rest[1:].strip()}`")
    return _no_colon(at, word[1])


def _closes_nothing(text: Malformed) -> Diagnosis | None:
    if text.character not in ("}", "]") or "expected key" not in text.problem:
        return None
    message = f"the bracket `{text.character}` closes nothing"
    return Diagnosis(text.at, message, f"leave out one `{text.character}`")


def _several_values(text: Malformed) -> Diagnosis | None:
    """`key: {…}, {…}`."""
    key, before = KEY.match(text.line), text.before.rstrip()
    if text.character != "," or key is None or before[-1:] not in ("}", "]"):
        return None
    name, value = key[0].strip(" -:"), before[key.end() :].strip()
    if value[:1] not in _PAIR:
        return None
    at = (text.at[0], text.line.index(value, key.end()) + 1)
    return Diagnosis(
        at, "more than one value", f"several stand in brackets: `{name}: [{value}, …]`"
    )


def _list_in_mapping(text: Malformed) -> Diagnosis | None:
    if text.begun is None or text.before.strip() or not text.line.lstrip().startswith("- "):
        return None
    if "expected key" not in text.problem or text.begun[1] != text.at[1]:
        return None
    message = "keys and list items at the same level"
    return Diagnosis(text.begun, message, "begin each item with `- `, or none")


def _mapping_in_list(text: Malformed) -> Diagnosis | None:
    if "expected '-' indicator" not in text.problem or text.begun is None:
        return None
    message = "a list that goes on without `- `"
    return Diagnosis(text.begun, message, "write no `- ` before keys such as names of nodes")


def _odd_beginning(text: Malformed) -> Diagnosis | None:
    if "cannot start any token" not in text.problem:
        return None
    message = f"plain text cannot begin with `{text.character}`"
    return Diagnosis(text.at, message, "put it in quotes")


_TABLE: tuple[Callable[[Malformed], Diagnosis | None], ...] = (
    _merge_marker,
    _tab,
    _invisible_character,
    _smart_quotes,
    _unclosed_quote,
    _odd_beginning,
    _text_after_quotes,
    _closes_nothing,
    _flow,
    _several_values,
    _colon_in_text,
    _no_colon_above,
    _simple_key,
    _list_in_mapping,
    _mapping_in_list,
    indentation,
)
