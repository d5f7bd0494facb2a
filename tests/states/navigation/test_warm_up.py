"""In a process of its own: kernels that other tests compiled would hide a late one."""

import subprocess
import sys
from pathlib import Path

import pytest

CODE = """
import gc
import numpy as np
from numba.core.registry import CPUDispatcher

from behaviors.profile.profile import load_profile
from engine.state import Stamped
from hw.jit import compile_examples
from hw.geometry import Pose2
from hw.scene.room import Disc
from hw.model.robot import load_robot
from hw.scene.scene import load_scene
from states import navigation
from states.navigation.planner_interfaces import Limits, Tolerance
from states.navigation.planners import GLOBAL_PLANNERS, LOCAL_PLANNERS
from states.navigation.grid import grid_planners, scanning
from states.navigation.local import teb_planner
from cobodeck.bench.navigation.drive_trials import TRIALS, Trial, drive
from states.subsystems import SUBSYSTEMS
from tests.scans import scan_of

def kernels():
    return [o for o in gc.get_objects() if isinstance(o, CPUDispatcher)]

def versions():
    return {(k.py_func.__module__, k.py_func.__name__): len(k.signatures) for k in kernels()}

room = ((0, 0), (11, 0), (11, 10), (0, 10))
column = ((5, 4), (6, 4), (6, 6), (5, 6))
compile_examples((navigation,))
before = versions()
for make in GLOBAL_PLANNERS.values():
    planner = make(room, (column,), inflation_radius=1)
    planner.plan((2, 5), (9, 5), Disc(3, 8, 1), 1)
    planner.nearest_free((0.5, 5))
    planner.allows((2, 5), (3, 5), Disc(3, 8, 1))
    planner.is_free((1, 5))
    for local in LOCAL_PLANNERS.values():
        for mode in ("omni", "differential"):
            driver = local(planner, Limits(1, 1, 1, 1), Tolerance(), mode)
            drive(driver, Trial("", Pose2(2, 5, 1), Pose2(9, 5, 0), Disc(3, 7, 1), 1), longest=2)
            drive(driver, Trial("", Pose2(0.5, 5), Pose2(2, 2), None, 1), longest=2)
tuned, lab_a = load_profile("tuned"), load_scene("lab_a")
environment = tuned.environment(lab_a.room, load_robot("rbkairos_ur10"))
seeing = environment.obstacle_estimator()
for n, posts in enumerate(([], [(5.0, 4.0)], [(5.3, 4.0)])):
    seeing.update("base.pose", Stamped(Pose2(3.0, 5.0, 0.5), n * 10**8))
    seeing.update("base.scan", Stamped(scan_of(*posts, sensor=Pose2(3.0, 5.0, 0.5)), n * 10**8))
    for name in SUBSYSTEMS:
        planner = environment.planner_among(name, seeing.value())
        planner.plan((3.0, 5.0), (6.0, 3.0), Disc(6.0, 8.0, 1.0))
        planner.are_free(np.ones((2, 2)))
        costmaps = environment.costmaps_among(name, seeing.value())
        costmaps.planner("theta_star").plan((3.0, 5.0), (6.0, 3.0))
assert seeing.value()
after = versions()
print([name for name in after if after[name] > before.get(name, 0)])
"""


@pytest.mark.slow
def test_nothing_is_compiled_after_the_warm_up():
    run = subprocess.run(
        [sys.executable, "-c", CODE],
        capture_output=True,
        text=True,
        check=True,
        cwd=Path(__file__).parents[3],
    )
    assert run.stdout.strip() == "[]"
