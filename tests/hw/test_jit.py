"""Examples of compiled functions: modules register them, and are named by those who need them."""

from __future__ import annotations

from collections.abc import Iterator
from types import ModuleType

import pytest

from hw import jit as compiled
from hw.jit import compile_examples, example

FIRST, SECOND, LONGER = (ModuleType(name) for name in ("tests.a", "tests.a.b", "tests.ab"))


@pytest.fixture(autouse=True)
def register(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    monkeypatch.setattr(compiled, "_EXAMPLES", [])
    return


@pytest.fixture
def called() -> list[object]:
    """What examples in three modules do; that of the last needs to be given an arm."""
    found: list[object] = []

    def first() -> None:
        found.append("first")

    def second() -> None:
        found.append("second")

    def third(arm: object) -> None:
        found.append(arm)

    for call, module in ((first, FIRST), (second, SECOND), (third, LONGER)):
        call.__module__ = module.__name__
        assert example(call) is call
    return found


def test_those_of_a_module_are_called_and_no_others(called: list[object]) -> None:
    compile_examples((SECOND,))
    assert called == ["second"]


def test_a_package_stands_for_its_modules(called: list[object]) -> None:
    compile_examples((FIRST,))
    assert called == ["first", "second"]


def test_without_parameters_they_are_called_once_in_a_process(called: list[object]) -> None:
    for _ in range(2):
        compile_examples((FIRST, SECOND))
    assert called == ["first", "second"]


def test_parameters_are_given_by_name_each_time(called: list[object]) -> None:
    for arm in ("ur5", "ur10"):
        compile_examples((LONGER,), arm=arm, base="not asked for")
    assert called == ["ur5", "ur10"]
    with pytest.raises(KeyError, match="arm"):
        compile_examples((LONGER,))
