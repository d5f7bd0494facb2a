"""Objects of MRPT's binary archives: rawlogs and simplemaps, as far as planar logs need them.

The size of an object is not stored, so unknown classes cannot be skipped: the archive is read as a
flat sequence of objects, in which containers only mark their beginning, and after an unknown object
reading continues at the next known class name.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from typing import Any, NamedTuple

from cobodeck.logs.mrpt.archive_reader import END, ArchiveReader, Broken, Kinds, header_at
from cobodeck.logs.mrpt.mrpt_poses import POSES
from cobodeck.logs.mrpt.mrpt_sensors import SENSORS


class Found(NamedTuple):
    """An object: class name without namespace, value (None for containers), offset in bytes."""

    kind: str
    value: Any
    at: int


def objects(data: bytes, tell: Callable[[str], None]) -> Iterator[Found]:
    """All known objects of an archive, in order; `tell` receives a sentence on each left out."""
    reader = ArchiveReader(data, KINDS)
    while reader.at < len(data):
        head = header_at(data, reader.at)
        if head is None:
            if data[reader.at] == END:
                reader.at += 1
            elif not _go_on(reader, reader.at + 1):
                tell(f"it is cut off at byte {len(data)}")
                return
        elif head.kind in HOLDERS:
            reader.at = head.end + HOLDERS[head.kind](head.version)
            yield Found(head.kind, None, head.at)
        elif head.kind in KINDS:
            try:
                yield Found(head.kind, reader.body(head), head.at)
            except Broken as broken:
                tell(str(broken))
                if not _go_on(reader, head.end):
                    return
        else:
            tell(f"{head.kind} is not read")
            if not _go_on(reader, head.end):
                return


def _go_on(reader: ArchiveReader, after: int) -> bool:
    """Advance to the next object of a known class; False if there is none."""
    for match in _KNOWN.finditer(reader.data, after):
        name = match.start()
        for begin in (name - 1, name - 4):
            head = header_at(reader.data, begin) if begin >= after else None
            if head is not None and head.end - (4 if head.old else 1) == match.end():
                reader.at = begin
                return True
    reader.at = len(reader.data)
    return False


def _frame_head(version: int) -> int:
    return 4 + (4 if version < 2 else 0) + (8 if version == 0 else 0)


HOLDERS: Mapping[str, Callable[[int], int]] = {
    "CSensoryFrame": _frame_head,
    "CSensorialFrame": _frame_head,
    "CActionCollection": lambda _: 4,
    "CSimpleMap": lambda _: 4,
    "CSensFrameProbSequence": lambda _: 4,
    "CRawlog": lambda _: 4,
}
"""Container classes, and the number of bytes before their first object, by version."""
KINDS: Kinds = {**POSES, **SENSORS}
_NAMES = sorted((*HOLDERS, *KINDS), key=len, reverse=True)
_KNOWN = re.compile(rb"(?:mrpt::\w+::)?(?:" + "|".join(_NAMES).encode() + rb")")
