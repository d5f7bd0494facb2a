"""Compiled code is kept in one place; without one there is a message, and the run goes on."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from cobodeck.setup import compiled_code
from cobodeck.setup.compiled_code import ROOT, described, keep_compiled_code

VARIABLE = "NUMBA_CACHE_DIR"
LOCKED = Path("/proc/self")  # not even root can make a folder there


@pytest.fixture
def checkout(tmp_path: Path) -> Path:
    (tmp_path / "checkout" / "states").mkdir(parents=True)
    (tmp_path / "checkout" / "pyproject.toml").write_text("")
    return tmp_path / "checkout"


def test_a_checkout_keeps_it_beside_its_modules(checkout: Path) -> None:
    environment = {"HOME": str(checkout)}

    assert keep_compiled_code(environment, checkout) is None
    assert VARIABLE not in environment  # as numba does by itself


@pytest.mark.parametrize("name", ["HOME", "XDG_CACHE_HOME"])
def test_installed_it_is_kept_in_the_users_cache(tmp_path: Path, name: str) -> None:
    environment = {"HOME": "/elsewhere", name: str(tmp_path / "mine")}
    cache = {"HOME": tmp_path / "mine" / ".cache", "XDG_CACHE_HOME": tmp_path / "mine"}[name]

    assert keep_compiled_code(environment, tmp_path / "site-packages") is None
    assert environment[VARIABLE] == str(cache / "cobodeck")


def test_without_a_place_there_is_a_message_and_a_temporary_one() -> None:
    environment = {"XDG_CACHE_HOME": str(LOCKED / "cache")}

    message = keep_compiled_code(environment, LOCKED)

    assert message == (
        "compiled code is not kept, each start takes longer: "
        f"cannot write to {LOCKED}/cache/cobodeck"
    )
    assert Path(environment[VARIABLE]).is_dir()
    Path(environment[VARIABLE]).rmdir()


def test_a_place_of_ones_own_is_left_alone() -> None:
    environment = {VARIABLE: "/elsewhere"}

    assert keep_compiled_code(environment, LOCKED) is None
    assert environment == {VARIABLE: "/elsewhere"}
    assert described(environment) == "in /elsewhere, as NUMBA_CACHE_DIR says"


def test_without_a_home_there_is_a_message(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nobody's list of users has this number, and nothing says where home is."""

    def nowhere() -> Path:
        raise RuntimeError("Could not determine home directory.")

    monkeypatch.setattr(Path, "home", nowhere)
    environment: dict[str, str] = {}

    assert keep_compiled_code(environment, LOCKED) == (
        "compiled code is not kept, each start takes longer: cannot write to a home directory"
    )
    Path(environment[VARIABLE]).rmdir()


def test_where_it_is_kept_is_described(
    checkout: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(compiled_code, "ROOT", checkout)
    assert described({}) == "beside the modules"

    monkeypatch.setattr(compiled_code, "ROOT", tmp_path)
    assert described({"XDG_CACHE_HOME": str(tmp_path)}) == f"in {tmp_path}/cobodeck"
    assert described({"XDG_CACHE_HOME": str(LOCKED)}).startswith("nowhere")


@pytest.mark.slow
def test_numba_goes_by_it(tmp_path: Path) -> None:
    """What a run of an installed program compiles goes to the cache and to no other folder."""
    program = (
        "import os, sys; sys.dont_write_bytecode = True\n"
        "from pathlib import Path\n"
        "from cobodeck.setup.compiled_code import keep_compiled_code\n"
        f"here = Path({str(tmp_path)!r})\n"
        "assert keep_compiled_code(os.environ, here) is None\n"
        "import compiled\n"
        "compiled.twice(3)\n"
    )
    (tmp_path / "compiled.py").write_text(
        "import numba\n@numba.njit(cache=True)\ndef twice(x):\n    return 2 * x\n"
    )
    environment = {"XDG_CACHE_HOME": str(tmp_path / "cache"), "PYTHONPATH": f"{ROOT}:{tmp_path}"}

    subprocess.run([sys.executable, "-c", program], env=environment, check=True)

    found = [file for file in tmp_path.rglob("*") if file.suffix in (".nbi", ".nbc")]
    assert len(found) == 2
    assert all(file.is_relative_to(tmp_path / "cache" / "cobodeck") for file in found)
