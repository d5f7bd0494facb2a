"""A layout for the Foxglove app, in which records of runs open: room, nodes, separation, log.

Import it in the app (Layouts, Import from file) and open the record; topics are those of the
record. Foxglove's own library writes it, so that its form is theirs.
"""

from __future__ import annotations

from collections.abc import Collection

from foxglove import layouts

from cobodeck.record.format import TOPIC
from cobodeck.record.read import Record

MAP = "map"
TRANSITIONS = {"next node": "trace.line[:]{5}", "outcome": "trace.line[:]{4}"}
SCANS = ("base.scan", "lidar")


def foxglove_layout(record: Record) -> str:
    """The layout for what is in a record, as JSON.

    Raises:
        FileError: the record cannot be read.
    """
    topics = {told.topic for group in record.groups() for told in group.told}
    right = layouts.SplitContainer(
        direction="column",
        items=[
            layouts.SplitItem(proportion=2, content=_transitions()),
            layouts.SplitItem(proportion=2, content=_separation(topics)),
            layouts.SplitItem(proportion=1, content=_log()),
            layouts.SplitItem(proportion=1, content=_trace()),
        ],
    )
    both = layouts.SplitContainer(
        direction="row",
        items=[
            layouts.SplitItem(proportion=3, content=_room(record, topics)),
            layouts.SplitItem(proportion=2, content=right),
        ],
    )
    return layouts.Layout(content=both).to_json()
