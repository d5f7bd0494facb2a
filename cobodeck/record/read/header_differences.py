"""How two records differ in what was run: entries of their headers, values, texts of files."""

from __future__ import annotations

import difflib
from collections.abc import Container, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from cobodeck.record.format import sha256
from cobodeck.record.read.reader import Record
from engine.files import written_text

LEFT_OUT = {"format", "began", "command", "given", "named", "charts", "files"}
"""Entries that differ between any two runs, are redundant, or are compared separately."""
WORDS = {"versions": "version of {}", "code": "code of {}", "parts": "part {}", "options": "{}"}
"""The names of nested entries."""
LINES = 3
"""Number of differing lines shown per place and record; twice as many in all."""


@dataclass(frozen=True, slots=True)
class HeaderDifference:
    """An entry that differs; for texts, `lines` counts differing lines and `first` has some."""

    what: str
    a: Any
    b: Any
    lines: int | None = None
    first: tuple[str, ...] = ()


def header_differences(a: Record, b: Record) -> Iterator[HeaderDifference]:
    """Every entry and every text that is not the same in both."""
    one, other = (dict(_entries(record.header)) for record in (a, b))
    for what in dict.fromkeys((*one, *other)):
        if one.get(what) != other.get(what):
            yield HeaderDifference(what, one.get(what), other.get(what))
    yield from _files(a, b)


def _entries(header: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    """Every entry, by its name in words."""
    for name, held in header.items():
        if name in LEFT_OUT:
            continue
        if not isinstance(held, Mapping):
            yield name, held
        elif name == "inputs":
            yield from ((f"input {key}", written_text(value)) for key, value in held.items())
        elif {"name", "sha256"} <= set(held) <= {"name", "sha256", "values"}:
            yield name, f"{held['name']} {held['sha256']}"
            yield from held.get("values", {}).items()
        else:
            words = WORDS.get(name, f"{name} {{}}")
            yield from ((words.format(key), part) for key, part in held.items())


def _files(a: Record, b: Record) -> Iterator[HeaderDifference]:
    """Charts compared by their names, wherever their files are; all other files by theirs."""
    used = [_charts(record) for record in (a, b)]
    apart = {file for files in used for file in files.values()}
    one, other = (_read(*given, apart) for given in zip((a, b), used, strict=True))
    for what in sorted({*one, *other}):
        (before, mine), (after, its) = (found.get(what, (None, None)) for found in (one, other))
        if before != after:
            lines = () if mine is None or its is None else _differing(mine, its)
            yield HeaderDifference(what, before, after, *lines)


def _charts(record: Record) -> dict[str, str]:
    """The files of the charts that were run."""
    return {f"chart {name}": file for name, file in record.header["charts"].items()}


def _read(
    record: Record, used: Mapping[str, str], apart: Container[str]
) -> dict[str, tuple[str, list[str] | None]]:
    """Hash and text of the files used, and of all others that are not in `apart`."""
    hashes = _hashes(record)
    files = {**used, **{f"file {name}": name for name in hashes if name not in apart}}
    return {what: (hashes[file], _lines(record, file)) for what, file in files.items()}


def _hashes(record: Record) -> dict[str, str]:
    attached = {name: sha256(data) for name, data in record.attachments.items()}
    return {**attached, **record.header["files"]}


def _lines(record: Record, name: str) -> list[str] | None:
    """The lines of an attached file; None if it is not attached or not text."""
    try:
        return record.attachments[name].decode().splitlines()
    except (KeyError, UnicodeDecodeError):
        return None


def _differing(a: list[str], b: list[str]) -> tuple[int, tuple[str, ...]]:
    """The number of differing lines, and some of them from the first place on."""
    found = difflib.SequenceMatcher(None, a, b, autojunk=False).get_opcodes()
    places = [(a[i:j], b[k:m], i, k) for tag, i, j, k, m in found if tag != "equal"]
    count = sum(max(len(mine), len(its)) for mine, its, _, _ in places)
    if not places:
        return 0, ("the ends of lines",)
    shown: list[str] = []
    for mine, its, i, k in places:
        shown += [f"A {n}: {line.strip()}" for n, line in enumerate(mine[:LINES], i + 1)]
        shown += [f"B {n}: {line.strip()}" for n, line in enumerate(its[:LINES], k + 1)]
    return count, tuple(shown[: 2 * LINES])
