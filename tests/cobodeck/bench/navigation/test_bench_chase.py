"""The benchmark of the Chase pose: finer cells are better, the reference is the best of all."""

from __future__ import annotations

import pytest

from cobodeck.bench.navigation import chase_bench as bench
from cobodeck.bench.navigation.decisions import situations


@pytest.fixture(scope="module")
def choices():
    return {choice.name: choice for several in bench._choices() for choice in several}


def test_finer_cells_lose_less_of_the_weight(choices):
    paper = choices["paper"]
    met = situations(paper.environment, paper.settings, 4)
    best = [bench._largest(paper, now, paper.at(0.02).cells()) for now in met]

    sizes = [paper.at(cell) for cell in (0.4, 0.1, 0.02)]
    lost = [bench._point(choice, met, best, own=False)[0][0].error for choice in sizes]

    assert lost == sorted(lost, reverse=True)
    assert lost[0] > 1.0
    assert lost[-1] == pytest.approx(0.0, abs=1e-9)


def test_with_all_cells_and_without_ties_nothing_is_lost_to_the_reference_of_the_same_size(choices):
    every = choices["tuned, no ties, all cells"].at(0.2)
    usual = choices["tuned"].at(0.2)
    for now in situations(every.environment, every.settings, 4):
        cells = every.cells()
        most = bench._largest(every, now, cells)
        assert bench._shortfall(every, now, cells, most) == pytest.approx(0.0, abs=1e-9)
        assert bench._shortfall(usual, now, cells, most) >= -1e-9
