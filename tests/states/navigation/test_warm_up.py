"""In a process of its own: kernels that other tests compiled would hide a late one."""

import subprocess
import sys
from pathlib import Path

CODE = """
import gc
from numba.core.registry import CPUDispatcher

from hw.geometry import Pose2
from hw.room import Disc
from hw.samples import Scan
from states.maps.cells import Grid
from states.navigation.costmap import Costmap
from states.navigation.inflation import Inflation
from states.navigation.local_planner import Limits, Tolerance
from states.navigation.obstacles import ObstacleLayer
from states.navigation.planners import GLOBAL_PLANNERS, LOCAL_PLANNERS, warm_up
from states.navigation.trials import TRIALS, Trial, drive

def kernels():
    return [o for o in gc.get_objects() if isinstance(o, CPUDispatcher)]

def versions():
    return {(k.py_func.__module__, k.py_func.__name__): len(k.signatures) for k in kernels()}

room = ((0, 0), (11, 0), (11, 10), (0, 10))
column = ((5, 4), (6, 4), (6, 6), (5, 6))
warm_up()
before = versions()
for make in GLOBAL_PLANNERS.values():
    planner = make(room, (column,), (), inflation_radius=1)
    planner.plan((2, 5), (9, 5), Disc(3, 8, 1), 1)
    planner.nearest_free((0.5, 5))
    planner.allows((2, 5), (3, 5), Disc(3, 8, 1))
    planner.is_free((1, 5))
    for local in LOCAL_PLANNERS.values():
        for mode in ("omni", "differential"):
            driver = local(planner, Limits(1, 1, 1, 1), Tolerance(), mode)
            drive(driver, Trial("", Pose2(2, 5, 1), Pose2(9, 5, 0), Disc(3, 7, 1), 1), longest=2)
            drive(driver, Trial("", Pose2(0.5, 5), Pose2(2, 2), None, 1), longest=2)
layer = ObstacleLayer(Grid(0.1, 50, 50), rolling=True)
layer.see(Pose2(3, 3), Scan("", 0.0, 0.1, (1.0, 2.0)), 0)
costmap = Costmap(layer.grid, Inflation(1, 0.4), obstacles=layer.costs)
after = versions()
print([name for name in after if after[name] > before.get(name, 0)])
"""


def test_nothing_is_compiled_after_the_warm_up():
    run = subprocess.run(
        [sys.executable, "-c", CODE],
        capture_output=True,
        text=True,
        check=True,
        cwd=Path(__file__).parents[3],
    )
    assert run.stdout.strip() == "[]"
