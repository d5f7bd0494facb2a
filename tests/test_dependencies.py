"""Each dependency is imported somewhere; the program runs without what only extras bring."""

from __future__ import annotations

import ast
import re
import tomllib
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import pytest
import yaml

from cobodeck.logs.formats.run_record import MAGIC
from cobodeck.terminal.console import FAILED, OK, USAGE
from hw.connection.connection import FOLDER
from hw.extras import EXTRAS, PACKAGES, needs
from tests.program import python

ROOT = Path(__file__).resolve().parents[1]
PRODUCT = ("engine", "states", "behaviors", "hw", "cobodeck")
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
BY_EXTRA: dict[str, list[str]] = PROJECT["optional-dependencies"]
MODULES = {
    "pyyaml": "yaml",
    "pillow": "PIL",
    "ur-rtde": "rtde_control",
    **{package: module for module, package in PACKAGES.items() if " " not in package},
}
"""What is imported under another name than it is installed by."""
INDIRECT = {"msgpack": "python-can", "serial": "python-can", "twisted": "roslibpy"}
"""Modules that are imported, and the package of the extra that depends on theirs."""
HIDDEN = sorted(EXTRAS.keys() - {"ompl"})
HIDING = f"""
import sys

class Hiding:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in {HIDDEN!r}:
            raise ModuleNotFoundError(f"No module named {{name!r}}", name=name)

sys.meta_path.insert(0, Hiding())
"""
"""Imported by every interpreter that starts, children of the program included."""


def imported() -> Iterator[str]:
    """The modules that the product imports."""
    files = [file for top in PRODUCT for file in (ROOT / top).rglob("*.py")]
    for file in files:
        if "template" in file.relative_to(ROOT).parts:
            continue
        for node in ast.walk(ast.parse(file.read_text())):
            if isinstance(node, ast.Import):
                yield from (alias.name for alias in node.names)
            elif isinstance(node, ast.ImportFrom) and node.module:
                yield node.module
            elif isinstance(node, ast.Call) and ast.unparse(node.func).endswith("import_module"):
                yield from (a.value for a in node.args if isinstance(a, ast.Constant))


def named(requirements: Iterable[str]) -> set[str]:
    """The packages that requirements name, cobodeck's own extras left out."""
    return {re.split(r"[\[<>=!~; ]", line, maxsplit=1)[0] for line in requirements} - {"cobodeck"}


def test_every_dependency_is_imported() -> None:
    modules = {name.partition(".")[0] for name in imported()}
    declared = named(PROJECT["dependencies"]).union(
        *(named(BY_EXTRA[extra]) for extra in ("record", "robot", "ros", "live", "plots"))
    )

    assert {name for name in declared if MODULES.get(name, name) not in modules} == set()


def test_the_extras_bring_what_is_told_of_them() -> None:
    default = named(PROJECT["dependencies"])
    for module, extra in EXTRAS.items():
        package = INDIRECT.get(module) or PACKAGES.get(module, module)
        assert package in named(BY_EXTRA[extra]), module
    told = {extra: {m for m, has in EXTRAS.items() if has == extra} for extra in BY_EXTRA}
    for extra in ("record", "robot", "ros", "live", "plots"):
        brought = {MODULES.get(name, name) for name in named(BY_EXTRA[extra]) - default}
        assert brought <= told[extra]


@pytest.fixture(scope="module")
def hidden(tmp_path_factory: pytest.TempPathFactory) -> str:
    """A folder on whose path no extra's package can be imported."""
    folder = tmp_path_factory.mktemp("hidden")
    (folder / "sitecustomize.py").write_text(HIDING)
    return str(folder)


@pytest.mark.parametrize(
    "command",
    [
        "validate",
        "list states",
        "list connections",
        "render cobodeck -o chart.svg",
        "simulate --duration 1",
        "run cobodeck --robot mock --scene lab_a --user demo --duration 1 --fast",
    ],
)
def test_the_default_installation_is_enough_for(hidden: str, tmp_path: Path, command: str) -> None:
    done = python(tmp_path, "-m", "cobodeck", *command.split(), before=hidden)

    assert done.returncode == OK, done.stderr
    recorded = f"cobodeck: no record: it {needs('mcap')}\n" if command.startswith("run") else ""
    assert recorded in done.stderr


@pytest.mark.parametrize(
    ("command", "module"),
    [
        ("simulate --duration 1 --record run.mcap", "mcap"),
        ("run cobodeck --robot mock --fast --duration 1 --record run.mcap", "mcap"),
        ("simulate --user walk.mcap --duration 1", "mcap"),
        ("render run.mcap -o run.svg", "mcap"),
        ("replay run.mcap", "mcap"),
        ("recover run.mcap", "mcap"),
        ("compare run.mcap run.mcap", "mcap"),
        ("localize run.mcap", "mcap"),
        ("localize walk.bag", "rosbags"),
        ("calibrate walk.zst", "zstandard"),
        ("render --scene lab_a -o room.svg", "matplotlib"),
        ("space lab_a -o room.svg", "matplotlib"),
        ("reach -o reach.svg", "matplotlib"),
        ("simulate --duration 1 --live", "websockets"),
    ],
)
def test_a_missing_package_is_one_line_with_what_installs_it(
    hidden: str, tmp_path: Path, command: str, module: str
) -> None:
    if "--record" not in command:
        (tmp_path / "run.mcap").write_bytes(MAGIC + bytes(13) + b"cobodeck")
    (tmp_path / "walk.bag").write_bytes(b"#ROSBAG V2.0\n")
    (tmp_path / "walk.zst").write_bytes(b"\x28\xb5\x2f\xfd")

    done = python(tmp_path, "-m", "cobodeck", *command.split(), before=hidden)

    assert done.stderr == f"cobodeck: this {needs(module)}\n"
    assert done.returncode == USAGE


FAKES = yaml.safe_load((FOLDER / "fakes.yaml").read_text())
NODES = {key: value for key, value in FAKES["peers"]["nodes"].items() if key != "tells"}
ASKING = "chart: ask\noutcomes: [x]\nstates:\n  a: {do: CallOperator, next: {helped: .x}}\n"
"""A chart that commands no part; the stop line is opened all the same, and its link with it."""
KAIROS = {"driver": "hw.fakes.kairos.kairos_peer:Kairos", "host": "loopback"}
ON_CHAIN = {name: part for name, part in FAKES["parts"].items() if part.get("link") == "chain"}


@pytest.mark.parametrize(
    ("changed", "told"),
    [
        (
            {"peers": {"nodes": NODES}},
            f"peer 'nodes' by hw.fakes.can.can_peer:CanNodes: {needs('canopen')}",
        ),
        (
            {"peers": {"kairos": KAIROS}},
            f"peer 'kairos' by hw.fakes.kairos.kairos_peer:Kairos: {needs('websockets')}",
        ),
        ({}, f"link 'unity' by hw.drivers.unity.unity_link:Unity: {needs('rosbags')}"),
        (
            {"links": {"chain": FAKES["links"]["chain"]}, "parts": ON_CHAIN},
            "link 'chain' by hw.drivers.chain.chain_client:ChainLink: OSError: "
            f"hw.drivers.can.can_base:CanBase: {needs('canopen')}",
        ),
    ],
    ids=["fake nodes", "fake kairos", "unity", "chain"],
)
def test_a_driver_that_lacks_a_package_is_told_with_its_place(
    hidden: str, tmp_path: Path, changed: dict[str, Any], told: str
) -> None:
    given = FAKES | {"connection": "own", "peers": {}} | changed
    (tmp_path / "own.yaml").write_text(yaml.safe_dump(given, sort_keys=False))
    (tmp_path / "ask.yaml").write_text(ASKING)
    chart = "ask.yaml" if "parts" in changed else "cobodeck"

    command = ["-m", "cobodeck", "run", chart, "--robot", "own.yaml", "--duration", "1"]
    done = python(tmp_path, *command, before=hidden)

    assert done.returncode == FAILED
    assert told in done.stderr
    assert "Traceback" not in done.stderr


def test_the_doctor_tells_what_the_drivers_of_a_connection_lack(
    hidden: str, tmp_path: Path
) -> None:
    done = python(tmp_path, "-m", "cobodeck", "doctor", "--robot", "fakes", before=hidden)

    assert done.returncode == FAILED
    assert f"hw.drivers.can.can_base:CanBase: {needs('canopen')}" in done.stdout
    assert f"hw.drivers.unity.unity_link:Unity {needs('rosbags')}" in done.stdout
