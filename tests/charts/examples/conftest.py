"""Charts of the examples, which are a project of their own."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from cobodeck.project.named_files import EXAMPLES, own_files_around
from cobodeck.testing import ChartTester
from engine.files.declared import with_own_files


@pytest.fixture
def sim(sim: ChartTester) -> Iterator[ChartTester]:
    """Finds charts, scenes and the battery as in the folder of the examples."""
    sim.folder = sim.root = EXAMPLES
    with with_own_files(own_files_around(EXAMPLES)):
        yield sim
