"""Records that others have made: read if they are whole, else told in one sentence."""

from __future__ import annotations

import json
import struct
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import pytest
import zstandard
from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer

from cobodeck.__main__ import main
from cobodeck.record.format.chunks import LARGEST
from cobodeck.record.read.reader import Record
from engine.files.finding import FileError

COMMANDS = {
    "replay": lambda path: ["replay", path, "--check"],
    "render": lambda path: ["render", path, "-o", "picture.svg"],
    "compare": lambda path: ["compare", path, path],
    "recover": lambda path: ["recover", path],
    "person": lambda path: ["simulate", "--scene", "lab_a", "--duration", "1", "--user", path],
}


@dataclass
class Content:
    """What is in a record, to be written by another library."""

    header: dict[str, str]
    attached: dict[str, bytes]
    messages: list[tuple[Any, Any, Any]] = field(default_factory=list)

    def but(self, **entries: Any) -> Content:
        """With other entries in the header."""
        texts = {name: json.dumps(value) for name, value in entries.items()}
        return replace(self, header=self.header | texts)

    def write(self, path: Path, **options: Any) -> Path:
        with path.open("wb") as stream:
            writer = Writer(stream, **options)
            writer.start()
            writer.add_metadata("run", self.header)
            for name, data in self.attached.items():
                writer.add_attachment(0, 0, name, "", data)
            channels: dict[tuple[str, str], int] = {}
            for schema, channel, message in self.messages:
                key = schema.name, channel.topic
                if key not in channels:
                    made = writer.register_schema(schema.name, schema.encoding, schema.data)
                    channels[key] = writer.register_channel(channel.topic, "json", made)
                writer.add_message(channels[key], message.log_time, message.data, 0)
            writer.finish()
        return path


@pytest.fixture(scope="module")
def content(tmp_path_factory: pytest.TempPathFactory) -> Content:
    path = tmp_path_factory.mktemp("run") / "run.mcap"
    given = ["--scene", "lab_a", "--duration", "2", "--record", str(path)]
    assert main(["simulate", *given]) == 0
    with path.open("rb") as stream:
        reader = make_reader(stream)
        header = next(m.metadata for m in reader.iter_metadata() if m.name == "run")
        attached = {a.name: a.data for a in reader.iter_attachments()}
        messages = list(reader.iter_messages(log_time_order=False))
    return Content(header, attached, messages)


@pytest.fixture
def said(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> Callable[..., tuple[int, str]]:
    """What a command says of a file, in a folder in which it must leave nothing if it fails."""
    folder = tmp_path / "here"
    folder.mkdir()
    monkeypatch.chdir(folder)

    def say(command: str, path: Path) -> tuple[int, str]:
        capsys.readouterr()
        code = main(COMMANDS[command](str(path)))
        if code:
            assert list(folder.iterdir()) == []
        return code, capsys.readouterr().err

    return say


@pytest.mark.parametrize(
    "options",
    [
        {"compression": CompressionType.LZ4},
        {"compression": CompressionType.NONE},
        {"use_chunking": False},
        {"enable_crcs": False, "enable_data_crcs": False},
    ],
    ids=lambda options: ", ".join(options),
)
def test_a_copy_of_another_library_is_the_same(
    options: dict[str, Any],
    content: Content,
    tmp_path: Path,
    said: Callable[..., tuple[int, str]],
) -> None:
    path = content.write(tmp_path / "copy.mcap", **options)

    assert len(list(Record(path).groups())) == 62
    assert said("replay", path)[0] == 0


WRONG: dict[str, Callable[[Content], Content]] = {
    "an entry that is missing": lambda c: replace(
        c, header={name: text for name, text in c.header.items() if name != "parts"}
    ),
    "an entry of another type": lambda c: c.but(options=[]),
    "an option too many": lambda c: c.but(
        options=json.loads(c.header["options"]) | {"evil": "\x1b]0;x\x07"}
    ),
    "no ticks a second": lambda c: c.but(tick_hz=0),
    "a chart that there is not": lambda c: c.but(chart="../../x"),
    "no texts": lambda c: replace(c, attached={}),
    "a text that is none": lambda c: replace(c, attached=dict.fromkeys(c.attached, b"\xff")),
    "a scene that there is not": lambda c: c.but(
        given={"scene": "/etc/passwd", "profile": "tuned", "robot": None}
    ),
}


@pytest.mark.parametrize("command", ["replay", "render"])
@pytest.mark.parametrize("what", WRONG)
def test_what_cannot_be_run_is_told_and_nothing_is_written(
    what: str,
    command: str,
    content: Content,
    tmp_path: Path,
    said: Callable[..., tuple[int, str]],
) -> None:
    path = WRONG[what](replace(content, messages=content.messages[:200])).write(tmp_path / "x.mcap")

    code, text = said(command, path)

    assert code == 1
    assert text.startswith("cobodeck: ")
    assert "\x1b" not in text


@pytest.mark.parametrize("command", COMMANDS)
def test_a_record_without_a_tick_is_told(
    command: str, content: Content, tmp_path: Path, said: Callable[..., tuple[int, str]]
) -> None:
    messages = [found for found in content.messages if found[1].topic != "tick"]
    path = replace(content, messages=messages).write(tmp_path / "x.mcap")

    assert said(command, path) == (1, f"cobodeck: {path}: no complete tick: it has none\n")


def test_a_file_of_somebody_else_has_no_header_of_ours(content: Content, tmp_path: Path) -> None:
    path = replace(content, header={}).write(tmp_path / "x.mcap")

    with pytest.raises(FileError, match="is no record of a run: it has no header of ours"):
        Record(path)


MESSAGES: dict[str, bytes] = {
    "tick": b'{"at_ns":1e300,"n":1,"kind":"grid","missed":0,"late_ns":0,"crc":0}',
    "trace": b'{"line":[1]}',
    "truth": b'{"base":"x"}',
    "parts": b'{"part":"operator","what":"report","args":7}',
    "safety": b"[" * 50_000,
    "signal/user.pose": b'{"value":{"$array":["O",[9],"AAAA"]},"stamp":0}',
}


@pytest.mark.parametrize("command", COMMANDS)
@pytest.mark.parametrize("topic", MESSAGES)
@pytest.mark.few(4)
def test_whatever_a_message_is_the_commands_end_in_order(
    topic: str,
    command: str,
    content: Content,
    tmp_path: Path,
    said: Callable[..., tuple[int, str]],
) -> None:
    third = [n for n, found in enumerate(content.messages) if found[1].topic == topic][2]
    schema, channel, message = content.messages[third]
    for data in (b"{", b"{}", MESSAGES[topic]):
        messages = [*content.messages]
        messages[third] = schema, channel, replace(message, data=data)
        path = replace(content, messages=messages).write(tmp_path / "x.mcap")

        code, text = said(command, path)

        assert code in (0, 1), text
        for file in Path().iterdir():
            if file.is_file():
                file.unlink()


def record(opcode: int, body: bytes) -> bytes:
    return struct.pack("<BQ", opcode, len(body)) + body


def chunk(size: int, data: bytes) -> bytes:
    return record(6, struct.pack("<QQQI", 0, 0, size, 0) + b"\4\0\0\0zstd" + data_of(data))


def data_of(data: bytes) -> bytes:
    return struct.pack("<Q", len(data)) + data


@pytest.mark.parametrize("told", [100, LARGEST, 4 * LARGEST])
def test_a_chunk_that_never_ends_is_not_unpacked(
    told: int, content: Content, tmp_path: Path
) -> None:
    bomb = zstandard.compress(bytes(4 * LARGEST))
    path = replace(content, messages=[]).write(tmp_path / "x.mcap")
    whole = path.read_bytes()
    path.write_bytes(whole[: whole.index(record(15, b"")[:1] + struct.pack("<Q", 4))])
    with path.open("ab") as stream:
        stream.write(chunk(told, bomb))

    found = Record(path)
    with pytest.raises(FileError, match="no complete tick: it breaks off"):
        found.require_ticks()
