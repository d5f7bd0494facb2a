"""Damaged files of every kind: findings with a place, and nothing else."""

import random
import re
from collections.abc import Callable
from pathlib import Path

import pytest

from cobodeck.project.library import findings_of, load_beside, yaml_files
from cobodeck.project.named_files import kind_of
from cobodeck.project.state_catalogue import CHARTS, catalogue
from cobodeck.validation.file_checks import FileChecker
from engine.files.finding import Finding

ROOT = CHARTS.parent
COUNT = 60
SHIPPED: dict[str, list[Path]] = {}
for folder in (CHARTS, ROOT / "hw", ROOT / "states" / "arm"):
    for file in yaml_files(folder):
        SHIPPED.setdefault(kind_of(file) or "none", []).append(file)

ROBOT = ROOT / "cobodeck" / "template" / "robot" / "PROJECT"
SHIPPED["connection"].append(ROBOT / "rover_udp.yaml")

KNOWN = catalogue()
BREAKS = (b"\n", b"\r", b"\xc2\x85", b"\xe2\x80\xa8", b"\xe2\x80\xa9")  # of YAML 1.1
NUMBER = re.compile(rb"(?<![\w.\"'])-?\d+(?:\.\d+)?(?:e-?\d+)?(?![\w.])")
VALUE = re.compile(rb"(?<=: )[^\s{}\[\],#]+")
KEY = re.compile(rb"[a-z_]{3,}(?=:)")


def found_in(file: Path, kind: str) -> list[Finding]:
    if kind == "chart":
        return findings_of(load_beside([file], KNOWN), KNOWN, [file])
    return list(FileChecker(KNOWN, []).findings(file, kind))


def replaced(data: bytes, pattern: re.Pattern[bytes], chance: random.Random, new: bytes) -> bytes:
    places = list(pattern.finditer(data))
    if not places:
        return data + new
    at = chance.choice(places)
    return data[: at.start()] + new + data[at.end() :]


def swapped(data: bytes, chance: random.Random) -> bytes:
    at = chance.choice(list(KEY.finditer(data))).start()
    return data[:at] + data[at + 1 : at + 2] + data[at : at + 1] + data[at + 2 :]


def on_a_line(data: bytes, chance: random.Random, change: Callable[[bytes], bytes]) -> bytes:
    lines = data.split(b"\n")
    at = chance.randrange(len(lines))
    lines[at] = change(lines[at])
    return b"\n".join(lines)


def inserted(data: bytes, chance: random.Random, new: bytes) -> bytes:
    at = chance.randrange(len(data))
    return data[:at] + new + data[at:]


DAMAGES: list[Callable[[bytes, random.Random], bytes]] = [
    lambda data, chance: on_a_line(data, chance, lambda line: b""),
    lambda data, chance: on_a_line(data, chance, lambda line: line + b"\n" + line),
    lambda data, chance: on_a_line(data, chance, lambda line: b"\t" + line),
    lambda data, chance: on_a_line(data, chance, lambda line: b" " + line),
    lambda data, chance: on_a_line(data, chance, lambda line: chance.randbytes(12)),
    lambda data, chance: data[: chance.randrange(len(data))],
    lambda data, chance: inserted(data, chance, chance.choice(b"{}[]:,-#'\"&*!x09.\0").to_bytes()),
    lambda data, chance: inserted(data, chance, b"[" * chance.choice([3, 70, 5000])),
    lambda data, chance: inserted(data, chance, b"\xff\xfe"),
    lambda data, chance: inserted(data, chance, chance.randbytes(200)),
    lambda data, chance: swapped(data, chance),
    lambda data, chance: replaced(data, NUMBER, chance, chance.choice([b".nan", b"nan", b"1e999"])),
    lambda data, chance: replaced(data, NUMBER, chance, chance.choice([b"3 kg", b"3 s", b"3 ly"])),
    lambda data, chance: replaced(data, NUMBER, chance, chance.choice([b"1e30", b"-1e30"])),
    lambda data, chance: replaced(data, NUMBER, chance, chance.choice([b"-3", b"0", b"012"])),
    lambda data, chance: replaced(data, VALUE, chance, chance.choice([b"[]", b"{}", b"{a: 1}"])),
    lambda data, chance: replaced(data, VALUE, chance, chance.choice([b"true", b"5", b"on"])),
    lambda data, chance: replaced(data, VALUE, chance, b"&a 3"),
    lambda data, chance: replaced(data, VALUE, chance, b"../../" * 40),
    lambda data, chance: replaced(data, VALUE, chance, b"x" * 5000),
]  # fmt: skip


@pytest.mark.parametrize("kind", sorted(SHIPPED))
@pytest.mark.few(4)
def test_a_damaged_file_is_accepted_or_refused_with_places(tmp_path: Path, kind: str) -> None:
    damage(tmp_path, kind, COUNT)


@pytest.mark.parametrize("kind", sorted(SHIPPED))
@pytest.mark.slow
def test_so_are_two_hundred(tmp_path: Path, kind: str) -> None:
    damage(tmp_path, kind, 200)


def damage(tmp_path: Path, kind: str, count: int) -> None:
    chance = random.Random(kind)
    refused = 0
    for n in range(count):
        shipped = chance.choice(SHIPPED[kind])
        data = DAMAGES[n % len(DAMAGES)](shipped.read_bytes(), chance)
        target = tmp_path / str(n) / shipped.name
        target.parent.mkdir()
        target.write_bytes(data)
        if kind == "connection":
            (target.parent / "rover.yaml").write_bytes((ROBOT / "rover.yaml").read_bytes())

        findings = found_in(target, kind)

        refused += any(finding.severity == "error" for finding in findings)
        for finding in findings:
            assert finding.message
            assert Path(finding.place.file).is_file()
            read = Path(finding.place.file).read_bytes()
            assert 1 <= finding.place.line <= sum(map(read.count, BREAKS)) + 1
            assert 1 <= finding.place.column <= finding.place.end_column
    assert refused >= count // 2


OTHER_KINDS = sorted(kind for kind in SHIPPED if kind not in ("chart", "connection"))


@pytest.mark.parametrize("kind", OTHER_KINDS)
@pytest.mark.parametrize("wrong", [b"1e30", b"-1e30", b".nan", b".inf", b"3 ly", b"true"])
@pytest.mark.few(7)  # each kind, each value
def test_every_number_has_bounds_and_a_unit_that_fits(
    tmp_path: Path, kind: str, wrong: bytes
) -> None:
    some = SHIPPED[kind][:1] if kind == "arm" else SHIPPED[kind]  # arms have all the same keys
    for shipped in some:
        text, _, _ = shipped.read_bytes().partition(b"\ncharts:")
        about = [
            re.search(rb"^about:.*(\n +.*)*(\nsource:.*(\n +.*)*)?", text, re.MULTILINE),
            *re.finditer(rb"#.*", text),
        ]
        target = tmp_path / shipped.name
        for at in NUMBER.finditer(text):
            if any(part and part.start() <= at.start() < part.end() for part in about):
                continue
            unit = re.match(rb" ?(deg|rad|[a-z]+/?[a-z]*2?)\b", text[at.end() :])
            end = at.end() + (unit.end() if unit else 0)
            target.write_bytes(text[: at.start()] + wrong + text[end:])

            findings = found_in(target, kind)

            line = text.count(b"\n", 0, at.start()) + 1
            assert any(finding.place.line == line for finding in findings), (shipped, line, at)


def test_the_kinds_are_those_that_have_a_reader() -> None:
    assert set(SHIPPED) == {
        "arm", "calibration", "chart", "connection", "profile", "prop", "robot", "scene",
        "tracking", "user",
    }  # fmt: skip
