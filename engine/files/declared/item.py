"""Values of a YAML file with their places, so that every mistake is reported where it is."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

from engine.files import source as yaml
from engine.files.declared.named import YAML, known_files
from engine.files.declared.values import shown
from engine.files.finding import CODE, OLD, FileError, Finding, Place, did_you_mean, not_found
from engine.files.source import Map, Mark, Seq, SourceFile
from engine.files.text import is_file, read_bytes

T = TypeVar("T")
Fault = tuple[str, str]
"""The dotted key of a value that is inconsistent with others of its mapping, and why."""
_notes: ContextVar[list[Finding] | None] = ContextVar("notes", default=None)
SUFFIXES = (*YAML, ".txt", ".csv")
_PACE = re.compile(r" at [^ ]+ ?c?m/s\Z")


@dataclass(frozen=True, slots=True)
class Item:
    """A value of a file with its place and its dotted key."""

    source: SourceFile
    value: Any
    at: Mark
    key: str = ""

    @property
    def place(self) -> Place:
        """The place of the value."""
        return self.source.place(self.at)

    @property
    def folder(self) -> Path:
        """The folder that paths in this file are relative to."""
        return Path(self.source.file).parent

    def error(self, message: str, hint: str = "") -> FileError:
        """The error to raise for this item."""
        told = f"{self.key}: {message}" if self.key else message
        return FileError([Finding(CODE, told, self.place, hint)])

    def note(self, message: str, hint: str = "") -> None:
        """Remark on this item, which is read all the same; see `notes`."""
        told = f"{self.key}: {message}" if self.key else message
        if (found := _notes.get()) is not None:
            found.append(Finding(OLD, told, self.place, hint, "note"))

    def inner(self, dotted: str) -> Item:
        """The value at a dotted key (`walls.0`), or the innermost existing one around it."""
        found = self
        for key in dotted.split("."):
            if isinstance(found.value, Map) and key in found.value:
                found = found._child(key)
            elif isinstance(found.value, Seq) and _is_index(key) and int(key) < len(found.value):
                found = found.items()[int(key)]
        return found

    def mapping(self) -> dict[str, Item]:
        """The values of a mapping, by key; any keys are allowed.

        Raises:
            FileError: it is not a mapping.
        """
        if not isinstance(self.value, Map):
            raise self.error(f"needs a mapping (key: value), not {shown(self.value)}")
        return {key: self._child(key) for key in self.value}

    def items(self) -> list[Item]:
        """The items of a list.

        Raises:
            FileError: it is not a list.
        """
        if not isinstance(self.value, Seq):
            raise self.error(f"needs a list, not {shown(self.value)}")
        pairs = zip(self.value, self.value.values_at, strict=True)
        return [
            Item(self.source, value, at, f"{self.key}[{n}]") for n, (value, at) in enumerate(pairs)
        ]

    def key_place(self, key: str) -> Place:
        """The place of a key of this mapping."""
        source: SourceFile = self.value.files.get(key, self.source)
        return source.place(self.value.keys_at[key])

    def require(self, faults: Iterable[Fault]) -> None:
        """Accept the values only without faults.

        Raises:
            FileError: every fault, at its key.
        """
        findings = [f for key, why in faults for f in self.inner(key).error(why).findings]
        if findings:
            raise FileError(findings)

    def target(self) -> str:
        """This text as the name or path of a file; paths are relative to this file's folder.

        Raises:
            FileError: it is not text.
        """
        if not isinstance(self.value, str):
            raise self.error(f"{shown(self.value)} is not the name of a file")
        return str(self.path(self.value)) if is_path(self.value) else self.value

    def path(self, written: str) -> Path:
        """A path as written here: relative to this file's folder, absolute, or below a home (~).

        Raises:
            FileError: there is no such home.
        """
        try:
            return self.folder / Path(written).expanduser()
        except RuntimeError:
            raise self.error(f"'{written}' is below a home that is not known") from None

    def refer(self, load: Callable[[], T]) -> T:
        """The content of another file that this item names.

        Raises:
            FileError: that file's mistakes, at their own places, with a note that refers to this
                item; a file that does not exist is reported at this item.
        """
        try:
            return load()
        except FileError as error:
            raise FileError(map(self._referred, error.findings)) from None

    def _referred(self, finding: Finding) -> Finding:
        if finding.place == self.place:
            return finding
        if is_file(Path(finding.place.file)):
            note = (self.place, "named here")
            return dataclasses.replace(finding, related=(*finding.related, note))
        told = f"{self.key}: {finding.place.file}: {finding.message}"
        return dataclasses.replace(finding, message=told, place=self.place)

    def _child(self, key: str) -> Item:
        dotted, value = f"{self.key}.{key}" if self.key else key, self.value[key]
        is_plain = not isinstance(value, Map | Seq)
        at = (self.value.values_at if is_plain else self.value.keys_at)[key]
        return Item(self.value.files.get(key, self.source), value, at, dotted)


def is_path(name: str) -> bool:
    """True if `name` is the path of a file, not the name of one in a known folder.

    What follows the source of a person, `#id@x,y,yaw` or ` at 2 m/s`, is ignored.
    """
    file = _PACE.sub("", re.split("[#@]", name)[0])
    return "/" in file or file.endswith(SUFFIXES)


def find_file(name: str, folder: Path, kind: str, also: Iterable[str] = ()) -> Path:
    """Path of a file given by path or by name: a project's own, or one in the shipped folder.

    `also`: other names that would have been right where this one was given.

    Raises:
        NotFound: no file has this name, or a path that does not exist is a known name with an
            ending other than `.yaml`.
    """
    known = known_files(folder, kind)
    if is_path(name):
        path = Path(name)
        if path.stem in known and path.suffix != ".yaml" and not is_file(path):
            hint = f"did you mean {path.stem!r}, without the file ending?"
            raise not_found(name, f"no such {kind}", hint)
        return path
    if name in known:
        return known[name]
    raise not_found(name, f"no such {kind}", did_you_mean(name, (*known, *also)))


def load_yaml(path: Path, read: Callable[[Item], T]) -> T:
    """A file read by `read`.

    Raises:
        NotFound: there is no such file.
        FileError: every mistake, of syntax and of content.
    """
    return _read(yaml.read(read_bytes(path, yaml.MAX_BYTES), str(path)), read)


def parse_yaml(text: str, file: str, read: Callable[[Item], T]) -> T:
    """Like `load_yaml`, for text in memory; `file` names it in messages."""
    return _read(yaml.read(text.encode(), file), read)


def _read(source: SourceFile, read: Callable[[Item], T]) -> T:
    if source.value is None and not source.findings:
        source.report(CODE, "the file is empty", (1, 1, 2))
    findings = list(source.findings)
    if source.value is not None:
        with noted(findings):
            found = read(Item(source, source.value, getattr(source.value, "at", (1, 1, 2))))
    if findings:
        raise FileError(findings)
    return found


def gather(reads: Iterable[Callable[[], T]]) -> list[T]:
    """The results of all calls.

    Raises:
        FileError: the findings of all calls that failed.
    """
    findings: list[Finding] = []
    found = []
    for call in reads:
        with noted(findings):
            found.append(call())
    if findings:
        raise FileError(findings)
    return found


@contextmanager
def notes() -> Iterator[list[Finding]]:
    """Gives the notes on all items that are read in the block."""
    found: list[Finding] = []
    token = _notes.set(found)
    try:
        yield found
    finally:
        _notes.reset(token)


class noted:
    """Adds the findings of a FileError raised in the block to `findings`, and suppresses it.

    A class: a generator would take a tenth of the time that reading a file takes.
    """

    __slots__ = ("_findings",)

    def __init__(self, findings: list[Finding]) -> None:
        self._findings = findings

    def __enter__(self) -> None:
        """Nothing to do."""

    def __exit__(self, kind: object, error: BaseException | None, trace: object) -> bool:
        """Takes what the error found."""
        if not isinstance(error, FileError):
            return False
        self._findings.extend(error.findings)
        return True


def _is_index(key: str) -> bool:
    return key.isascii() and key.isdigit()
