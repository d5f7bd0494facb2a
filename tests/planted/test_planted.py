"""Mistakes of the kind that reviewers miss are noticed: the table is true, and some of it is tried.

`python -m tests.planted` tries all of it.
"""

from __future__ import annotations

from collections import Counter
from functools import cache
from pathlib import Path

import pytest

from tests.planted.fault import Fault
from tests.planted.faults import FAULTS
from tests.planted.planting import ROOT, Copy

TRIED = (
    "track-not-unwrapped",
    "offer-from-the-future",
    "innovation-of-a-yaw-not-wrapped",
    "chord-of-a-bend-not-shortened",
    "torque-without-coriolis",
    "zone-by-the-body",
    "ticks-in-floats",
    "yaw-error-across-pi",
)
"""The cheapest of each part of the table."""


@cache
def text_of(file: str) -> str:
    return (ROOT / file).read_text(encoding="utf-8")


@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault.name)
def test_each_fault_fits_its_file_and_names_a_test(fault: Fault) -> None:
    text = text_of(fault.file)
    assert fault.planted_in(text) != text
    file, _, function = fault.test.partition("::")
    assert f"\ndef {function}(" in text_of(file)


def test_each_fault_has_a_name_of_its_own() -> None:
    assert [name for name, number in Counter(f.name for f in FAULTS).items() if number > 1] == []


@pytest.mark.slow
def test_faults_that_are_planted_are_noticed(tmp_path: Path) -> None:
    chosen = [fault for fault in FAULTS if fault.name in TRIED]
    assert len(chosen) == len(TRIED)
    copy = Copy(tmp_path)
    copy.check(chosen)

    assert [fault.name for fault in chosen if not copy.tried(fault).noticed] == []


@pytest.mark.slow
def test_a_fault_that_nobody_notices_is_told(tmp_path: Path) -> None:
    harmless = Fault(
        "harmless", "engine/clock.py", "SECOND_NS = 10**9", "SECOND_NS = 10**8 * 10",
        "tests/engine/test_clock.py::test_rule_1_what_a_state_plans_is_rounded",
    )  # fmt: skip

    assert not Copy(tmp_path).tried(harmless).noticed
