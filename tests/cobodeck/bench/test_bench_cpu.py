"""CPU of runs: beside frozen yardsticks, by part of a tick, and told without them as well."""

from __future__ import annotations

import hashlib
import signal
import sys
import time
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from cobodeck.bench import peers, simulation_bench as bench
from cobodeck.bench.peers import irsim_robot, mujoco_robot, rollout
from cobodeck.bench.simulation_bench import CPU, CPU_GOALS, RunCase, cpu_rows, part_rows
from cobodeck.bench.simulation_cpu import PARTS, Sampler, least_cpu, part_of, run_cpu
from cobodeck.commands.bench import text
from cobodeck.setup import Options
from hw import needs

TINY = {"study": RunCase("study", Options(requests=1, duration_s=2.0, seed=3))}
MACHINE = {"name": "M", "cores": 2, "system": "S", "python": "P"}


def sha256(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()[:16]


def test_the_yardsticks_are_frozen() -> None:
    assert sha256(mujoco_robot.model_text().encode()) == "f51cbb0a0011d94f"
    assert sha256(irsim_robot.SCENE.read_bytes()) == "e9ac4a93aa9a4204"
    assert (mujoco_robot.STEPS, mujoco_robot.AT_ONCE, irsim_robot.STEPS) == (10_200, 17, 1500)
    state = np.zeros(6)
    assert rollout.rollout(state, 300) == pytest.approx(0.9689503077447825)
    assert state[:3] == pytest.approx([2.94034787, 0.59450842, 0.0])


def test_each_simulator_that_is_installed_tells_its_cpu() -> None:
    found = peers.simulators()

    assert "bare physics" in found
    assert all(0.0 < measure() < 1e5 for measure in found.values())


def test_missing_simulators_are_told_with_what_brings_them(monkeypatch: pytest.MonkeyPatch) -> None:
    for module in ("mujoco", "irsim"):
        monkeypatch.setitem(sys.modules, module, None)

    rows = {(row.name, row.variant): row for row in cpu_rows(TINY, 1)}

    assert rows["cpu", "MuJoCo"].ratio_to == needs("mujoco")
    assert rows["cpu", "ir-sim"].ratio_to == needs("irsim")
    assert "sim-peers" in needs("mujoco", "irsim")
    own = rows["cpu_study", "cobodeck"]
    assert own.time_us is not None
    assert own.time_us > 0.0
    assert own.ratio is own.goal is None
    shown = text({"machine": MACHINE, "rows": [row.plain() for row in rows.values()]})
    assert shown.count("pip install 'cobodeck[") == 2


def test_cpu_is_told_in_units_of_mujoco(monkeypatch: pytest.MonkeyPatch) -> None:
    """And relative to real time, of which 33 ms have passed."""
    monkeypatch.setattr(peers, "simulators", lambda: {"MuJoCo": lambda: 50.0})
    monkeypatch.setattr(bench, "run_cpu", lambda setup, options: 200.0)

    rows = {(row.name, row.variant): row for row in cpu_rows(TINY, 1)}

    own, speed = rows["cpu_study", "cobodeck"], rows["cpu_study", "speed"]
    assert (own.time_us, own.ratio, own.ratio_to, own.goal) == (200.0, 4.0, "MuJoCo", 1.1)
    assert speed.ratio == pytest.approx(166.67, abs=0.01)
    assert rows["cpu", "MuJoCo"].ratio == 1.0
    assert CPU.keys() == CPU_GOALS.keys()


def test_the_least_of_all_rounds_counts_and_the_unit_takes_every_other_turn() -> None:
    order: list[str] = []
    times = {"unit": iter([3.0, 2.0, 9.0, 4.0]), "a": iter([5.0, 7.0]), "b": iter([8.0, 6.0])}

    def measure(name: str) -> Callable[[], float]:
        def told() -> float:
            order.append(name)
            return next(times[name])

        return told

    found = least_cpu({name: measure(name) for name in times}, "unit", rounds=2)

    assert found == {"unit": 2.0, "a": 5.0, "b": 6.0}
    assert order == ["unit", "a", "unit", "b"] * 2


def test_cpu_counts_the_loop_alone_per_33_ms(monkeypatch: pytest.MonkeyPatch) -> None:
    """A clock that advances by 60 s of CPU at each look, over a run of 2 s: 60 ticks of 1 s."""
    case = TINY["study"]
    looks = iter(range(0, 6000, 60))
    setup = case.setup()
    monkeypatch.setattr(time, "thread_time", lambda: next(looks))

    assert run_cpu(setup, case.options) == pytest.approx(1e6)


def part_within(*modules: str) -> str:
    """The part of a frame of the last of these modules, called by the one before it, and so on.

    A module with a `*` calls from the generator `run`, as states do.
    """

    def call() -> str:
        return part_of(sys._getframe(1))

    for module in reversed(modules):
        names: dict[str, Any] = {"__name__": module.strip("*"), "inner": call}
        generator = "def run():\n    yield inner()\ndef call():\n    return next(run())\n"
        plain = "def call():\n    return inner()\n"
        exec(generator if module.endswith("*") else plain, names)
        call = names["call"]
    return call()


LOOP = "cobodeck.loop.loop"


@pytest.mark.parametrize(
    ("modules", "part"),
    [
        ((LOOP,), "loop"),
        ((LOOP, "engine.run.chart_run"), "engine"),
        ((LOOP, "hw.sim.world", "hw.geometry"), "plant"),
        ((LOOP, "hw.sim.world", "hw.safety.chain", "hw.geometry"), "safety chain"),
        ((LOOP, "cobodeck.loop.sample_router", "hw.safety.guarded_base"), "samples"),
        ((LOOP, "cobodeck.evaluate.watch", "hw.safety.chain"), "observers"),
        ((LOOP, "engine.run.stepping", "states.arm.states*", "hw.safety.chain"), "states"),
        ((LOOP, "engine.run.stepping", "states.arm.states*", "engine.signals.slots"), "signals"),
        ((LOOP, "engine.run.stepping", "engine.signals.slots", "behaviors.rules"), "signals"),
        ((LOOP, "cobodeck.loop.wiring", "engine.signals.slots"), "signals"),
    ],
)
def test_a_frame_belongs_to_what_has_called_it(modules: tuple[str, ...], part: str) -> None:
    assert part_within(*modules) == part


def test_samples_are_taken_as_cpu_is_spent_and_the_signal_is_given_back() -> None:
    before, sampler = signal.getsignal(signal.SIGPROF), Sampler()

    with sampler.sampling(None):  # type: ignore[arg-type]
        begin = time.process_time()
        while time.process_time() - begin < 0.2:
            pass

    assert sampler.counts.total() > 1
    assert signal.getsignal(signal.SIGPROF) == before
    assert signal.getitimer(signal.ITIMER_PROF) == (0.0, 0.0)


def test_the_parts_of_a_run_make_up_the_whole() -> None:
    case = RunCase("study", Options(requests=1, seed=3))

    rows = list(part_rows("study", case))

    assert {row.variant for row in rows} == set(PARTS)
    assert sum(row.ratio or 0.0 for row in rows) == pytest.approx(1.0)
