"""Nothing is compiled or loaded in a tick."""

import subprocess
import sys
from pathlib import Path

from cobodeck.setup.compiling import compiling

ROOT = Path(__file__).resolve().parents[3]
WATCHED = """
import sys
from numba.core.dispatcher import Dispatcher
from cobodeck.run import simulation
from cobodeck.setup.warmup import warm_up
from cobodeck.setup.setup import open_setup

setup = open_setup()
loop = simulation.stage(setup, simulation.Options())
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


def test_compiling_tells_which_function_and_loading_tells_nothing() -> None:
    """Numba's own events count; a function that is compiled already raises none."""
    import numba

    told: list[tuple[str, float | None]] = []

    class Line:
        def at(self, text: str, share: float | None = None) -> None:
            told.append((text, share))

        def done(self) -> None:
            told.append(("done", None))

    double = numba.njit(lambda x: 2 * x)
    for _ in range(2):
        with compiling(4, Line()):  # type: ignore[arg-type]
            assert double(3) == 6
    assert told == [("function 1 of about 4", 0.0), ("done", None), ("done", None)]
