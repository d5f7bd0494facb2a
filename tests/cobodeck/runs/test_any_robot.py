"""A chart runs on whatever robot has what it uses; what is missing is refused before the start."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from cobodeck.__main__ import main
from cobodeck.terminal.console import FAILED, OK

OWN = '''
from engine.state import Action, Context, Run


class Ring(Action):
    """Ring with the fingers, when it is quiet."""

    outcomes = ("rung",)
    reads = {"battery.level": None, "room.noise": None}
    commands = ("gripper",)

    def run(self, ctx: Context) -> Run:
        yield
        return "rung"
'''
SIGNALS = """
from engine.signals.signal_kinds import Derived, Measured

SIGNALS = (
    Measured("battery.level", float),
    Measured("room.sound", float),
    Derived("room.noise", ("room.sound",), abs, float),
)
"""


def test_a_chart_without_a_person_is_run_without_one(folder: Path, capsys: Any) -> None:
    (folder / "stands.yaml").write_text(
        "chart: stands\noutcomes: [failed]\n"
        "any:\n  stop: {watch: FaultRaised, next: {raised: .failed}}\n"
    )

    assert (
        main(["simulate", "stands.yaml", "--duration", "600", "--json", "--scene", "study"]) == OK
    )

    figures = json.loads(capsys.readouterr().out)
    assert figures["person_watched"] is False
    assert not {"requests", "contacts", "beside_share"} & figures.keys()
    assert figures["ticks"] == 600 * 30 + 1
    assert figures["left_out"] >= 0.9 * figures["ticks"]


def test_a_person_who_was_asked_for_is_there_whatever_the_chart(folder: Path, capsys: Any) -> None:
    (folder / "stands.yaml").write_text(
        "chart: stands\noutcomes: [failed]\n"
        "any:\n  stop: {watch: FaultRaised, next: {raised: .failed}}\n"
    )
    call = ["simulate", "stands.yaml", "--duration", "5", "--json", "--user", "cornering"]

    assert main(call) == OK

    figures = json.loads(capsys.readouterr().out)
    assert figures["person_watched"] is True
    assert figures["contacts"] == 0


def test_all_that_is_missing_is_told_together(folder: Path, capsys: Any) -> None:
    (folder / "pyproject.toml").write_text(
        '[project]\nname = "own"\n[project.entry-points."cobodeck.states"]\n'
        'own = "lacking_states"\nmore = "lacking_signals"\n'
    )
    (folder / "lacking_states.py").write_text(OWN)
    (folder / "lacking_signals.py").write_text(SIGNALS)
    (folder / "ring.yaml").write_text(
        "chart: ring\noutcomes: [rung, failed]\n"
        "states:\n  ring: {do: Ring, next: {rung: .rung, error: .failed}}\n"
    )

    code = main(["simulate", "ring.yaml"])

    told = capsys.readouterr().err
    assert code == FAILED
    for part in (
        "'gripper', commanded by Ring",
        "'battery.level', read by Ring",
        "'room.sound', read by Ring through 'room.noise'",
    ):
        assert part in told
