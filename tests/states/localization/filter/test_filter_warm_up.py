"""In a process of its own: kernels that other tests compiled would hide a late one."""

import subprocess
import sys
from pathlib import Path

import pytest

CODE = """
import gc
import numpy as np
from numba.core.registry import CPUDispatcher
from states.localization.filter.planar import PlanarFilter, planar_config
from states.localization.filter.measurement_sources import (
    FilterConfig, Measurement, MeasurementSource, ProcessNoise,
)
from states.localization.filter.spatial import SpatialFilter

def versions():
    kernels = [o for o in gc.get_objects() if isinstance(o, CPUDispatcher)]
    return {(k.py_func.__module__, k.py_func.__name__): len(k.signatures) for k in kernels}

source = MeasurementSource("scan", ("x", "y", "yaw"), correlation=1)
nothing = (0,) * 15
config = FilterConfig((source,), ProcessNoise((1,) * 15, nothing, nothing), (1,) * 15)
filters = [PlanarFilter(planar_config(source)), SpatialFilter(config)]
before = versions()
spread = np.asfortranarray(np.eye(3) + 0.1)
for f in filters:
    for at, covariance in enumerate(((1, 1, 1), spread, spread[::-1, ::-1], [[1.0] * 3] * 3)):
        for values in ((0, 0, 0), np.zeros(6)[::2], (9e9, 0, 0), (float("nan"), 1, 1)):
            at += 1
            f.correct(Measurement(at, "scan", values, covariance))
    f.mean, f.covariance, f.at(at + 5), f.pose
after = versions()
print(len(before) > 5, [name for name in after if after[name] > before.get(name, 0)])
"""


@pytest.mark.slow
def test_nothing_is_compiled_after_a_filter_is_made() -> None:
    run = subprocess.run(
        [sys.executable, "-c", CODE],
        capture_output=True,
        text=True,
        check=True,
        cwd=Path(__file__).parents[4],
    )
    assert run.stdout.strip() == "True []"
