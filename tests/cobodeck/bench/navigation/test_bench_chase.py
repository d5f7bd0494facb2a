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
    best = [bench._best_worth(paper.at(0.05), now) for now in met]

    sizes = [paper.at(cell) for cell in (0.4, 0.1, 0.05)]
    lost = [bench._point(choice, met, best, own=False)[0][0].error for choice in sizes]

    assert lost == sorted(lost, reverse=True)
    assert lost[0] > 1.0
    assert lost[-1] == pytest.approx(0.0, abs=1e-9)


def test_without_ties_nothing_is_lost_to_the_reference_of_the_same_size(choices):
    untied, usual = choices["tuned, no ties, all cells"].at(0.2), choices["tuned"].at(0.2)
    for now in situations(untied.environment, untied.settings, 4):
        most = bench._best_worth(untied, now)
        assert bench._shortfall(untied, now, most) == pytest.approx(0.0, abs=1e-4)
        assert bench._shortfall(usual, now, most) >= -1e-4
