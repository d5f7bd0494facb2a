"""The header of a record: what was requested, what it ran on, hashes of all files read."""

from __future__ import annotations

import hashlib
import os
import platform
import sys
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import asdict, fields
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from cobodeck.loop import Loop
from cobodeck.project import KINDS, Catalogue, reached
from cobodeck.setup import Options, Setup
from cobodeck.terminal import behind_record
from engine.files import FileError, noted, read_bytes
from engine.files.declared import own_files
from hw.people import is_recording

FORMAT = "cobodeck record 1"
ROOT = Path(__file__).parent.parent.parent.parent
PACKAGES = ("engine", "hw", "states", "behaviors", "cobodeck")
LIBRARIES = (
    "cobodeck", "numpy", "scipy", "numba", "shapely", "networkx", "pyyaml", "foxglove-sdk",
    "mujoco",
)  # fmt: skip
REPLAY = "replay"
"""The kind of plant of a replay."""
LARGEST = 16 << 20
"""Files larger than this, bytes, are not attached, only hashed."""
LARGEST_READ = 1 << 28
"""Files larger than this, bytes, are not read again for hashing."""


def kind_of(options: Options) -> str:
    """The kind of plant that a run is on."""
    if options.tier == 0:
        return "logic"
    if options.connection is not None:
        return options.connection.name
    return "mock" if options.mock else "simulation"


def header(
    setup: Setup, options: Options, loop: Loop, command: Iterable[str], began: str
) -> dict[str, Any]:
    """What was run, on what, and with what code.

    Args:
        setup: what was run.
        options: how.
        loop: before its first tick.
        command: the command line.
        began: the wall time of the start, ISO 8601.
    """
    guard, board = loop.plant.guard, loop.wired.board
    return {
        "format": FORMAT,
        "began": began,
        "command": list(command),
        **header_of_setup(setup, options),
        "real_time": loop.clock.waits,
        "latency_ns": loop.plant.latency_ns,
        "parts": {name: list(part.signals) for name, part in loop.plant.parts.items()},
        "signals": list(board.slots),
        "flowing": sorted(loop.wired.inlet.flowing),
        "guard": None
        if guard is None
        else {"governor": guard.chain.limits.governor, "watched": guard.chain.limits.watched},
        "versions": versions(),
        "machine": machine(),
        "files": {label(path): sha256(data) for path, data in read_files()} | _of_person(options),
        "code": code(setup.catalogue),
    }


def header_of_setup(setup: Setup, options: Options) -> dict[str, Any]:
    """What of the header is known before anything is built."""
    scene = setup.scene
    return {
        "plant": kind_of(options),
        "chart": setup.chart.name,
        "charts": {name: label(Path(setup.library[name].file)) for name in _charts(setup)},
        "inputs": dict(setup.inputs),
        "scene": None if scene is None else {"name": scene.name, "sha256": scene.sha256},
        "robot": setup.robot.name,
        "connection": _connection(setup),
        "limits": asdict(setup.limits),
        "profile": {
            "name": setup.profile.name,
            "sha256": setup.profile.sha256,
            "values": dict(setup.profile.values),
        },
        "given": setup.given,
        "named": _named(),
        "tick_hz": setup.tick_hz,
        "options": _plain(options),
        "user": options.user or (None if scene is None else scene.user),
    }


def _named() -> dict[str, dict[str, str]]:
    """The project's own files that were read, by kind and name, so that a replay finds them."""
    read = noted()
    files = {kind: own_files(kind) for kind in KINDS}
    found = {
        kind: {name: label(file) for name, file in own.items() if file in read}
        for kind, own in files.items()
    }
    return {kind: own for kind, own in found.items() if own}


def _connection(setup: Setup) -> dict[str, Any] | None:
    found = setup.connection
    if found is None:
        return None
    return {"name": found.name, "sha256": found.sha256, "real": found.real}


def read_files() -> list[tuple[Path, bytes]]:
    """All files read so far, except the lists of installed entry points."""
    return [(path, data) for path, data in noted().items() if path.name != "entry_points.txt"]


def _of_person(options: Options) -> dict[str, str]:
    """The hash of the record that the person is replayed from, which is not attached."""
    if options.user is None or behind_record(options.user) is None:
        return {}
    with Path(options.user).open("rb") as stream:
        return {label(Path(options.user)): hashlib.file_digest(stream, "sha256").hexdigest()}


def _charts(setup: Setup) -> list[str]:
    return sorted(reached({setup.chart.name}, setup.library))


def _plain(options: Options) -> dict[str, Any]:
    named = {field.name for field in fields(options)} - {"connection", "console", "timed"}
    return {name: getattr(options, name) for name in sorted(named)}


def attachments(setup: Setup) -> dict[str, bytes]:
    """All files read, by label, except recorded walks, TOML, and those above `LARGEST`."""
    found = {
        label(path): data
        for path, data in read_files()
        if not is_recording(str(path)) and len(data) <= LARGEST and path.suffix != ".toml"
    }
    for name in _charts(setup):
        chart = setup.library[name]
        found[label(Path(chart.file))] = chart.source.text.encode()
    return found


def label(path: Path) -> str:
    """The name of a file in records; shipped ones are relative to the program's folder."""
    try:
        return path.resolve().relative_to(ROOT).as_posix()
    except ValueError:
        return str(path)


def sha256(data: bytes) -> str:
    """The hash of some bytes."""
    return hashlib.sha256(data).hexdigest()


def versions() -> dict[str, str]:
    """The versions of Python and of the numeric libraries."""
    return {"python": platform.python_version(), **{name: _version(name) for name in LIBRARIES}}


@cache
def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return "0"


def code(known: Catalogue) -> dict[str, str]:
    """Hashes of the program's packages, and of each project module that provides states.

    Files are read once: what is changed on disk later does not run in this process.
    """
    found = {name: _folder_sha256(ROOT / name) for name in PACKAGES}
    names = {cls.__module__ for cls in known.classes.values()}
    names |= {module for project in known.projects for module in project.modules}
    for name in sorted(names):
        file = getattr(sys.modules.get(name), "__file__", None)
        if name.partition(".")[0] not in PACKAGES and file is not None:
            found[name] = _module_sha256(Path(file))
    return found


@cache
def _module_sha256(file: Path) -> str:
    return sha256(file.read_bytes())


@cache
def _folder_sha256(folder: Path) -> str:
    digest = hashlib.sha256()
    for file in sorted(folder.rglob("*.py")):
        digest.update(file.relative_to(folder).as_posix().encode() + b"\0")
        digest.update(sha256(file.read_bytes()).encode())
    return digest.hexdigest()


def header_of_replay(
    then: Mapping[str, Any], setup: Setup, command: Iterable[str], began: str
) -> dict[str, Any]:
    """The header of a replay: what was run then, but with today's code and machine."""
    return {
        **then,
        "began": began,
        "command": list(command),
        "plant": REPLAY,
        "versions": versions(),
        "machine": machine(),
        "code": code(setup.catalogue),
    }


def changes(then: Mapping[str, Any], setup: Setup) -> list[str]:
    """Which versions, machine, code and files differ from those of an earlier run, in words."""
    now = {"versions": versions(), "machine": machine(), "code": code(setup.catalogue)}
    found = []
    for name, values in now.items():
        before = then[name]
        found += [
            f"{name} {key}: {_short(before.get(key))}, now {_short(values.get(key))}"
            for key in sorted({*before, *values})
            if before.get(key) != values.get(key)
        ]
    for name, hashed in then["files"].items():
        now_hashed = _hashes_of(name)
        if now_hashed and hashed not in now_hashed:
            found.append(f"{name} has changed; the record's own is used")
    return found


def _hashes_of(name: str) -> set[str]:
    """Hashes of today's files of this name, in the program's folder and in the current folder."""
    found = set()
    for file in (ROOT / name, Path(name)):
        with suppress(FileError):
            found.add(sha256(read_bytes(file, LARGEST_READ)))
    return found


def _short(value: Any) -> str:
    shown = "none" if value is None else str(value)
    return shown[:12] if len(shown) == 64 else shown


def machine() -> dict[str, str]:
    """The machine and the Python that figures are of."""
    libc = platform.libc_ver()
    return {
        "name": _processor(),
        "cores": str(os.cpu_count()),
        "system": " ".join(filter(None, (platform.system(), platform.machine(), *libc))),
        "python": f"{platform.python_implementation()} {platform.python_version()}",
    }


def _processor() -> str:
    try:
        text = Path("/proc/cpuinfo").read_text()
    except OSError:
        return platform.processor() or platform.machine()
    named = (line.partition(":")[2].strip() for line in text.splitlines() if "model name" in line)
    return next(named, platform.machine())
