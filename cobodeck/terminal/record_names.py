"""File names of records."""

from __future__ import annotations

import re
from pathlib import Path

ENDING = ".mcap"
PART = ".part"
"""The suffix of an unfinished file."""
_PERSON = re.compile(rf".+?{re.escape(ENDING)}({re.escape(PART)})?(?P<behind>[#@].*)?")


def behind_record(source: str) -> str | None:
    """The text after the record's name, if a person is named by a record; None if not."""
    found = _PERSON.fullmatch(source)
    return None if found is None else found["behind"] or ""


def is_record(path: Path | str) -> bool:
    """Whether a name is that of a record, finished or not."""
    return str(path).endswith((ENDING, ENDING + PART))
