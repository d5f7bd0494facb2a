"""A profile chooses planners by name; the four behaviours work with each of them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from behaviors.profile.profile import load_profile
from cobodeck.run.build_run import stage
from cobodeck.run.simulation import simulate
from cobodeck.setup.options import Options
from cobodeck.setup.setup import open_setup
from cobodeck.setup.warmup import warm_up
from engine.files.finding import FileError
from states.subsystems import SUBSYSTEMS

CHOICES = [
    ("theta_star", "teb"),
    *(
        pytest.param(*names, marks=pytest.mark.slow)
        for names in (
            ("exact", "profile"), ("theta_star", "profile"), ("navfn", "profile"), ("exact", "teb"),
        )
    ),
]  # fmt: skip


def chosen(folder: Path, planner: str, local: str) -> str:
    """`tuned` with these planners in all subsystems."""
    lines = "".join(
        f"  {name}: {{planner: {planner}, local_planner: {local}}}\n" for name in SUBSYSTEMS
    )
    file = folder / "chosen.yaml"
    file.write_text(f"profile: chosen\nbase: tuned\nnavigation:\n{lines}")
    return str(file)


@pytest.mark.requirement(35, 39, 40)
@pytest.mark.parametrize(("planner", "local"), CHOICES)
def test_requests_are_served_with_every_choice(tmp_path: Path, planner: str, local: str) -> None:
    setup = open_setup("cobodeck", "study", chosen(tmp_path, planner, local))

    figures: Any = simulate(setup, Options(requests=2, duration_s=270.0)).figures

    assert (figures["requests"], figures["served"]) == (2, 2)
    assert (figures["contacts"], figures["wall_hits"], figures["faults"]) == (0, 0, 0)
    assert figures["response_s"]["mean"] <= 7.2  # 0.7 s of it for the line to the DEEP


@pytest.mark.slow
def test_nothing_is_compiled_in_a_tick_on_cells_either(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from numba.core.dispatcher import Dispatcher

    setup = open_setup("cobodeck", "lab_a", chosen(tmp_path, "theta_star", "teb"))
    loop = stage(setup, Options())
    warm_up(setup, loop.wired.run.machine)
    compiled: list[str] = []
    compile_ = Dispatcher.compile

    def watched(dispatcher: Any, signature: Any) -> Any:
        compiled.append(dispatcher.py_func.__qualname__)
        return compile_(dispatcher, signature)

    monkeypatch.setattr(Dispatcher, "compile", watched)
    while loop.next_ns < 60 * 10**9:
        loop.tick()

    assert compiled == []


@pytest.mark.parametrize(
    ("key", "wrong"),
    [("planner", "exat"), ("local_planner", "tab")],
)
def test_a_planner_that_there_is_not_is_named_with_its_place(
    tmp_path: Path, key: str, wrong: str
) -> None:
    file = tmp_path / "wrong.yaml"
    file.write_text(f"profile: x\nbase: tuned\nnavigation:\n  chase: {{{key}: {wrong}}}\n")

    with pytest.raises(FileError, match=r"wrong.yaml:4:\d+: navigation.chase.*planner"):
        load_profile(file)


@pytest.mark.requirement(67)
@pytest.mark.slow
def test_the_same_trace_with_and_without_skipping_on_cells(tmp_path: Path) -> None:
    setup = open_setup("cobodeck", "lab_a", chosen(tmp_path, "theta_star", "profile"))
    runs = [simulate(setup, Options(duration_s=40.0, eager=eager)) for eager in (False, True)]

    assert len({run.figures["trace_sha256"] for run in runs}) == 1
