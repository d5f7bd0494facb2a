"""The text of a URDF; xacro is expanded where the package of that name is installed."""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from engine.files import FileError, mistake, note, read_text
from hw.extras import needs

LARGEST = 20_000_000
"""Most bytes of a file."""
_COMMENT = re.compile(r"<!--.*?-->", re.DOTALL)
_QUOTED = re.compile(r"'([^']+)'|(xacro:\S+)")


def urdf_text(file: Path) -> str:
    """The text of a URDF, of an `.xacro` as it is expanded, without arguments.

    What has no macros is taken as it is. The expanded text is noted as that of the file, so that a
    record has it, and replays without xacro.

    Raises:
        FileError: the file cannot be read or expanded; the package xacro is missing.
    """
    text = read_text(file, LARGEST)
    if file.suffix != ".xacro" or not is_xacro(text):
        return text
    try:
        import xacro
    except ImportError:
        plain = file.with_suffix("" if file.stem.endswith(".urdf") else ".urdf").name
        hint = f"or write its expansion beside it: xacro {file.name} > {plain}"
        raise mistake(file, f"is xacro, which {needs('xacro')}", hint=hint) from None
    try:
        expanded: str = xacro.process_file(str(file)).toxml()
    except Exception as error:  # noqa: BLE001  macros may raise anything
        raise _refused(file, error, xacro.filestack) from None
    note(file, expanded.encode())
    return expanded


def is_xacro(text: str) -> bool:
    """Whether there are macros or expressions in it, outside comments."""
    plain = _COMMENT.sub("", text)
    return any(sign in plain for sign in ("<xacro:", "${", "$("))


def _refused(file: Path, error: Exception, files: Any) -> FileError:
    """What xacro said, in the file that it was in, at the line that has what it names."""
    stack = [Path(name) for name in files or () if isinstance(name, str)]
    at = stack[-1] if stack else file
    message = " ".join(str(error).split()) or type(error).__name__
    line = getattr(error, "lineno", None) or _line_of(message, at)
    return mistake(at, f"xacro: {message}", line)


def _line_of(message: str, file: Path) -> int:
    """The first line that has what is quoted in a message; 1 without."""
    try:
        lines = read_text(file, LARGEST).splitlines()
    except FileError:
        return 1
    return next((found for found in _lines(message, lines) if found), 1)


def _lines(message: str, lines: list[str]) -> Iterable[int]:
    for quoted, macro in _QUOTED.findall(message):
        wanted = quoted or macro.rstrip(".,;:")
        yield next((n for n, line in enumerate(lines, 1) if wanted in line), 0)
