"""`KEY=VALUE`, by which command lines give single values; VALUE is YAML."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Mapping
from typing import Any

from engine.files.finding import FileError, mistake
from engine.files.source import Mark, SourceFile, read

ANYWHERE: Mark = (1, 1, 1)
"""The place of values of a command line: their text as a whole."""


def assignment(text: str, option: str, example: str) -> tuple[str, SourceFile]:
    """The key in `KEY=VALUE`, and the value as read; mistakes are in the text as a whole.

    Args:
        text: as given after the `option`.
        option: of the command line, `--set`.
        example: a text that would be right.

    Raises:
        FileError: it is not KEY=VALUE, or VALUE is not YAML.
    """
    key, equals, value = (part.strip() for part in text.partition("="))
    shown = f"{option} {text}"
    if not (equals and value and all(key.split("."))):
        raise mistake(shown, "is not KEY=VALUE", hint=f"write it as in {example}")
    source = read(value.encode(), shown)
    if source.findings:
        raise FileError(
            dataclasses.replace(finding, place=source.place(ANYWHERE), related=())
            for finding in source.findings
        )
    return key, source


def written_text(value: Any) -> str:
    """A value as YAML in one line, `{x: 2 m, y: 1 m}`; read again, it is the same."""
    if isinstance(value, Mapping):
        return f"{{{', '.join(f'{key}: {written_text(item)}' for key, item in value.items())}}}"
    if type(value) is tuple or isinstance(value, list):
        return f"[{', '.join(map(written_text, value))}]"
    if isinstance(value, str):
        again = read(f"[{value}]".encode(), "")
        is_plain = not again.findings and again.value == [value]
        return value if is_plain else json.dumps(value, ensure_ascii=False)
    return json.dumps(value) if value is None or isinstance(value, bool) else str(value)
