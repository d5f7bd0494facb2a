"""Real-time priorities of a run: for whom, when, and what is said where there are none."""

from __future__ import annotations

import os
import resource
from pathlib import Path
from types import SimpleNamespace

import pytest

from cobodeck.__main__ import main
from cobodeck.checks import machine_checks as machine
from cobodeck.checks.machine_checks import hindered
from cobodeck.commands.run import _look_first
from cobodeck.commands.run_and_report import _looked_after
from cobodeck.fitness.check import FIT, MISSING, CheckResult
from cobodeck.fitness.check_list import ask
from cobodeck.setup.options import Options
from cobodeck.terminal.console import FAILED
from hw.connection.connection import load_connection
from hw.ipc.priority import CHAIN, ENGINE, permitted

BODY = "connection: own\nmodel: rbkairos_ur10\nparts: {base: {driver: 'nobodys.package:Base'}}\n"


def mine() -> tuple[int, int]:
    return os.sched_getscheduler(0) & ~os.SCHED_RESET_ON_FORK, os.sched_getparam(0).sched_priority


@pytest.mark.requirement(149)
@pytest.mark.parametrize("devices", [True, False])
def test_a_run_goes_before_other_programs_beside_devices_only_and_only_while_it_lasts(
    devices: bool,
) -> None:
    before = mine()
    loop = SimpleNamespace(busy=False, stop=lambda: None)
    with _looked_after(1.0, devices, None, loop):  # type: ignore[arg-type]
        assert mine() == ((os.SCHED_RR, ENGINE) if devices and permitted() else before)
    assert mine() == before


@pytest.mark.requirement(149)
@pytest.mark.parametrize(
    ("user", "limit", "right"),
    [
        (1000, 0, f"- rtprio {CHAIN}' and '"),
        (1000, CHAIN, "CAP_SYS_NICE"),
        (0, 0, "CAP_SYS_NICE"),
    ],
)
def test_who_has_no_right_to_priorities_is_told_what_gives_it(
    monkeypatch: pytest.MonkeyPatch, user: int, limit: int, right: str
) -> None:
    monkeypatch.setattr("hw.ipc.permitted", lambda: False)
    monkeypatch.setattr(os, "geteuid", lambda: user)
    monkeypatch.setattr(resource, "getrlimit", lambda _: (limit, limit))
    told = hindered()
    assert told is not None
    assert right in told
    assert looked_at() == CheckResult("real time", MISSING, told)
    monkeypatch.setattr("hw.ipc.permitted", lambda: True)
    assert hindered() is None
    assert looked_at().state == FIT


def looked_at() -> CheckResult:
    [found] = [answer for answer in ask("machine") if answer.what == "real time"]
    return found


@pytest.mark.requirement(149)
def test_a_run_on_devices_says_it_once_and_one_on_the_mock_does_not(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(machine, "hindered", lambda: "other programs may delay cycles")
    Path("own.yaml").write_text(BODY)
    assert main(["run", "chase", "--scene", "lab_a", "--robot", "./own.yaml"]) == FAILED
    assert capsys.readouterr().err.count("other programs may delay cycles") == 1
    mocked = SimpleNamespace(connection=load_connection("mock"))
    _look_first(SimpleNamespace(), Options(mock=True), mocked)  # type: ignore[arg-type]
    assert capsys.readouterr().err == ""
