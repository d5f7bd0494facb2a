"""The page of files: the keys of each kind, with types, units, ranges, defaults and an example."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from cobodeck.manual.driver_entries import driver_blocks
from cobodeck.manual.file_keys import Values, key_rows
from cobodeck.manual.page import ManualPage, PageBlock, PageEntry, PageTable, YamlCode, table_of
from cobodeck.validation import declarations
from engine.chart import (
    CHART,
    DATA,
    INPUT,
    NODE,
    PARAMETER,
    RETRY,
    RULE,
    Keys,
)

EXAMPLES = Path(__file__).parent / "examples"
"""A file of each kind, as small as it can be."""
_ABOUT = (
    "The first key of a YAML file says what it is, and what it is called: `scene: kitchen`; of "
    "these kinds only maps have no such key. A project's own files are found by it, whatever they "
    "are called. Numbers may have units: `20 cm`, `30 deg`; a bare number is in SI units, an angle "
    "in rad. A key without a default that is not required may be left out. In the names of keys "
    "`NAME` stands for a name of your own and `[]` for each item of a list. `cobodeck validate "
    "FILE` tells every mistake with its place; `cobodeck schema KIND -o FILE` writes the schema "
    "with which editors complete keys, but for maps and recordings.",
)
ABOUTS = {
    "chart": "A state chart: what to do and what to watch for.",
    "scene": "The room, its places, and where robot and person start.",
    "robot": "The body: base, arm, outline and sensors.",
    "profile": "A value for every parameter of the behaviours.",
    "user": "A script of what a simulated person does.",
    "prop": "What the arm holds, and how the arm is folded with it.",
    "calibration": "A measured chain of the arm's joints.",
    "arm": "An arm: lengths, joints, masses and shape.",
    "connection": "Which driver serves which part of a robot, and at which address.",
    "tracking": "Where the tracking system is in the room, and where trackers are on the robot.",
    "campaign": "Runs over all combinations of values.",
    "topics": "What stands for ROS topics, services and actions in states written for FlexBE.",
    "map": "A grid of a room, as map_server of ROS writes it: YAML beside a picture.",
    "recording": "Where a person walked, as text.",
}
"""What each kind of file holds, in a sentence."""
_BY_URDF = (
    "These are the keys of a UR arm, by its lengths. Any other arm of six or seven joints that "
    "turn is described by its URDF or xacro; its capsules are fitted to the collision shapes, and "
    "its inverse kinematics are numeric:"
)


def file_page() -> ManualPage:
    """The page of all kinds of files."""
    entries = tuple(PageEntry(kind, (about, *_blocks(kind))) for kind, about in ABOUTS.items())
    return ManualPage("files", "Files", _ABOUT, entries)


def _blocks(kind: str) -> Iterator[PageBlock]:
    if kind == "recording":
        yield from _RECORDING
    else:
        yield YamlCode((EXAMPLES / f"{kind}.yaml").read_text(encoding="utf-8"))
        yield from _chart_keys() if kind == "chart" else _declared_keys(kind)


def _declared_keys(kind: str) -> Iterator[PageBlock]:
    (declared, *others), values = _declarations(kind), None
    if kind == "profile":
        from behaviors.profile import load_profile

        values = load_profile("tuned").values
        yield (
            "Whatever a file leaves out is as in its `base` or, if it names none, as in the "
            "shipped profile of its `policy`. The defaults below are those of `tuned`; charts pick "
            "values by name, as `$profile.escape.ahead`."
        )
    yield from _key_table(declared, values)
    for other in others:
        yield _BY_URDF
        yield from _key_table(other, None)
    if kind == "connection":
        yield (
            "A driver is one of those below by its name, or `module:Class` of a project. All other "
            "keys of an entry are its arguments; `loopback` stands for an address of this machine "
            "that no other run uses."
        )
        yield from driver_blocks()


def _key_table(declared: type, values: Values | None) -> tuple[PageTable, ...]:
    rows = [tuple(row) for row in key_rows(declared, values)]
    return table_of(("key", "type", "default", "meaning"), rows)


def _declarations(kind: str) -> tuple[type, ...]:
    """The dataclasses that declare the keys of a kind of file."""
    if kind == "map":
        from states.maps import MapFile

        return (MapFile,)
    return declarations(kind)


def _chart_keys() -> Iterator[PageBlock]:
    groups = (
        ("key of a chart", CHART),
        ("key of a node", NODE),
        ("key of a rule under `when`", RULE),
        ("key of `retry`", RETRY),
        ("key of a parameter", PARAMETER),
        ("key of an input", INPUT),
        ("key of a data key", DATA),
    )
    for head, keys in groups:
        yield from _chart_table(head, keys)


def _chart_table(head: str, keys: Keys) -> tuple[PageTable, ...]:
    on_some = head.endswith("node")
    rows = [
        (name, ", ".join(key.on) if on_some and len(key.on) < 6 else "", key.about)
        for name, key in keys.items()
    ]
    return table_of((head, "nodes that have it", "meaning"), rows)


_RECORDING: tuple[PageBlock, ...] = (
    "`.txt` is the TUM format: a line `stamp tx ty tz qx qy qz qw` for each moment, s and m.",
    "`.csv` has a header with a time and a position, and may have a person: `id,t,x,y`. A name "
    "may carry a unit, as `t_ms` or `x_cm`. The tag export `id;x;y;z;time`, mm, with date and "
    "time of day, is read as well. `user: {source: walk.csv}` in a scene, or `--user walk.csv`, "
    "replays it; of several people `walk.csv#2` is the one whose id is 2.",
)
