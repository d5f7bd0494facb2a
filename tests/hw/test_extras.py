"""A missing package is told by the name it is installed by, with the extra that brings it."""

import sys
from importlib import import_module

import pytest

from hw.extras import missing, needs


@pytest.mark.parametrize(
    ("modules", "told"),
    [
        (("mcap",), "needs the package mcap: pip install 'cobodeck[record]'"),
        (("serial",), "needs the package pyserial: pip install 'cobodeck[robot]'"),
        (
            ("can", "canopen"),
            "needs the packages python-can, canopen: pip install 'cobodeck[robot]'",
        ),
        (
            ("mcap", "foxglove", "roslibpy"),
            "needs the packages mcap, foxglove-sdk, roslibpy: pip install 'cobodeck[record,ros]'",
        ),
        (("mujoco",), "needs the package mujoco: pip install 'cobodeck[reference]'"),
        (("of_a_project",), "needs the package of_a_project"),
    ],
)
def test_what_is_needed_is_told_with_the_line_that_installs_it(
    modules: tuple[str, ...], told: str
) -> None:
    assert needs(*modules) == told


def test_only_a_module_that_is_not_there_is_missing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "mcap.reader", None)
    with pytest.raises(ModuleNotFoundError) as halted:
        import_module("mcap.reader")

    assert missing(halted.value) == needs("mcap")
    assert missing(ModuleNotFoundError("no numpy", name="numpy")) is None
    assert missing(ModuleNotFoundError("of no name")) is None
    assert missing(ImportError("of another version", name="mcap")) is None
    assert missing(OSError("mcap")) is None
