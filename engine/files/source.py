"""YAML text to plain values with a side table of their places.

One pass over libyaml's events with an explicit stack: libyaml's composer recurses once per level
and crashes on deep nesting, and it expands aliases before they can be refused.
Scalars are `true`, `false`, `null`, numbers or text; `on`, `yes`, `12:30` and dates are text.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from types import MappingProxyType
from typing import Any

import yaml

from engine.files.finding import FileError, Finding, Place
from engine.files.indentation import Malformed
from engine.files.malformed import diagnose
from engine.files.text import read_bytes
from engine.files.units import NUMBER

MAX_DEPTH = 64
_TOO_DEEP = f"nested deeper than {MAX_DEPTH} levels"
MAX_BYTES = 1_000_000

_NUMBER = re.compile(rf"{NUMBER}\Z")
_INTEGER = re.compile(r"[-+]?(?:0|[1-9][0-9]*)\Z")
_LINE_END = re.compile("\r\n|[\n\r\x85\u2028\u2029]")  # as libyaml counts lines
_DECIMALS = re.compile(r"\d+(?: .*)?")
_WORDS: dict[str, Any] = {"": None, "~": None, "null": None, "true": True, "false": False}
_NUMERIC_START = frozenset("-+.0123456789")

Mark = tuple[int, int, int]  # line and column from 1, end column


ONE_FILE: Mapping[str, SourceFile] = MappingProxyType({})


class Map(dict[str, Any]):
    """A mapping with the places of itself, its keys and its values.

    `files`: the sources of keys that come from another file than the mapping itself (`merge.py`).
    """

    __slots__ = ("at", "files", "keys_at", "values_at")

    def __init__(self, at: Mark) -> None:
        super().__init__()
        self.at = at
        self.keys_at: dict[str, Mark] = {}
        self.values_at: dict[str, Mark] = {}
        self.files = ONE_FILE


class Seq(list[Any]):
    """A list with the places of itself and its items."""

    __slots__ = ("at", "values_at")

    def __init__(self, at: Mark) -> None:
        super().__init__()
        self.at = at
        self.values_at: list[Mark] = []


def plain(value: Any) -> Any:
    """A copy of a value without places: dicts, lists, text and numbers."""
    if isinstance(value, Map):
        return {str(key): plain(inner) for key, inner in value.items()}
    if isinstance(value, Seq):
        return [plain(inner) for inner in value]
    return value


@dataclass(slots=True)
class SourceFile:
    """A file as read; `value` is `None` if nothing in the file is usable."""

    file: str
    text: str
    value: Any = None
    findings: list[Finding] = field(default_factory=list)

    def place(self, mark: Mark) -> Place:
        """The place of a mark in this file."""
        return Place(self.file, *mark)

    def report(self, code: str, message: str, mark: Mark, hint: str = "") -> None:
        """Add a finding at `mark`."""
        self.findings.append(Finding(code, message, self.place(mark), hint))


def read_file(path: Path) -> SourceFile:
    """Read a YAML file; every mistake becomes a finding, nothing is raised."""
    try:
        data = read_bytes(path, MAX_BYTES)
    except FileError as error:
        return SourceFile(str(path), "", findings=list(error.findings))
    return read(data, str(path))


def read(data: bytes, file: str) -> SourceFile:
    """Read YAML bytes; every mistake becomes a finding, nothing is raised."""
    if len(data) > MAX_BYTES:
        source = SourceFile(file, "")
        source.report("Y06", f"the file has {len(data)} bytes", (1, 1, 2), f"at most {MAX_BYTES}")
        return source
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        good = data[: error.start].decode("utf-8", "replace")
        line, column = good.count("\n") + 1, len(good) - good.rfind("\n")
        source = SourceFile(file, data.decode("utf-8", "replace"))
        byte = data[error.start]
        source.report("Y01", f"byte 0x{byte:02x} is not UTF-8", (line, column, column + 1))
        return source
    source = SourceFile(file, text)
    _compose(source)
    return source


class _GiveUp(Exception):
    """Raised after a mistake that makes the rest of the file unreadable."""


def _compose(source: SourceFile) -> None:
    loader = yaml.CSafeLoader(source.text)
    try:
        _Builder(source).build(loader)
    except _GiveUp:
        source.value = None
    except yaml.MarkedYAMLError as error:
        source.value = None
        _report_form(source, error)
    except yaml.reader.ReaderError as error:
        source.value = None
        good = source.text[: error.position]
        at = (good.count("\n") + 1, len(good) - good.rfind("\n"), len(good) - good.rfind("\n") + 1)
        source.report("Y01", f"a character that YAML forbids: {error.character!r}", at)
    finally:
        loader.dispose()


def _report_form(source: SourceFile, error: yaml.MarkedYAMLError) -> None:
    """Report why the text is not YAML, with a note on where libyaml detected it."""
    lines = source.text.split("\n")
    at = _within(lines, error.problem_mark or error.context_mark)
    begun = _within(lines, error.context_mark) if error.context_mark else None
    problem = error.problem or error.context or "unreadable"
    if any(finding.place.line == at[0] for finding in source.findings):
        return  # an alias such as `*word` has been reported already
    if "nesting depth" in problem:  # libyaml has a limit of its own, and meets it reading ahead
        source.report("Y06", _TOO_DEEP, at)
        return
    found = diagnose(Malformed(lines, problem, at[:2], begun[:2] if begun else None))
    place = source.place((*found.at, found.at[1] + 1))
    notes = ((source.place(at), "noticed here"),) if found.at[0] != at[0] else ()
    message = f"not YAML: {found.message}"
    source.findings.append(Finding("Y01", message, place, found.hint, related=notes))


def _within(lines: list[str], mark: Any) -> Mark:
    """A mark of libyaml, moved to the last line if it is beyond the end of the text."""
    if mark is None:
        return (1, 1, 2)
    if mark.line < len(lines):
        return (mark.line + 1, mark.column + 1, mark.column + 2)
    return (len(lines), len(lines[-1]) + 1, len(lines[-1]) + 2)


_QUOTE_IT = "put text in quotes that begins with"


class _Builder:
    def __init__(self, source: SourceFile) -> None:
        self.source = source
        self.stack: list[Map | Seq | None] = []
        self.into: Map | Seq | None = None
        self.key: str | None = None
        self.roots: list[Any] = []

    def build(self, loader: Any) -> None:
        next_event = loader.get_event
        handlers: dict[type, Any] = {
            yaml.MappingStartEvent: self._open_map,
            yaml.SequenceStartEvent: self._open_seq,
            yaml.MappingEndEvent: self._close,
            yaml.SequenceEndEvent: self._close,
            yaml.AliasEvent: self._alias,
            yaml.DocumentStartEvent: self._document,
        }
        scalar, end = yaml.ScalarEvent, yaml.StreamEndEvent
        while True:
            event = next_event()
            kind = type(event)
            if kind is scalar:
                self._scalar(event)
            elif kind is end:
                break
            elif kind in handlers:
                handlers[kind](event)
        if self.roots:
            self.source.value = self.roots[0]

    def _document(self, event: Any) -> None:
        if self.roots:
            self.source.report("Y01", "a second document starts here", _mark(event), "one per file")
            raise _GiveUp

    def _scalar(self, event: Any) -> None:
        start, end = event.start_mark, event.end_mark
        column = start.column + 1
        if end.line == start.line and end.column > start.column:
            at = (start.line + 1, column, end.column + 1)
        else:
            at = (start.line + 1, column, column + 1)
        if event.anchor is not None or event.tag is not None:
            self._no_anchor(event, at)
        text = event.value
        if type(self.into) is Map and self.key is None:
            self._begin_pair(text, at)
            return
        if not text and event.implicit[0] and type(self.into) is Map and self._mended(self.into):
            return
        self._add_value(self._plain(text, at) if event.implicit[0] else text, at)

    def _plain(self, text: str, at: Mark) -> Any:
        if text in _WORDS:
            return _WORDS[text]
        return self._number(text, at) if text[0] in _NUMERIC_START else text

    def _mended(self, into: Map) -> bool:
        """Whether the present key has no value because it is one in part, as in `{a: 2,5 m}`."""
        assert self.key is not None
        at = into.keys_at[self.key]
        return self._after_comma(into, self.key, at) or self._after_colon(into, self.key, at)

    @cached_property
    def _lines(self) -> list[str]:
        return _LINE_END.split(self.source.text)

    def _after_comma(self, into: Map, key: str, at: Mark) -> bool:
        before = next(reversed(into), "")
        start = into.values_at.get(before, at)
        is_next = (start[0], start[2] + 1) == at[:2]
        if not is_next or type(into[before]) is not int or not _DECIMALS.fullmatch(key):
            return False
        line = self._lines[at[0] - 1]
        meant = f"{line[start[1] - 1 : start[2] - 1]}.{key}"
        whole = (start[0], start[1], at[2])
        self.source.report("Y05", "a comma separates entries", whole, f"write {meant}")
        into[before] = float(meant) if key.isdigit() else meant
        self._forget(into, key)
        return True

    def _after_colon(self, into: Map, key: str, at: Mark) -> bool:
        first, colon, last = key.partition(":")
        if not (colon and last and first.isidentifier()) or first in into.keys_at:
            return False
        if self._lines[at[0] - 1][at[1] - 1] in "\"'":
            return False
        hint = f"put a space after the `:`, `{first}: {last}`"
        self.source.report("Y04", f"no space after the `:` in {key!r}", at, hint)
        self._forget(into, key)
        self._begin_pair(first, at)
        self._add_value(self._plain(last, at), at)
        return True

    def _forget(self, into: Map, key: str) -> None:
        del into.keys_at[key]
        self.key = None

    def _number(self, text: str, at: Mark) -> Any:
        if not _NUMBER.match(text):
            return text
        digits = text.lstrip("+-")
        if len(digits) > 1 and digits[0] == "0" and digits.isdigit():
            hint = f"write {digits.lstrip('0') or '0'}, or '{text}' in quotes for text"
            self.source.report("Y05", f"{text} has a leading zero", at, hint)
        if _INTEGER.match(text) and len(digits) < 20:
            return int(text)
        number = float(text)
        if number in (float("inf"), float("-inf")):
            self.source.report("Y05", f"{text} is too large for a number", at)
            return 0.0
        return number

    def _begin_pair(self, key: str, at: Mark) -> None:
        into = self.into
        assert type(into) is Map
        if key in into.keys_at:
            first = into.keys_at[key]
            self.source.findings.append(
                Finding(
                    "Y02",
                    f"key {key!r} stands here again",
                    self.source.place(at),
                    "keep one of them",
                    related=((self.source.place(first), "first here"),),
                )
            )
        self.key = key
        into.keys_at[key] = at

    def _add_value(self, value: Any, at: Mark) -> None:
        into = self.into
        if type(into) is Map:
            key = self.key
            assert key is not None
            into[key] = value
            into.values_at[key] = at
            self.key = None
        elif type(into) is Seq:
            into.append(value)
            into.values_at.append(at)
        else:
            self.roots.append(value)

    def _open_map(self, event: Any) -> None:
        self._open(event, Map(_mark(event)))

    def _open_seq(self, event: Any) -> None:
        self._open(event, Seq(_mark(event)))

    def _open(self, event: Any, made: Map | Seq) -> None:
        at = made.at
        if event.anchor is not None or event.tag is not None:
            self._no_anchor(event, at)
        if type(self.into) is Map and self.key is None:
            braces = self._lines[at[0] - 1][at[1] - 2 : at[1]]
            hint = "put `{{…}}` in quotes, or write one pair of braces" if braces == "{{" else ""
            before = next(reversed(self.into), "")
            if isinstance(self.into.get(before), Map):
                hint = f"several stand in brackets: `{before}: [{{…}}, {{…}}]`"
            self.source.report("Y04", "a key must be a word", at, hint)
            raise _GiveUp
        if len(self.stack) >= MAX_DEPTH:
            self.source.report("Y06", _TOO_DEEP, at)
            raise _GiveUp
        self._add_value(made, at)
        self.stack.append(self.into)
        self.into = made

    def _close(self, _event: Any) -> None:
        self.into = self.stack.pop()

    def _alias(self, event: Any) -> None:
        at = _mark(event)
        self.source.report(
            "Y03", f"alias *{event.anchor}", at, f"write the value out; {_QUOTE_IT} `*`"
        )
        if type(self.into) is Map and self.key is None:
            raise _GiveUp
        self._add_value(None, at)

    def _no_anchor(self, event: Any, at: Mark) -> None:
        if event.anchor is not None:
            hint = f"write the value out; {_QUOTE_IT} `&`"
            self.source.report("Y03", f"anchor &{event.anchor}", at, hint)
        else:
            self.source.report("Y03", f"tag {event.tag}", at, f"leave it out; {_QUOTE_IT} `!`")


def _mark(event: Any) -> Mark:
    start = event.start_mark
    return (start.line + 1, start.column + 1, start.column + 2)
