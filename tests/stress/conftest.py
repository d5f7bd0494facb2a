"""The suite `stress`: a short form by default, more with the slow tests, all with `-m stress`."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.stress.places import cases

HERE = Path(__file__).parent
MORE = 20
"""So many more places are tried by chance in each theme, with `-m stress`."""


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    for item in items:
        if item.path.is_relative_to(HERE):
            item.add_marker(pytest.mark.stress)


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    theme = metafunc.definition.get_closest_marker("theme")
    if theme is not None:
        in_full = "stress" in metafunc.config.option.markexpr
        found = cases(theme.args[0], MORE if in_full else 0)
        ids = [f"{subject.name}-{at}" for subject, at in found]
        metafunc.parametrize(("subject", "at"), found, ids=ids)
