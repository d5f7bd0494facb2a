"""Records open in Foxglove: messages are of its schemas, frames lead to the map, a layout fits."""

from __future__ import annotations

import json
import struct
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

import foxglove.messages
import pytest
from jsonschema import Draft202012Validator
from mcap.reader import make_reader

from cobodeck.__main__ import main
from cobodeck.record.format.messages import log_text
from cobodeck.record.write.start import recorder
from cobodeck.run.simulation import simulate
from cobodeck.setup.options import Options
from cobodeck.setup.setup import open_setup
from engine.files.text import noting
from engine.run import raised
from tests.cobodeck.review.runs import AT

OURS = {"yaw", "head_yaw", "repeat", "moving", "course", "refused", "mode", "scaling"}
"""What our messages have beside Foxglove's fields; see FORMAT.md."""
KINDS = {1: (int, float), 2: (int, float), 5: int, 7: int, 8: bool, 9: str, 13: int, 14: int}
"""Of Protocol Buffers: double, float, int32, fixed32, bool, string, uint32, enum."""
MESSAGE, REPEATED = 11, 3

Fields = dict[int, list[Any]]


def fields_of(data: bytes) -> Fields:
    """The fields of a message of Protocol Buffers, by number."""
    found: Fields = {}
    rest = memoryview(data)

    def number() -> int:
        nonlocal rest
        value = 0
        for at, byte in enumerate(rest):
            value |= (byte & 127) << 7 * at
            if byte < 128:
                rest = rest[at + 1 :]
                return value
        raise AssertionError("it breaks off")

    while rest:
        key = number()
        wire = key & 7
        if wire == 0:
            value: Any = number()
        else:
            size = {1: 8, 5: 4}.get(wire) or number()
            value, rest = bytes(rest[:size]), rest[size:]
        found.setdefault(key >> 3, []).append(value)
    return found


@cache
def official() -> dict[str, dict[str, tuple[int, int, str]]]:
    """Foxglove's messages by full name: each field's type, label and the name of its message."""
    found: dict[str, dict[str, tuple[int, int, str]]] = {}
    names = ("FrameTransform", "FrameTransforms", "JointStates", "LaserScan", "SceneUpdate", "Log")
    for name in names:
        for file in fields_of(getattr(foxglove.messages, name).get_schema().data)[1]:
            told = fields_of(file)
            package = told.get(2, [b""])[0].decode()
            for message in told.get(4, []):
                parts = fields_of(message)
                described = [fields_of(field) for field in parts.get(2, [])]
                found[f".{package}.{parts[1][0].decode()}"] = {
                    one[1][0].decode(): (one[5][0], one[4][0], one.get(6, [b""])[0].decode())
                    for one in described
                }
    return found


def misfits(message: Any, kind: str, at: str) -> Iterator[str]:
    """How a JSON message differs from Foxglove's schema of this name."""
    if kind in (".google.protobuf.Timestamp", ".google.protobuf.Duration"):
        right = set(message) == {"sec", "nsec"} and 0 <= message["nsec"] < 1_000_000_000
        if not right or not all(type(part) is int for part in message.values()):
            yield f"{at}: {message} is no time"
        return
    known = official()[kind]
    if not isinstance(message, dict):
        yield f"{at}: {message!r} is no {kind}"
        return
    yield from (f"{at}.{name}: unknown" for name in message.keys() - known.keys() - OURS)
    for name, held in message.items():
        if name not in known:
            continue
        type_, label, inner = known[name]
        if (label == REPEATED) != isinstance(held, list):
            yield f"{at}.{name}: {held!r}"
            continue
        for one in held if label == REPEATED else [held]:
            if type_ == MESSAGE:
                yield from misfits(one, inner, f"{at}.{name}")
            elif not isinstance(one, KINDS[type_]):
                yield f"{at}.{name}: {one!r}"


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run with all sensors."""
    path = tmp_path_factory.mktemp("foxglove") / "run.mcap"
    with noting():
        setup = open_setup(scene="study")
        options = Options(duration_s=1.0, tier=2)
        writer = recorder(setup, options, path, AT, print)
        simulate(setup, options, recorder=writer)
    return path


def messages(path: Path) -> list[tuple[str, str, str, bytes, int]]:
    with path.open("rb") as file:
        found = make_reader(file, validate_crcs=True).iter_messages()
        return [
            (channel.topic, schema.name if schema else "", channel.message_encoding, *told)
            for schema, channel, message in found
            for told in [(message.data, message.log_time)]
        ]


@pytest.mark.slow
def test_messages_are_of_foxgloves_schemas(run: Path) -> None:
    seen = set()
    for topic, schema, encoding, data, _ in messages(run):
        if not schema.startswith("foxglove."):
            continue
        seen.add(schema)
        if encoding == "json":
            assert [*misfits(json.loads(data), f".{schema}", topic)] == []

    assert seen >= {
        "foxglove.SceneUpdate", "foxglove.FrameTransform", "foxglove.FrameTransforms",
        "foxglove.JointStates", "foxglove.LaserScan",
    }  # fmt: skip


def test_errors_are_foxgloves_logs() -> None:
    told = log_text(raised(1_500_000_000, "chase/go", RuntimeError("unplugged")))

    assert [*misfits(json.loads(told), ".foxglove.Log", "log")] == []


def test_a_misfit_would_be_seen() -> None:
    wrong = {"timestamp": {"sec": 0, "nsec": -1}, "parent_frame_id": 1, "turned": 0.0}

    found = " ".join(misfits(wrong, ".foxglove.FrameTransform", "t"))

    assert "no time" in found
    assert "parent_frame_id: 1" in found
    assert "turned: unknown" in found


@pytest.mark.slow
def test_messages_are_of_the_schemas_in_the_record(run: Path) -> None:
    """As an independent validator sees it, and with an index, which viewers need."""
    validators: dict[str, Draft202012Validator] = {}
    with run.open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        summary = reader.get_summary()
        assert summary is not None
        assert summary.chunk_indexes
        for schema, channel, message in reader.iter_messages():
            assert schema is not None
            if schema.encoding == "protobuf":
                official = getattr(foxglove.messages, schema.name.removeprefix("foxglove."))
                assert schema.data == official.get_schema().data
                continue
            assert (schema.encoding, channel.message_encoding) == ("jsonschema", "json")
            if schema.name not in validators:
                told = json.loads(schema.data)
                Draft202012Validator.check_schema(told)
                assert told["type"] == "object"  # Foxglove takes no other
                validators[schema.name] = Draft202012Validator(told)
            validators[schema.name].validate(json.loads(message.data))
    assert {"foxglove.SceneUpdate", "cobodeck.Tick", "cobodeck.Trace"} <= set(validators)


@pytest.mark.slow
def test_scans_are_foxgloves_messages_with_their_times(run: Path) -> None:
    scans = [(data, at) for _, schema, _, data, at in messages(run) if schema.endswith("LaserScan")]
    assert scans
    for data, at_ns in scans:
        told = fields_of(data)
        time = fields_of(told[1][0])
        stamp_ns = time.get(1, [0])[0] * 10**9 + time.get(2, [0])[0]
        [start], [end] = (struct.unpack("<d", told[n][0]) for n in (4, 5))
        ranges = struct.unpack(f"<{len(told[6][0]) // 8}d", told[6][0])
        assert at_ns - 200_000_000 < stamp_ns <= at_ns
        assert start < end
        assert len(ranges) == 541


@pytest.mark.slow
def test_every_frame_leads_to_the_map(run: Path) -> None:
    parents: dict[str, str] = {}
    used: set[str] = set()
    for _, schema, encoding, data, _ in messages(run):
        if schema == "foxglove.LaserScan":
            used.add(fields_of(data)[2][0].decode())
        if encoding != "json" or not schema.startswith("foxglove."):
            continue
        told = json.loads(data)
        used |= {entity["frame_id"] for entity in told.get("entities", [])}
        for frame in told.get("transforms", [told] if "child_frame_id" in told else []):
            assert (
                parents.setdefault(frame["child_frame_id"], frame["parent_frame_id"])
                == (frame["parent_frame_id"])
            )

    assert {"front_laser", "rear_laser", "base_link", "map"} <= used
    for frame in used:
        while frame != "map":
            frame = parents[frame]


@pytest.mark.slow
def test_times_go_on(run: Path) -> None:
    times = [at for *_, at in messages(run)]
    assert times == sorted(times)


@pytest.mark.slow
def test_a_layout_names_what_is_in_the_record(
    run: Path, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["render", str(run), "--foxglove", "layouts/run.json"]) == 0
    layout = json.loads(Path("layouts/run.json").read_text())

    room, side = (item["content"] for item in layout["content"]["items"])
    panels = [item["content"] for item in side["items"]]
    topics = {topic for topic, *_ in messages(run)}
    paths = [path["value"] for panel in panels for path in panel["config"].get("paths", ())]

    assert room["config"]["fixedFrame"] == "map"
    assert set(room["config"]["topics"]) == {"scene", "signal/base.scan"} <= topics
    assert {path.partition(".")[0] for path in paths} == {"trace", "safety", "truth"} <= topics
    first = {topic: json.loads(data) for topic, _, kind, data, _ in messages(run) if kind == "json"}
    fields = [path.split(".") for path in paths if not path.startswith("trace")]
    assert all(field in first[topic] for topic, field in fields)
    lines = [json.loads(data)["line"] for topic, _, _, data, _ in messages(run) if topic == "trace"]
    moves = [line for line in lines if len(line) > 4]
    assert moves
    assert all(line[1] == "move" and len(line) == 6 for line in moves)


def test_a_layout_is_for_records(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["render", "chase", "--foxglove", "x.json"]) != 0
    assert "--foxglove is for records" in capsys.readouterr().err
