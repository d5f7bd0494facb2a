"""The behaviours and state classes in a file or a folder."""

from __future__ import annotations

import io
import tokenize
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

from cobodeck.flexbe.behaviour import Behaviour
from cobodeck.flexbe.names import identifier, unique
from cobodeck.flexbe.reading.json_reading import is_neutral, read_json
from cobodeck.flexbe.reading.python_reading import is_behaviour, read_python
from cobodeck.flexbe_states import FlexbeClass, read_state_classes
from engine.files import FileError, mistake, read_bytes

LARGEST = 5_000_000
"""Bytes of a file; a larger one is refused."""
_ENDINGS = (".py", ".json")
_LEFT_OUT = frozenset((".git", "__pycache__", "build", "devel", "install", "log", "node_modules"))


@dataclass(slots=True)
class FoundBehaviours:
    """What was found.

    Attributes:
        modules: the files with state classes.
        wrong: why files that look like behaviours or states are none, each with its place.
    """

    behaviours: list[Behaviour] = field(default_factory=list)
    classes: dict[str, FlexbeClass] = field(default_factory=dict)
    modules: list[Path] = field(default_factory=list)
    wrong: list[str] = field(default_factory=list)


def found_in(path: Path) -> FoundBehaviours:
    """What is in a file or, at any depth, in a folder.

    Raises:
        FileError: the file is no behaviour, or there is none in the folder.
    """
    found = FoundBehaviours()
    if not path.is_dir():
        found.behaviours.append(_behaviour(path, _text(path), ()))
        return found
    for file in _files(path):
        try:
            _add(found, file)
        except FileError as error:
            found.wrong.append(str(error))
    if not found.behaviours:
        wrong = f"; {found.wrong[0]}" if found.wrong else ""
        hint = "wanted: *_sm.py as FlexBE generates them, or behaviours as JSON"
        raise mistake(str(path), f"there is no FlexBE behaviour in this folder{wrong}", 1, hint)
    return found


def _files(folder: Path) -> Iterator[Path]:
    for file in sorted(folder.rglob("*")):
        inside = file.relative_to(folder).parts
        if file.suffix in _ENDINGS and file.is_file() and not _LEFT_OUT.intersection(inside):
            yield file


def _add(found: FoundBehaviours, file: Path) -> None:
    text = _text(file)
    taken = [behaviour.name for behaviour in found.behaviours]
    if is_neutral(text) if file.suffix == ".json" else is_behaviour(text):
        found.behaviours.append(_behaviour(file, text, taken))
    elif file.suffix == ".py" and ("EventState" in text or "userdata" in text):
        classes = read_state_classes(text, str(file))
        for cls in classes:
            found.classes.setdefault(cls.name, cls)
        found.modules += [file] if classes else []


def _behaviour(file: Path, text: str, taken: Iterable[str]) -> Behaviour:
    stem = file.stem.removesuffix("_sm").rpartition("__")[2]
    name = unique(identifier(stem), taken)
    if file.suffix == ".json":
        return read_json(text, str(file), name)
    return read_python(text, str(file), name)


def _text(file: Path) -> str:
    """The text of a file, in the encoding that its first lines name, else UTF-8."""
    data = read_bytes(file, LARGEST)
    try:
        encoding = tokenize.detect_encoding(io.BytesIO(data).readline)[0]
        text = data.decode(encoding)
    except (SyntaxError, UnicodeDecodeError, LookupError) as error:
        raise mistake(str(file), f"this is not text: {error}", 1) from None
    if "\0" in text:
        raise mistake(str(file), "this is not text", 1, "name a behaviour of FlexBE")
    return text
