"""How claims are judged: ties, what judges is printed, and what served nothing explains nothing."""

import copy

import pytest

from cobodeck.paper import CONDITIONS
from cobodeck.paper.claims import claims
from cobodeck.paper.page import committed
from cobodeck.paper.tables import tables


@pytest.fixture
def result():
    return copy.deepcopy(committed("paper"))


def claim_of(result, words):
    (found,) = (claim for claim in claims(result) if words in claim["claim"])
    return found


@pytest.mark.parametrize(
    ("words", "key", "chase"),
    [("Escapes are most frequent", "escapes", 1), ("drives the least way", "distance_m", -1.0)],
)
def test_a_tie_does_not_hold(words, key, chase, result):
    for run in result["conditions"].values():
        run[key] = 10
    assert claim_of(result, words)["holds"] is False
    result["conditions"]["chase"][key] += chase
    assert claim_of(result, words)["holds"] is True


@pytest.mark.parametrize(("p", "told"), [(0.5, "p = 1"), (0.2, "p = 0.4"), (0.99, "p = 0.02")])
def test_the_probability_that_judges_whether_conditions_do_not_differ_is_printed(p, told, result):
    pair = result["statistics"]["study"]["jonckheere_terpstra"]["corner < center"]
    pair |= {"p": p, "p_holm": 1.0, "z": 0.1}
    claim = claim_of(result, "do not differ")
    assert claim["ours"].endswith(told)
    assert claim["holds"] is (2.0 * min(p, 1.0 - p) > 0.05)


def test_values_with_which_nothing_is_served_explain_no_response(result):
    lost = copy.deepcopy(result["causes"][0]) | {"sets": ["nothing.served=1"]}
    for run in lost["conditions"].values():
        run["response_s"] = dict.fromkeys(run["response_s"])
    judged = claims(result)
    result["causes"].append(lost)
    assert claims(result) == judged


def test_contacts_on_the_study_s_walk_are_a_claim_that_names_those_of_the_routes_too(result):
    claim = claim_of(result, "No contact")
    assert claim["holds"] is False
    assert (
        claim["ours"] == "28 (14 by the robot) in 300; on random routes 101 (4 by the robot) in 840"
    )
    for name in CONDITIONS:
        result["conditions"][name] |= {"contacts": 0, "contact_list": []}
    claim = claim_of(result, "No contact")
    assert (claim["holds"], claim["cause"]) == (True, None)


def test_without_varied_values_claims_are_judged_as_with_them(result):
    judged = claims(result)
    result["causes"] = []
    assert [claim["holds"] for claim in claims(result)] == [claim["holds"] for claim in judged]
    assert not any(
        claim["cause"] == "" or "depends on" in (claim["cause"] or "") for claim in claims(result)
    )
    assert len(tables(result)) == len(tables(committed("paper"))) - 1
