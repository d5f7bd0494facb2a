"""Every import contract of pyproject.toml holds, and each is broken by a deliberate violation."""

import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[3]
PACKAGES = ("engine", "hw", "states", "behaviors", "cobodeck")
CONTRACTS = {
    contract["id"]: contract["name"]
    for contract in tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["importlinter"][
        "contracts"
    ]
}
VIOLATIONS = [  # contract, file, line that breaks it
    ("layers", "engine/violation.py", "import hw.geometry"),
    ("layers", "hw/violation.py", "import engine.state"),
    ("files", "engine/files/violation.py", "import engine.state"),
    ("layers", "states/arm/violation.py", "import behaviors"),
    ("layers", "behaviors/violation.py", "import cobodeck"),
    ("abilities", "states/navigation/violation.py", "import engine.state"),
    ("abilities", "states/signals/violation.py", "def late():\\n    from engine import state"),
    ("states", "states/navigation/violation.py", "import states.violating.states"),
    ("engine", "engine/chart/violation.py", "import engine.run.chart_run"),
    ("hw", "hw/scene/violation.py", "import hw.sim.world"),
    ("hw", "hw/fakes/violation.py", "import hw.drivers.violation"),
    ("cobodeck", "cobodeck/setup/violation.py", "import cobodeck.run.simulation"),
    ("faces", "cobodeck/run/violation.py", "import hw.scene.room"),
    ("libraries", "engine/violation.py", "import numpy"),
    ("vendors", "hw/sim/violation.py", "import can"),
    ("vendors", "cobodeck/violation.py", "import rtde_control"),
    ("clocks", "states/arm/violation.py", "import time"),
    ("clocks", "behaviors/violation.py", "from argparse import ArgumentParser"),
    ("judge", "cobodeck/avoidable/violation.py", "from hw.sim.contact.contact import gap"),
    ("judge", "cobodeck/avoidable/violation.py", "import cobodeck.bench.navigation.decisions"),
]
ADDED = {  # modules that a violation may need
    "states/violating/__init__.py": "",
    "states/violating/states.py": "import engine",
    "hw/drivers/__init__.py": "",
    "hw/drivers/violation.py": "",
    "hw/fakes/__init__.py": "",
}


def lint(folder: Path) -> subprocess.CompletedProcess[str]:
    program = "from importlinter.cli import lint_imports_command; lint_imports_command()"
    command = [sys.executable, "-c", program, "--no-cache", "--no-logo"]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)


@pytest.fixture(scope="module")
def checkout(tmp_path_factory: pytest.TempPathFactory) -> Path:
    pytest.importorskip("importlinter")
    folder = tmp_path_factory.mktemp("checkout")
    shutil.copy(ROOT / "pyproject.toml", folder)
    (folder / "tests").mkdir()
    shutil.copy(ROOT / "tests" / "faces_contract.py", folder / "tests")
    for package in PACKAGES:
        copied = shutil.ignore_patterns("*.yaml", "__pycache__", "*.json")
        shutil.copytree(ROOT / package, folder / package, ignore=copied)
    for file, text in ADDED.items():
        path = folder / file
        path.parent.mkdir(exist_ok=True)
        if not path.exists():
            path.write_text(text)
    return folder


def test_all_contracts_hold(checkout: Path) -> None:
    result = lint(checkout)

    assert result.returncode == 0, result.stdout


def test_every_contract_is_tried() -> None:
    assert {contract for contract, _, _ in VIOLATIONS} == set(CONTRACTS)


@pytest.mark.parametrize(("contract", "file", "line"), VIOLATIONS)
@pytest.mark.few(5)
def test_a_violation_is_reported(checkout: Path, contract: str, file: str, line: str) -> None:
    violation = checkout / file
    before = violation.read_text() if violation.exists() else None
    violation.write_text(line.replace("\\n", "\n") + "\n")
    try:
        result = lint(checkout)
    finally:
        violation.unlink() if before is None else violation.write_text(before)

    assert result.returncode == 1
    shown = " ".join(result.stdout.split())
    assert f"{CONTRACTS[contract]} BROKEN" in shown
    assert violation.stem in shown
