"""Curves of simulation and envelope: finer settings are more exact, where that is exact itself."""

from __future__ import annotations

import itertools

import pytest

from cobodeck.bench import envelope_bench as envelope, simulation_curves as curves


def test_a_drive_on_ideal_wheels_hardly_depends_on_the_step() -> None:
    """Wheels move in cycles of their own, whatever the world's step is."""
    exact = curves.driven(10, slips=False)

    assert exact == curves.driven(10, slips=False)
    assert exact != curves.driven(10, slips=True)
    off = [a.distance_to(b) for a, b in zip(exact, curves.driven(250, slips=False), strict=True)]
    assert 0.0 < max(off) < 5e-3
    way = [a.distance_to(b) for a, b in itertools.pairwise(exact)]
    assert sum(way) > 5.0


@pytest.mark.slow
def test_responses_at_more_ticks_and_poses_with_more_beams_are_nearer() -> None:
    by_rate = [row.error for row, _ in curves.tick_points((15, 120))]
    by_beams = [row.error for row, _ in curves.beam_points((19, 541))]

    for coarse, fine in (by_rate, by_beams):
        assert coarse is not None
        assert fine is not None
        assert fine < coarse


@pytest.mark.slow
def test_more_directions_and_durations_find_better_motions() -> None:
    """The search tries all motions of its grid: a grid that has another's motions is as good."""
    (question, *_) = envelope.questions()
    for knob, values in (("directions", (6, 12, 24)), ("durations", (1, 5))):
        found = [envelope._gaps([question], envelope._grid(knob, value))[0] for value in values]
        assert found == sorted(found)
        assert found[-1] > found[0]
