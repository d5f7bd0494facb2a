"""Suggestions for unknown words: a table of checks for typical mistakes.

Used by `finding.did_you_mean`, so that keys, names, choices and outcomes of all files get the same
help.
"""

from __future__ import annotations

import difflib
import re
import unicodedata
from collections.abc import Callable, Iterable, Sequence

LONGEST_GUESS = 60  # letters of a word that are compared with others, in quadratic time
MOST_SHOWN = 12  # names listed if none is similar

_LOOK_ALIKE = str.maketrans(
    "аАВсСеЕНіІјЈКМоОрРѕЅТуУхХԁԛԝһαΑΒΕΖΗιΙΚΜνΝοΟρΡΤυΥΧ",
    "aABcCeEHiIjJKMoOpPsSTyYxXdqwhaABEZHiIKMvNoOpPTuYX",
)
"""Cyrillic and Greek letters that look like Latin ones, after Unicode TR 39, confusables.txt."""
_QUOTES = "“”„‟‘’‚‛«»‹›"
_INVISIBLE = re.compile("[\u00a0\u1680\u2000-\u200f\u2028-\u202f\u205f-\u2064\u3000\ufeff]")
_WORDS = {
    **dict.fromkeys(("yes", "on", "y", "true"), "true"),
    **dict.fromkeys(("no", "off", "n", "false"), "false"),
    **dict.fromkeys(("none", "nil", "null", "nothing", "~"), "none"),
}
"""Words that YAML 1.1 or Python read as a boolean or as null, in lower case."""
_COMMENT = re.compile(r"#.*")

SYNONYMS = {
    "transitions": "next", "transition": "next", "goto": "next", "then": "next", "on": "next",
    "to": "next", "target": "next", "targets": "next",
    "params": "with", "parameters": "with", "parameter": "with", "args": "with",
    "arguments": "with",
    "inputs": "in", "input": "in", "reads": "in", "remap": "in",
    "outputs": "out", "output": "out", "writes": "out",
    "class": "do", "action": "do", "run": "do", "execute": "do",
    "monitor": "watch", "guard": "watch", "condition": "watch",
    "chart": "use", "include": "use", "embed": "use", "behavior": "use",
    "sequence": "states", "nodes": "states", "children": "states", "steps": "states",
    "parallel": "any or all", "concurrent": "any or all", "race": "any", "join": "all",
    "name": "chart", "id": "chart", "description": "about", "comment": "about", "doc": "about",
    "after": "timeout", "deadline": "timeout", "time_limit": "timeout",
    "repeat": "retry", "retries": "retry", "tries": "retry", "when": "if", "conditions": "if",
    "initial": "default", "default": "initial",
    "variables": "data", "userdata": "data", "keys": "data", "results": "outcomes",
    "float": "number", "double": "number", "int": "integer", "bool": "boolean", "str": "text",
    "string": "text", "object": "any", "time": "duration", "seconds": "duration",
    "distance": "length", "metres": "length", "meters": "length", "degrees": "angle",
    "radians": "angle",
}  # fmt: skip
"""Words of other chart languages and of Python, with the word for the same thing here."""


def advice(word: str, known: Iterable[str]) -> str:
    """What to write instead of an unknown `word`; the known words if none is similar."""
    names = sorted(set(known))
    for notice in _TABLE:
        found = notice(word, names)
        if found:
            return found
    if not names:
        return "nothing is allowed here"
    shown = ", ".join(names[:MOST_SHOWN]) + (", …" if len(names) > MOST_SHOWN else "")
    return f"allowed: {shown}"


def nearest(word: object, known: Iterable[str]) -> str | None:
    """The known word that a misspelt one most likely stands for."""
    names = sorted(name for name in set(known) if len(name) <= LONGEST_GUESS)
    wanted = _folded(str(word))
    for name in names:
        if _folded(name) == wanted:
            return name
    near = difflib.get_close_matches(str(word)[:LONGEST_GUESS], names, n=1, cutoff=0.6)
    return near[0] if near else None


def all_near(word: str, known: Iterable[str]) -> list[str]:
    """The known words that a misspelt one may stand for with equal right; at most three."""
    best = nearest(word, known)
    if best is None or _folded(best) == _folded(word):
        return [] if best is None else [best]
    names = sorted(name for name in set(known) if len(name) <= LONGEST_GUESS)
    near = difflib.get_close_matches(word[:LONGEST_GUESS], names, n=3, cutoff=0.6)
    least = _likeness(word, best)
    return sorted(name for name in near if _likeness(word, name) >= least)


def _likeness(word: str, name: str) -> float:
    return difflib.SequenceMatcher(None, name, word[:LONGEST_GUESS]).ratio()


def plain_word(value: object) -> str:
    """`true` or `false` for a word that other YAML readers take for that; otherwise empty."""
    meant = _WORDS.get(str(value).lower(), "") if isinstance(value, str) else ""
    return meant if meant in ("true", "false") else ""


def foreign_letter(word: str) -> str:
    """Names the first letter of a word that looks Latin but is not; empty if there is none."""
    for letter in word:
        if unicodedata.name(letter, "").startswith("FULLWIDTH"):
            return f"{letter!r} in it is a full-width character"
        if letter.translate(_LOOK_ALIKE) != letter:
            script = unicodedata.name(letter).split()[0].capitalize()
            return f"{letter!r} in it is a {script} letter"
    return ""


def latin(word: str) -> str:
    """The word with Latin letters for those that look like them."""
    return unicodedata.normalize("NFKC", word.translate(_LOOK_ALIKE))


def help_with_name(word: str) -> str:
    """What to write instead of a word that cannot be a name."""
    which, plain = foreign_letter(word), latin(word)
    rule = "letters, digits and _, not starting with a digit"
    if not plain.isascii():
        return f"Latin {rule}"
    if which:
        return f"{which}; write {plain!r} in Latin letters"
    plain = re.sub(r"[^A-Za-z0-9_]+", "_", word.strip(" .,;:'\"")).strip("_")
    if word == f".{plain}":
        return f"write {plain!r}, without the dot"
    return f"write {plain!r}: {rule}" if plain[:1].isalpha() and plain != word else rule


def invisible(text: str) -> re.Match[str] | None:
    """The first character of a text that is invisible or looks like a plain space."""
    return _INVISIBLE.search(text)


def name_of(character: str) -> str:
    """The name of an unusual character: `non-breaking space`, `zero width space` …."""
    if character == "\u00a0":
        return "non-breaking space"
    return unicodedata.name(character, f"U+{ord(character):04X}").lower()


def smart_quote(text: str) -> int:
    """The index of the first typographic quotation mark in a text; -1 without one."""
    return next((n for n, character in enumerate(text) if character in _QUOTES), -1)


def _folded(word: str) -> str:
    return word.casefold().replace("_", "").replace("-", "").replace(" ", "")


def _meant(word: str, names: Sequence[str]) -> str:
    near = nearest(word, names)
    return f"; did you mean {near!r}?" if near is not None else ""


def _is_quoted(word: str, names: Sequence[str]) -> str:
    bare = word.strip(_QUOTES)
    if bare == word:
        return ""
    return f"write straight quotes (\" or ') or none{_meant(bare, names)}"


def _has_invisible(word: str, names: Sequence[str]) -> str:
    found = invisible(word)
    if found is None:
        return ""
    bare = _INVISIBLE.sub("", word)
    return f"there is an invisible character in it, {name_of(found[0])}{_meant(bare, names)}"


def _has_foreign_letter(word: str, names: Sequence[str]) -> str:
    which = foreign_letter(word)
    near = nearest(latin(word), names) if which else None
    return f"{which}; did you mean {near!r}, in Latin letters?" if near is not None else ""


def _ends_in_a_comma(word: str, names: Sequence[str]) -> str:
    bare = word.rstrip(",;")
    return f"leave out the comma: {bare}" if bare in names and bare != word else ""


def _ends_in_a_comment(word: str, names: Sequence[str]) -> str:
    bare = _COMMENT.sub("", word)
    return f"a comment begins with a space: `{bare} # …`" if bare in names and bare != word else ""


def _has_a_dot_too_much(word: str, names: Sequence[str]) -> str:
    bare = word.lstrip(". ")
    if bare == word or bare not in names or f".{bare}" in names:
        return ""
    return f"did you mean {bare!r}, without the dot?"


def _is_a_file(word: str, names: Sequence[str]) -> str:
    bare = re.sub(r"\.(ya?ml|json|py|txt)\Z", "", word).rpartition("/")[2]
    return f"did you mean {bare!r}, without the file ending?" if word != bare in names else ""


def _is_a_synonym(word: str, names: Sequence[str]) -> str:
    if any(_folded(name) == _folded(word) for name in names):
        return ""
    meant = SYNONYMS.get(word.lower(), "")
    if not meant or not set(meant.split(" or ")) <= set(names):
        return ""
    return f"did you mean {' or '.join(map(repr, meant.split(' or ')))}?"


def _is_elsewhere(word: str, names: Sequence[str]) -> str:
    """The most similar dotted name of which the last part is the same."""
    first, dot, last = word.rpartition(".")
    alike = [name for name in names if name.rpartition(".")[2] == last] if dot and first else []
    near = nearest(word, alike)
    return f"did you mean {near!r}?" if near is not None else ""


def _is_misspelt(word: str, names: Sequence[str]) -> str:
    return _meant(word, names).removeprefix("; ")


_TABLE: tuple[Callable[[str, Sequence[str]], str], ...] = (
    _is_quoted,
    _has_invisible,
    _has_foreign_letter,
    _ends_in_a_comma,
    _ends_in_a_comment,
    _has_a_dot_too_much,
    _is_a_file,
    _is_a_synonym,
    _is_elsewhere,
    _is_misspelt,
)
