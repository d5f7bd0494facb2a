"""Reads the small YAML files of this folder: robots, scenes, users.

Every value keeps its file, line and key, so that an error says where it is, what is wrong and what
would be right. Strict YAML: no anchors, aliases, tags or duplicate keys; only true and false are
booleans; numbers may be written 1e3. The reader builds the tree from parser events itself, because
libyaml's composer recurses without a limit.
"""

from __future__ import annotations

import difflib
import math
import re
from dataclasses import dataclass
from pathlib import Path

import yaml

from hw.geometry import Pose2

MAX_BYTES = 1_000_000
MAX_DEPTH = 32
FAR = 1e4
"""Places farther than this from the origin of the map, m, are taken for a mistake."""
_LOADER = getattr(yaml, "CLoader", yaml.Loader)
_NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?\Z")
_WORDS: dict[str, object] = {"true": True, "false": False, "null": None, "~": None, "": None}

Value = object


class FileError(ValueError):
    """A file is not what it should be; the text starts with `file:line:` (line 0: all of it)."""

    def __init__(self, path: Path | str, line: int, message: str) -> None:
        super().__init__(f"{path}:{line}: {message}" if line else f"{path}: {message}")
        self.path, self.line, self.message = str(path), line, message


@dataclass(frozen=True, slots=True)
class Item:
    """A value with its place: a number, text, boolean, None, list of items or dict of items."""

    value: Value
    path: str
    line: int
    key: str
    error: type[FileError] = FileError

    def fail(self, message: str) -> FileError:
        """The error to raise for this item."""
        return self.error(self.path, self.line, f"{self.key}: {message}" if self.key else message)

    def number(self, low: float = -math.inf, high: float = math.inf) -> float:
        """A finite number within [low, high]."""
        if isinstance(self.value, bool) or not isinstance(self.value, int | float):
            raise self.fail(f"needs a number, not {self._shown()}")
        if not math.isfinite(self.value):
            raise self.fail(f"{self.value} is not a finite number")
        if not low <= self.value <= high:
            raise self.fail(f"{self.value:g} is out of range, {_interval(low, high)}")
        return float(self.value)

    def text(self, choices: tuple[str, ...] = ()) -> str:
        """A text, one of the choices if there are any."""
        if not isinstance(self.value, str):
            raise self.fail(f"needs a text, not {self._shown()}")
        if choices and self.value not in choices:
            raise self.fail(f"'{self.value}' is unknown{suggestion(self.value, choices)}")
        return self.value

    def items(self) -> list[Item]:
        """The elements of a list."""
        if not isinstance(self.value, list):
            raise self.fail(f"needs a list, not {self._shown()}")
        return self.value

    def numbers(self, count: int | None = None) -> tuple[float, ...]:
        """A list of finite numbers, of this length if given."""
        found = tuple(item.number() for item in self.items())
        if count is not None and len(found) != count:
            raise self.fail(f"needs {count} numbers, has {len(found)}")
        return found

    def section(
        self, required: tuple[str, ...] = (), optional: tuple[str, ...] = ()
    ) -> dict[str, Item]:
        """A mapping that has every required key and no key that is not named."""
        content = self.mapping()
        known = required + optional
        for key, item in content.items():
            if key not in known:
                raise item.fail(f"unknown key{suggestion(key, known)}")
        for key in required:
            if key not in content:
                raise self.fail(f"the key '{key}' is missing")
        return content

    def mapping(self) -> dict[str, Item]:
        """A mapping with free keys."""
        if not isinstance(self.value, dict):
            raise self.fail(f"needs a mapping (key: value), not {self._shown()}")
        return self.value

    def point(self) -> tuple[float, float]:
        """A place written `[x, y]`, m."""
        x, y = self.numbers(count=2)
        if max(abs(x), abs(y)) > FAR:
            raise self.fail(f"({x:g}, {y:g}) is too far away; places are in m, within {FAR:g} m")
        return x, y

    def pose(self) -> Pose2:
        """A pose written `{x: 1.0, y: 2.0, yaw: 0.5}` in m and rad; yaw is 0 if left out."""
        part = self.section(required=("x", "y"), optional=("yaw",))
        yaw = part["yaw"].number() if "yaw" in part else 0.0
        return Pose2.checked(part["x"].number(-FAR, FAR), part["y"].number(-FAR, FAR), yaw)

    def _shown(self) -> str:
        if isinstance(self.value, list):
            return "a list"
        if isinstance(self.value, dict):
            return "a mapping"
        return "nothing" if self.value is None else repr(self.value)


def suggestion(word: str, known: tuple[str, ...]) -> str:
    """How to go on after an unknown word: the closest known one, or all of them."""
    close = difflib.get_close_matches(word, known, n=1)
    if close:
        return f"; did you mean '{close[0]}'?"
    return f"; known: {', '.join(known)}" if known else ""


def find_file(name: str, folder: Path, kind: str, error: type[FileError]) -> Path:
    """A file by its path, or by the name of one in a folder of the project.

    Raises:
        FileError: of the class `error`: the folder has no such name.
    """
    if name.endswith((".yaml", ".yml")) or "/" in name:
        return Path(name)
    known = tuple(sorted(path.stem for path in folder.glob("*.yaml")))
    if name in known:
        return folder / f"{name}.yaml"
    raise error(name, 0, f"no such {kind}{suggestion(name, known)}")


def _interval(low: float, high: float) -> str:
    if high == math.inf:
        return f"at least {low:g} is needed"
    return f"at most {high:g} is allowed" if low == -math.inf else f"{low:g} to {high:g} is allowed"


def read_text(path: Path, error: type[FileError] = FileError, limit: int = MAX_BYTES) -> str:
    """The text of a file; raises the given error where it cannot be read."""
    try:
        data = path.read_bytes() if path.stat().st_size <= limit else None
    except OSError as failure:
        raise error(path, 0, f"cannot be read: {failure.strerror or failure}") from None
    if data is None:
        raise error(path, 0, f"is larger than {limit / 1e6:g} MB")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as failure:
        line = data.count(b"\n", 0, failure.start) + 1
        raise error(path, line, "is not text (UTF-8)") from None


def read_document(path: Path, error: type[FileError] = FileError) -> Item:
    """The whole file as one item; errors of form are raised as the given error."""
    return parse_document(read_text(path, error), str(path), error)


def parse_document(text: str, path: str, error: type[FileError] = FileError) -> Item:
    """Like `read_document`, for text that is already there."""
    builder = _Builder(path, error)
    try:
        for event in yaml.parse(text, Loader=_LOADER):
            builder.take(event, event.start_mark.line + 1 if event.start_mark else 0)
    except yaml.MarkedYAMLError as failure:
        line = failure.problem_mark.line + 1 if failure.problem_mark else 0
        raise error(path, line, f"is not YAML: {failure.problem}") from None
    except yaml.YAMLError as failure:
        raise error(path, 0, f"is not YAML: {str(failure).splitlines()[0]}") from None
    if builder.root is None:
        raise error(path, 1, "is empty")
    return builder.root


class _Builder:
    """Turns parser events into items, without recursion."""

    def __init__(self, path: str, error: type[FileError]) -> None:
        self.root: Item | None = None
        self._path, self._error = path, error
        self._stack: list[Item] = []
        self._keys: list[str | None] = []

    def take(self, event: yaml.Event, line: int) -> None:
        if isinstance(event, yaml.DocumentStartEvent) and self.root is not None:
            raise self._error(self._path, line, "a second document; one file holds one document")
        if isinstance(event, yaml.AliasEvent) or getattr(event, "anchor", None):
            raise self._error(self._path, line, "anchors and aliases are not allowed")
        if isinstance(event, yaml.ScalarEvent):
            self._scalar(event, line)
        elif isinstance(event, yaml.MappingStartEvent):
            self._open({}, line)
        elif isinstance(event, yaml.SequenceStartEvent):
            self._open([], line)
        elif isinstance(event, yaml.CollectionEndEvent):
            self._stack.pop()
            self._keys.pop()

    def _scalar(self, event: yaml.ScalarEvent, line: int) -> None:
        if event.tag is not None:
            raise self._error(self._path, line, f"tags such as {event.tag} are not allowed")
        if self._awaits_key():
            self._take_key(event.value, line)
            return
        self._place(_plain(event.value) if event.implicit[0] else event.value, line)

    def _awaits_key(self) -> bool:
        return bool(self._stack) and isinstance(self._stack[-1].value, dict) and not self._keys[-1]

    def _take_key(self, key: str, line: int) -> None:
        mapping = self._stack[-1].mapping()
        if key in mapping:
            first = mapping[key].line
            raise self._error(self._path, line, f"'{key}' stands twice, first in line {first}")
        if not key:
            raise self._error(self._path, line, "an empty key")
        self._keys[-1] = key

    def _open(self, value: Value, line: int) -> None:
        if self._awaits_key():
            raise self._error(self._path, line, "a key must be a word")
        if len(self._stack) >= MAX_DEPTH:
            raise self._error(self._path, line, f"nested deeper than {MAX_DEPTH} levels")
        self._stack.append(self._place(value, line))
        self._keys.append(None)

    def _place(self, value: Value, line: int) -> Item:
        parent = self._stack[-1] if self._stack else None
        if parent is None:
            item = self.root = Item(value, self._path, line, "", self._error)
        elif isinstance(parent.value, dict):
            key = str(self._keys[-1])
            dotted = f"{parent.key}.{key}" if parent.key else key
            item = parent.value[key] = Item(value, self._path, line, dotted, self._error)
            self._keys[-1] = None
        else:
            siblings = parent.items()
            dotted = f"{parent.key}[{len(siblings)}]"
            item = Item(value, self._path, line, dotted, self._error)
            siblings.append(item)
        return item


def _plain(text: str) -> Value:
    if text in _WORDS:
        return _WORDS[text]
    if not _NUMBER.match(text):
        return text
    # Python refuses to turn thousands of digits into an int, and large ints into floats
    short = len(text) < 18 and text.lstrip("+-").isdigit()
    return int(text) if short else float(text)
