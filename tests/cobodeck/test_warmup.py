"""Nothing is compiled or loaded in a tick, and a disk that cannot be written is no failure."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from cobodeck.warmup import keep_compiled_code

ROOT = Path(__file__).resolve().parents[2]
WATCHED = """
import sys
from numba.core.dispatcher import Dispatcher
from cobodeck import simulate
from cobodeck.warmup import warm_up
from cobodeck.wiring import open_setup

setup = open_setup()
loop = simulate.stage(setup, simulate.Options())
warm_up(setup, loop.wired.run.machine)
compiled, loaded = [], set(sys.modules)
original = Dispatcher.compile

def compile(dispatcher, signature):
    compiled.append(dispatcher.py_func.__qualname__)
    return original(dispatcher, signature)

Dispatcher.compile = compile
while loop.next_ns < 120 * 10**9:
    loop.tick()
print(compiled, sorted(set(sys.modules) - loaded))
"""


def test_nothing_is_compiled_or_imported_in_a_tick() -> None:
    result = subprocess.run(
        [sys.executable, "-c", WATCHED], cwd=ROOT, capture_output=True, text=True, check=True
    )

    assert result.stdout == "[] []\n"


def test_without_a_place_for_compiled_code_there_is_a_message_and_a_temporary_one() -> None:
    locked = Path("/proc/self")
    environment: dict[str, str] = {}

    message = keep_compiled_code(environment, [locked])

    if os.access(locked, os.W_OK):
        pytest.skip("nothing is locked here")
    assert (
        message == "compiled code is not kept, each start takes longer: cannot write to /proc/self"
    )
    assert Path(environment["NUMBA_CACHE_DIR"]).is_dir()
    Path(environment["NUMBA_CACHE_DIR"]).rmdir()


def test_a_place_of_ones_own_is_left_alone(tmp_path: Path) -> None:
    environment = {"NUMBA_CACHE_DIR": "/elsewhere"}

    assert keep_compiled_code(environment, []) is None
    assert environment == {"NUMBA_CACHE_DIR": "/elsewhere"}
    assert keep_compiled_code({}, [Path("/proc/self"), tmp_path / "new"]) is None


def test_without_home_and_cache_there_is_a_message() -> None:
    """Nobody's list of users has this number, and nothing says where home is."""
    program = (
        "import pathlib\n"
        "def nowhere(): raise RuntimeError('Could not determine home directory.')\n"
        "pathlib.Path.home = nowhere\n"
        "import cobodeck.warmup as warmup\n"
        "warmup.ROOT = pathlib.Path('/proc/self')\n"
        "found = {}\n"
        "print(warmup.keep_compiled_code(found), 'NUMBA_CACHE_DIR' in found)\n"
    )
    result = subprocess.run(
        [sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True, check=True
    )

    if os.access("/proc/self", os.W_OK):
        pytest.skip("nothing is locked here")
    assert result.stdout == (
        "compiled code is not kept, each start takes longer: cannot write to /proc/self/states "
        "True\n"
    )
