"""Sums of sequences, orders and differences between conditions."""

import pytest
from hypothesis import given, strategies as st

from cobodeck.paper.comparison import on_routes, on_study, sequence_sums


def figures(responses, **others):
    return {"request_list": [{"response_s": time} for time in responses], **others}


@pytest.mark.requirement(137)
def test_a_hundred_requests_have_fourteen_sums_of_seven():
    sums = sequence_sums(figures(range(100)))
    assert len(sums) == 14
    assert sums[0] == sum(range(7))
    assert sums[-1] == sum(range(91, 98))


@given(st.lists(st.none() | st.floats(1.0, 30.0), max_size=40))
def test_a_sequence_with_an_unserved_request_has_no_sum(responses):
    whole = [responses[k : k + 7] for k in range(0, len(responses) - 6, 7)]
    assert sequence_sums(figures(responses)) == pytest.approx(
        [sum(part) for part in whole if None not in part]
    )


@pytest.mark.requirement(138, 139)
def test_separated_conditions_differ_as_the_paper_s_do():
    waves = [0.01 * (7 * k % 13) for k in range(98)]
    runs = {
        "chase": figures([10.0 + wave for wave in waves]),
        "corner": figures([12.8 + wave for wave in waves]),
        "center": figures([12.8 + wave for wave in reversed(waves)]),
    }
    found = on_study(runs)
    pairs = found["jonckheere_terpstra"]
    assert found["kruskal_wallis"]["p"] < 0.001
    assert pairs["chase < corner"]["r"] == pytest.approx(0.851, abs=5e-4)
    assert pairs["chase < corner"]["p_holm"] < 0.001
    assert pairs["corner < center"]["p_holm"] > 0.05


@pytest.mark.parametrize("responses", [[5.0] * 7, [], [None] * 7])
def test_what_allows_no_test_has_none(responses):
    found = on_study(dict.fromkeys(("chase", "corner", "center"), figures(responses)))
    assert found["kruskal_wallis"] is None
    assert found["jonckheere_terpstra"] == {}


def run(response, escapes=0):
    return {
        "response_s": {"mean": response}, "distance_m": 20.0, "energy_j": 100.0, "requests": 10,
        "served": 9, "escapes": escapes, "escape_failures": 0, "contacts": 0,
        "contacts_by_robot": 0, "escape_list": [{"time_s": 1.5, "outcome": "safe"}] * escapes,
    }  # fmt: skip


def test_routes_are_compared_pair_by_pair():
    found = on_routes(
        {
            "chase": [run(6.0, 2), run(8.0), run(None)],
            "corner": [run(8.0), run(7.0), run(9.0)],
            "center": [run(9.0), run(9.0), run(9.0)],
        }
    )
    assert found["orders"] == {"chase < corner < center": 1, "corner < chase < center": 1}
    gap = found["differences"]["corner - chase"]
    assert gap["response_s"] == {"mean": 0.5, "low": -1.0, "high": 2.0}
    assert gap["escapes"]["mean"] == pytest.approx(-0.2 / 3)
    assert found["conditions"]["chase"]["escape_time_s"] == 1.5
    assert found["conditions"]["chase"]["served_share"]["share"] == 0.9
    assert found["conditions"]["corner"]["escape_failure_share"] is None
