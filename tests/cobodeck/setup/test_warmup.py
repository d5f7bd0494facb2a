"""Nothing is compiled or loaded in a tick."""

import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

from cobodeck.setup.compiling import compiling
from cobodeck.setup.setup import open_setup
from states.environment.environment import Environment
from states.subsystems import SUBSYSTEMS

ROOT = Path(__file__).resolve().parents[3]
HEAVY = ("scipy.linalg", "scipy.ndimage", "networkx", "PIL", "jsonschema", "unittest")
"""What no run in a drawn room needs."""
WATCHED = f"""
import sys
HEAVY = {HEAVY!r}
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
print([name for name in HEAVY if name in sys.modules])
"""


def test_nothing_is_compiled_or_imported_in_a_tick_and_nothing_that_is_not_needed() -> None:
    result = subprocess.run(
        [sys.executable, "-c", WATCHED], cwd=ROOT, capture_output=True, text=True, check=True
    )

    assert result.stdout == "[] []\n[]\n"


def test_no_example_is_forgotten_and_only_what_is_used_is_compiled() -> None:
    """All that register examples are asked for by somebody, planners only by who uses them."""
    files = [file for top in ("behaviors", "hw", "states") for file in (ROOT / top).rglob("*.py")]
    registered = {
        ".".join(file.relative_to(ROOT).with_suffix("").parts)
        for file in files
        if "\n@example\n" in file.read_text()
    }
    environment = open_setup().environment
    of_choices = {
        (planner, local, scanning): {
            module.__name__ for module in chosen(environment, planner, local).compiled(scanning)
        }
        for planner in ("exact", "theta_star")
        for local in ("profile", "teb")
        for scanning in (False, True)
    }
    navigation = "states.navigation"
    local = f"{navigation}.local"
    always = {
        f"{navigation}.exact.visibility",
        f"{local}.profile_planner",
        f"{local}.straight_planner",  # of all who get out of the way, whatever their local planner
    }
    in_turn = {f"{navigation}.grid.grid_planners", f"{local}.teb_planner"}
    others = ("behaviors.", "hw.motion.", "hw.safety.", "hw.sim.", "states.arm.")
    beside = {name for name in registered if name.startswith(others)}

    assert of_choices["exact", "profile", False] == always
    assert of_choices["theta_star", "teb", False] == always | in_turn
    assert of_choices["exact", "profile", True].isdisjoint(in_turn)
    assert set.union(*of_choices.values()) | beside == registered


def chosen(environment: Environment, planner: str, local: str) -> Environment:
    navigation = environment.navigation
    own: Any = {"planner": planner, "local_planner": local}
    for name in SUBSYSTEMS:
        navigation = replace(navigation, **{name: replace(navigation.named(name), **own)})
    return replace(environment, navigation=navigation)


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
