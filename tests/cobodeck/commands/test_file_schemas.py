"""The schemas of all kinds of files against the files there are, and against their readers."""

from __future__ import annotations

import copy
import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import jsonschema
import pytest
import yaml
from hypothesis import given, settings, strategies as st

from behaviors.profile.profile import load_profile
from behaviors.profile.profile_layers import BASE
from cobodeck.__main__ import main
from cobodeck.campaign.campaign_file import load_campaign
from cobodeck.flexbe_states.ros.topic_table import topics_from
from cobodeck.project.named_files import KINDS, ROOT, kind_of
from cobodeck.project.state_catalogue import catalogue
from cobodeck.terminal.console import OK
from cobodeck.validation.editor_schema import schema_for
from engine.files.declared import load_yaml
from engine.files.declared.item import notes
from engine.files.finding import FileError
from engine.files.source import plain, read_file
from hw.connection.connection import load_connection
from hw.model.arm import load_arm
from hw.model.calibration import load_calibration
from hw.model.prop import load_prop
from hw.model.robot import load_robot
from hw.model.tracking_file import load_tracking
from hw.people.walking.script import load_script
from hw.scene.scene import load_scene
from tests.repeats import examples

READERS: dict[str, Callable[[Path], object]] = {
    "arm": load_arm,
    "campaign": load_campaign,
    "calibration": load_calibration,
    "connection": load_connection,
    "profile": load_profile,
    "prop": load_prop,
    "robot": load_robot,
    "scene": load_scene,
    "tracking": load_tracking,
    "user": load_script,
    "topics": lambda file: load_yaml(file, topics_from),
}
KNOWN = catalogue(own=False)
SCHEMAS = {kind: json.loads(schema_for(kind, KNOWN)) for kind in READERS}
WHOLE = ROOT / "tests/behaviors/profile/spelled_out.yaml"
"""A profile without a base."""
FILES = {WHOLE: "profile"} | {
    file: kind
    for folder in ("charts", "hw", "cobodeck/campaign", "cobodeck/template", "cobodeck/manual")
    for file in sorted((ROOT / folder).rglob("*.yaml"))
    if (kind := kind_of(file)) in READERS and file != BASE
}


def content(file: Path) -> dict[str, Any]:
    found: dict[str, Any] = plain(read_file(file).value)
    return found


def first(kind: str) -> dict[str, Any]:
    """A shipped file of a kind."""
    return content(next(file for file, its in FILES.items() if its == kind))


def refused(kind: str, value: Any) -> str:
    """Why the schema refuses a value; empty if it does not."""
    found = list(jsonschema.Draft7Validator(SCHEMAS[kind]).iter_errors(value))
    newer = list(jsonschema.Draft202012Validator(SCHEMAS[kind]).iter_errors(value))
    assert [str(error) for error in found] == [str(error) for error in newer]
    return "\n".join(f"{list(error.absolute_path)}: {error.message}" for error in found)


def read(kind: str, value: Any, folder: Path) -> str:
    """Why the reader refuses a value, or what it remarks on; empty if neither."""
    file = folder / f"{kind}.yaml"
    file.write_text(yaml.safe_dump(value, sort_keys=False, allow_unicode=True))
    with notes() as told:
        try:
            READERS[kind](file)
        except FileError as error:
            return str(error)
    return "\n".join(map(str, told))


def objects(schema: Any) -> Iterator[dict[str, Any]]:
    """All schemas of mappings inside one."""
    if isinstance(schema, dict):
        if "additionalProperties" in schema and "properties" in schema:
            yield schema
        for inner in schema.values():
            yield from objects(inner)


def test_every_kind_of_file_is_declared_and_has_shipped_files() -> None:
    assert {*READERS, "chart"} == set(KINDS)
    assert set(FILES.values()) == set(READERS)


@pytest.mark.parametrize("kind", READERS)
def test_a_schema_is_one_in_both_drafts_with_neither_one_of_nor_any_of(kind: str) -> None:
    jsonschema.Draft7Validator.check_schema(SCHEMAS[kind])
    jsonschema.Draft202012Validator.check_schema(SCHEMAS[kind])
    text = json.dumps(SCHEMAS[kind])
    assert not [word for word in ("oneOf", "anyOf", "$ref") if word in text]


@pytest.mark.parametrize("kind", READERS)
def test_every_key_has_a_line_of_meaning(kind: str) -> None:
    bare = [
        key
        for inner in objects(SCHEMAS[kind])
        for key, of in inner["properties"].items()
        if not of.get("description", "").partition(".")[0]
    ]
    assert not bare


@pytest.mark.parametrize("file", FILES, ids=lambda file: str(file.relative_to(ROOT)))
def test_every_shipped_file_is_right(file: Path) -> None:
    assert not refused(FILES[file], content(file))


MISTAKES: dict[str, dict[str, Any]] = {
    "arm": {"payload": "5 m", "dh.d1": 50, "joints.shoulder_pan_joint.speed": True, "apart": 3},
    "calibration": {"chain": [], "calibration": "two words", "abut": "x", "chain.0": 5},
    "campaign": {"scene": 3, "user": [], "tier": [1, 4], "requests": [0], "duration": "3 m"},
    "connection": {"real": "no", "plant": "mok", "told": "one", "parts": [1], "limits.speed": 99},
    "profile": {"escape.angles": [], "chase.tries": 1.5, "haptic.close": 1, "robot.arm_jerk": -1},
    "prop": {"mass": "1 m", "tcp": 4, "capsules.0.radius": 0, "parked": "away", "mas": 1},
    "robot": {"mass": 0, "base.modes": [], "base.modes.0": "fly", "footprint.foam": "9 kg"},
    "scene": {"robot.start.x": "2 s", "room": 5, "tracking": "there", "parking": [], "zone": 1},
    "tracking": {"residual": 1, "residual.yaw": -1, "mounts": [], "map_from_vive": None},
    "user": {"steps": [], "steps.0": {"stand": 1, "look": 1}, "speed": 0, "repeat": 0, "step": 1},
}


@pytest.mark.parametrize(
    ("kind", "key", "wrong"),
    [(kind, key, wrong) for kind, all_of in MISTAKES.items() for key, wrong in all_of.items()],
)
def test_a_mistake_is_refused_by_reader_and_schema(
    kind: str, key: str, wrong: Any, tmp_path: Path
) -> None:
    value = first(kind)
    assert not read(kind, value, tmp_path)
    put(value, key.split("."), wrong)
    assert read(kind, value, tmp_path)
    assert refused(kind, value)


@pytest.mark.parametrize("kind", READERS)
def test_a_missing_key_is_refused_by_reader_and_schema(kind: str, tmp_path: Path) -> None:
    for key in SCHEMAS[kind]["required"]:
        value = {name: inner for name, inner in first(kind).items() if name != key}
        assert f"the key '{key}' is missing" in read(kind, value, tmp_path)
        assert f"{key!r} is a required property" in refused(kind, value)


def test_of_a_profile_no_key_is_required_but_its_name(tmp_path: Path) -> None:
    assert not refused("profile", content(WHOLE))
    assert not refused("profile", {"profile": "mine", "chase": {"inner": "1 m"}})
    assert "'profile' is a required property" in refused("profile", {"chase": {"inner": "1 m"}})


def put(value: Any, keys: list[str], what: Any) -> None:
    """Put a value at a dotted key; mappings on the way are made."""
    for key in keys[:-1]:
        value = value[int(key)] if isinstance(value, list) else value.setdefault(key, {})
    value[int(keys[-1]) if isinstance(value, list) else keys[-1]] = what


def places(value: Any) -> Iterator[tuple[Any, Any]]:
    """Every mapping or list inside a value, with each of its keys."""
    for key, inner in value.items() if isinstance(value, dict) else enumerate(value):
        yield value, key
        if isinstance(inner, dict | list):
            yield from places(inner)


ODD = (None, True, 0, 1, -3, 2.5, 1e9, "", "5 cm", "2 s", "90 deg", "a b", [], [1, 2], {}, {"x": 1})


@settings(max_examples=examples(150), deadline=None)
@given(data=st.data())
def test_a_schema_refuses_nothing_that_is_read(
    data: st.DataObject, tmp_path_factory: pytest.TempPathFactory
) -> None:
    file = data.draw(st.sampled_from([f for f in FILES if "template" not in f.parts]))
    value = copy.deepcopy(content(file))
    inside, key = data.draw(st.sampled_from(list(places(value))))
    if data.draw(st.booleans()):
        inside[key] = data.draw(st.sampled_from(ODD))
    else:
        del inside[key]
    why = refused(FILES[file], value)
    if why:
        assert read(FILES[file], value, tmp_path_factory.mktemp("odd")), why


@pytest.mark.parametrize("kind", READERS)
def test_the_command_writes_the_schema(kind: str, tmp_path: Path) -> None:
    assert main(["schema", kind, "-o", str(tmp_path / "s.json")]) == OK
    assert json.loads((tmp_path / "s.json").read_text()) == SCHEMAS[kind]
